//! The statusword in each mode (chapter 7; bits 4, 7 and 9 as the real drive and its siblings show them).

use cia402::{ModeOfOperation, PowerState, Statusword};

use crate::engine::axis::AxisStatus;

/// Bit 12 in profile velocity; never with [`RUNNING`], which slower than the threshold of standstill means that the motor is
/// to turn.
pub const SPEED_IS_ZERO: u16 = 1 << 12;
/// Bit 13 in profile position: the deviation is within 2002h.
pub const IN_POSITION: u16 = 1 << 13;
/// Bit 14.
pub const RUNNING: u16 = 1 << 14;
/// Bit 15: an input stops the motor.
pub const EXTERNAL_STOP: u16 = 1 << 15;

/// The value of 6041h.
pub(super) fn statusword(state: PowerState, mode: ModeOfOperation, status: &AxisStatus) -> Statusword {
    let bit = |mask: u16, set: bool| if set { mask } else { 0 };
    let fault = matches!(state, PowerState::Fault | PowerState::FaultReactionActive);
    let by_mode = match mode {
        ModeOfOperation::PROFILE_POSITION => {
            bit(Statusword::SET_POINT_ACKNOWLEDGE, status.acknowledged) | bit(IN_POSITION, status.in_position)
        }
        ModeOfOperation::PROFILE_VELOCITY => bit(SPEED_IS_ZERO, !status.running),
        _ => 0,
    };
    Statusword(
        state.statusword_bits()
            | Statusword::VOLTAGE_ENABLED
            | Statusword::REMOTE
            | bit(Statusword::WARNING, fault)
            | bit(Statusword::TARGET_REACHED, status.target_reached && !fault)
            | by_mode
            | bit(RUNNING, status.running)
            | bit(EXTERNAL_STOP, status.external_stop),
    )
}

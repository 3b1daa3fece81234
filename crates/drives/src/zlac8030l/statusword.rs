//! The statusword in each mode (chapter 7; bits 4, 7 and 9 as the real drive and its siblings show them).

pub use devices::zltech::zlac8030l::statusword::*;

use cia402::{ModeOfOperation, PowerState, Statusword};

use crate::engine::cia402::Status;

/// The value of 6041h.
pub(super) fn statusword(state: PowerState, mode: ModeOfOperation, status: &Status) -> Statusword {
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

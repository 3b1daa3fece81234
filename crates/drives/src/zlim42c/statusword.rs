//! The statusword ("ZLIM42-C user manual V1.03", 5.3.2 and the bit tables of 5.3.4 to 5.3.6; bits 4 and 9 as the
//! sibling's recordings show them).

pub use devices::zltech::zlim42c::statusword::*;

use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};

use crate::engine::cia402::Status;

/// What the statusword is made of.
#[derive(Clone, Copy)]
pub(super) struct StatusCondition {
    pub(super) state: PowerState,
    pub(super) mode: ModeOfOperation,
    pub(super) controlword: Controlword,
    pub(super) energised: bool,
    pub(super) axis: Status,
}

/// The value of 6041h.
pub(super) fn statusword(now: StatusCondition) -> Statusword {
    let bit = |mask: u16, set: bool| if set { mask } else { 0 };
    let fault = matches!(now.state, PowerState::Fault | PowerState::FaultReactionActive);
    // There is nothing to be reached before the drive is live and has a mode.
    let live = matches!(now.state, PowerState::OperationEnabled | PowerState::QuickStopActive);
    let reached = now.axis.target_reached && live && now.mode != ModeOfOperation::NONE;
    let by_mode = match now.mode {
        ModeOfOperation::PROFILE_POSITION => {
            bit(Statusword::SET_POINT_ACKNOWLEDGE, now.axis.acknowledged) | bit(IN_POSITION, reached)
        }
        ModeOfOperation::PROFILE_VELOCITY => bit(SPEED_IS_ZERO, now.axis.standing),
        _ => 0,
    };
    Statusword(
        now.state.statusword_bits()
            | Statusword::VOLTAGE_ENABLED
            | Statusword::REMOTE
            | bit(Statusword::WARNING, fault)
            | bit(HOMING_ATTAINED, now.axis.homing_attained)
            | bit(Statusword::TARGET_REACHED, reached)
            | bit(BIT_4_OF_CONTROLWORD, now.controlword.has(Controlword::NEW_SET_POINT))
            | by_mode
            | bit(ENERGISED, now.energised && !fault)
            | bit(RUNNING, now.axis.running),
    )
}

//! The controlword of one cycle (CiA 402-2, 8.2 to 8.4): what the statusword shows, what is wanted, what to write.

use cia402::{Controlword, ModeOfOperation, PowerCommand, PowerState, next_command};
use devices::PowerStyle;

use super::demand::Demand;

/// What to write for a drive that nothing keeps from its demand.
pub(super) fn controlword(
    style: PowerStyle,
    state: Option<PowerState>,
    demand: Demand,
    mode: ModeOfOperation,
    odd_step: bool,
) -> Controlword {
    match demand {
        Demand::Off if state == Some(PowerState::OperationEnabled) => PowerCommand::Shutdown.controlword(),
        Demand::Off => PowerCommand::DisableVoltage.controlword(),
        Demand::QuickStop => PowerCommand::QuickStop.controlword(),
        // An edge needs both values, one after the other.
        Demand::ResetFault => Controlword(if odd_step { Controlword::FAULT_RESET } else { 0 }),
        Demand::Hold | Demand::Position(_) | Demand::Velocity(_) | Demand::Current(_) => enable(style, state, mode),
    }
}

/// One step nearer to Operation enabled, or what keeps it there.
fn enable(style: PowerStyle, state: Option<PowerState>, mode: ModeOfOperation) -> Controlword {
    let enabled = PowerCommand::EnableOperation.controlword();
    if style != PowerStyle::Cia402 {
        return enabled;
    }
    match state {
        // Bit 4 lets the interpolation run (CiA 402-2, 12.2).
        Some(PowerState::OperationEnabled) if mode == ModeOfOperation::INTERPOLATED_POSITION => {
            Controlword(enabled.0 | Controlword::NEW_SET_POINT)
        }
        Some(PowerState::OperationEnabled) => enabled,
        Some(PowerState::Fault) => PowerCommand::DisableVoltage.controlword(),
        Some(state) => next_command(state).unwrap_or(PowerCommand::Shutdown).controlword(),
        None => PowerCommand::DisableVoltage.controlword(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ON: Demand = Demand::Hold;
    const PV: ModeOfOperation = ModeOfOperation::PROFILE_VELOCITY;

    #[test]
    fn each_state_gets_the_command_that_leads_on() {
        use PowerState::{OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
        let words = [SwitchOnDisabled, ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive]
            .map(|state| controlword(PowerStyle::Cia402, Some(state), ON, PV, false).0);
        // CiA 402-2, table 27: shutdown, switch on, enable operation.
        assert_eq!(words, [0x06, 0x07, 0x0F, 0x0F, 0x0F]);
        let ip = ModeOfOperation::INTERPOLATED_POSITION;
        assert_eq!(controlword(PowerStyle::Cia402, Some(OperationEnabled), ON, ip, false).0, 0x1F);
    }

    #[test]
    fn nothing_is_enabled_unseen_or_at_fault() {
        for state in [None, Some(PowerState::Fault)] {
            assert_eq!(controlword(PowerStyle::Cia402, state, ON, PV, false).0, 0);
        }
    }

    #[test]
    fn off_goes_by_the_shutdown_ramp() {
        let word = |state| controlword(PowerStyle::Cia402, Some(state), Demand::Off, PV, false).0;
        assert_eq!([word(PowerState::OperationEnabled), word(PowerState::ReadyToSwitchOn)], [0x06, 0]);
    }

    #[test]
    fn a_reset_has_edges() {
        let words = [false, true]
            .map(|odd| controlword(PowerStyle::Cia402, Some(PowerState::Fault), Demand::ResetFault, PV, odd).0);
        assert_eq!(words, [0, 0x80]);
    }
}

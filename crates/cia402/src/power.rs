//! The power drive state machine as one table. Source: CiA 402-2, clause 8.2 (figure 6, tables 8 and 9).
//!
//! Events in, states out. Ramps that delay a transition (option codes 605Ah to 605Eh) are the drive's: it raises
//! the event when the ramp is done.

use crate::PowerCommand;

/// A state of the power drive state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PowerState {
    /// Self-test runs.
    NotReadyToSwitchOn,
    /// High voltage may not be applied.
    SwitchOnDisabled,
    /// High voltage may be applied.
    ReadyToSwitchOn,
    /// High voltage is applied, no torque.
    SwitchedOn,
    /// Set-points are followed.
    OperationEnabled,
    /// The quick stop function runs or has ended at standstill.
    QuickStopActive,
    /// A fault occurred and the drive is stopping.
    FaultReactionActive,
    /// Stopped by a fault.
    Fault,
}

impl PowerState {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
    ];

    /// The standard's name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReadyToSwitchOn => "Not ready to switch on",
            Self::SwitchOnDisabled => "Switch on disabled",
            Self::ReadyToSwitchOn => "Ready to switch on",
            Self::SwitchedOn => "Switched on",
            Self::OperationEnabled => "Operation enabled",
            Self::QuickStopActive => "Quick stop active",
            Self::FaultReactionActive => "Fault reaction active",
            Self::Fault => "Fault",
        }
    }
}

/// What can move the state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PowerEvent {
    /// A controlword asks.
    Command(PowerCommand),
    /// Initialisation and self-test have ended well.
    SelfTestDone,
    /// A fault occurred.
    FaultOccurred,
    /// The fault reaction has ended.
    FaultReactionDone,
    /// The quick stop has ended and its option code (1, 2, 3) says to leave.
    QuickStopDone,
}

/// One arrow of the state diagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// The standard's number.
    pub number: u8,
    /// From this state,
    pub from: PowerState,
    /// on this event,
    pub event: PowerEvent,
    /// to this state.
    pub to: PowerState,
}

/// Every arrow of the diagram except 0 (start) and 13 (a fault, from everywhere). Source: CiA 402-2, table 9.
///
/// "Enable operation" in Ready to switch on takes transitions 3 and 4 in one step: it stands here as 3, and the
/// standard's automatic transition 4 follows because the command is still there: see [`transition`].
pub const TRANSITIONS: [Transition; 19] = {
    use PowerCommand as C;
    use PowerEvent::{Command, FaultReactionDone, QuickStopDone, SelfTestDone};
    use PowerState as S;
    const fn row(number: u8, from: S, event: PowerEvent, to: S) -> Transition {
        Transition { number, from, event, to }
    }
    [
        row(1, S::NotReadyToSwitchOn, SelfTestDone, S::SwitchOnDisabled),
        row(2, S::SwitchOnDisabled, Command(C::Shutdown), S::ReadyToSwitchOn),
        row(3, S::ReadyToSwitchOn, Command(C::SwitchOn), S::SwitchedOn),
        row(3, S::ReadyToSwitchOn, Command(C::EnableOperation), S::SwitchedOn),
        row(4, S::SwitchedOn, Command(C::EnableOperation), S::OperationEnabled),
        row(5, S::OperationEnabled, Command(C::SwitchOn), S::SwitchedOn),
        row(6, S::SwitchedOn, Command(C::Shutdown), S::ReadyToSwitchOn),
        row(7, S::ReadyToSwitchOn, Command(C::DisableVoltage), S::SwitchOnDisabled),
        row(7, S::ReadyToSwitchOn, Command(C::QuickStop), S::SwitchOnDisabled),
        row(8, S::OperationEnabled, Command(C::Shutdown), S::ReadyToSwitchOn),
        row(9, S::OperationEnabled, Command(C::DisableVoltage), S::SwitchOnDisabled),
        row(10, S::SwitchedOn, Command(C::DisableVoltage), S::SwitchOnDisabled),
        row(10, S::SwitchedOn, Command(C::QuickStop), S::SwitchOnDisabled),
        row(11, S::OperationEnabled, Command(C::QuickStop), S::QuickStopActive),
        row(12, S::QuickStopActive, Command(C::DisableVoltage), S::SwitchOnDisabled),
        row(12, S::QuickStopActive, QuickStopDone, S::SwitchOnDisabled),
        row(14, S::FaultReactionActive, FaultReactionDone, S::Fault),
        row(15, S::Fault, Command(C::FaultReset), S::SwitchOnDisabled),
        row(16, S::QuickStopActive, Command(C::EnableOperation), S::OperationEnabled),
    ]
};

/// The arrow that `event` takes in `state`; `None` when it does nothing there.
///
/// After transition 3 by "enable operation" the caller asks again with the same event: the standard's automatic
/// transition 4. Transition 13 leads from every state but the two fault states to Fault reaction active.
pub fn transition(state: PowerState, event: PowerEvent) -> Option<Transition> {
    if event == PowerEvent::FaultOccurred {
        let faulted = matches!(state, PowerState::FaultReactionActive | PowerState::Fault);
        return (!faulted).then_some(Transition {
            number: 13,
            from: state,
            event,
            to: PowerState::FaultReactionActive,
        });
    }
    TRANSITIONS.iter().find(|row| row.from == state && row.event == event).copied()
}

/// The command that brings a drive one step nearer to Operation enabled; `None` when it is there, or when the
/// drive has to act first (self-test, fault reaction).
pub const fn next_command(state: PowerState) -> Option<PowerCommand> {
    match state {
        PowerState::SwitchOnDisabled => Some(PowerCommand::Shutdown),
        PowerState::ReadyToSwitchOn => Some(PowerCommand::SwitchOn),
        PowerState::SwitchedOn | PowerState::QuickStopActive => Some(PowerCommand::EnableOperation),
        PowerState::Fault => Some(PowerCommand::FaultReset),
        PowerState::NotReadyToSwitchOn | PowerState::OperationEnabled | PowerState::FaultReactionActive => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Statusword;

    #[test]
    fn quick_stop_from_switched_on_goes_to_switch_on_disabled() {
        let taken = transition(PowerState::SwitchedOn, PowerEvent::Command(PowerCommand::QuickStop)).unwrap();
        assert_eq!((taken.number, taken.to), (10, PowerState::SwitchOnDisabled));
    }

    #[test]
    fn the_next_command_leads_to_operation_enabled_from_every_state_that_listens() {
        for start in PowerState::ALL {
            let mut state = start;
            for _ in 0..4 {
                let Some(command) = next_command(state) else { break };
                state = transition(state, PowerEvent::Command(command)).expect("the step exists").to;
            }
            let waits = matches!(start, PowerState::NotReadyToSwitchOn | PowerState::FaultReactionActive);
            assert_eq!(state == PowerState::OperationEnabled, !waits, "{start:?}");
        }
    }

    #[test]
    fn a_fault_reset_does_nothing_without_a_fault() {
        for state in PowerState::ALL.into_iter().filter(|state| *state != PowerState::Fault) {
            assert_eq!(transition(state, PowerEvent::Command(PowerCommand::FaultReset)), None);
        }
    }

    /// CiA 402-2, table 9, transition 13: a second fault does not begin the reaction anew.
    #[test]
    fn a_fault_leads_to_its_reaction_from_every_state_but_that_and_fault_itself() {
        for state in PowerState::ALL {
            let taken = transition(state, PowerEvent::FaultOccurred).map(|taken| (taken.number, taken.to));
            let reacts = ![PowerState::FaultReactionActive, PowerState::Fault].contains(&state);
            assert_eq!(taken, reacts.then_some((13, PowerState::FaultReactionActive)), "{state:?}");
        }
    }

    #[test]
    fn every_state_is_shown_by_its_statusword() {
        for state in PowerState::ALL {
            // Bits 4 and 9 belong to no state.
            assert_eq!(Statusword(state.statusword_bits() | 0x0210).state(), Some(state));
        }
    }

    #[test]
    fn no_two_rows_start_with_the_same_state_and_event() {
        for (i, a) in TRANSITIONS.iter().enumerate() {
            assert!(TRANSITIONS[i + 1..].iter().all(|b| (a.from, a.event) != (b.from, b.event)), "{a:?}");
        }
    }
}

//! The power drive state machine with a controlword's edges and the ramps that delay transitions.
//!
//! The arrows are those of [`cia402::TRANSITIONS`]. A drive may add arrows of its own as data. A command that is to
//! ramp down first (605Bh, 605Ch) stays pending in Operation enabled until [`ramp_done`](PowerMachine::ramp_done).

use cia402::{
    Controlword, DisableOperationOption, PowerCommand, PowerEvent, PowerState, ShutdownOption, Transition, transition,
};

/// What "shutdown" and "disable operation" do in Operation enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisableOptions {
    /// 605Bh.
    pub shutdown: ShutdownOption,
    /// 605Ch.
    pub disable_operation: DisableOperationOption,
}

/// State, last controlword, and a command that waits for the motor to stand.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerMachine {
    state: PowerState,
    controlword: Controlword,
    pending: Option<PowerCommand>,
    extra: &'static [Transition],
}

impl PowerMachine {
    /// Not ready to switch on, with the arrows that the drive has beyond the standard's.
    pub const fn new(extra: &'static [Transition]) -> Self {
        Self { state: PowerState::NotReadyToSwitchOn, controlword: Controlword(0), pending: None, extra }
    }

    /// The state.
    pub const fn state(&self) -> PowerState {
        self.state
    }

    /// The last controlword.
    pub const fn controlword(&self) -> Controlword {
        self.controlword
    }

    /// A command waits until the motor stands.
    pub const fn is_ramping_down(&self) -> bool {
        self.pending.is_some()
    }

    /// Self-test has ended well.
    pub fn self_test_done(&mut self) {
        self.take(PowerEvent::SelfTestDone);
    }

    /// Takes a controlword. True if it asks for a fault reset, by the rising edge of bit 7: whether the cause is gone
    /// is for the caller to judge, who then calls [`reset_fault`](Self::reset_fault).
    pub fn command(&mut self, controlword: Controlword, options: DisableOptions) -> bool {
        let before = core::mem::replace(&mut self.controlword, controlword);
        match (self.state, controlword.command()) {
            (_, PowerCommand::FaultReset) => {
                return controlword.rises(before, Controlword::FAULT_RESET) && self.state == PowerState::Fault;
            }
            (PowerState::OperationEnabled, PowerCommand::Shutdown) if options.shutdown != ShutdownOption::DISABLE => {
                self.pending = Some(PowerCommand::Shutdown);
            }
            (PowerState::OperationEnabled, PowerCommand::SwitchOn)
                if options.disable_operation != DisableOperationOption::DISABLE =>
            {
                self.pending = Some(PowerCommand::SwitchOn);
            }
            (_, command) => {
                self.pending = None;
                self.take(PowerEvent::Command(command));
                // The automatic transition 4 of the standard.
                if command == PowerCommand::EnableOperation && self.state == PowerState::SwitchedOn {
                    self.take(PowerEvent::Command(command));
                }
            }
        }
        false
    }

    /// The motor stands: a pending command is carried out.
    pub fn ramp_done(&mut self) {
        if let Some(command) = self.pending.take() {
            self.take(PowerEvent::Command(command));
        }
    }

    /// The drive disables itself: power off.
    pub fn disable(&mut self) {
        self.pending = None;
        self.take(PowerEvent::Command(PowerCommand::DisableVoltage));
    }

    /// A fault occurred: its reaction begins.
    pub fn fault(&mut self) {
        self.pending = None;
        self.take(PowerEvent::FaultOccurred);
    }

    /// The fault reaction has ended.
    pub fn fault_reaction_done(&mut self) {
        self.take(PowerEvent::FaultReactionDone);
    }

    /// The quick stop has ended, and its option code says to leave Quick stop active.
    pub fn quick_stop_done(&mut self) {
        self.take(PowerEvent::QuickStopDone);
    }

    /// The cause of the fault is gone and its reset was asked for.
    pub fn reset_fault(&mut self) {
        self.take(PowerEvent::Command(PowerCommand::FaultReset));
    }

    fn take(&mut self, event: PowerEvent) {
        let own = self.extra.iter().find(|row| row.from == self.state && row.event == event).copied();
        if let Some(taken) = own.or_else(|| transition(self.state, event)) {
            self.state = taken.to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT_ONCE: DisableOptions =
        DisableOptions { shutdown: ShutdownOption::DISABLE, disable_operation: DisableOperationOption::DISABLE };
    const RAMP: DisableOptions =
        DisableOptions { shutdown: ShutdownOption::SLOW_DOWN, disable_operation: DisableOperationOption::SLOW_DOWN };

    fn after(words: &[u16], options: DisableOptions) -> PowerMachine {
        let mut power = PowerMachine::new(&[]);
        power.self_test_done();
        for word in words {
            power.command(Controlword(*word), options);
        }
        power
    }

    #[test]
    fn enabling_takes_three_steps_or_two() {
        assert_eq!(after(&[6, 7, 0xF], RAMP).state(), PowerState::OperationEnabled);
        assert_eq!(after(&[6, 0xF], RAMP).state(), PowerState::OperationEnabled);
        assert_eq!(after(&[7, 0xF], RAMP).state(), PowerState::SwitchOnDisabled);
    }

    #[test]
    fn disabling_waits_for_the_ramp_only_when_the_option_asks_for_one() {
        for (word, to) in [(6, PowerState::ReadyToSwitchOn), (7, PowerState::SwitchedOn)] {
            let mut power = after(&[6, 7, 0xF, word], RAMP);
            assert!(power.is_ramping_down() && power.state() == PowerState::OperationEnabled);
            power.ramp_done();
            assert_eq!(power.state(), to);
            assert_eq!(after(&[6, 7, 0xF, word], AT_ONCE).state(), to);
        }
    }

    #[test]
    fn enabling_again_during_the_ramp_stays_enabled() {
        let mut power = after(&[6, 7, 0xF, 7, 0xF], RAMP);
        assert!(!power.is_ramping_down());
        power.ramp_done();
        assert_eq!(power.state(), PowerState::OperationEnabled);
    }

    #[test]
    fn only_a_rising_bit_7_in_fault_asks_for_a_reset() {
        let mut power = after(&[6, 7, 0x80], RAMP);
        power.fault();
        assert_eq!(power.state(), PowerState::FaultReactionActive);
        assert!(!power.command(Controlword(0), RAMP), "nothing is taken before the reaction has ended");
        power.command(Controlword(0x80), RAMP);
        power.fault_reaction_done();
        assert_eq!(power.state(), PowerState::Fault);
        assert!(!power.command(Controlword(0x80), RAMP), "it stood already");
        power.command(Controlword(0), RAMP);
        assert!(power.command(Controlword(0x80), RAMP));
        power.reset_fault();
        assert_eq!(power.state(), PowerState::SwitchOnDisabled);
        assert!(!power.command(Controlword(0x00), RAMP) && !power.command(Controlword(0x80), RAMP));
    }
}

//! One axis by CiA 402-2: joins the power state machine, the modes and everything that stops a motor.
//!
//! In go controlwords, targets and what the shaft does; out comes a [`Demand`] for the control loops each period. While
//! something asks for a stop ([`StopCause`]) it lies over what the mode does, and the mode goes on when nothing does any
//! more. What a shaft does that is not enabled is for the drive to say. Nothing here knows objects, units or statusword
//! bits.

use cia402::{Controlword, FaultReactionOption, ModeOfOperation, PowerState, StopRamp, Transition};

use super::parameters::{ModeChange, Parameters, Targets};
use super::power::PowerMachine;
use super::set_points::{SetPoint, SetPoints};
use super::stop::StopCause;
use crate::engine::axis::{Axis, Control, Demand, Feedback, HomingState, Ramp, StopState, Switches, Task};

/// Power state machine, mode and motion of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerDrive {
    pub(super) power: PowerMachine,
    pub(super) mode: ModeOfOperation,
    requested_mode: ModeOfOperation,
    pub(super) axis: Axis,
    pub(super) set_points: SetPoints,
    pub(super) switches: Switches,
    /// A limit switch ended the last move before its target.
    pub(super) short_of_target: bool,
    pub(super) stop: Option<(StopCause, StopRamp)>,
    pub(super) engaged: Engaged,
    pub(super) external_stop: bool,
    pub(super) host_timeout: bool,
    pub(super) fault_reaction: FaultReactionOption,
}

/// What the shaft is held for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Engaged {
    No,
    /// Without being enabled.
    Idle,
    Yes,
}

impl PowerDrive {
    /// Not ready to switch on, without a mode; with the arrows that the drive has beyond those of the standard.
    pub fn new(extra: &'static [Transition]) -> Self {
        Self {
            power: PowerMachine::new(extra),
            mode: ModeOfOperation::NONE,
            requested_mode: ModeOfOperation::NONE,
            axis: Axis::new(),
            set_points: SetPoints::resting(0),
            switches: Switches::default(),
            short_of_target: false,
            stop: None,
            engaged: Engaged::No,
            external_stop: false,
            host_timeout: false,
            fault_reaction: FaultReactionOption::DISABLE,
        }
    }

    /// State of the power drive state machine.
    pub const fn state(&self) -> PowerState {
        self.power.state()
    }

    /// The last controlword.
    pub const fn controlword(&self) -> Controlword {
        self.power.controlword()
    }

    /// The mode in effect.
    pub const fn mode(&self) -> ModeOfOperation {
        self.mode
    }

    /// The shaft's motion, to look at.
    pub const fn axis(&self) -> &Axis {
        &self.axis
    }

    /// What the motor is being stopped for.
    pub fn stop_cause(&self) -> Option<StopCause> {
        self.stop.map(|(cause, _)| cause)
    }

    /// How the motor is being stopped.
    pub fn stop_ramp(&self) -> Option<StopRamp> {
        self.stop.map(|(_, ramp)| ramp)
    }

    /// Operation enabled, quick stop active or fault reaction active: the motor is under control.
    pub const fn is_live(&self) -> bool {
        matches!(
            self.power.state(),
            PowerState::OperationEnabled | PowerState::QuickStopActive | PowerState::FaultReactionActive
        )
    }

    /// Under control, and not left to coast.
    pub fn is_driven(&self) -> bool {
        self.is_live() && self.axis.stop_state() != Some(StopState::Free)
    }

    /// Self-test has ended well.
    pub fn self_test_done(&mut self) {
        self.power.self_test_done();
    }

    /// Takes a controlword; `target` is the target position that a rising bit 4 takes. True if a fault reset is asked
    /// for.
    pub fn command(&mut self, controlword: Controlword, target: i32, parameters: &Parameters) -> bool {
        let before = self.power.controlword();
        let wants_reset = self.power.command(controlword, parameters.disable);
        if self.power.state() == PowerState::QuickStopActive && parameters.quick_stop.ramp() == Some(StopRamp::Free) {
            self.power.quick_stop_done();
        }
        if self.is_live() && self.engaged != Engaged::Yes {
            self.engage();
        }
        if self.power.is_ramping_down() && self.is_at_rest() {
            self.power.ramp_done();
        }
        let new = controlword.has(Controlword::NEW_SET_POINT);
        if controlword.rises(before, Controlword::NEW_SET_POINT) && self.takes_starts() {
            let set_point = SetPoint {
                target,
                relative: controlword.has(Controlword::RELATIVE),
                immediately: controlword.has(Controlword::CHANGE_SET_IMMEDIATELY),
            };
            self.start(set_point, parameters);
        } else if !new {
            self.axis.interrupt_homing();
        }
        self.set_points.release(new);
        wants_reset
    }

    /// Asks for a mode: it takes effect at standstill, or with the next period ([`ModeChange`]).
    pub fn request_mode(&mut self, mode: ModeOfOperation) {
        self.requested_mode = mode;
        self.adopt_mode(ModeChange::AtStandstill);
    }

    /// Whether the external stop input is active.
    pub fn set_external_stop(&mut self, active: bool) {
        self.external_stop = active;
    }

    /// What the limit and home switches say.
    pub fn set_switches(&mut self, switches: Switches) {
        self.switches = switches;
        self.axis.set_switches(switches);
    }

    /// Where homing has just found the home position, reported once: the caller then shifts the position.
    pub fn take_home(&mut self) -> Option<i32> {
        self.axis.take_home()
    }

    /// The host is silent: stops the motor once.
    pub fn on_host_timeout(&mut self) {
        self.host_timeout = self.power.state() == PowerState::OperationEnabled;
    }

    /// A fault. A motor that is driven is stopped first if that is its reaction; else the power is off at once.
    pub fn fault(&mut self, reaction: FaultReactionOption) {
        let stops = self.is_driven() && reaction.ramp() != Some(StopRamp::Free);
        self.power.fault();
        self.fault_reaction = reaction;
        if !stops {
            self.power.fault_reaction_done();
            self.disengage();
        }
    }

    /// The cause of the fault is gone.
    pub fn reset_fault(&mut self) {
        self.power.reset_fault();
    }

    /// The zero of position moves: what was `by` is 0 from now on.
    pub fn shift_position(&mut self, by: i32) {
        self.axis.shift(by);
        self.set_points.shift(by);
    }

    /// One period; `None` while the axis is not enabled: see [`idle`](Self::idle).
    pub fn update(
        &mut self,
        feedback: Feedback,
        targets: &Targets,
        parameters: &Parameters,
        dt_s: f64,
    ) -> Option<Demand> {
        self.axis.observe(feedback);
        self.adopt_mode(parameters.mode_change);
        if !self.is_live() {
            return None;
        }
        if self.engaged != Engaged::Yes {
            self.engage();
        }
        self.choose_stop(targets, parameters);
        if self.stop.is_some() {
            self.stopping(parameters, dt_s)
        } else {
            Some(self.following(targets, parameters, dt_s))
        }
    }

    /// One period of a shaft that is not enabled: what it does meanwhile, or nothing.
    pub fn idle(&mut self, task: Option<Task>, dt_s: f64) -> Demand {
        let Some(task) = task else {
            if self.engaged != Engaged::No {
                self.disengage();
            }
            return Demand::Off;
        };
        if self.engaged != Engaged::Idle {
            self.disengage();
            self.axis.engage();
            self.engaged = Engaged::Idle;
        }
        self.axis.begin(task);
        self.axis.update(dt_s)
    }

    fn takes_starts(&self) -> bool {
        let stopped = self.stop.is_some_and(|(cause, _)| cause != StopCause::Halt);
        self.power.state() == PowerState::OperationEnabled
            && !stopped
            && !self.external_stop
            && !self.power.is_ramping_down()
    }

    fn is_at_rest(&self) -> bool {
        let no_way_to_go = self.axis.is_resting() || self.mode == ModeOfOperation::PROFILE_TORQUE;
        let homing = self.axis.homing() == HomingState::Running;
        self.axis.feedback().standing && no_way_to_go && !homing
    }

    // With each RPDO and in each period, while a mode is new next to never.
    #[inline]
    fn adopt_mode(&mut self, change: ModeChange) {
        if self.requested_mode != self.mode {
            self.change_mode(change);
        }
    }

    #[inline(never)]
    fn change_mode(&mut self, change: ModeChange) {
        if change == ModeChange::AtStandstill && self.engaged == Engaged::Yes && !self.is_at_rest() {
            return;
        }
        self.mode = self.requested_mode;
        if self.engaged == Engaged::Yes && self.stop.is_none() {
            self.engage();
        } else {
            self.set_points.abort(self.axis.feedback().position);
            self.axis.begin(HERE);
        }
    }

    /// Takes the shaft over as it turns.
    pub(super) fn engage(&mut self) {
        self.axis.engage();
        self.set_points.abort(self.axis.feedback().position);
        self.short_of_target = false;
        self.stop = None;
        self.engaged = Engaged::Yes;
    }

    fn disengage(&mut self) {
        self.engage();
        self.axis.release();
        self.host_timeout = false;
        self.engaged = Engaged::No;
    }
}

/// Whatever was under way is over.
pub(super) const HERE: Task = Task::Hold { control: Control::Position, ramp: Ramp::NONE };

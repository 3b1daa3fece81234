//! What both drives do around their motor: the axis with its rules for a shaft that is not enabled, the terminals, and the
//! rhythm of the supervision periods. Each drive owns one, and keeps its own `tick` and `supervise`.

use canopen::od::Storage;
use cia402::{FaultReactionOption, PowerState};
use devices::AxisId;

use super::parameters::Holding;
use super::terminals::Signals;
use crate::Report;
use crate::engine::axis::{Control, Demand, Feedback, Ramp, Task};
use crate::engine::cia402::{ExternalStop, Parameters as AxisParameters, PowerDrive, Status, Targets};
use crate::engine::device::Device;
use crate::engine::inputs::Inputs;

/// State of a drive with so many inputs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shell<const INPUTS: usize> {
    pub(crate) axis: PowerDrive,
    /// What the control loops are asked for.
    pub(crate) demand: Demand,
    pub(crate) targets: Targets,
    /// A parameter was written since they were last taken over.
    pub(crate) parameters_changed: bool,
    pub(crate) inputs: Inputs<INPUTS>,
    /// Levels of Y0 and Y1.
    pub(crate) outputs: [bool; 2],
    external_stop: bool,
    periods: u8,
}

impl<const INPUTS: usize> Shell<INPUTS> {
    /// Motor free, nothing asked for.
    pub(crate) fn new() -> Self {
        Self {
            axis: PowerDrive::new(&[]),
            demand: Demand::Off,
            targets: Targets::default(),
            parameters_changed: false,
            inputs: Inputs::default(),
            outputs: [false; 2],
            external_stop: false,
            periods: 0,
        }
    }

    /// One control period; true in each that is a supervision period too.
    #[inline]
    pub(crate) fn is_supervision_due(&mut self, divider: u8) -> bool {
        self.periods += 1;
        let due = self.periods >= divider;
        if due {
            self.periods = 0;
        }
        due
    }

    /// One supervision period of the axis.
    pub(crate) fn move_axis(
        &mut self,
        feedback: Feedback,
        parameters: &AxisParameters,
        holding: Holding,
        dt_s: f64,
    ) -> Demand {
        let demand = self.axis.update(feedback, &self.targets, parameters, dt_s);
        demand.unwrap_or_else(|| {
            let task = self.idle_task(parameters.external_stop, holding);
            self.axis.idle(task, dt_s)
        })
    }

    /// The power stage is to be on: enabled and not let go, or held without being enabled.
    pub(crate) fn is_energised(&self, external_stop: ExternalStop, holding: Holding) -> bool {
        self.axis.is_driven() || (!self.axis.is_live() && self.idle_task(external_stop, holding).is_some())
    }

    /// What a shaft does that is not enabled. An external stop that is to leave the motor free does so here too.
    fn idle_task(&self, external_stop: ExternalStop, holding: Holding) -> Option<Task> {
        let freed = self.external_stop && external_stop != ExternalStop::Hold;
        let holds = match self.axis.state() {
            PowerState::NotReadyToSwitchOn | PowerState::FaultReactionActive | PowerState::Fault => false,
            PowerState::SwitchedOn => holding.when_disabled || holding.when_switched_on,
            _ => holding.when_disabled,
        };
        (holds && !freed).then_some(Task::Hold { control: Control::Position, ramp: Ramp::NONE })
    }

    /// What the inputs say. True when an external stop begins or ends: the targets are taken away then, so that nothing
    /// starts by itself.
    pub(crate) fn take_signals(&mut self, signals: &Signals) -> bool {
        self.axis.set_switches(signals.switches);
        let changed = signals.emergency_stop != self.external_stop;
        if changed {
            self.external_stop = signals.emergency_stop;
            self.axis.set_external_stop(self.external_stop);
        }
        changed
    }

    /// A fault: off at once.
    pub(crate) fn enter_fault(&mut self) {
        self.axis.fault(FaultReactionOption::DISABLE);
        self.demand = Demand::Off;
    }

    /// Supply voltage is gone.
    pub(crate) fn power_off(&mut self) {
        self.axis = PowerDrive::new(&[]);
        self.demand = Demand::Off;
    }

    /// The zero of the position: what was `by` is 0 from now on, and whatever moves goes on moving. What is demanded at this
    /// moment stands at the same place of the shaft: no lag comes of it.
    pub(crate) fn shift_position(&mut self, by: i32) {
        self.axis.shift_position(by);
        if let Demand::Position(point) | Demand::Velocity(point) = &mut self.demand {
            point.position = point.position.wrapping_sub(by);
        }
    }

    /// What the statusword shows.
    pub(crate) fn status(&self, parameters: &AxisParameters) -> Status {
        self.axis.status(&self.targets, parameters)
    }

    /// What both drives report alike.
    pub(crate) fn report<S: Storage>(&self, device: &Device<S>, _axis: AxisId) -> Report {
        Report {
            powered: device.is_running(),
            node_id: device.node().node_id(),
            bitrate: device.bitrate(),
            nmt: device.node().state(),
            state: self.axis.state(),
            mode: self.axis.mode(),
            fault_code: 0,
            position_counts: 0,
            velocity_rpm: 0.0,
            current_a: 0.0,
            brake_engaged: false,
        }
    }
}

//! What a host sets in motion at an axis.

use canopen::od::{Dictionary, Slot, Storage};
use cia402::{Controlword, FaultReactionOption, ModeOfOperation, PowerCommand};

use super::Shaft;
use crate::servo::read;

/// What a write to an axis did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::servo) enum Written {
    /// It was no object of this axis.
    Elsewhere,
    /// The status may have changed.
    Command,
    /// A fault reset is asked for.
    FaultReset,
    /// It acts when its time comes.
    Value,
}

impl Shaft {
    /// The self-test has ended well, and 6060h is in effect.
    pub(in crate::servo) fn start(&mut self, values: &Dictionary<impl Storage>) {
        self.select_mode(read(values, self.slots.mode, 0));
        self.power.self_test_done();
    }

    /// A peer wrote to `slot`.
    pub(in crate::servo) fn written(
        &mut self,
        values: &Dictionary<impl Storage>,
        slot: Slot,
        inputs: [bool; 2],
    ) -> Written {
        let written = Some(slot);
        let slots = &self.slots;
        let value = read(values, written, 0);
        if written == slots.controlword {
            return self.command(Controlword(value as u16), values);
        }
        if written == slots.mode {
            self.select_mode(value);
            return Written::Command;
        }
        let mode = self.power.mode();
        if written == slots.target_position {
            if mode == ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION {
                self.take_set_point(value, self.position());
            }
        } else if written == slots.interpolation_set_point {
            // 60C4h:06 = 0: the buffer is closed.
            let open = read(values, slots.interpolation_buffer_clear, 1) != 0;
            if mode == ModeOfOperation::INTERPOLATED_POSITION && self.is_enabled() && open {
                self.take_set_point(value, self.position());
            }
        } else if written == slots.touch_probe_function {
            self.probes.set_function(value as u16, inputs);
        } else if !slots.is_target(slot) {
            let known = values.table().row(slot).index >= 0x6000;
            self.parameters_changed |= known;
            return if known { Written::Value } else { Written::Elsewhere };
        }
        Written::Value
    }

    /// Whether 6060h accepts a mode.
    pub(in crate::servo) fn has_mode(&self, mode: ModeOfOperation) -> bool {
        mode == ModeOfOperation::NONE || self.modes.has(mode)
    }

    /// A fault: stops the motor as its reaction says.
    pub(in crate::servo) fn fault(&mut self, reaction: FaultReactionOption) {
        self.power.fault(reaction);
        if reaction == FaultReactionOption::DISABLE {
            self.demand = crate::engine::axis::Demand::Off;
        }
    }

    /// What is remembered of faults whose cause is gone.
    pub(in crate::servo) fn forget_causes(&mut self) {
        self.overload.reset();
        self.outside.restart();
        self.following_error = false;
    }

    /// The last fault is gone.
    pub(in crate::servo) fn reset_fault(&mut self) {
        self.power.reset_fault();
    }

    /// The device gives the command itself, whatever the host wants.
    pub(in crate::servo) fn command_itself(&mut self, command: PowerCommand) {
        let _ = self.power.command(command.controlword(), 0, &self.parameters.power);
    }

    fn select_mode(&mut self, value: i64) {
        let mode = ModeOfOperation(value as i8);
        if self.has_mode(mode) {
            if mode != self.power.mode() {
                self.set_point_age_s = None;
            }
            self.power.request_mode(mode);
        }
    }

    fn command(&mut self, controlword: Controlword, values: &Dictionary<impl Storage>) -> Written {
        if self.parameters_changed {
            self.parameters_changed = false;
            self.parameters = crate::servo::parameters::Parameters::of(values, &self.slots, &self.motor);
        }
        let target = self.parameters.scales.increments(read(values, self.slots.target_position, 0));
        let relative = controlword.has(Controlword::RELATIVE);
        let target = self.held_target(target, relative);
        if self.power.command(controlword, target, &self.parameters.power) {
            Written::FaultReset
        } else {
            Written::Command
        }
    }

    /// A target position held to the software limits.
    fn held_target(&self, target: i32, relative: bool) -> i32 {
        let Some(travel) = self.parameters.travel else { return target };
        let from = if relative { f64::from(self.power.axis().target()) } else { 0.0 };
        (travel.hold(from + f64::from(target)) - from) as i32
    }
}

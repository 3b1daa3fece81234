//! What a host sets in motion at an axis.

use canopen::node::Via;
use canopen::object::COMMUNICATION_CYCLE_PERIOD;
use canopen::od::{Dictionary, Slot, Storage};
use cia402::{AbortConnectionOption, Controlword, FaultReactionOption, ModeOfOperation, PowerCommand};

use super::cyclic::{MOST_WAITING, Organisation};
use super::{Shaft, TargetHold};
use crate::engine::faults::FaultSet;
use crate::servo::parameters::counter;
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
    pub(in crate::servo) fn start(&mut self, values: &mut Dictionary<impl Storage>) {
        self.organise_buffer(values);
        self.select_mode(read(values, self.slots.mode, 0));
        self.power.self_test_done();
    }

    /// A peer wrote to `slot`.
    pub(in crate::servo) fn written(
        &mut self,
        values: &mut Dictionary<impl Storage>,
        slot: Slot,
        via: Via,
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
        if written == slots.touch_probe_function {
            self.probes.set_function(value as u16, inputs);
        } else if self.is_set_point(written) {
            // 60C4h:06 = 0: the buffer is closed. A set-point that waits for nothing needs none.
            let mode = self.power.mode();
            let open = mode != ModeOfOperation::INTERPOLATED_POSITION
                || !self.set_points.waiting.is_used()
                || read(values, slots.interpolation_buffer_clear, 1) != 0;
            if open {
                self.take_set_point(values, matches!(via, Via::Rpdo(_)));
                self.publish_waiting(values);
            }
        } else if self.is_of_buffer(written) {
            self.organise_buffer(values);
        } else if written == slots.interpolation_buffer_position {
            self.publish_waiting(values);
        } else if !slots.is_target(slot) {
            let index = values.table().row(slot).index;
            let is_gain = self.named.is_some_and(|named| named.has(slot));
            let known = index >= 0x6000;
            self.parameters_changed |= known || is_gain || index == COMMUNICATION_CYCLE_PERIOD.index;
            return if known { Written::Value } else { Written::Elsewhere };
        }
        Written::Value
    }

    /// The object that brings the set-points of the mode in effect, if that is given one each cycle.
    fn is_set_point(&self, written: Option<Slot>) -> bool {
        let slots = &self.slots;
        let of_mode = match self.power.mode() {
            ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => slots.target_position,
            ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY => slots.target_velocity,
            ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE
            | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE => slots.target_torque,
            ModeOfOperation::INTERPOLATED_POSITION => slots.interpolation_set_point,
            _ => None,
        };
        of_mode.is_some() && written == of_mode
    }

    fn is_of_buffer(&self, written: Option<Slot>) -> bool {
        let slots = &self.slots;
        [slots.interpolation_buffer_size, slots.interpolation_buffer_organisation, slots.interpolation_buffer_clear]
            .contains(&written)
    }

    /// 60C4h: what waits is dropped when the buffer is cleared (sub-index 06h = 0), or gets another size or organisation.
    pub(super) fn organise_buffer(&mut self, values: &mut Dictionary<impl Storage>) {
        let slots = &self.slots;
        let most = read(values, slots.interpolation_most_waiting, 1).clamp(1, MOST_WAITING as i64);
        let size = read(values, slots.interpolation_buffer_size, 1).clamp(1, most) as u8;
        let organisation = match read(values, slots.interpolation_buffer_organisation, 0) {
            1 => Organisation::Ring,
            _ => Organisation::FirstInFirstOut,
        };
        self.set_points.waiting.reorganise(size, organisation);
        self.publish_waiting(values);
    }

    /// The connection to the host is lost, in the way that this row is the fault of; 6007h says what that does. True if it is a
    /// fault, which lasts as long as the loss does, if it lasts at all.
    pub(in crate::servo) fn lose_connection(
        &mut self,
        values: &Dictionary<impl Storage>,
        row: usize,
        lasts: bool,
    ) -> bool {
        self.refresh(values);
        match self.parameters.abort_connection {
            AbortConnectionOption::NONE => false,
            AbortConnectionOption::DISABLE_VOLTAGE => {
                self.command_itself(PowerCommand::DisableVoltage);
                false
            }
            AbortConnectionOption::QUICK_STOP => {
                self.command_itself(PowerCommand::QuickStop);
                false
            }
            // Codes that mean nothing to this firmware count as the standard's default.
            _ => {
                self.lost = self.lost.with(row, lasts);
                true
            }
        }
    }

    /// It is there again in this way: a fault for it can be reset.
    pub(in crate::servo) fn regain_connection(&mut self, row: usize) {
        self.lost = FaultSet(self.lost.0 & !FaultSet::row(row).0);
        let _ = self.faults.forget(row);
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
                self.set_points.forget();
            }
            self.power.request_mode(mode);
        }
    }

    fn command(&mut self, controlword: Controlword, values: &Dictionary<impl Storage>) -> Written {
        self.refresh(values);
        let target = self.parameters.scales.increments(read(values, self.slots.target_position, 0));
        let held = self.held_target(target, controlword);
        if controlword.rises(self.power.controlword(), Controlword::NEW_SET_POINT) {
            self.target_hold = held.1;
        }
        if self.power.command(controlword, held.0, &self.parameters.power) {
            Written::FaultReset
        } else {
            Written::Command
        }
    }

    /// 607Ah as the axis is given it (bit 6: the way), held to the software limits, and to what the counter can show: to its
    /// two ends, and to no more than half of its round, for beyond that the short way is the other one. Relative moves turn on
    /// past the ends.
    ///
    /// In a range of positions (607Bh) a target counts in the round in which the shaft is to be (60F2h = 0, its default: as of a
    /// linear axis), and may be further away than a round.
    fn held_target(&self, target: i64, controlword: Controlword) -> (i32, TargetHold) {
        let axis = self.power.axis();
        let relative = controlword.has(Controlword::RELATIVE);
        if let (Some(range), false) = (self.parameters.range, relative) {
            let from = if controlword.has(Controlword::CHANGE_SET_IMMEDIATELY) {
                axis.point().position
            } else {
                axis.target()
            };
            let whole = self.whole(from);
            let wanted = range.in_round_of(target, self.parameters.scales.whole_position(whole));
            let way = (wanted - whole as f64).clamp(-f64::from(i32::MAX), f64::from(i32::MAX));
            let hold = if way == wanted - whole as f64 { TargetHold::None } else { TargetHold::Counter };
            return (from.wrapping_add(way as i32), hold);
        }
        let from = if relative { i64::from(axis.target()) } else { 0 };
        let wanted = from.saturating_add(target);
        let within = match self.parameters.travel.map(|travel| travel.hold(wanted as f64)) {
            Some(held) if held != wanted as f64 => held as i64,
            _ => wanted,
        };
        let at_once = controlword.has(Controlword::CHANGE_SET_IMMEDIATELY);
        let begins = if at_once { axis.point().position } else { axis.target() };
        let middle = if relative { begins.wrapping_sub(axis.target()) } else { begins };
        let [middle, most] = [middle, i32::MAX].map(i64::from);
        let reported = counter(within.saturating_sub(from).clamp(middle - most, middle + most));
        let hold = match within.saturating_sub(from) {
            way if i64::from(reported) != way => TargetHold::Counter,
            _ if within != wanted => TargetHold::Limit,
            _ => TargetHold::None,
        };
        (reported, hold)
    }
}

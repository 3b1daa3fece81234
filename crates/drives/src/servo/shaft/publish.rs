//! What an axis shows in its objects.

use canopen::od::{Dictionary, Storage};
use cia402::{DigitalInputs, DigitalOutputs, ModeOfOperation, PowerState};

use super::{AxisSensors, Shaft, TargetHold};
use crate::engine::axis::Demand;
use crate::engine::cia402::StopCause;
use crate::servo::statusword::{Facts, statusword};
use crate::servo::{read, write};

/// Levels of an axis' outputs.
pub(super) struct Outputs {
    /// The host has the brake set.
    pub(super) set_brake: bool,
    /// Bits 16 to 31.
    pub(super) manufacturer: u16,
}

/// Probes in the maker's half of 60FDh.
const PROBE_BITS: [u32; 2] = [1 << 16, 1 << 17];

impl Shaft {
    pub(super) fn publish(&self, values: &mut Dictionary<impl Storage>, sensors: &AxisSensors, bus_v: f32) {
        let slots = &self.slots;
        let scales = &self.parameters.scales;
        let position = self.position();
        let velocity = f64::from(self.servo.velocity_rad_s() / self.model.rad_per_count());
        let direction = scales.direction() as f32;
        write(values, slots.position, self.shown(position));
        write(values, slots.position_internal, i64::from(position));
        write(values, slots.velocity, scales.velocity(velocity));
        write(values, slots.vl_actual, self.parameters.velocity_mode.actual(velocity));
        let torque = self.parameters.torque(self.servo.current_a(), &self.motor);
        write(values, slots.torque, torque * scales.direction() as i64);
        let current = self.servo.current_a() * direction / self.motor.rated_current_a;
        write(values, slots.current, libm::roundf(current * 1e3) as i64);
        let demanded = self.parameters.torque(self.servo.setpoint_a(), &self.motor);
        write(values, slots.torque_demand, demanded * scales.direction() as i64);
        if let Some((slot, shown)) = self.named.and_then(|named| named.shown(self.servo.setpoint_a())) {
            write(values, Some(slot), shown * scales.direction() as i64);
        }
        write(values, slots.bus_voltage, libm::roundf(bus_v * 1e3) as i64);
        write(values, slots.digital_inputs, i64::from(digital_inputs(sensors).0));
        self.publish_demand(values, position);
        self.publish_status(values);
    }

    fn publish_demand(&self, values: &mut Dictionary<impl Storage>, position: i32) {
        let slots = &self.slots;
        let scales = &self.parameters.scales;
        let (demanded, velocity) = match &self.demand {
            Demand::Position(point) => (point.position, point.velocity),
            Demand::Velocity(point) => (position, point.velocity),
            Demand::Off | Demand::Torque(_) => (position, 0.0),
        };
        write(values, slots.position_demand, self.shown(demanded));
        write(values, slots.position_demand_internal, i64::from(demanded));
        write(values, slots.velocity_demand, scales.velocity(velocity));
        write(values, slots.vl_demand, self.parameters.velocity_mode.demand(velocity));
        let error = self.error().unwrap_or(0);
        let error = i32::try_from(error).unwrap_or(if error < 0 { i32::MIN } else { i32::MAX });
        write(values, slots.following_error, scales.position(error));
        write(values, slots.control_effort, scales.velocity(self.control_effort()));
    }

    /// What the position loop asks of the velocity loop, increments/s; 0 while no position is controlled.
    fn control_effort(&self) -> f64 {
        let (Demand::Position(point), Some(error)) = (&self.demand, self.error()) else { return 0.0 };
        let gains = &self.gains.cascade;
        let fed_forward = f64::from(gains.velocity_feed_forward) * point.velocity;
        let wanted = f64::from(gains.position_per_s) * (error as f64 + point.fraction) + fed_forward;
        let most = f64::from(gains.velocity_limit_rad_s / self.model.rad_per_count());
        wanted.clamp(-most, most)
    }

    /// Statusword and mode display; also right after a command, for a host that reads back.
    pub(in crate::servo) fn publish_status(&self, values: &mut Dictionary<impl Storage>) {
        let mode = self.power.mode();
        let word = statusword(self.power.state(), mode, &self.facts());
        write(values, self.slots.statusword, i64::from(word.0));
        write(values, self.slots.mode_display, i64::from(mode.0));
    }

    fn facts(&self) -> Facts {
        let status = self.power.status(&self.targets, &self.parameters.power);
        let halted = self.power.stop_cause() == Some(StopCause::Halt);
        let windowed =
            matches!(self.power.mode(), ModeOfOperation::PROFILE_POSITION | ModeOfOperation::PROFILE_VELOCITY);
        let time_ms = match self.power.mode() {
            ModeOfOperation::PROFILE_POSITION => self.parameters.position_window.time_ms,
            _ => self.parameters.velocity_window.1,
        };
        let lasts = self.reached.has_lasted(time_ms);
        let target_hold = match self.power.mode() {
            ModeOfOperation::PROFILE_POSITION => self.target_hold,
            _ => TargetHold::None,
        };
        let out_of_reach = target_hold == TargetHold::Counter && self.power.stop_cause().is_none();
        Facts {
            voltage: !matches!(self.power.state(), PowerState::NotReadyToSwitchOn),
            target_reached: status.target_reached && !out_of_reach && (halted || !windowed || lasts),
            limited: self.limited || target_hold != TargetHold::None || status.limit_active,
            acknowledged: status.acknowledged,
            standing: self.standing.has_lasted(self.parameters.velocity_threshold.1),
            following_error: self.following_error,
            homing_attained: status.homing_attained,
            homing_error: status.homing_error,
            follows: self.targets.cyclic.is_some() && self.power.stop_cause().is_none(),
        }
    }

    pub(super) fn outputs(&self, values: &Dictionary<impl Storage>) -> Outputs {
        let outputs = DigitalOutputs {
            physical_outputs: read(values, self.slots.physical_outputs, 0) as u32,
            bit_mask: match self.slots.output_mask {
                Some(_) => read(values, self.slots.output_mask, 0) as u32,
                None if self.slots.physical_outputs.is_some() => !DigitalOutputs::SET_BRAKE,
                None => 0,
            },
        };
        let levels = outputs.levels(0);
        Outputs { set_brake: levels & DigitalOutputs::SET_BRAKE != 0, manufacturer: (levels >> 16) as u16 }
    }
}

fn digital_inputs(sensors: &AxisSensors) -> DigitalInputs {
    DigitalInputs::default()
        .with(DigitalInputs::NEGATIVE_LIMIT_SWITCH, sensors.negative_limit)
        .with(DigitalInputs::POSITIVE_LIMIT_SWITCH, sensors.positive_limit)
        .with(DigitalInputs::HOME_SWITCH, sensors.home)
        .with(PROBE_BITS[0], sensors.probes[0])
        .with(PROBE_BITS[1], sensors.probes[1])
}

//! Actual values -> dictionary.

use cia402::{Controlword, ModeOfOperation};

use super::{HEARTBEAT_ALARM, MJoint};
use crate::engine::axis::HomingState;
use crate::mjoint::alarms;
use crate::mjoint::assumptions::{COUNTS_S_PER_RPM, POSITION_REACHED_COUNTS, SPEED_REACHED_RPM, STANDSTILL_RPM};
use crate::mjoint::hardware::Sensors;
use crate::mjoint::objects::*;
use crate::mjoint::statusword::{StatusCondition, statusword};

/// 6078h: 1/2000 A.
const CURRENT_COUNTS_PER_A: f32 = 2000.0;
/// 6079h: 1/327 V.
const VOLTAGE_COUNTS_PER_V: f32 = 327.0;
/// 606Ch: 0.1 r/min.
const SPEED_COUNTS_PER_RPM: f32 = 10.0;
/// Largest value of the 16-bit objects.
const LARGEST: f32 = 32767.0;

impl MJoint {
    pub(super) fn publish(&mut self, sensors: &Sensors) {
        let speed = round(self.output.shown_velocity_rpm() * SPEED_COUNTS_PER_RPM).clamp(-30_000.0, 30_000.0) as i16;
        let current = round(self.output.shown_current_a().abs() * CURRENT_COUNTS_PER_A).min(LARGEST) as u16;
        let (inputs, pwm) = (self.terminals.levels(), round(self.output.share(sensors.bus_v) * LARGEST) as i16);
        let values = self.device.values_mut();
        // Another width with firmware 1.66.
        values.set_number(VELOCITY_ACTUAL_VALUE, speed);
        values.set(CURRENT_ACTUAL_VALUE, current);
        values.set(DC_LINK_CIRCUIT_VOLTAGE, round(sensors.bus_v * VOLTAGE_COUNTS_PER_V).clamp(0.0, LARGEST) as u16);
        values.set(DRIVER_TEMPERATURE, round(sensors.driver_c).clamp(0.0, 100.0) as u16);
        // 2613h is signed as the current that is asked for.
        values.set(OUTPUT_PWM, pwm);
        values.set(DIGITAL_INPUTS, inputs);
        self.publish_position();
        self.publish_status();
    }

    pub(super) fn publish_position(&mut self) {
        let position = self.encoder.position();
        let values = self.device.values_mut();
        values.set(POSITION_ACTUAL_VALUE, position);
        values.set(POSITION_ACTUAL_INTERNAL_VALUE, position);
    }

    /// 260Eh, 1001h and the heartbeat.
    pub(super) fn publish_alarms(&mut self) {
        let code = alarms::code(self.alarms.latched());
        let register = self.alarms.error_register();
        let values = self.device.values_mut();
        values.set(ALARM_CODE, code);
        values.set(ERROR_REGISTER, register);
        self.device.set_heartbeat_state((code != 0).then_some(HEARTBEAT_ALARM));
    }

    /// The statusword; also right after a command, for a host that reads back.
    pub(super) fn publish_status(&mut self) {
        let in_homing = self.orders.mode == ModeOfOperation::HOMING;
        let condition = StatusCondition {
            controlword: self.orders.controlword,
            output_enabled: self.values().get(OUTPUT_ENABLED) == 1,
            alarm: !self.alarms.latched().is_empty(),
            live: self.is_shown_live(),
            reached: self.is_target_reached(),
            homing_attained: in_homing && self.homing() == HomingState::Attained,
            homing_error: in_homing && self.homing() == HomingState::Failed,
        };
        self.device.values_mut().set(STATUSWORD, statusword(&condition).0);
    }

    /// Bit 4: of a joint that takes pulses it shows nothing until the host asks. 0404h is what 5.10.1 prints for one that
    /// was just switched on, and such a one holds its shaft.
    fn is_shown_live(&self) -> bool {
        let by_host = self.orders.controlword.has(Controlword::ENABLE_VOLTAGE) || self.has_homing_the_motor();
        self.axis.is_engaged() && (by_host || !self.parameters.function.takes_pulses())
    }

    /// Bit 10: nothing is left to be done. An alarm that stops the motor leaves it undone.
    fn is_target_reached(&self) -> bool {
        let stopping = alarms::RELEASING.0 | 1 << alarms::row::COMMUNICATION;
        if self.alarms.latched().0 & stopping != 0 {
            return false;
        }
        if !self.axis.is_engaged() {
            return true;
        }
        if self.orders.are_halted() {
            return self.output.servo.velocity_rpm().abs() < STANDSTILL_RPM;
        }
        match self.orders.mode {
            _ if !self.orders.are_the_hosts() => self.is_there(),
            ModeOfOperation::HOMING => self.homing() == HomingState::Attained,
            ModeOfOperation::PROFILE_VELOCITY if self.may_move() => self.is_at_speed(),
            _ => self.is_there() && self.orders.next_point.is_none(),
        }
    }

    fn is_there(&self) -> bool {
        self.axis.is_done() && self.axis.way_to_go().unsigned_abs() <= POSITION_REACHED_COUNTS
    }

    fn is_at_speed(&self) -> bool {
        let target_rpm = self.target_velocity() / COUNTS_S_PER_RPM;
        (f64::from(self.output.servo.velocity_rpm()) - target_rpm).abs() <= SPEED_REACHED_RPM
    }
}

fn round(value: f32) -> f32 {
    libm::roundf(value)
}

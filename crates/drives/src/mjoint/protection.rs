//! Which causes of alarms are present, judged once each supervision period.

use super::alarms::row;
use super::assumptions::*;
use super::gains::MODULATION_LIMIT;
use super::hardware::{Battery, Sensors};
use super::parameters::Parameters;
use crate::engine::actuator::servo::Servo;
use crate::engine::faults::{FaultSet, exceeds_with_hysteresis};

/// What has to be remembered from one period to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Protection {
    at_current_limit_s: f32,
    at_output_limit_s: f32,
    turning_s: f32,
    halved: bool,
    battery_was_missing: bool,
    turns_were_lost: bool,
    /// The turns are unknown until an origin is set.
    battery_lost: bool,
}

/// What the causes are judged by, besides the sensors.
pub(super) struct FaultSituation<'a> {
    pub(super) servo: &'a Servo,
    pub(super) live: bool,
    /// Amplitude of the current, over some supervision periods: a gear that swings makes it dip.
    pub(super) current_a: f32,
    pub(super) velocity_rpm: f32,
    pub(super) latched: FaultSet,
    /// The heartbeat of the host is missing.
    pub(super) host_lost: bool,
    /// The turns outlive a power-off without a battery.
    pub(super) has_brake: bool,
    pub(super) turns_known: bool,
}

impl Protection {
    pub(super) fn causes(&mut self, parameters: &Parameters, sensors: &Sensors, now: &FaultSituation<'_>) -> FaultSet {
        self.watch_battery(sensors, now);
        FaultSet::NONE
            .with(row::OVER_VOLTAGE, over_voltage(sensors.bus_v, now))
            .with(row::LOCKED_ROTOR, self.locked_rotor(parameters, now))
            .with(row::STALL, self.stall(parameters, now))
            .with(row::COMMUNICATION, now.host_lost)
            .with(row::BATTERY, self.battery_lost)
    }

    /// A reset gives both times back.
    pub(super) fn reset(&mut self) {
        self.at_current_limit_s = 0.0;
        self.at_output_limit_s = 0.0;
        self.halved = false;
    }

    /// A new origin has been set: the turns are known.
    pub(super) fn origin_set(&mut self) {
        self.battery_lost = false;
    }

    /// Reported once each time: a battery that stays away does not bring the alarm back after an origin was set.
    fn watch_battery(&mut self, sensors: &Sensors, now: &FaultSituation<'_>) {
        let missing = sensors.battery == Battery::Missing && !now.has_brake;
        self.battery_lost |= missing && !self.battery_was_missing;
        self.battery_lost |= !now.turns_known && !self.turns_were_lost;
        self.battery_was_missing = missing;
        self.turns_were_lost = !now.turns_known;
    }

    /// The current stays at the limit of 261Dh.
    fn locked_rotor(&mut self, parameters: &Parameters, now: &FaultSituation<'_>) -> bool {
        let limit_a = parameters.limits.current_a;
        let at_limit = now.live && limit_a > 0.0 && now.current_a >= AT_CURRENT_LIMIT_SHARE * limit_a;
        lasts(&mut self.at_current_limit_s, at_limit, parameters.current_time_s)
    }

    /// Share of the output that the motor may have: 2618h while it is stationary. Without an alarm that is halved after a
    /// while of stall, until the motor has turned for more than the swing of a gear that unwinds.
    pub(super) fn output_share(&mut self, parameters: &Parameters, stationary: bool) -> f32 {
        self.turning_s = if stationary { 0.0 } else { self.turning_s + SUPERVISION_PERIOD_S };
        let stalled = parameters.stationary_time_s == 0.0 && self.at_output_limit_s >= HALVED_AFTER_S;
        self.halved = stalled || (self.halved && self.turning_s < TURNS_AGAIN_S);
        if self.halved {
            0.5 * parameters.stationary_output
        } else if stationary {
            parameters.stationary_output
        } else {
            MODULATION_LIMIT
        }
    }

    /// The output stays at the limit of 2618h and the motor does not turn.
    fn stall(&mut self, parameters: &Parameters, now: &FaultSituation<'_>) -> bool {
        let at_limit = now.live && now.servo.is_saturated() && now.velocity_rpm.abs() < STATIONARY_RPM;
        lasts(&mut self.at_output_limit_s, at_limit, parameters.stationary_time_s)
    }
}

/// True once something has lasted for `limit_s`; a limit of 0 never is.
fn lasts(lasted_s: &mut f32, present: bool, limit_s: f32) -> bool {
    *lasted_s = if present { *lasted_s + SUPERVISION_PERIOD_S } else { 0.0 };
    limit_s > 0.0 && *lasted_s >= limit_s
}

fn over_voltage(bus_v: f32, now: &FaultSituation<'_>) -> bool {
    exceeds_with_hysteresis(bus_v, OVER_VOLTAGE_V, VOLTAGE_HYSTERESIS_V, now.latched.has(row::OVER_VOLTAGE))
}

//! Which causes of faults are present, judged from the sensors once each supervision period.
//!
//! A cause that a fault was latched for counts as gone only some way back from its threshold (hysteresis).

use super::assumptions::*;
use super::faults::row;
use super::hardware::Sensors;
use super::parameters::Parameters;
use crate::engine::actuator::overload::Overload;
use crate::engine::actuator::servo::Servo;
use crate::engine::axis::Demand;
use crate::engine::faults::{FaultSet, exceeds, exceeds_with_hysteresis, within};

/// What has to be remembered from one period to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Protection {
    overload: Overload,
    loose_wire_for: u16,
    supplied_for: u16,
}

/// What the causes are judged by, besides the sensors.
pub(super) struct Situation<'a> {
    pub(super) servo: &'a Servo,
    pub(super) demand: &'a Demand,
    pub(super) position: i32,
    pub(super) velocity_rpm: f32,
    pub(super) eeprom_sound: bool,
    /// More is asked for than this firmware takes.
    pub(super) speed_setting_wrong: bool,
    pub(super) latched: FaultSet,
}

impl Protection {
    pub(super) fn causes(&mut self, parameters: &Parameters, sensors: &Sensors, now: &Situation<'_>) -> FaultSet {
        FaultSet::NONE
            .with(row::OVER_VOLTAGE, over_voltage(sensors.bus_v, now))
            .with(row::UNDER_VOLTAGE, self.under_voltage(sensors.bus_v, now))
            .with(row::OVER_CURRENT, is_over_current(sensors) || self.loose_wire(now))
            .with(row::OVERLOAD, self.overload.update(&parameters.overload, now.current_a(), SUPERVISION_PERIOD_S))
            .with(row::OUT_OF_TOLERANCE, out_of_tolerance(parameters, now))
            .with(row::REFERENCE_VOLTAGE, !within(sensors.reference_v, REFERENCE_V, REFERENCE_TOLERANCE_V))
            .with(row::EEPROM, !now.eeprom_sound)
            .with(row::HALL, matches!(sensors.hall & 7, 0 | 7))
            .with(
                row::MOTOR_TEMPERATURE,
                too_hot(sensors.motor_c, parameters.motor_limit_c, now, row::MOTOR_TEMPERATURE),
            )
            .with(
                row::DRIVER_TEMPERATURE,
                too_hot(sensors.driver_c, parameters.driver_limit_c, now, row::DRIVER_TEMPERATURE),
            )
            .with(
                row::ENCODER,
                !sensors.encoder_wired || exceeds(now.servo.disagreement_turns().abs(), HALL_DISAGREEMENT_TURNS),
            )
            .with(row::SPEED_SETTING, now.speed_setting_wrong)
    }

    /// A fault reset gives the overload its whole time back.
    pub(super) fn reset(&mut self) {
        self.overload.reset();
        self.loose_wire_for = 0;
    }

    fn under_voltage(&mut self, bus_v: f32, now: &Situation<'_>) -> bool {
        if self.supplied_for < SUPPLY_SETTLING_PERIODS {
            self.supplied_for += 1;
            return false;
        }
        let recovered = if now.latched.has(row::UNDER_VOLTAGE) { VOLTAGE_HYSTERESIS_V } else { 0.0 };
        exceeds(UNDER_VOLTAGE_V + recovered, bus_v)
    }

    /// The voltage is used up at a standstill and the current still does not come.
    fn loose_wire(&mut self, now: &Situation<'_>) -> bool {
        let asked_a = now.servo.setpoint_a().abs();
        let missing = now.servo.is_saturated()
            && asked_a >= LOOSE_WIRE_LEAST_A
            && now.current_a().abs() < LOOSE_WIRE_CURRENT_SHARE * asked_a
            && now.velocity_rpm.abs() < LOOSE_WIRE_MOST_RPM;
        self.loose_wire_for = if missing { self.loose_wire_for.saturating_add(1) } else { 0 };
        self.loose_wire_for >= LOOSE_WIRE_PERIODS
    }
}

impl Situation<'_> {
    fn current_a(&self) -> f32 {
        self.servo.current_a()
    }
}

/// Any phase carries more than the power stage bears. The third current is the sum of the others, reversed.
#[inline]
pub(super) fn is_over_current(sensors: &Sensors) -> bool {
    let [u, v] = sensors.phase_current_a;
    [u, v, u + v].iter().any(|current_a| exceeds(current_a.abs(), OVER_CURRENT_A))
}

fn out_of_tolerance(parameters: &Parameters, now: &Situation<'_>) -> bool {
    match now.demand {
        Demand::Position(point) => {
            point.position.wrapping_sub(now.position).unsigned_abs() > parameters.out_of_tolerance
        }
        _ => false,
    }
}

fn over_voltage(bus_v: f32, now: &Situation<'_>) -> bool {
    exceeds_with_hysteresis(bus_v, OVER_VOLTAGE_V, VOLTAGE_HYSTERESIS_V, now.latched.has(row::OVER_VOLTAGE))
}

fn too_hot(celsius: f32, limit_c: f32, now: &Situation<'_>, row: usize) -> bool {
    exceeds_with_hysteresis(celsius, limit_c, TEMPERATURE_HYSTERESIS_C, now.latched.has(row))
}

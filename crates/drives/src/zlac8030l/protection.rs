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
    wires: WireWatch,
    supplied_for: u16,
}

/// Detects a wire that has come off a moving motor: one current stays away while the two others flow.
///
/// The current vector of a sound motor turns with its rotor, whichever way it points, and leaves each wire without current in two
/// narrow stretches of an electrical turn only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WireWatch {
    /// U, V and W since they last carried something.
    empty: [ElectricalTravel; 3],
}

/// Where a rotor has been, in electrical turns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ElectricalTravel {
    /// From where it began.
    at: f32,
    lowest: f32,
    highest: f32,
    /// There and back counted.
    whole: f32,
}

impl ElectricalTravel {
    fn go_on(&mut self, turns: f32) {
        self.at += turns;
        self.lowest = self.lowest.min(self.at);
        self.highest = self.highest.max(self.at);
        self.whole += turns.abs();
    }
}

impl WireWatch {
    /// Takes in one supervision period, in which the rotor turned so far. True if a wire is off.
    fn observe(&mut self, [u, v]: [f32; 2], electrical_turns: f32) -> bool {
        let currents_a = [u, v, u + v].map(f32::abs);
        let most_a = currents_a.iter().fold(0.0, |most: f32, now| if *now > most { *now } else { most });
        let carried_a =
            LOOSE_WIRE_CARRIED_SHARE * if most_a > LOOSE_WIRE_OTHERS_A { most_a } else { LOOSE_WIRE_OTHERS_A };
        let turned = electrical_turns.clamp(-LOOSE_WIRE_MOST_TURNS, LOOSE_WIRE_MOST_TURNS);
        let mut off = false;
        for (empty, current_a) in self.empty.iter_mut().zip(currents_a) {
            if current_a >= carried_a {
                *empty = ElectricalTravel::default();
            } else if most_a >= LOOSE_WIRE_OTHERS_A {
                empty.go_on(turned);
            }
            off |= empty.whole >= LOOSE_WIRE_TURNS && empty.highest - empty.lowest >= LOOSE_WIRE_SPAN_TURNS;
        }
        off
    }
}

/// What the causes are judged by, besides the sensors.
pub(super) struct FaultSituation<'a> {
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
    pub(super) fn causes(&mut self, parameters: &Parameters, sensors: &Sensors, now: &FaultSituation<'_>) -> FaultSet {
        FaultSet::NONE
            .with(row::OVER_VOLTAGE, over_voltage(sensors.bus_v, now))
            .with(row::UNDER_VOLTAGE, self.under_voltage(parameters, sensors.bus_v, now))
            .with(row::OVER_CURRENT, is_over_current(sensors) || self.loose_wire(parameters, sensors, now))
            .with(
                row::OVERLOAD,
                self.overload.update(&parameters.overload, now.current_a(), parameters.supervision_period_s()),
            )
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
        self.wires = WireWatch::default();
    }

    fn under_voltage(&mut self, parameters: &Parameters, bus_v: f32, now: &FaultSituation<'_>) -> bool {
        if self.supplied_for < SUPPLY_SETTLING_PERIODS {
            self.supplied_for += parameters.supervisions;
            return false;
        }
        let recovered = if now.latched.has(row::UNDER_VOLTAGE) { VOLTAGE_HYSTERESIS_V } else { 0.0 };
        exceeds(UNDER_VOLTAGE_V + recovered, bus_v)
    }

    /// The voltage is used up at a standstill and the current still does not come, or one wire of a turning motor stays without.
    fn loose_wire(&mut self, parameters: &Parameters, sensors: &Sensors, now: &FaultSituation<'_>) -> bool {
        let asked_a = now.servo.setpoint_a().abs();
        let missing = now.servo.is_saturated()
            && asked_a >= LOOSE_WIRE_LEAST_A
            && now.current_a().abs() < LOOSE_WIRE_CURRENT_SHARE * asked_a
            && now.velocity_rpm.abs() < LOOSE_WIRE_MOST_RPM;
        self.loose_wire_for = if missing { self.loose_wire_for.saturating_add(parameters.supervisions) } else { 0 };
        let pole_pairs = parameters.model.commutation.pole_pairs as f32;
        let turned = now.velocity_rpm * (parameters.supervision_period_s() / 60.0) * pole_pairs;
        let off = if *now.demand == Demand::Off {
            self.wires = WireWatch::default();
            false
        } else {
            self.wires.observe(sensors.phase_current_a, turned)
        };
        off || self.loose_wire_for >= LOOSE_WIRE_PERIODS
    }
}

impl FaultSituation<'_> {
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

fn out_of_tolerance(parameters: &Parameters, now: &FaultSituation<'_>) -> bool {
    match now.demand {
        Demand::Position(point) => {
            point.position.wrapping_sub(now.position).unsigned_abs() > parameters.out_of_tolerance
        }
        _ => false,
    }
}

fn over_voltage(bus_v: f32, now: &FaultSituation<'_>) -> bool {
    exceeds_with_hysteresis(bus_v, OVER_VOLTAGE_V, VOLTAGE_HYSTERESIS_V, now.latched.has(row::OVER_VOLTAGE))
}

fn too_hot(celsius: f32, limit_c: f32, now: &FaultSituation<'_>, row: usize) -> bool {
    exceeds_with_hysteresis(celsius, limit_c, TEMPERATURE_HYSTERESIS_C, now.latched.has(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The verdict after so many electrical turns of a rotor whose current vector has this amplitude, a wire or none being off.
    fn judged(amplitude_a: f32, off: Option<usize>, turns_per_period: f32, turns: f32) -> bool {
        let mut watch = WireWatch::default();
        let periods = (turns / turns_per_period.abs()) as u32;
        (0..periods).any(|period| {
            let angle = turns_per_period * period as f32 * core::f32::consts::TAU;
            let third = core::f32::consts::TAU / 3.0;
            let mut currents_a = [0.0, 1.0, 2.0].map(|wire: f32| amplitude_a * libm::sinf(angle - wire * third));
            if let Some(wire) = off {
                // What is left flows through the two others.
                let (one, other) = ((wire + 1) % 3, (wire + 2) % 3);
                let through_a = 0.5 * (currents_a[one] - currents_a[other]);
                (currents_a[wire], currents_a[one], currents_a[other]) = (0.0, through_a, -through_a);
            }
            watch.observe([currents_a[0], currents_a[1]], turns_per_period)
        })
    }

    #[test]
    fn a_wire_that_is_off_is_reported_within_two_electrical_turns_whichever_it_is_and_whichever_way_the_motor_turns() {
        for wire in 0..3 {
            for turns_per_period in [2e-3, -2e-3, 0.0125, -0.0125] {
                assert!(judged(1.0, Some(wire), turns_per_period, 2.0), "{wire} at {turns_per_period}");
                assert!(!judged(1.0, Some(wire), turns_per_period, 0.4), "{wire} at {turns_per_period}");
            }
        }
    }

    #[test]
    fn a_sound_motor_is_never_taken_for_one_at_any_speed_and_current() {
        for turns_per_period in [1e-4, 2e-3, 0.0125, 0.05, 0.125, -0.125, 0.16, 0.25] {
            for amplitude_a in [0.01, 0.1, 0.25, 1.0, 60.0] {
                assert!(!judged(amplitude_a, None, turns_per_period, 50.0), "{amplitude_a} A, {turns_per_period}");
            }
        }
    }

    #[test]
    fn a_rotor_that_swings_shows_a_wire_that_is_off_only_if_it_swings_farther_than_a_sound_one_leaves_it_empty() {
        let swings = |turns: f32| {
            let mut watch = WireWatch::default();
            (0..10_000)
                .any(|period| watch.observe([0.0, 3.0], if period / 10 % 2 == 0 { turns } else { -turns } / 10.0))
        };
        // |sin x| below a quarter of the others' 0.87: 25 degrees.
        assert!(!swings(25.0 / 360.0) && swings(0.22));
    }
}

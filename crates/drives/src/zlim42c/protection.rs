//! Which causes of faults are present, judged once each supervision period from the largest values in it.

use super::assumptions::*;
use super::faults::row;
use super::hardware::Sensors;
use crate::engine::actuator::stepper::Peaks;
use crate::engine::faults::{FaultSet, exceeds, exceeds_with_hysteresis, within};

/// What the causes are judged by, besides the sensors.
pub(super) struct FaultSituation {
    /// Current from the bus, A, mean over the supervision period.
    pub(super) bus_a: f32,
    pub(super) phase_lost: bool,
    pub(super) eeprom_sound: bool,
    pub(super) latched: FaultSet,
}

/// Distinguishes an open phase from one that is not asked for current at present, or cannot be given any.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PhaseWatch {
    /// Supervision periods in which each phase was asked and carried nothing, since it last carried something. Those in
    /// which it was not asked do not count: a slowly turning vector asks each phase for a part of its turn only.
    empty_for: [u16; 2],
}

impl PhaseWatch {
    /// Takes in one supervision period: amplitude of the vector asked for, A (0 while the motor is free), and its speed.
    /// True if a phase is lost.
    pub(super) fn observe(&mut self, peaks: &Peaks, amplitude_a: f32, speed_rpm: f64) -> bool {
        if amplitude_a <= 0.0 {
            *self = Self::default();
            return false;
        }
        let carries = |phase: usize, share| peaks.current_a[phase] >= share * amplitude_a;
        let fast = speed_rpm.abs() > PHASE_COMPARED_RPM;
        let mut lost = false;
        for (phase, empty_for) in self.empty_for.iter_mut().enumerate() {
            // Where the motor's own voltage is near the bus voltage, a sound motor takes hardly any current: in both.
            let beside = fast && peaks.current_a[phase] >= PHASE_BESIDE_SHARE * peaks.current_a[1 - phase];
            let held_down = fast && !carries(1 - phase, PHASE_SOUND_SHARE);
            if carries(phase, PHASE_CARRIED_SHARE) {
                *empty_for = 0;
            } else if peaks.reference_a[phase] > PHASE_ASKED_SHARE * amplitude_a && !held_down && !beside {
                *empty_for = empty_for.saturating_add(1);
            }
            lost |= *empty_for >= PHASE_LOSS_DEBOUNCE_PERIODS;
        }
        lost
    }
}

pub(super) fn causes(sensors: &Sensors, now: &FaultSituation) -> FaultSet {
    FaultSet::NONE
        .with(row::OVER_VOLTAGE, over_voltage(sensors.bus_v, now))
        .with(row::OVER_CURRENT, is_over_current(sensors))
        .with(row::PHASE_LOSS, now.phase_lost)
        .with(row::REFERENCE_VOLTAGE, !within(sensors.reference_v, REFERENCE_V, REFERENCE_TOLERANCE_V))
        .with(row::EEPROM, !now.eeprom_sound)
        .with(row::BUS_OVER_CURRENT, exceeds(now.bus_a, BUS_OVER_CURRENT_A))
}

/// Any phase carries more than the power stage bears.
#[inline]
pub(super) fn is_over_current(sensors: &Sensors) -> bool {
    sensors.phase_current_a.iter().any(|current_a| exceeds(current_a.abs(), OVER_CURRENT_A))
}

fn over_voltage(bus_v: f32, now: &FaultSituation) -> bool {
    exceeds_with_hysteresis(bus_v, OVER_VOLTAGE_V, VOLTAGE_HYSTERESIS_V, now.latched.has(row::OVER_VOLTAGE))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The watch's verdict after so many periods in which both phases of a vector of 1 A are asked for 0.7 A.
    fn judged(current_a: [f32; 2], speed_rpm: f64, periods: u16) -> bool {
        let mut watch = PhaseWatch::default();
        let peaks = Peaks { current_a, reference_a: [0.7; 2] };
        (0..periods).any(|_| watch.observe(&peaks, 1.0, speed_rpm))
    }

    #[test]
    fn two_empty_phases_are_lost_at_low_speed_and_held_down_by_the_motors_own_voltage_at_high_speed() {
        let long = 10 * PHASE_LOSS_DEBOUNCE_PERIODS;
        assert!(judged([0.0; 2], 0.5 * PHASE_COMPARED_RPM, PHASE_LOSS_DEBOUNCE_PERIODS));
        assert!(!judged([0.0; 2], 2.0 * PHASE_COMPARED_RPM, long));
        assert!(!judged([0.0; 2], -2.0 * PHASE_COMPARED_RPM, long));
    }

    #[test]
    fn an_empty_phase_beside_one_that_carries_is_lost_at_any_speed() {
        for speed_rpm in [0.0, 0.5 * PHASE_COMPARED_RPM, 2.0 * PHASE_COMPARED_RPM] {
            for current_a in [[0.0, 0.7], [0.7, 0.0]] {
                assert!(!judged(current_a, speed_rpm, PHASE_LOSS_DEBOUNCE_PERIODS - 1), "{speed_rpm} r/min");
                assert!(judged(current_a, speed_rpm, PHASE_LOSS_DEBOUNCE_PERIODS), "{speed_rpm} r/min");
            }
            assert!(!judged([0.7; 2], speed_rpm, 10 * PHASE_LOSS_DEBOUNCE_PERIODS), "{speed_rpm} r/min");
        }
    }
}

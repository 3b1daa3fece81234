//! Which causes of faults are present, judged once each supervision period from the largest values in it.

use super::faults::row;
use super::hardware::Sensors;
use super::readings::*;
use crate::engine::faults::FaultSet;
use crate::engine::stepper::Peaks;

/// What the causes are judged by, besides the sensors.
pub(super) struct Situation {
    pub(super) peaks: Peaks,
    /// Amplitude of the current vector, A; 0 while the motor is free.
    pub(super) amplitude_a: f32,
    pub(super) eeprom_readable: bool,
    pub(super) latched: FaultSet,
}

pub(super) fn causes(sensors: &Sensors, now: &Situation) -> FaultSet {
    FaultSet::NONE
        .with(row::OVER_VOLTAGE, over_voltage(sensors.bus_v, now))
        .with(row::OVER_CURRENT, is_over_current(sensors))
        .with(row::PHASE_LOSS, (0..2).any(|phase| is_lost(phase, now)))
        .with(row::REFERENCE_VOLTAGE, !within(sensors.reference_v, REFERENCE_V, REFERENCE_TOLERANCE_V))
        .with(row::EEPROM, !(sensors.eeprom_ok && now.eeprom_readable))
        .with(row::BUS_OVER_CURRENT, exceeds(now.peaks.bus_a, BUS_OVER_CURRENT_A))
}

/// Any phase carries more than the power stage bears.
#[inline]
pub(super) fn is_over_current(sensors: &Sensors) -> bool {
    sensors.phase_current_a.iter().any(|current_a| exceeds(current_a.abs(), OVER_CURRENT_A))
}

/// The phase was asked for current throughout and carried none.
fn is_lost(phase: usize, now: &Situation) -> bool {
    now.amplitude_a > 0.0
        && now.peaks.reference_a[phase] > PHASE_ASKED_SHARE * now.amplitude_a
        && now.peaks.current_a[phase] < PHASE_CARRIED_SHARE * now.amplitude_a
}

fn over_voltage(bus_v: f32, now: &Situation) -> bool {
    let hysteresis_v = if now.latched.has(row::OVER_VOLTAGE) { VOLTAGE_HYSTERESIS_V } else { 0.0 };
    exceeds(bus_v, OVER_VOLTAGE_V - hysteresis_v)
}

/// A reading that is no number is no sound reading.
fn exceeds(value: f32, limit: f32) -> bool {
    value > limit || value.is_nan()
}

fn within(value: f32, nominal: f32, tolerance: f32) -> bool {
    (value - nominal).abs() <= tolerance
}

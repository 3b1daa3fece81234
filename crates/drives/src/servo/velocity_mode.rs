//! Velocity mode, vl (CiA 402-2, clause velocity mode): a speed in r/min of the motor with ramps of its own.
//!
//! ```text
//! speed [r/min] = 6042h * 604Bh * 604Ch          6043h likewise; 6044h, 6046h and the ramps without 604Bh
//! rate          = delta speed / delta time       6048h, 6049h, 604Ah
//! ```
//!
//! So makers' manuals have it (Emerson SM-EtherCAT user guide, 7.5: units are r/min while both factors are 1, and of 6044h and 6046h
//! while the dimension factor is). Read so: a target between 0 and the least speed is raised to it, and 0 is standstill; a greatest speed
//! of 0 limits nothing; a delta time of 0 is as fast as 60C5h and 60C6h allow; bit 4 = 0, which is left to makers, leads to
//! standstill as bit 6 = 0 does.

use canopen::od::{Dictionary, Slot, Storage};
use cia402::Controlword;

use super::read;
use super::scales::Scales;
use super::slots::AxisSlots;

/// The objects of the mode in increments.
#[derive(Clone, Copy, Debug)]
pub(super) struct VelocityMode {
    /// Increments per second in a unit of 6044h, signed.
    unit: f64,
    /// Units of 6044h in one of 6042h, signed.
    set_point: f64,
    least: f64,
    greatest: f64,
    /// Rates of 6048h, 6049h and 604Ah; `None` without the object.
    pub(super) acceleration: Option<f64>,
    pub(super) deceleration: Option<f64>,
    pub(super) quick_stop: Option<f64>,
}

impl VelocityMode {
    pub(super) fn of(values: &Dictionary<impl Storage>, slots: &AxisSlots, scales: &Scales) -> Self {
        let amount = |slot: Option<Slot>| read(values, slot, 0).saturating_abs() as f64;
        let factor = |numerator, denominator| match (read(values, numerator, 1), read(values, denominator, 1)) {
            // As delivered with a 0 in it, it has no meaning; a write of 0 is refused.
            (0, _) | (_, 0) => 1.0,
            (numerator, denominator) => numerator as f64 / denominator as f64,
        };
        let unit = factor(slots.vl_dimension_numerator, slots.vl_dimension_denominator) * scales.motor_speed(1);
        let rate = |speed: Option<Slot>, time: Option<Slot>| {
            let (speed, time_s) = (amount(Some(speed?)) * unit.abs(), amount(time));
            match time {
                Some(_) if time_s == 0.0 => Some(f64::INFINITY),
                Some(_) => Some(speed / time_s),
                None => Some(speed),
            }
        };
        Self {
            unit: unit * scales.direction(),
            set_point: factor(slots.vl_set_point_numerator, slots.vl_set_point_denominator),
            least: amount(slots.vl_min) * unit.abs(),
            greatest: match amount(slots.vl_max) {
                0.0 => f64::INFINITY,
                most => most * unit.abs(),
            },
            acceleration: rate(slots.vl_acceleration_speed, slots.vl_acceleration_time),
            deceleration: rate(slots.vl_deceleration_speed, slots.vl_deceleration_time),
            quick_stop: rate(slots.vl_quick_stop_speed, slots.vl_quick_stop_time),
        }
    }

    /// What the ramp leads to (increments/s) with the ramp's present output, and whether 6046h has limited it.
    pub(super) fn reference(&self, target: i64, controlword: Controlword, output: f64) -> (f64, bool) {
        if !controlword.has(Controlword::ENABLE_RAMP) {
            return (0.0, false);
        }
        if !controlword.has(Controlword::UNLOCK_RAMP) {
            return (output, false);
        }
        if !controlword.has(Controlword::REFERENCE_RAMP) {
            return (0.0, false);
        }
        let wanted = target as f64 * self.set_point * self.unit;
        if wanted == 0.0 {
            return (0.0, false);
        }
        let held = wanted.abs().max(self.least).min(self.greatest).copysign(wanted);
        (held, held != wanted)
    }

    /// A velocity (increments/s) as 6043h shows it.
    pub(super) fn demand(&self, velocity: f64) -> i64 {
        libm::round(velocity / (self.set_point * self.unit)) as i64
    }

    /// A velocity (increments/s) as 6044h shows it.
    pub(super) fn actual(&self, velocity: f64) -> i64 {
        libm::round(velocity / self.unit) as i64
    }
}

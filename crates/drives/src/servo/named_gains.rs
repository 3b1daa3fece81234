//! Gains of the loops in the maker's objects, where the description of an axis names them ([`Loops`]).
//!
//! No file says what a count of them is worth. As delivered the velocity loop is that which suits the motor, so that a value is a
//! share of the delivered one; a drive whose counts are known is ordered with a [`SpeedWorth`]. No acceleration is fed forward: no
//! object would set it.

use core::f64::consts::FRAC_1_SQRT_2;

use canopen::od::{DefaultValue, Dictionary, Slot, Storage, Table};
use devices::{Integral, Loops, Quantity, Scale};
use motion::filter::LowPassGains;
use motion::pid::PiGains;

use super::motor::{Motor, SUPERVISION_PERIOD_S, SpeedWorth};
use crate::Fidelity;
use crate::engine::actuator::servo::ServoGains;

/// Where an axis has its gains.
#[derive(Clone, Copy, Debug)]
pub(super) struct NamedGains {
    proportional: Slot,
    integral: Slot,
    is_time: bool,
    filter: Option<(Slot, f64)>,
    position: Option<(Slot, f64)>,
    demand: Option<(Slot, f64)>,
}

impl NamedGains {
    /// Those of a table; `None` where it lacks one of the velocity loop.
    pub(super) fn of(loops: &Loops, table: &Table) -> Option<Self> {
        let find = |quantity: Option<Quantity>| match quantity?.scale {
            Scale::PerCount(worth) => Some((table.find(quantity?.object).ok()?, worth)),
            _ => None,
        };
        Some(Self {
            proportional: table.find(loops.speed_proportional).ok()?,
            integral: table.find(loops.speed_integral.object()).ok()?,
            is_time: matches!(loops.speed_integral, Integral::Time(_)),
            filter: find(loops.speed_filter),
            position: find(loops.position_proportional),
            demand: find(loops.demand),
        })
    }

    /// Whether a write to it changes a gain.
    pub(super) fn has(&self, slot: Slot) -> bool {
        let others = [self.filter, self.position].into_iter().flatten().map(|(slot, _)| slot);
        [self.proportional, self.integral].into_iter().chain(others).any(|gain| gain == slot)
    }

    /// The object of the maker's that shows what the velocity loop asks for, and what it shows of this amplitude.
    pub(super) fn shown(&self, setpoint_a: f32) -> Option<(Slot, i64)> {
        let (slot, worth) = self.demand?;
        Some((slot, libm::round(f64::from(setpoint_a) * FRAC_1_SQRT_2 / worth) as i64))
    }

    /// The loops of a motor as these values have them.
    pub(super) fn gains(&self, values: &Dictionary<impl Storage>, motor: &Motor, fidelity: Fidelity) -> ServoGains {
        let mut gains = motor.gains(fidelity);
        let value = |slot| values.value(slot) as f32;
        let worth = motor.speed_worth.or_else(|| self.as_delivered(values.table(), &gains.cascade.velocity));
        if let Some(SpeedWorth { proportional, integral }) = worth {
            let proportional = proportional * value(self.proportional);
            let second = integral * value(self.integral);
            let integral_per_s = match (self.is_time, second > 0.0) {
                (false, _) => second,
                (true, true) => proportional / second,
                // A time of 0 switches it off.
                (true, false) => 0.0,
            };
            gains.cascade.velocity = PiGains { proportional, integral_per_s };
        }
        gains.cascade.acceleration_feed_forward = 0.0;
        if let Some((slot, worth)) = self.filter {
            gains.velocity_filter = LowPassGains::from_time_constant(value(slot) * worth as f32, SUPERVISION_PERIOD_S);
        }
        if let Some((slot, worth)) = self.position {
            gains.cascade.position_per_s = value(slot) * worth as f32;
        }
        gains
    }

    /// The motor's own loop by the values as delivered; `None` where the table delivers none.
    fn as_delivered(&self, table: &Table, own: &PiGains) -> Option<SpeedWorth> {
        let delivered = |slot| match table.row(slot).default {
            DefaultValue::Value(value @ 1..) => Some(value as f32),
            _ => None,
        };
        let second = if self.is_time { own.proportional / own.integral_per_s } else { own.integral_per_s };
        Some(SpeedWorth {
            proportional: own.proportional / delivered(self.proportional)?,
            integral: second / delivered(self.integral)?,
        })
    }
}

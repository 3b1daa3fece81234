//! Gains as values of objects, within what these can hold.

use canopen::Mux;
use devices::{Description, Integral, Loops, Scale};
use tune::{Margins, Wish};

use super::found::Found;
use super::setup::Setup;

/// Phase that the position loop keeps.
const POSITION_PHASE_DEG: f64 = 60.0;
/// Filters of the speed that are tried.
const FILTERS_S: [f64; 4] = [0.25e-3, 1e-3, 3e-3, 8e-3];

/// An object, what it has, and what is proposed for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gain {
    /// Which one.
    pub object: Mux,
    /// Its name.
    pub name: &'static str,
    /// What it has.
    pub before: i64,
    /// What is proposed.
    pub after: i64,
}

/// What is proposed.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposed {
    /// Objects and values.
    pub gains: Vec<Gain>,
    /// Margins of the speed loop as it is.
    pub before: Margins,
    /// Margins of the speed loop as it would be.
    pub after: Margins,
    /// Of the position loop around it, if that was wished for.
    pub position: Option<Margins>,
    /// The bandwidth that was wished for is not reached: the margins end before.
    pub is_limited: bool,
}

impl Proposed {
    /// Gains for a wish; `None` where none keep the margins.
    pub fn of(
        found: &Found,
        setup: &Setup,
        (model, loops): (&'static Description, &Loops),
        wish: Wish,
        with_position: bool,
    ) -> Option<Self> {
        let highest_hz = 0.5 / loops.period.as_secs_f64();
        // Of the drive's own gains: those that it was measured with may have been lower.
        let own = tune::Loop {
            proportional: found.around.proportional / found.gain_share,
            integral: found.around.integral / found.gain_share,
            ..found.around
        };
        let range =
            |object: Mux| model.row(object).and_then(|row| row.integer_limits()).unwrap_or((0, i64::from(u16::MAX)));
        let count = |object: Mux, factor: f64| {
            let had = setup.had(object)?;
            let (low, high) = range(object);
            let wanted = (had as f64 * factor).round() as i64;
            (low.max(1)..=high).contains(&wanted).then_some(wanted)
        };
        let integral_object = loops.speed_integral.object();
        // A time is the proportional gain over the integral one.
        let of_integral = |proportional: f64, integral: f64| match loops.speed_integral {
            Integral::Gain(_) => integral,
            Integral::Time(_) => proportional / integral,
        };
        let can_hold = |proportional: f64, integral: f64| {
            let second = of_integral(proportional, integral);
            count(loops.speed_proportional, proportional).is_some() && count(integral_object, second).is_some()
        };
        let filter = loops.speed_filter.and_then(|filter| match filter.scale {
            Scale::PerCount(worth) => Some((filter.object, worth)),
            _ => None,
        });
        let filters = filter.map_or_else(|| vec![own.filter_s], |_| FILTERS_S.to_vec());
        let proposal = tune::propose(&found.plant, &own, wish, highest_hz, &filters, can_hold)?;
        let mut values = vec![
            (loops.speed_proportional, count(loops.speed_proportional, proposal.proportional)?),
            (integral_object, count(integral_object, of_integral(proposal.proportional, proposal.integral))?),
        ];
        values.extend(filter.map(|(object, worth)| (object, (proposal.filter_s / worth).round() as i64)));
        let mut position = None;
        if with_position && let Scale::PerCount(worth) = loops.position_proportional.scale {
            let around = tune::Loop {
                proportional: own.proportional * proposal.proportional,
                integral: own.integral * proposal.integral,
                filter_s: proposal.filter_s,
                ..own
            };
            let late_s = loops.period.as_secs_f64();
            let (gain, margins) =
                tune::propose_position(&found.plant, &around, POSITION_PHASE_DEG, highest_hz, late_s)?;
            let object = loops.position_proportional.object;
            let (low, high) = range(object);
            values.push((object, ((gain / worth) as i64).clamp(low.max(1), high)));
            position = Some(margins);
        }
        let name = |object| model.row(object).map_or("", |row| row.name);
        let gain = |(object, after)| Some(Gain { object, name: name(object), before: setup.had(object)?, after });
        Some(Self {
            gains: values.into_iter().filter_map(gain).collect(),
            before: tune::margins(&found.plant, &own, highest_hz),
            after: proposal.margins,
            position,
            is_limited: proposal.is_limited,
        })
    }
}

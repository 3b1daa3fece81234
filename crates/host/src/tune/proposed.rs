//! Gains as values of objects, within what these can hold.

use canopen::Mux;
use devices::{Description, Integral, Loops, Quantity, Scale};
use tune::{Disturbance, Loop, Margins, Objective};

use super::found::Found;
use super::setup::Setup;

/// Phase that the position loop keeps.
const POSITION_PHASE_DEG: f64 = 60.0;
/// Filters of the speed that are tried.
const FILTERS_S: [f64; 8] = [0.25e-3, 1e-3, 2e-3, 3e-3, 5e-3, 8e-3, 14e-3, 25e-3];

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
    /// The proportional gain, A/(rad/s).
    pub proportional_a_s_rad: f64,
    /// Margins of the speed loop as it is.
    pub before: Margins,
    /// Margins of the speed loop as it would be.
    pub after: Margins,
    /// Of the position loop around it, if that was asked for.
    pub position: Option<Margins>,
    /// The bandwidth that was asked for is not reached: the margins, or the highest crossover, end before.
    pub is_limited: bool,
}

/// Why nothing is proposed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unreachable {
    /// The device lacks one of its model's gains.
    #[error("this device has no {0}, which its model sets the loop by")]
    NoObject(Mux),
    /// The shaft does not let any gains keep the margins.
    #[error(
        "no gains keep a phase margin of {phase_deg} degrees, a sensitivity of 2 and a gain margin of 2 with what was found"
    )]
    Margins {
        /// Least phase margin.
        phase_deg: f64,
    },
    /// Gains would, and the objects do not hold them.
    #[error("the gains that keep the margins are outside of what {proportional} and {integral} take")]
    Range {
        /// Proportional gain.
        proportional: Mux,
        /// Integral part.
        integral: Mux,
    },
    /// The gain of the position loop is not known.
    #[error(
        "it is not known where the gain of the position loop is: position_proportional of loops in the machine file says it"
    )]
    NoPositionGain,
    /// None for the position loop.
    #[error("no gain of the position loop keeps {POSITION_PHASE_DEG} degrees around that speed loop")]
    Position,
}

impl Proposed {
    /// Gains for an objective, with which the gain of the speed loop falls to one below this frequency in Hz.
    ///
    /// # Errors
    /// Why there are none.
    pub fn of(
        found: &Found,
        setup: &Setup,
        (model, loops): (&'static Description, &Loops),
        (objective, disturbance): (Objective, Disturbance),
        most_hz: f64,
        with_position: bool,
    ) -> Result<Self, Unreachable> {
        let own = &found.own;
        let highest_hz = 0.5 / loops.period.as_secs_f64();
        let speed = SpeedObjects::of(setup, loops)?;
        let filters_s = speed.filters_s(own.filter_s);
        let search = |can_hold: &dyn Fn(f64, f64) -> bool| {
            tune::propose(&found.plant, own, (objective, disturbance), (most_hz, highest_hz), &filters_s, can_hold)
        };
        let out_of_range = || {
            let (proportional, integral) = (speed.proportional.0, speed.integral.0);
            Unreachable::Range { proportional, integral }
        };
        let found_one = search(&|proportional, integral| speed.counts(proportional, integral).is_some());
        let proposal = found_one.ok_or_else(|| match search(&|_, _| true) {
            Some(_) => out_of_range(),
            None => Unreachable::Margins { phase_deg: objective.phase_deg() },
        })?;
        let (proportional, integral) =
            speed.counts(proposal.proportional, proposal.integral).ok_or_else(out_of_range)?;
        let mut values = vec![(speed.proportional.0, proportional), (speed.integral.0, integral)];
        values.extend(speed.filter.map(|filter| (filter.object, filter.count(proposal.filter_s))));
        let around = Loop {
            proportional: own.proportional * proposal.proportional,
            integral: own.integral * proposal.integral,
            filter_s: proposal.filter_s,
            ..*own
        };
        let mut position = None;
        if with_position {
            let (object, worth) = match loops.position_proportional {
                Some(Quantity { object, scale: Scale::PerCount(worth) }) => (object, worth),
                _ => return Err(Unreachable::NoPositionGain),
            };
            setup.had(object).ok_or(Unreachable::NoObject(object))?;
            let (late_s, phase_deg) = (loops.period.as_secs_f64(), POSITION_PHASE_DEG);
            let gain = tune::propose_position(&found.plant, &around, phase_deg, highest_hz, late_s);
            let (gain, margins) = gain.ok_or(Unreachable::Position)?;
            let (low, high) = setup.range(object);
            let (before, step) = (setup.had(object).unwrap_or_default(), loops.gain_step);
            let wanted = before + ((gain / worth - before as f64) / step as f64).floor() as i64 * step;
            values.push((object, wanted.clamp(low.max(1), high)));
            position = Some(margins);
        }
        let name = |object| model.row(object).map_or("", |row| row.name);
        let gain = |(object, after)| Some(Gain { object, name: name(object), before: setup.had(object)?, after });
        Ok(Self {
            gains: values.into_iter().filter_map(gain).collect(),
            proportional_a_s_rad: around.proportional,
            before: tune::margins(&found.plant, own, highest_hz),
            after: proposal.margins,
            position,
            is_limited: proposal.is_limited,
        })
    }

    /// Objects and proposed values.
    pub fn values(&self) -> Vec<(Mux, i64)> {
        self.gains.iter().map(|gain| (gain.object, gain.after)).collect()
    }
}

/// The objects of a speed loop, with what they have.
struct SpeedObjects<'a> {
    setup: &'a Setup,
    proportional: (Mux, i64),
    integral: (Mux, i64),
    is_time: bool,
    gain_step: i64,
    filter: Option<Filter>,
}

/// A filter with an object.
#[derive(Clone, Copy)]
struct Filter {
    object: Mux,
    s_per_count: f64,
}

impl Filter {
    fn count(self, filter_s: f64) -> i64 {
        (filter_s / self.s_per_count).round() as i64
    }
}

impl<'a> SpeedObjects<'a> {
    fn of(setup: &'a Setup, loops: &Loops) -> Result<Self, Unreachable> {
        let had = |object: Mux| Ok((object, setup.had(object).ok_or(Unreachable::NoObject(object))?));
        let filter = loops.speed_filter.and_then(|filter| match filter.scale {
            Scale::PerCount(s_per_count) => Some(Filter { object: filter.object, s_per_count }),
            _ => None,
        });
        Ok(Self {
            setup,
            proportional: had(loops.speed_proportional)?,
            integral: had(loops.speed_integral.object())?,
            gain_step: loops.gain_step,
            is_time: matches!(loops.speed_integral, Integral::Time(_)),
            filter: filter.filter(|filter| setup.had(filter.object).is_some()),
        })
    }

    /// The values for these factors of both gains, if the objects take them.
    fn counts(&self, proportional: f64, integral: f64) -> Option<(i64, i64)> {
        let count = |(object, had): (Mux, i64), factor: f64| {
            let (low, high) = self.setup.range(object);
            // Digits that mean something else stay.
            let step = self.gain_step;
            let wanted = had + ((had as f64 * (factor - 1.0)) / step as f64).round() as i64 * step;
            (low.max(1)..=high).contains(&wanted).then_some(wanted)
        };
        // A time is the proportional gain over the integral one.
        let second = if self.is_time { proportional / integral } else { integral };
        count(self.proportional, proportional).zip(count(self.integral, second))
    }

    /// Those to try; the one that it has, where its object takes none of them.
    fn filters_s(&self, own_s: f64) -> Vec<f64> {
        let can_have = |filter_s: &f64| {
            self.filter.is_some_and(|filter| {
                let (low, high) = self.setup.range(filter.object);
                (low..=high).contains(&filter.count(*filter_s))
            })
        };
        let filters: Vec<f64> = FILTERS_S.into_iter().filter(can_have).collect();
        if filters.is_empty() { vec![own_s] } else { filters }
    }
}

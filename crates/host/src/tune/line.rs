//! A tuning as a line of a scenario's host: `4 tune bandwidth 20 loop position apply`.

use std::str::FromStr;

use machine::base_drive::finite;
use machine::group_move::turns;
use master::Drive;
use master::cyclic::CyclicOptions;
use master::units::{Amperes, Rpm};
use words::failure::{Failure, both};
use words::time::some_time;

use super::{Order, Request, TuneReport, loops_of, tune};
use crate::capture::Restorer;

/// A tuning as a line of a host asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct TuneLine {
    /// The objective, and what the motion keeps to.
    pub order: Order,
    /// Most current that the speed loop may ask for; that which is usual for the model without it.
    pub current_a: Option<f64>,
    /// The drive tries the gains, and keeps them if its error is not larger.
    pub apply: bool,
}

impl FromStr for TuneLine {
    type Err = String;

    /// What stands behind `tune`: its [form](TuneLine::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let mut asked = Self { order: Order::usual(), current_a: None, apply: false };
        let mut has_margin = false;
        let order = &mut asked.order;
        words::line::take(Self::FORM, text.split_whitespace(), |word, value| {
            match word {
                "phase-margin" => (order.phase_margin_deg, has_margin) = (finite(value()?)?, true),
                "bandwidth" => order.bandwidth_hz = Some(finite(value()?)?),
                "loop" => {
                    order.position = match value()? {
                        "position" => true,
                        "speed" => false,
                        other => return Err(format!("expected the loop speed or position, got '{other}'")),
                    }
                }
                "speed" => order.speed_rpm = Some(value()?.parse::<Rpm>().map_err(|error| error.to_string())?.0),
                "current" => {
                    asked.current_a = Some(value()?.parse::<Amperes>().map_err(|error| error.to_string())?.0);
                }
                "travel" => order.travel_turns = turns(value()?)?,
                "period" => order.period_ms = Some(some_time(value()?)?.as_secs_f64() * 1e3),
                "torque-constant" => order.torque_constant_nm_a = Some(finite(value()?)?),
                "apply" => asked.apply = true,
                _ => return Ok(false),
            }
            Ok(true)
        })?;
        if has_margin && asked.order.bandwidth_hz.is_some() {
            return Err("expected a phase margin or a bandwidth, not both: one follows from the other".to_owned());
        }
        // What is usual for a model is within its range.
        asked.request((1.0, 1.0)).map(|_| asked).map_err(|failure| failure.one_line())
    }
}

impl TuneLine {
    /// It as a line of a host has it.
    pub const FORM: &str = "tune [phase-margin DEGREES] [bandwidth HZ] [loop speed|position] [speed SPEED] [current CURRENT] \
                            [travel TURNS] [period TIME] [torque-constant NM_PER_A] [apply]";

    fn request(&self, (usual_rpm, usual_a): (f64, f64)) -> Result<Request, Failure> {
        let order = Order { current_a: self.current_a.unwrap_or(usual_a), ..self.order.clone() };
        let request = order.request(usual_rpm, CyclicOptions::default(), None)?;
        Ok(Request { apply: self.apply, ..request })
    }

    /// Finds gains for a virtual drive, and has it try them, if that was asked for.
    ///
    /// # Errors
    /// What stopped it, what is not possible with this drive, and what could not be put back.
    pub async fn carry_out(&self, drive: &Drive) -> Result<TuneReport, Failure> {
        let (_, loops) = loops_of(drive)?;
        let request = self.request((loops.usual_rpm, loops.usual_a))?;
        let restorer = Restorer::of(drive);
        let tuned = tune((drive, &restorer), &request, &(), std::future::ready(false)).await;
        both(tuned, restorer.restored().await)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_one_wish_and_its_limits() {
        let asked: TuneLine = "bandwidth 20 loop position speed 60rpm current 8A travel 10 apply".parse().unwrap();
        let Request { bounds, with_position, apply, .. } = asked.request((120.0, 15.0)).unwrap();
        assert_eq!((bounds.speed_rpm, bounds.current_a, bounds.travel_turns), (60.0, 8.0, 10.0));
        assert!(with_position && apply);
        let usual = "".parse::<TuneLine>().unwrap().request((120.0, 15.0)).unwrap();
        assert_eq!((usual.bounds.speed_rpm, usual.bounds.current_a, usual.apply), (120.0, 15.0, false));
        for (line, said) in [
            ("fast", "'fast' is not a part of tune"),
            ("loop current", "expected the loop speed or position"),
            ("phase-margin 95", "phase margin"),
            ("speed", "'speed' has no value"),
            ("bandwidth 20 phase-margin 50", "not both"),
        ] {
            let refused = line.parse::<TuneLine>().unwrap_err();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}

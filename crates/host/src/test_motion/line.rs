//! A test motion as a line of a scenario's host: `4 test-motion steps speed 60rpm count 3`.

use std::str::FromStr;
use std::time::Duration;

use can::Bitrate;
use machine::base_drive::finite;
use machine::group_move::{angle, directed, rate, turning, turns};
use master::Drive;
use master::cyclic::CyclicOptions;
use master::units::Angle;
use words::failure::{Failure, both};
use words::time::some_time;

use super::{Motion, Order, Run, ShapeName, run, usual_quantities};
use crate::capture::commanded::measurands;
use crate::capture::{Restorer, Wanted};

/// How often steps are captured where nothing is said of it.
const STEPS: Duration = Duration::from_millis(1);

/// A test motion as a line of a host asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct TestMotionLine {
    /// What is moved, how often, and its limits.
    pub order: Order,
    /// What is captured; empty: what the figures need.
    pub quantities: Vec<String>,
    /// Time between two readings; with each point, or every millisecond of steps, without it.
    pub rate: Option<Duration>,
}

/// An angle that needs no drive to be known.
fn degrees(text: &str) -> Result<f64, String> {
    match angle(text)? {
        Angle::Turns(turns) => Ok(turns * 360.0),
        Angle::Counts(_) => Err(format!("expected an angle in degrees or turns, e.g. 20deg, got '{text}'")),
    }
}

fn count(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| format!("expected a whole number, got '{text}'"))
}

impl FromStr for TestMotionLine {
    type Err = String;

    /// What stands behind `test-motion`: its [form](TestMotionLine::FORM).
    fn from_str(text: &str) -> Result<Self, String> {
        let mut words = text.split_whitespace();
        let shape = words.next().ok_or_else(|| format!("expected: {}", Self::FORM))?;
        let mut asked = Self { order: Order::usual(shape.parse()?), quantities: Vec::new(), rate: None };
        let order = &mut asked.order;
        if order.shape == ShapeName::Path {
            let text = "a path is followed by `group follow FILE.csv`; its capture is moved along by: ferrodrive test-motion NODE path --path FILE";
            return Err(text.to_owned());
        }
        words::line::take(Self::FORM, words, |word, value| {
            match word {
                "by" => order.by_deg = degrees(value()?)?,
                "speed" => order.speed_rpm = directed(value()?)?.0,
                "frequency" => order.frequency_hz = finite(value()?)?,
                "to-frequency" => order.to_frequency_hz = finite(value()?)?,
                "periods" => order.periods = count(value()?)?,
                "time" => order.time_s = some_time(value()?)?.as_secs_f64(),
                "count" => order.count = count(value()?)?,
                "velocity" => order.velocity_rpm = turning(value()?)?.0,
                "acceleration" => order.acceleration_rpm_s = Some(rate(value()?)? * 60.0),
                "travel" => order.travel_turns = Some(turns(value()?)?),
                "following-error" => order.following_error_deg = degrees(value()?)?.abs(),
                "period" => order.period_ms = some_time(value()?)?.as_secs_f64() * 1e3,
                "capture" => asked.quantities = value()?.split(',').map(str::to_owned).collect(),
                "rate" => asked.rate = Some(some_time(value()?)?),
                _ => return Ok(false),
            }
            Ok(true)
        })?;
        asked.motion().map(|_| asked)
    }
}

impl TestMotionLine {
    /// It as a line of a host has it. What is not named is as of the command line.
    pub const FORM: &str = "test-motion SHAPE [by ANGLE] [speed SPEED] [frequency HZ] [to-frequency HZ] [periods NUMBER] [time TIME] \
                            [count NUMBER] [velocity SPEED] [acceleration RATE] [travel TURNS] [following-error ANGLE] [period TIME] \
                            [capture QUANTITY,..] [rate TIME]";

    fn motion(&self) -> Result<Motion, String> {
        self.order.motion(CyclicOptions::default())
    }

    /// Moves a virtual drive, captures each run, and puts back what the captures and the motion have changed: the drive is without power
    /// then.
    ///
    /// # Errors
    /// What stopped it, and what could not be put back.
    pub async fn carry_out(&self, drive: &Drive, bitrate: Bitrate) -> Result<Vec<Run>, Failure> {
        let motion = self.motion().map_err(Failure::usage)?;
        let points =
            matches!(motion, Motion::Points { .. }).then(|| Duration::from_secs_f64(self.order.period_ms / 1e3));
        let names = if self.quantities.is_empty() { usual_quantities(drive).await? } else { self.quantities.clone() };
        let quantities = measurands(drive, None, &names).await?;
        let wanted = Wanted::of_a_virtual_drive(quantities, self.rate.or(points).unwrap_or(STEPS), bitrate);
        wanted.check(&motion.span())?;
        let restorer = Restorer::of(drive);
        let (mut runs, how) = (Vec::new(), (self.order.count, self.order.travel_turns));
        let moved = run((drive, &motion), (&wanted, &restorer), how, &mut runs, |_| ()).await;
        both(moved, restorer.restored().await).map(|()| runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_an_order_and_what_makes_no_sense_is_refused() {
        let asked: TestMotionLine =
            "sine by 0.05turn frequency 2 periods 4 count 2 velocity 90rpm travel 1 capture position,current rate 2ms"
                .parse()
                .unwrap();
        let back: TestMotionLine = "steps speed -30rpm".parse().unwrap();
        assert_eq!(back.order.speed_rpm, -30.0);
        let Order { shape, by_deg, frequency_hz, periods, count, velocity_rpm, travel_turns, .. } = asked.order;
        assert_eq!((shape, by_deg, frequency_hz, periods), (ShapeName::Sine, 18.0, 2.0, 4));
        assert_eq!((count, velocity_rpm, travel_turns), (2, 90.0, Some(1.0)));
        assert_eq!(asked.quantities, ["position", "current"]);
        assert_eq!(asked.rate, Some(Duration::from_millis(2)));
        for (line, said) in [
            ("", "expected: test-motion SHAPE"),
            ("wiggle", "expected a shape of"),
            ("steps by", "'by' has no value"),
            ("steps speed 0rpm", "above 0"),
            ("steps speed --30rpm", "above 0"),
            ("steps fast", "'fast' is not a part of test-motion"),
            ("steps speed 90rpm", "a speed of 90 r/min, and 60 r/min are allowed"),
            ("back-and-forth by 4000", "no unit"),
            ("back-and-forth by 4000counts", "expected an angle in degrees or turns"),
            ("steps count 0", "expected 1 to 999 runs"),
            ("path", "group follow FILE.csv"),
        ] {
            let refused = line.parse::<TestMotionLine>().unwrap_err();
            assert!(refused.contains(said), "{line}: {refused}");
        }
    }
}

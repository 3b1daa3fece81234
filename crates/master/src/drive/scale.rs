use core::fmt;
use std::time::Duration;

use canopen::Mux;
use canopen::od::Entry;
use cia402::object::TARGET_POSITION;
use devices::{CountsPerTurn, Quantity, Ramps, Scale};

use super::handle::Drive;
use crate::error::Error;
use crate::units::{Along, Angle, Ramp, Shown, Turning};

/// The least band within which a speed of the shaft counts as reached: the resolution that drives of this kind show when
/// they run smoothly.
pub(super) const REACHED_LEAST_RPM: f64 = 2.0;

/// A physical value as it was asked for, and as it was sent to the drive: an object holds whole counts.
///
/// What would come to zero counts and is not zero is refused ([`Error::TooFine`]); everything else is rounded to the nearest
/// count, and the caller can see by how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Commanded {
    /// What it is: `speed`, `position`, `acceleration`, ...
    pub what: &'static str,
    /// What was asked for, in [`unit`](Self::unit).
    pub requested: f64,
    /// What the counts sent are worth.
    pub commanded: f64,
    /// The unit of both.
    pub unit: &'static str,
    /// The object that was written.
    pub object: Mux,
    /// The counts sent.
    pub raw: i64,
}

/// Part of a value by which it may differ from what was asked for without a word: a thousandth, which is finer than any of
/// these drives keeps its speed, current or ramp.
const UNSAID_SHARE: f64 = 1e-3;

impl Commanded {
    /// True if what was sent differs from what was asked for by more than a thousandth of it.
    pub fn is_rounded(&self) -> bool {
        (self.commanded - self.requested).abs() > self.requested.abs() * UNSAID_SHARE
    }
}

/// `speed: 2.7 r/min asked for, 3 r/min sent (60FFh:00 = 3)`.
impl fmt::Display for Commanded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, unit, object, raw, .. } = self;
        let (requested, commanded) = (Shown(self.requested), Shown(self.commanded));
        write!(f, "{what}: {requested} {unit} asked for, {commanded} {unit} sent ({object} = {raw})")
    }
}

/// Conversion between physical units and what this drive's objects hold, read from the drive where it is set there.
impl Drive {
    /// Counts of position in one turn of the output.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO read.
    pub async fn counts_per_turn(&self) -> Result<f64, Error> {
        Ok(self.counts_per_shaft_turn().await? * self.gear.ratio())
    }

    /// Counts of position in one turn of the drive's shaft.
    pub(super) async fn counts_per_shaft_turn(&self) -> Result<f64, Error> {
        match self.motion("convert positions")?.units.counts_per_turn {
            CountsPerTurn::Fixed(counts) => Ok(f64::from(counts)),
            CountsPerTurn::Object { object, factor } => Ok(self.read_number(object).await? as f64 * f64::from(factor)),
            CountsPerTurn::Table { object, counts, default } => {
                let place = usize::try_from(self.read_number(object).await?).ok();
                // A value beyond the table: the drive's own table refuses it, so it is as delivered.
                let known = place.and_then(|place| counts.get(place)).or(counts.get(default as usize));
                Ok(known.copied().map_or(1.0, f64::from))
            }
            CountsPerTurn::Ratio { times, over } => Ok(self.product(times).await? / self.product(over).await?),
        }
    }

    /// A quantity of rotation of the output, out of one that may be along the way of what it moves.
    ///
    /// # Errors
    /// [`Error::NoFeed`] for a way, where the [gear](Self::gear) has no feed.
    pub fn turning<T: Turning>(&self, wish: Along<T>) -> Result<T, Error> {
        match (wish, self.gear.feed_m()) {
            (Along::Turning(turning), _) => Ok(turning),
            (Along::Metres(metres), Some(feed)) => Ok(T::of_turns(metres / feed)),
            (Along::Metres(_), None) => Err(Error::NoFeed { node: self.node.id() }),
        }
    }

    /// The product of some objects that are never 0 by the standard; where a drive holds 0 nevertheless it counts as 1.
    pub(super) async fn product(&self, objects: [Option<Mux>; 2]) -> Result<f64, Error> {
        let mut product = 1.0;
        for object in objects.into_iter().flatten() {
            product *= match self.read_number(object).await? {
                0 => 1.0,
                factor => factor as f64,
            };
        }
        Ok(product)
    }

    /// An angle as 607Ah holds it.
    pub(super) async fn position(&self, what: &'static str, angle: Angle) -> Result<Commanded, Error> {
        let object = self.place(TARGET_POSITION);
        let (requested, counts_per_turn) = match angle {
            Angle::Counts(raw) => {
                self.check_number(object, raw).await?;
                let exact = raw as f64;
                let (requested, commanded, unit) = (exact, exact, "counts");
                return Ok(Commanded { what, requested, commanded, unit, object, raw });
            }
            Angle::Turns(turns) => (turns, self.counts_per_turn().await?),
        };
        let raw = (requested * counts_per_turn).round() as i64;
        let (requested, step) = (requested * 360.0, 360.0 / counts_per_turn);
        let row = self.check_number(object, raw).await?;
        let commanded =
            Commanded { what, requested, commanded: raw as f64 * step, unit: "deg", object: row.mux(), raw };
        self.refuse_too_fine(&commanded, step, row).await
    }

    /// A physical value as its object holds it, and so that it comes into effect.
    pub(super) async fn quantity(
        &self,
        (what, unit): (&'static str, &'static str),
        quantity: Quantity,
        value: f64,
    ) -> Result<Commanded, Error> {
        let step = self.step_of(quantity).await?;
        let raw = (value / step).round() as i64;
        let row = self.check_effect(quantity.object, raw).await?;
        let commanded =
            Commanded { what, requested: value, commanded: raw as f64 * step, unit, object: row.mux(), raw };
        self.refuse_too_fine(&commanded, step, row).await
    }

    async fn refuse_too_fine(&self, commanded: &Commanded, step: f64, row: &'static Entry) -> Result<Commanded, Error> {
        let Commanded { requested, raw, unit, object, .. } = *commanded;
        if raw != 0 || requested == 0.0 {
            return Ok(*commanded);
        }
        let finer = self.limits_of(row).await?.resolution;
        let (node, name) = (self.node.id(), row.name);
        Err(Error::TooFine { node, object, name, asked: Shown(requested), step: Shown(step), unit, finer })
    }

    /// Reads a physical value from its object.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO reads.
    pub async fn read_quantity(&self, quantity: Quantity) -> Result<f64, Error> {
        let raw = self.read_number(quantity.object).await? as f64;
        Ok(raw * self.step_of(quantity).await?)
    }

    /// Physical units in one count, by the resolution that is set on the drive.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO reads.
    pub async fn step_of(&self, quantity: Quantity) -> Result<f64, Error> {
        Ok(self.worth(quantity).await? / self.resolution(quantity).await?)
    }

    /// Physical units in one count at a resolution of 1.
    async fn worth(&self, Quantity { object, scale }: Quantity) -> Result<f64, Error> {
        Ok(match scale {
            Scale::PerCount(worth) => worth,
            Scale::Shaft(rpm) => self.gear.at_output(rpm),
            // Counts of position in a second, as turns in a minute.
            Scale::Positions(counts) => counts * 60.0 / self.counts_per_turn().await?,
            Scale::Factors { times, over } => {
                self.gear.at_output(self.product(times).await? / self.product(over).await?)
            }
            // Infinitely much at once.
            Scale::InTime { .. } => {
                self.worth_in_a_second(scale).await? / self.read_number(time_of(object)).await? as f64
            }
            Scale::Rated { rated, per_count } => per_count * self.read_number(rated).await? as f64,
        })
    }

    /// (r/min)/s in one count of a change in a time ([`Scale::InTime`]) of 1 s.
    async fn worth_in_a_second(&self, scale: Scale) -> Result<f64, Error> {
        let Scale::InTime { times, over } = scale else { return Ok(1.0) };
        let factor = self.product([times, None]).await? / self.product([over, None]).await?;
        Ok(self.gear.at_output(factor.abs()))
    }

    /// How many counts make one of the object's unit, by the resolution that is set on the drive.
    pub(crate) async fn resolution(&self, quantity: Quantity) -> Result<f64, Error> {
        let Some(object) = self.row(quantity.object, "convert units")?.resolution else { return Ok(1.0) };
        // A drive that holds 0 where its manual allows 1 to 10 does not divide.
        Ok((self.read_number(object).await? as f64).max(1.0))
    }

    /// Sets acceleration and deceleration for a change of speed by `change_rpm`, and says what was sent. Where the speed does
    /// not change there is nothing to ramp, and the drive's own ramps stay.
    pub(super) async fn write_ramps(
        &self,
        acceleration: Option<Ramp>,
        deceleration: Option<Ramp>,
        change_rpm: f64,
    ) -> Result<Vec<Commanded>, Error> {
        let change_rpm = change_rpm.abs();
        let wishes = [("acceleration", acceleration), ("deceleration", deceleration)];
        let wishes = wishes.into_iter().filter_map(|(what, ramp)| Some((what, ramp?)));
        if change_rpm < self.gear.at_output(LEAST_CHANGE_RPM) {
            return Ok(Vec::new());
        }
        let (mut sent, mut times_of_a_second) = (Vec::new(), Vec::new());
        match self.ramps("set its ramps")? {
            Ramps::Times { acceleration: up, deceleration: down, .. } => {
                for (what, ramp) in wishes {
                    let object = if what == "acceleration" { up } else { down };
                    let raw = ramp_ms(ramp, change_rpm);
                    sent.push(self.ramp(what, ramp, change_rpm, object, raw, raw as f64 * 1e-3).await?);
                }
            }
            Ramps::Rates { acceleration: up, deceleration: down, scale, none_from, .. } => {
                let worths = self.worth_of_rates([up, down], scale).await?;
                let mut rates = Vec::new();
                for (what, ramp) in wishes {
                    let (object, mut worth) = if what == "acceleration" { (up, worths[0]) } else { (down, worths[1]) };
                    if worth.is_infinite() {
                        worth = self.worth_in_a_second(scale).await?;
                        times_of_a_second.push(time_of(object));
                    }
                    rates.push((what, ramp, object, worth, ramp_counts(ramp, change_rpm, worth, none_from)));
                }
                // One object for both: the gentler of the two.
                let gentler = if up == down { rates.iter().map(|(.., own)| *own).min() } else { None };
                for (what, ramp, object, worth, own) in rates {
                    let raw = gentler.unwrap_or(own);
                    let time_s = rate_time_s(raw, change_rpm, worth, none_from);
                    sent.push(self.ramp(what, ramp, change_rpm, object, raw, time_s).await?);
                }
            }
        }
        // Nothing is written before all of it has been found good.
        for object in times_of_a_second {
            self.write_number(object, 1).await?;
        }
        for Commanded { object, raw, .. } in &sent {
            self.write_number(*object, *raw).await?;
        }
        Ok(sent)
    }

    /// Sets ramps that follow a new speed in every cycle: drives with times take this period for each change, drives with rates
    /// twice the acceleration that the speeds have. The program makes the ramps then; a stop of the drive's own by its
    /// profile deceleration (6084h) becomes as hard as its current allows. What the objects had is put back when the drive stands and
    /// its guard is given back ([`Network::release_guards`](crate::Network::release_guards)).
    pub(crate) async fn write_ramps_of_a_cycle(&self, period: Duration, rpm_per_s: f64) -> Result<(), Error> {
        let (ramp, changes, is_in_time) = match self.ramps("follow a speed in each cycle")? {
            Ramps::Times { acceleration, deceleration, .. } => {
                (Ramp::Time(period), [acceleration, deceleration], false)
            }
            Ramps::Rates { acceleration, deceleration, scale, .. } => {
                let ramp = Ramp::RpmPerSecond(2.0 * rpm_per_s);
                (ramp, [acceleration, deceleration], matches!(scale, Scale::InTime { .. }))
            }
        };
        let times = changes.into_iter().filter(|_| is_in_time).map(time_of);
        for object in changes.into_iter().chain(times) {
            self.node.network().note_former(self.node.id(), object, self.node.upload(object).await?);
        }
        // The change does not matter to either, but for being one.
        self.write_ramps(Some(ramp), Some(ramp), self.gear.at_output(1.0)).await.map(|_| ())
    }

    /// The speed from which a ramp to a new target begins: the one that is kept, without the noise of what is measured; where
    /// the shaft does not follow its target, as it turns.
    pub(super) async fn ramp_start_rpm(&self) -> Result<f64, Error> {
        let units = self.motion("set its ramps")?.units;
        let actual = self.read_quantity(self.has(units.actual_velocity, "the actual velocity")?).await?;
        let target = self.read_quantity(self.has(units.target_velocity, "a target velocity")?).await?;
        let same = (actual - target).abs() <= self.gear.at_output(REACHED_LEAST_RPM);
        Ok(if same { target } else { actual })
    }

    /// A ramp of `raw` counts that takes `time_s` for the change, in the words in which it was asked for.
    async fn ramp(
        &self,
        what: &'static str,
        asked: Ramp,
        change_rpm: f64,
        object: Mux,
        raw: i64,
        time_s: f64,
    ) -> Result<Commanded, Error> {
        let row = self.check_effect(object, raw).await?;
        let rate = if time_s > 0.0 { change_rpm / time_s } else { raw as f64 };
        let (requested, commanded, unit, step) = match asked {
            Ramp::Time(time) => (milliseconds(time), time_s * 1e3, "ms", 1.0),
            Ramp::RpmPerSecond(requested) => (requested, rate, "(r/min)/s", 1.0),
        };
        let commanded = Commanded { what, requested, commanded, unit, object, raw };
        self.refuse_too_fine(&commanded, step, row).await
    }

    /// The drive's ramp times in seconds, up and down: for the largest change of speed that can be asked for, or where the drive
    /// does not limit it for this one.
    pub(super) async fn ramp_times_s(&self, change_rpm: f64) -> Result<(f64, f64), Error> {
        match self.ramps("read its ramps")? {
            Ramps::Times { acceleration, deceleration, .. } => {
                Ok((self.seconds(acceleration).await?, self.seconds(deceleration).await?))
            }
            Ramps::Rates { acceleration, deceleration, scale, none_from, .. } => {
                let worths = self.worth_of_rates([acceleration, deceleration], scale).await?;
                let change_rpm = self.largest_change_rpm(change_rpm)?;
                let (up, down) = (self.read_number(acceleration).await?, self.read_number(deceleration).await?);
                Ok((
                    rate_time_s(up, change_rpm, worths[0], none_from),
                    rate_time_s(down, change_rpm, worths[1], none_from),
                ))
            }
        }
    }

    /// (r/min)/s in one count of each rate: asked once where it is the same for all.
    async fn worth_of_rates(&self, [up, down]: [Mux; 2], scale: Scale) -> Result<[f64; 2], Error> {
        let worth = self.worth(Quantity { object: up, scale }).await?;
        Ok(match scale {
            Scale::InTime { .. } => [worth, self.worth(Quantity { object: down, scale }).await?],
            _ => [worth; 2],
        })
    }

    /// The objects of its ramps that are 0 although they are rates: by them no speed would ever change.
    pub(crate) async fn rates_of_zero(&self) -> Vec<Mux> {
        let Ok(Ramps::Rates { acceleration, deceleration, .. }) = self.ramps("read its ramps") else {
            return Vec::new();
        };
        let mut zero = Vec::new();
        for object in [acceleration, deceleration] {
            if !zero.contains(&object) && self.read_number(object).await.is_ok_and(|raw| raw == 0) {
                zero.push(object);
            }
        }
        zero
    }

    /// Time of the drive's quick stop in seconds.
    pub(super) async fn quick_stop_time_s(&self, change_rpm: f64) -> Result<f64, Error> {
        match self.ramps("read its ramps")? {
            Ramps::Times { quick_stop, .. } => self.seconds(quick_stop).await,
            Ramps::Rates { quick_stop: Some(rate), scale, none_from, .. } => {
                let worth = self.worth(Quantity { object: rate, scale }).await?;
                let change_rpm = self.largest_change_rpm(change_rpm)?;
                Ok(rate_time_s(self.read_number(rate).await?, change_rpm, worth, none_from))
            }
            // Such a drive stops without a ramp.
            Ramps::Rates { quick_stop: None, .. } => Ok(0.0),
        }
    }

    /// The largest change of speed that can be asked for, r/min: from one limit of the target velocity to the other, or this one
    /// where it has no limits.
    fn largest_change_rpm(&self, change_rpm: f64) -> Result<f64, Error> {
        let target = self.has(self.motion("read its limits")?.units.target_velocity, "a target velocity")?;
        let row = self.row(target.object, "read its limits")?;
        let (low, high) = row.limits_at(1);
        let span = (high - low) as f64;
        Ok(match target.scale {
            Scale::Shaft(rpm) => span * self.gear.at_output(rpm),
            // The limits of the object are those of its type: what is to be changed counts.
            _ => change_rpm.abs(),
        })
    }

    fn ramps(&self, intent: &'static str) -> Result<Ramps, Error> {
        let (node, model, what) = (self.node.id(), self.title(), "ramps");
        self.motion(intent)?.units.ramps.ok_or(Error::NoSuchQuantity { node, model, what })
    }

    async fn seconds(&self, object: Mux) -> Result<f64, Error> {
        Ok(self.read_number(object).await? as f64 * 1e-3)
    }
}

/// Where the time of a change of speed is, in s ([`Scale::InTime`]).
const fn time_of(change: Mux) -> Mux {
    Mux::new(change.index, change.sub_index + 1)
}

/// A change of the shaft's speed below this does not count: half a count of the speed objects.
const LEAST_CHANGE_RPM: f64 = 0.5;

/// A ramp as an acceleration in counts that are `worth` (r/min)/s each; a change without a ramp is `none_from`. A time that is
/// longer than the gentlest acceleration takes gets that one.
fn ramp_counts(ramp: Ramp, change_rpm: f64, worth: f64, none_from: Option<u32>) -> i64 {
    let most = none_from.map_or(i64::MAX, i64::from);
    match ramp {
        Ramp::RpmPerSecond(rate) => ((rate / worth).round() as i64).min(most),
        Ramp::Time(time) => {
            let rate = change_rpm.abs() / time.as_secs_f64().max(1e-6);
            ((rate / worth).round() as i64).clamp(1, most)
        }
    }
}

/// How long a change of speed takes at an acceleration of `raw` counts, in seconds. 0 counts say nothing of it (CiA 402-2 gives
/// them no meaning): a drive that moves at all then moves by a ramp of its own.
fn rate_time_s(raw: i64, change_rpm: f64, worth: f64, none_from: Option<u32>) -> f64 {
    let none = none_from.is_some_and(|none_from| raw >= i64::from(none_from));
    if none || raw <= 0 { 0.0 } else { change_rpm / (raw as f64 * worth) }
}

/// A ramp as the time of one change of speed, in ms. A rate that is steeper than 1 ms gets that: 0 ms would mean no
/// ramp at all.
fn ramp_ms(ramp: Ramp, change_rpm: f64) -> i64 {
    match ramp {
        Ramp::Time(time) => milliseconds(time).round() as i64,
        // A rate of zero asks for a ramp without end: more than any drive's limit.
        Ramp::RpmPerSecond(rate) if rate <= 0.0 => i64::MAX,
        Ramp::RpmPerSecond(rate) => ((change_rpm.abs() / rate * 1e3).round() as i64).max(1),
    }
}

fn milliseconds(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_becomes_the_acceleration_of_the_change() {
        assert_eq!(ramp_counts(Ramp::Time(Duration::from_millis(500)), -60.0, 1.0, Some(60_000)), 120);
        assert_eq!(ramp_counts(Ramp::RpmPerSecond(20_000.0), 60.0, 1.0, Some(60_000)), 20_000);
        assert_eq!(ramp_counts(Ramp::Time(Duration::ZERO), 60.0, 1.0, Some(60_000)), 60_000);
        assert_eq!(ramp_counts(Ramp::Time(Duration::from_secs(3600)), 60.0, 1.0, Some(60_000)), 1);
    }

    #[test]
    fn a_rate_becomes_the_time_of_the_change() {
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(120.0), 60.0), 500);
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(120.0), -60.0), 500);
        assert_eq!(ramp_ms(Ramp::Time(Duration::from_millis(300)), 60.0), 300);
        assert_eq!(ramp_ms(Ramp::Time(Duration::from_micros(1600)), 60.0), 2);
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(1e9), 60.0), 1);
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(0.0), 60.0), i64::MAX);
    }

    #[test]
    fn a_difference_of_more_than_a_thousandth_is_reported() {
        let sent = |requested, commanded| {
            let (what, unit, object) = ("speed", "r/min", Mux::new(0x60FF, 0));
            Commanded { what, requested, commanded, unit, object, raw: commanded as i64 }
        };
        assert!(sent(2.7, 3.0).is_rounded() && sent(-2.7, -3.0).is_rounded());
        assert!(!sent(59.999_99, 60.0).is_rounded() && !sent(0.0, 0.0).is_rounded());
        assert_eq!(sent(2.7, 3.0).to_string(), "speed: 2.7 r/min asked for, 3 r/min sent (60FFh:00 = 3)");
    }
}

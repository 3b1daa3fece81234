use canopen::Mux;
use drives::profile::{CountsPerTurn, Quantity, Ramps};

use super::Drive;
use crate::error::Error;
use crate::units::{Angle, Ramp};

/// Conversion between physical units and what this drive's objects hold, read from the drive where it is set there.
impl Drive {
    /// Counts of position in one turn.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; those of the SDO read.
    pub async fn counts_per_turn(&self) -> Result<f64, Error> {
        match self.known("convert positions")?.units.counts_per_turn {
            CountsPerTurn::Fixed(counts) => Ok(f64::from(counts)),
            CountsPerTurn::Object { object, factor, .. } => {
                Ok(self.read_number(object).await? as f64 * f64::from(factor))
            }
            CountsPerTurn::Table { object, counts, default } => {
                let place = usize::try_from(self.read_number(object).await?).ok();
                // A value beyond the table: the drive's own table refuses it, so it is as delivered.
                let known = place.and_then(|place| counts.get(place)).or(counts.get(default as usize));
                Ok(known.copied().map_or(1.0, f64::from))
            }
        }
    }

    /// An angle in counts, rounded to the nearest.
    pub(super) async fn counts(&self, angle: Angle) -> Result<i64, Error> {
        match angle {
            Angle::Counts(counts) => Ok(counts),
            Angle::Turns(turns) => Ok((turns * self.counts_per_turn().await?).round() as i64),
        }
    }

    /// A physical value as its object holds it, rounded to the nearest count and within the object's limits.
    pub(super) async fn raw_quantity(&self, quantity: Quantity, value: f64) -> Result<i64, Error> {
        let counts = value / quantity.per_count * self.divisor(quantity).await?;
        let raw = counts.round() as i64;
        self.check_number(quantity.object, raw).map(|_| raw)
    }

    /// Reads a physical value from its object.
    pub(super) async fn read_quantity(&self, quantity: Quantity) -> Result<f64, Error> {
        let raw = self.read_number(quantity.object).await? as f64;
        Ok(raw * quantity.per_count / self.divisor(quantity).await?)
    }

    async fn divisor(&self, quantity: Quantity) -> Result<f64, Error> {
        let Some(object) = quantity.divisor else { return Ok(1.0) };
        // A drive that holds 0 where its manual allows 1 to 10 does not divide.
        Ok((self.read_number(object).await? as f64).max(1.0))
    }

    /// Sets acceleration and deceleration for a change of speed by `change_rpm`.
    pub(super) async fn write_ramps(
        &self,
        acceleration: Option<Ramp>,
        deceleration: Option<Ramp>,
        change_rpm: f64,
    ) -> Result<(), Error> {
        match self.known("set its ramps")?.units.ramps {
            Ramps::Milliseconds { acceleration: up, deceleration: down, .. } => {
                for (object, ramp) in [(up, acceleration), (down, deceleration)] {
                    if let Some(ramp) = ramp {
                        self.write_number(object, ramp_ms(ramp, change_rpm)).await?;
                    }
                }
            }
            Ramps::Acceleration { both, none_from } => {
                // One object for both: the gentler of two wishes.
                let wishes = [acceleration, deceleration].into_iter().flatten();
                if let Some(rate) = wishes.map(|ramp| ramp_rpm_s(ramp, change_rpm, none_from)).min() {
                    self.write_number(both, rate).await?;
                }
            }
        }
        Ok(())
    }

    /// The drive's ramp times for a whole change of speed, in seconds: up, down.
    pub(super) async fn ramp_times_s(&self) -> Result<(f64, f64), Error> {
        match self.known("read its ramps")?.units.ramps {
            Ramps::Milliseconds { acceleration, deceleration, .. } => {
                Ok((self.seconds(acceleration).await?, self.seconds(deceleration).await?))
            }
            Ramps::Acceleration { both, none_from } => {
                let rate = self.read_number(both).await?;
                let none = rate >= i64::from(none_from);
                let seconds = if none { 0.0 } else { self.largest_change_rpm()? / rate.max(1) as f64 };
                Ok((seconds, seconds))
            }
        }
    }

    /// Time of the drive's quick stop in seconds.
    pub(super) async fn quick_stop_time_s(&self) -> Result<f64, Error> {
        match self.known("read its ramps")?.units.ramps {
            Ramps::Milliseconds { quick_stop, .. } => self.seconds(quick_stop).await,
            // Such a drive stops without a ramp.
            Ramps::Acceleration { .. } => Ok(0.0),
        }
    }

    /// The largest change of speed that can be asked for, r/min: from one limit of the target velocity to the other.
    fn largest_change_rpm(&self) -> Result<f64, Error> {
        let target = self.known("read its limits")?.units.target_velocity;
        let row = self.row(target.object, "read its limits")?;
        let (low, high) = row.limits.unwrap_or(row.data_type.range());
        Ok((high - low) as f64 * target.per_count)
    }

    async fn seconds(&self, object: Mux) -> Result<f64, Error> {
        Ok(self.read_number(object).await? as f64 * 1e-3)
    }
}

/// A ramp as an acceleration in (r/min)/s; a change without a ramp is `none_from`.
fn ramp_rpm_s(ramp: Ramp, change_rpm: f64, none_from: u32) -> i64 {
    match ramp {
        Ramp::RpmPerSecond(rate) => (rate.max(1.0).round() as i64).min(i64::from(none_from)),
        Ramp::Time(time) => {
            let rate = change_rpm.abs() / time.as_secs_f64().max(1e-6);
            (rate.round() as i64).clamp(1, i64::from(none_from))
        }
    }
}

/// A ramp as the time of one change of speed, in ms.
fn ramp_ms(ramp: Ramp, change_rpm: f64) -> i64 {
    match ramp {
        Ramp::Time(time) => i64::try_from(time.as_millis()).unwrap_or(i64::MAX),
        // A rate of zero asks for a ramp without end: more than any drive's limit.
        Ramp::RpmPerSecond(rate) if rate <= 0.0 => i64::MAX,
        Ramp::RpmPerSecond(rate) => (change_rpm.abs() / rate * 1e3).round() as i64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_time_becomes_the_acceleration_of_the_change() {
        assert_eq!(ramp_rpm_s(Ramp::Time(Duration::from_millis(500)), -60.0, 60_000), 120);
        assert_eq!(ramp_rpm_s(Ramp::RpmPerSecond(20_000.0), 60.0, 60_000), 20_000);
        assert_eq!(ramp_rpm_s(Ramp::Time(Duration::ZERO), 60.0, 60_000), 60_000);
        assert_eq!(ramp_rpm_s(Ramp::RpmPerSecond(0.0), 60.0, 60_000), 1);
    }

    #[test]
    fn a_rate_becomes_the_time_of_the_change() {
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(120.0), 60.0), 500);
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(120.0), -60.0), 500);
        assert_eq!(ramp_ms(Ramp::Time(Duration::from_millis(300)), 60.0), 300);
        assert_eq!(ramp_ms(Ramp::RpmPerSecond(0.0), 60.0), i64::MAX);
    }
}

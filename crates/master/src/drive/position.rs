//! Profile position moves (CiA 402-2, clause 10): the set-point handshake of bits 4 and 12, and the wait for the
//! target with a deadline from way, speed and ramps. Interpolated and cyclic positions are not made here.

use std::time::Duration;

use cia402::object::{CONTROLWORD, POSITION_ACTUAL_VALUE, TARGET_POSITION};
use cia402::{Controlword, ModeOfOperation, Statusword};
use devices::NewSetPoint;

use super::conclude::{Interference, Trigger};
use super::goal::{Goal, REACHED_TURNS, Sent};
use super::handle::{Drive, POLL, STEP_TIMEOUT};
use super::motion::{LATE_FACTOR, LATE_MARGIN_S, MotionOptions, MotionReport};
use super::scale::Commanded;
use crate::error::Error;
use crate::units::{Angle, Rpm};

const ENABLED: u16 = 0x0F;

/// A move that may take longer than this is waited for where a time limit is given with it only: who has not set the drive up for
/// that would sit before a shaft that seems to stand.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

/// Profile position moves with the set-point handshake. Source: CiA 402-2, clause 10.
impl Drive {
    /// Turns to an absolute position. Enables the drive first.
    ///
    /// # Errors
    /// [`Error::OutOfLimits`], [`Error::TooFine`] and [`Error::InCycles`] before anything moves; [`Error::NotReached`] with an explanation
    /// when the drive faults, is stopped, falls silent or does not get there, and before anything moves where its profile velocity is
    /// 0, or so low that the way takes more than an hour and no time limit says that it may; those of the requests.
    pub async fn move_absolute(&self, to: impl Into<Angle>, options: MotionOptions) -> Result<MotionReport, Error> {
        let target = self.position("position", to.into()).await?;
        self.move_counts(target, false, options).await
    }

    /// Turns by an angle from the last target position. Enables the drive first.
    ///
    /// # Errors
    /// As [`move_absolute`](Self::move_absolute).
    pub async fn move_relative(&self, by: impl Into<Angle>, options: MotionOptions) -> Result<MotionReport, Error> {
        let distance = self.position("distance", by.into()).await?;
        self.move_counts(distance, true, options).await
    }

    async fn move_counts(&self, to: Commanded, relative: bool, options: MotionOptions) -> Result<MotionReport, Error> {
        const INTENT: &str = "move it to the wanted position";
        self.check_unclaimed(INTENT)?;
        let units = self.motion(INTENT)?.units;
        let profile_velocity = self.has(units.profile_velocity, "a profile velocity")?;
        let (counts, mut commanded) = (to.raw, vec![to]);
        self.check_software_limits(counts, relative).await?;
        if let Some(Rpm(speed)) = options.speed {
            let speed = self.quantity(("profile velocity", "r/min"), profile_velocity, speed.abs()).await?;
            self.write_number(speed.object, speed.raw).await?;
            commanded.push(speed);
        }
        let speed = self.read_quantity(profile_velocity).await?;
        if speed == 0.0 {
            return Err(self.not_reached(INTENT, Trigger::NoProfileVelocity(profile_velocity.object)).await);
        }
        commanded.extend(self.write_ramps(options.acceleration, options.deceleration, speed).await?);
        let stopped = self.set_mode(ModeOfOperation::PROFILE_POSITION).await?;
        let began_at = self.read_number(self.place(POSITION_ACTUAL_VALUE)).await?;
        let target = if relative { began_at.saturating_add(counts) } else { counts };
        let turn = self.counts_per_shaft_turn().await?.max(1.0);
        let of_output = turn * self.gear.ratio();
        let limit = match options.within {
            Some(within) => within,
            None => self.time_for(target.abs_diff(began_at) as f64 / of_output, speed).await?,
        };
        if options.wait && options.within.is_none() && limit > LONGEST_WAIT {
            let (object, rpm) = (profile_velocity.object, speed);
            return Err(self.not_reached(INTENT, Trigger::TooSlow { object, rpm, limit }).await);
        }
        // Without ramps: what takes longer than that cannot be there in time.
        let way_s = target.abs_diff(began_at) as f64 / of_output / speed.abs() * 60.0;
        let needed = Duration::try_from_secs_f64(way_s).unwrap_or(Duration::MAX);
        if let Some(within) = options.within.filter(|within| *within < needed) {
            let (object, rpm) = (profile_velocity.object, speed);
            return Err(self.not_reached(INTENT, Trigger::TooShort { object, rpm, needed, within }).await);
        }
        self.enable().await?;
        self.give_set_point(INTENT, counts, relative).await?;
        let notes = self.notes(stopped).await;
        if !options.wait {
            return Ok(MotionReport { reached_after: None, commanded, notes });
        }
        let band = (turn * REACHED_TURNS).max(1.0);
        let sent = Sent { object: self.place(TARGET_POSITION), raw: counts };
        let (network, goal) = (self.node.network(), Goal::Position { target, band, sent });
        let began = network.now();
        let spent = || network.now() - began;
        loop {
            let before = spent();
            let reached = before + self.watch(INTENT, goal, limit.saturating_sub(before)).await?;
            self.settle(INTENT).await?;
            let at = self.answered(INTENT, self.read_number(self.place(POSITION_ACTUAL_VALUE)).await).await?;
            if at.abs_diff(target) as f64 <= band {
                self.note_stopped();
                return Ok(MotionReport { reached_after: Some(reached), commanded, notes });
            }
            // One with a heavy load swings through its target, and shows bit 10 meanwhile: it may come to rest there yet.
            if spent() >= limit {
                let (at, target, unit) = (at as f64, target as f64, "counts");
                let elsewhere = Trigger::Elsewhere { at, target, unit, by: Interference::Unknown };
                return Err(self.not_reached(INTENT, elsewhere).await);
            }
        }
    }

    /// Target into 607Ah, then a rising edge of bit 4, acknowledged by statusword bit 12, and bit 4 back.
    ///
    /// A drive left halted gets the new set-point in place of the one it was halted in, not after it. A drive that acts
    /// on each write of bit 4 acknowledges nothing, and takes every set-point in place of the one before.
    async fn give_set_point(&self, intent: &'static str, counts: i64, relative: bool) -> Result<(), Error> {
        let before = self.node.read::<u16>(self.place(CONTROLWORD)).await.map_or(Controlword(ENABLED), Controlword);
        let halted = before.has(Controlword::HALT);
        let self_clearing = self.motion(intent)?.new_set_point == NewSetPoint::ClearsItself;
        let held = if halted { Controlword::HALT } else { 0 };
        let replace = if halted && !self_clearing { Controlword::CHANGE_SET_IMMEDIATELY } else { 0 };
        let kind = ENABLED | if relative { Controlword::RELATIVE } else { 0 };
        self.write_controlword(Controlword(kind | held)).await?;
        if !self_clearing {
            self.wait_acknowledge(intent, false).await?;
        }
        self.write_number(self.place(TARGET_POSITION), counts).await?;
        self.note_moved();
        self.write_controlword(Controlword(kind | replace | Controlword::NEW_SET_POINT)).await?;
        if self_clearing {
            return Ok(());
        }
        self.wait_acknowledge(intent, true).await?;
        self.write_controlword(Controlword(kind)).await
    }

    async fn wait_acknowledge(&self, intent: &'static str, acknowledged: bool) -> Result<(), Error> {
        let mut waited = Duration::ZERO;
        while self.still_enabled(intent).await?.has(Statusword::SET_POINT_ACKNOWLEDGE) != acknowledged {
            if waited >= STEP_TIMEOUT {
                return Err(self.not_reached(intent, Trigger::NoAcknowledge).await);
            }
            self.wait_poll(&mut waited).await;
        }
        Ok(())
    }

    /// Upper bound of a move's duration: the way at full speed plus both ramps, stretched by the margin.
    async fn time_for(&self, turns: f64, speed_rpm: f64) -> Result<Duration, Error> {
        let (up, down) = self.ramp_times_s(speed_rpm).await?;
        let cruise = turns / speed_rpm.abs() * 60.0;
        let seconds = (cruise + up + down) * LATE_FACTOR + LATE_MARGIN_S + POLL.as_secs_f64();
        Ok(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
    }
}

//! Turning at a speed, pushing with a current, stopping (CiA 402-2, clauses 13 and 15), in physical units.

use core::fmt;
use std::time::Duration;

use cia402::object::CONTROLWORD;
use cia402::{Controlword, ModeOfOperation, PowerState};

use super::goal::{Goal, Held, Sent};
use super::handle::{Drive, POLL};
use super::scale::{Commanded, REACHED_LEAST_RPM};
use crate::error::Error;
use crate::host_loss::HostLoss;
use crate::units::{Amperes, Ramp, Rpm};

/// How to make a motion. `None` leaves a setting as the drive has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionOptions {
    /// Speed of a position move.
    pub speed: Option<Rpm>,
    /// How fast the speed may rise.
    pub acceleration: Option<Ramp>,
    /// How fast the speed may fall.
    pub deceleration: Option<Ramp>,
    /// Wait until the target is reached, and watch the drive meanwhile.
    pub wait: bool,
    /// Longest time that it may take; `None` for half as long again as it is reckoned to take.
    pub within: Option<Duration>,
}

impl Default for MotionOptions {
    fn default() -> Self {
        Self { speed: None, acceleration: None, deceleration: None, wait: true, within: None }
    }
}

/// How a motion went.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionReport {
    /// From the command to the target; `None` if it was not waited for.
    pub reached_after: Option<Duration>,
    /// Each value that was asked for, and what was sent for it.
    pub commanded: Vec<Commanded>,
    /// What to know about it.
    pub notes: Vec<Note>,
}

/// Something to know about a motion that was commanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Note {
    /// What the drive does when the program that moves it dies or falls silent. See [`Drive::guard`].
    HostLoss(HostLoss),
    /// The shaft was turning in another mode and has been stopped before this motion began.
    StoppedFirst {
        /// That mode.
        before: ModeOfOperation,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::HostLoss(loss @ HostLoss::StopsInSilence { object, .. }) => write!(
                f,
                "when no frames are sent to it {loss}: watching the motion keeps it content; otherwise send it a request \
                 from time to time or set {object} to 0"
            ),
            Self::HostLoss(loss) => write!(f, "when the program that moves it dies {loss}"),
            Self::StoppedFirst { before } => {
                write!(f, "it was turning in mode {before} and has been stopped first: the mode changes at standstill")
            }
        }
    }
}

/// The bits of velocity mode's ramp (CiA 402-2, velocity mode): enabled, unlocked, and given its target.
const RAMP: u16 = Controlword::ENABLE_RAMP | Controlword::UNLOCK_RAMP | Controlword::REFERENCE_RAMP;
const RUN_VELOCITY: Controlword = Controlword(0x0F | RAMP);

/// Part of the target within which a speed or current counts as reached.
const REACHED_SHARE: f64 = 0.05;

/// What a computed duration is stretched by, and what is added to it, before a motion counts as late: for jerk
/// limits, load, and settling.
pub(super) const LATE_FACTOR: f64 = 1.5;
pub(super) const LATE_MARGIN_S: f64 = 2.0;

impl Drive {
    /// Turns at this speed (profile velocity) until commanded otherwise. Enables the drive first.
    ///
    /// # Errors
    /// [`Error::OutOfLimits`], [`Error::TooFine`] and [`Error::InCycles`] before anything moves; [`Error::NotReached`] with an
    /// explanation; those of the requests.
    pub async fn velocity(&self, speed: impl Into<Rpm>, options: MotionOptions) -> Result<MotionReport, Error> {
        const INTENT: &str = "turn it at the wanted speed";
        let Rpm(requested) = speed.into();
        self.check_unclaimed(INTENT)?;
        let axis = self.motion(INTENT)?;
        let target_velocity = self.has(axis.units.target_velocity, "a target velocity")?;
        let mode = axis.velocity_mode();
        let speed = self.quantity(("speed", "r/min"), target_velocity, requested).await?;
        let Commanded { raw, commanded: target, .. } = speed;
        let change = target - self.ramp_start_rpm().await?;
        let ramps = self.write_ramps(options.acceleration, options.deceleration, change).await?;
        let commanded = [vec![speed], ramps].concat();
        let stopped = self.set_mode(mode).await?;
        self.enable().await?;
        self.note_moved();
        self.write_number(target_velocity.object, raw).await?;
        self.follow(mode).await?;
        let notes = self.notes(stopped).await;
        if !options.wait {
            return Ok(MotionReport { reached_after: None, commanded, notes });
        }
        let (up, down) = self.ramp_times_s(change).await?;
        let reckoned = || Duration::from_secs_f64((up.max(down) * LATE_FACTOR + LATE_MARGIN_S).clamp(0.0, 3600.0));
        let limit = options.within.unwrap_or_else(reckoned);
        let held = self.held(target, Sent { object: target_velocity.object, raw })?;
        let reached = self.watch(INTENT, Goal::Speed(held), limit).await?;
        if target == 0.0 {
            self.note_stopped();
        }
        Ok(MotionReport { reached_after: Some(reached), commanded, notes })
    }

    /// Applies this motor current (profile torque) until commanded otherwise. Enables the drive first.
    ///
    /// The resulting speed depends on the load: supervise it. Does not wait.
    ///
    /// # Errors
    /// As [`velocity`](Self::velocity).
    pub async fn torque(&self, current: Amperes) -> Result<MotionReport, Error> {
        const INTENT: &str = "set its torque";
        self.check_unclaimed(INTENT)?;
        let axis = self.motion(INTENT)?;
        let Some(target) = axis.units.target_current else {
            return Err(self.no_such_mode(axis, ModeOfOperation::PROFILE_TORQUE));
        };
        let commanded = self.quantity(("current", "A"), target, current.0).await?;
        let stopped = self.set_mode(ModeOfOperation::PROFILE_TORQUE).await?;
        self.enable().await?;
        self.note_moved();
        self.write_number(target.object, commanded.raw).await?;
        self.follow(ModeOfOperation::PROFILE_TORQUE).await?;
        Ok(MotionReport { reached_after: None, commanded: vec![commanded], notes: self.notes(stopped).await })
    }

    /// Stops by the drive's deceleration ramp and stays enabled: target zero, or halt (bit 8) in a position move. In profile torque a
    /// target of zero has a shaft coast: a [quick stop](Self::quick_stop) brings it to rest, after which it is no longer enabled.
    ///
    /// # Errors
    /// As [`velocity`](Self::velocity).
    pub async fn stop(&self) -> Result<(), Error> {
        const INTENT: &str = "stop it";
        let axis = self.motion(INTENT)?;
        let units = axis.units;
        if self.power_state(self.statusword().await?) == Some(PowerState::OperationEnabled) {
            match self.mode().await? {
                mode if mode == axis.velocity_mode() => {
                    if mode == ModeOfOperation::VELOCITY {
                        // Drives with a least speed (6046h:01) may raise a target of 0 to it: the ramp leads to standstill
                        // without its reference, too (bit 6).
                        self.write_controlword(Controlword(RUN_VELOCITY.0 & !Controlword::REFERENCE_RAMP)).await?;
                    }
                    self.write_zero(units.target_velocity).await?;
                }
                ModeOfOperation::PROFILE_TORQUE => {
                    // Zeroed first: who enables it again does not get the old torque.
                    self.write_zero(units.target_current).await?;
                    return self.quick_stop().await;
                }
                _ => self.write_controlword(Controlword(0x0F | Controlword::HALT)).await?,
            }
        }
        self.wait_standstill(INTENT).await?;
        self.note_stopped();
        Ok(())
    }

    /// Polls a moving drive for `duration`, which keeps the drive's watch over its host content. In profile velocity its speed is
    /// looked at too.
    ///
    /// # Errors
    /// [`Error::NotReached`] as soon as the drive is no longer enabled or falls silent; when it stands still although it has a
    /// target velocity, or is given another one; when it turns at another speed at the end.
    pub async fn supervise(&self, duration: Duration) -> Result<(), Error> {
        const INTENT: &str = "keep it moving";
        if let Some(axis) = self.axis_description()
            && let Some(target) = axis.units.target_velocity
            && self.answered(INTENT, self.mode().await).await? == axis.velocity_mode()
        {
            let raw = self.answered(INTENT, self.read_number(target.object).await).await?;
            let rpm = self.answered(INTENT, self.read_quantity(target).await).await?;
            return self.watch_speed(INTENT, self.held(rpm, Sent { object: target.object, raw })?, duration).await;
        }
        // By the clock: looks take time as well, and a program that was frozen is late already.
        let (network, end) = (self.node.network(), self.node.network().now() + duration);
        while network.now() < end {
            self.still_enabled(INTENT).await?;
            network.sleep(POLL.min(end - network.now())).await;
        }
        Ok(())
    }

    /// When a speed counts as reached and kept.
    fn held(&self, target_rpm: f64, sent: Sent) -> Result<Held, Error> {
        let band_rpm = (target_rpm.abs() * REACHED_SHARE).max(self.gear.at_output(REACHED_LEAST_RPM));
        let quantity = self.has(self.motion("look at its speed")?.units.actual_velocity, "the actual velocity")?;
        Ok(Held { quantity, target_rpm, band_rpm, sent })
    }

    /// Has it follow its target, now that the target is the new one: takes a halt bit back that an earlier stop has left, and in
    /// velocity mode (vl) sets the bits of the ramp.
    pub(super) async fn follow(&self, mode: ModeOfOperation) -> Result<(), Error> {
        let run = if mode == ModeOfOperation::VELOCITY { RUN_VELOCITY } else { Controlword(0x0F) };
        let open = Controlword(Controlword::HALT | run.0 & RAMP);
        // A controlword that cannot be read has no halt that this master could know of.
        let present = self.node.read::<u16>(self.place(CONTROLWORD)).await;
        let waits = present.map_or(run.0 & RAMP != 0, |raw| raw & open.0 != run.0 & RAMP);
        if waits { self.write_controlword(run).await } else { Ok(()) }
    }

    /// What to know about a motion, beside what was noted at its start.
    pub(super) async fn notes(&self, noted: Option<Note>) -> Vec<Note> {
        // A note that cannot be made is not a reason to fail: the drive moves already.
        let loss = self.host_loss().await.ok().map(Note::HostLoss);
        noted.into_iter().chain(loss).collect()
    }
}

//! Homing (CiA 402-2, clause 11), as each model starts it and reports its end.
//!
//! The way to the switch is not known, so the time that it may take is the caller's to say. Setting a model's inputs up
//! as switches is not done here.

use std::time::Duration;

use cia402::object::MODES_OF_OPERATION;
use cia402::{Controlword, ModeOfOperation};
use devices::{HomingRules, HomingStart};

use super::goal::Goal;
use super::handle::Drive;
use super::motion::{MotionReport, Note};
use crate::error::{Error, Fact};
use crate::units::Rpm;

const ENABLED: u16 = 0x0F;

/// How to find the reference position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingOptions {
    /// Speed of the search, of a model that has an object for it; `None` leaves it as the drive has it.
    pub speed: Option<Rpm>,
    /// Longest time that it may take.
    pub limit: Duration,
    /// Wait until it is found, and watch the drive meanwhile.
    pub wait: bool,
}

impl Default for HomingOptions {
    fn default() -> Self {
        Self { speed: None, limit: Duration::from_secs(60), wait: true }
    }
}

const INTENT: &str = "find its reference position";

impl Drive {
    /// Finds the reference position with a homing method of CiA 402. Enables the drive first; leaves it in mode 6.
    ///
    /// A drive that does not find it in time is quick-stopped; the error says whether it was seen to stand then.
    ///
    /// # Errors
    /// [`Error::NoSuchMode`] for a model without homing; [`Error::NoSuchQuantity`] for a speed where the model has no object for it; [`Error::OutOfLimits`] for a method that it does not have, and
    /// [`Error::InCycles`], before anything moves; [`Error::NotReached`] with an explanation; those of the requests.
    pub async fn home(&self, method: i8, options: HomingOptions) -> Result<MotionReport, Error> {
        self.check_unclaimed(INTENT)?;
        self.home_claimed(method, options).await
    }

    /// [`home`](Self::home) for a group, which has claimed the axis.
    pub(crate) async fn home_claimed(&self, method: i8, options: HomingOptions) -> Result<MotionReport, Error> {
        let axis = self.motion(INTENT)?;
        let rules = axis.homing.ok_or_else(|| self.no_such_mode(axis, ModeOfOperation::HOMING))?;
        // At another speed than was asked for it does not search.
        let search =
            options.speed.map(|speed| Ok::<_, Error>((self.has(rules.search_speed, "a search speed")?, speed)));
        let search = search.transpose()?;
        self.write_number(rules.method, method.into()).await?;
        let mut commanded = Vec::new();
        if let Some((search, Rpm(speed))) = search {
            let speed = self.quantity(("search speed", "r/min"), search, speed.abs()).await?;
            self.write_number(speed.object, speed.raw).await?;
            commanded.push(speed);
        }
        let stopped = self.start_homing(&rules).await?;
        let notes = self.notes(stopped).await;
        if !options.wait {
            return Ok(MotionReport { reached_after: None, commanded, notes });
        }
        let reached = match self.watch(INTENT, Goal::Home { rules, method, looks: 0 }, options.limit).await {
            Err(Error::NotReached(mut explanation)) => {
                let stop = match self.quick_stop().await {
                    Ok(()) => "; it has been quick-stopped and stands",
                    Err(error) => {
                        explanation.facts.push(Fact::Failed(Box::new(error)));
                        "; it was sent a quick stop, and was not seen to stand"
                    }
                };
                explanation.conclusion.push_str(stop);
                return Err(Error::NotReached(explanation));
            }
            other => other?,
        };
        if rules.start == HomingStart::ControlwordBit4 {
            self.write_controlword(Controlword(ENABLED)).await?;
        }
        self.note_stopped();
        Ok(MotionReport { reached_after: Some(reached), commanded, notes })
    }

    async fn start_homing(&self, rules: &HomingRules) -> Result<Option<Note>, Error> {
        match rules.start {
            HomingStart::ControlwordBit4 => {
                let stopped = self.set_mode(ModeOfOperation::HOMING).await?;
                self.enable().await?;
                // Bit 4, which has to rise, may be left over.
                self.write_controlword(Controlword(ENABLED)).await?;
                self.note_moved();
                self.write_controlword(Controlword(ENABLED | Controlword::NEW_SET_POINT)).await?;
                Ok(stopped)
            }
            HomingStart::ModeWrite => {
                self.enable().await?;
                self.follow(ModeOfOperation::HOMING).await?;
                self.note_moved();
                self.node.write(self.place(MODES_OF_OPERATION), ModeOfOperation::HOMING.0).await?;
                Ok(None)
            }
        }
    }
}

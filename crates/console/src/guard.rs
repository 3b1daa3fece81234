//! `--guard`: what a drive does when the command that moves it dies, armed where the drive has something against that, and
//! reported where it has not.
//!
//! A guard lasts as long as its command. A command that ends and leaves the motor turning releases it, and says what
//! happens then.

use clap::ValueEnum;
use master::Drive;
use master::drive::{HostLoss, SwitchedOff};
use serde::Serialize;

use crate::context::{Context, Holding};
use crate::failure::Failure;

/// Whether a motion is guarded.
#[derive(Debug, Default, clap::Args)]
pub struct GuardArgs {
    /// Have the drive stop by itself if this command dies, where it can monitor its host (on, unless off is given)
    ///
    /// The model decides how: it stops when it receives no frame for a time, or when the heartbeat of this command
    /// (node 127, as a drive's 1016h has it) is missing; or it has no such function and goes on, which is reported
    /// before it moves. A monitoring time that is set to 0 on the drive stays 0, unless --guard is given: then it has
    /// its factory value until this command ends. A 1016h that is delivered as 0 is set to node 127 within 2000 ms for
    /// this command in any case.
    #[arg(long, value_name = "on|off", num_args = 0..=1, default_missing_value = "on")]
    guard: Option<OnOff>,
    /// Same as --guard off: no heartbeat is sent, and a drive keeps moving
    #[arg(long, conflicts_with = "guard")]
    no_guard: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OnOff {
    On,
    Off,
}

/// What a drive does without this command.
#[derive(Debug)]
pub struct Guard {
    loss: HostLoss,
    armed: bool,
}

/// The same for programs.
#[derive(Debug, Serialize)]
pub struct GuardReport {
    /// This command has seen to it that the drive stops by itself: while it runs, and after it if it leaves the motor turning.
    armed: bool,
    /// After how long without this command it stops; `null` if it does not.
    stops_after_ms: Option<u64>,
    /// The object that sets it.
    object: Option<String>,
    /// In words.
    pub text: String,
}

impl GuardArgs {
    /// Of a line for a host, before anything is done: it has guarded the drive by the time that these would count.
    ///
    /// # Errors
    /// One was given.
    pub fn check_for_host(&self) -> Result<(), words::failure::Failure> {
        if self.guard.is_none() && !self.no_guard {
            return Ok(());
        }
        let failure = words::failure::Failure::usage("--guard and --no-guard have no effect in a line of a page");
        Err(failure
            .because("the host guards every drive that it moves, and leaves a monitoring time that is set to 0")
            .next("omit it: set that time with the parameters of the drive, or accept in the Motion view that nothing stops it"))
    }

    /// Guards the drive before it moves. What nothing would stop is reported on standard error.
    pub async fn begin(&self, context: &Context, drive: &Drive) -> Result<Guard, Failure> {
        let armed = !self.no_guard && self.guard != Some(OnOff::Off);
        let switched_off = if self.guard.is_some() { SwitchedOff::SwitchOn } else { SwitchedOff::Leave };
        let loss = if armed { drive.guard(switched_off).await? } else { drive.host_loss().await? };
        if loss.stops_after().is_none() {
            let more = match loss {
                HostLoss::SwitchedOff { .. } if armed && context.in_control().is_none() => {
                    "; --guard gives it its factory value for this command"
                }
                HostLoss::NotArmed { .. } => "; without --no-guard they are",
                _ => "; keep an emergency stop within reach",
            };
            context.warn(&format!("node {}: if this command dies, {loss}{more}", drive.node().id()));
        }
        Ok(Guard { loss, armed: armed && loss.stops_after().is_some() })
    }
}

impl Guard {
    /// Releases the drive; what there is to know of one that `goes_on` moving. A bus of this command's own ends with it, and
    /// its drives go nowhere.
    pub async fn end(
        self,
        context: &Context,
        drive: &Drive,
        goes_on: bool,
    ) -> Result<(GuardReport, Option<String>), Failure> {
        let held = context.in_control().is_some();
        // A host guards the drive as long as it may move.
        if !held {
            drive.release_guard().await?;
        }
        let left = goes_on && context.holding == Holding::Unheld;
        let note = left.then(|| self.farewell(drive));
        // Of one that is left moving, what it has now that this command's own watch over it has ended.
        let loss = if left { drive.host_loss().await? } else { self.loss };
        let report = GuardReport {
            armed: self.armed && loss.stops_after().is_some(),
            stops_after_ms: loss.stops_after().map(|time| time.as_millis() as u64),
            object: loss.object().map(|object| object.to_string()),
            text: format!("without this command {loss}"),
        };
        Ok((report, note))
    }

    fn farewell(&self, drive: &Drive) -> String {
        let node = drive.node().id();
        match self.loss {
            HostLoss::StopsInSilence { object, .. } => format!(
                "this command ends here, and {}: omit --no-wait to keep this command running; to let the drive go on alone, write 0 to {object} \
                 before the motion",
                self.loss
            ),
            _ => format!(
                "this command ends here, and nothing monitors the drive: it keeps moving until it is stopped (ferrodrive stop {node})"
            ),
        }
    }
}

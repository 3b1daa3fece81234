//! `ferrodrive home`: homing (CiA 402-2, mode 6), where a drive has it.

use std::time::Duration;

use canopen::NodeId;
use master::drive::Motion;
use master::units::{Along, Rpm, parse_duration};

use super::motion::{MotionOutcome, Then, outcome, perform, speed};
use crate::context::Context;
use crate::failure::Failure;
use crate::guard::GuardArgs;
use crate::numbers::whole;
use words::node::node;

/// Find a drive's reference position
///
/// Enables the drive and waits until it has found the edge of its switch, which is position zero from then on. The
/// inputs have to be configured as switches first; a drive that does not find the edge in time is stopped.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 home 2 --method 17\n  \
    ferrodrive --bus can0 home 1 --method 18 --within 5s")]
pub struct Home {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// Homing method of CiA 402, e.g. 17 (negative limit switch)
    #[arg(long, value_parser = |text: &str| whole(text, i8::MIN..=i8::MAX), allow_hyphen_values = true)]
    method: i8,
    /// Speed of the search (6099h:01); refused where the drive has no object for it, as a joint, which has it in 6083h
    #[arg(long, value_name = "SPEED", value_parser = speed)]
    profile_velocity: Option<Along<Rpm>>,
    /// Longest time to wait for the reference
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "60s")]
    within: Duration,
    /// Return at once, without waiting for the reference
    #[arg(long)]
    no_wait: bool,
    #[command(flatten)]
    guard: GuardArgs,
}

impl Home {
    /// What the drive is to do.
    pub(super) const fn motion(&self) -> Motion {
        let (speed, within) = (self.profile_velocity, Some(self.within));
        Motion::Home { method: self.method, speed, wait: !self.no_wait, within }
    }

    pub(super) const fn guard(&self) -> &GuardArgs {
        &self.guard
    }

    /// Homes.
    pub async fn run(&self, context: &Context) -> Result<MotionOutcome, Failure> {
        let drive = context.known_drive(self.node).await?;
        let doing = format!("node {}: searching for its reference", self.node);
        let (motion, guard) = perform(context, &drive, &doing, &self.guard, &self.motion()).await?;
        let then = Then::goes_on_if(motion.reached_after.is_none());
        outcome(context, &drive, ("home with method", &self.method), motion, then, guard).await
    }
}

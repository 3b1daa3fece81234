//! `ferrodrive home`: homing (CiA 402-2, mode 6), where a drive has it.

use std::time::Duration;

use canopen::NodeId;
use cia402::ModeOfOperation;
use master::drive::Motion;
use master::units::{Along, Rpm, parse_duration};

use super::motion::{MotionOutcome, Then, outcome, perform, speed};
use crate::context::Context;
use crate::failure::Failure;
use crate::guard::GuardArgs;
use crate::numbers::whole;
use devices::AxisDescription;
use words::models::Description;
use words::node::node;

/// Find a drive's reference position
///
/// Enables the drive and waits until it has found the edge of its switch, which is position zero from then on. The
/// inputs have to be configured as switches first; a drive that does not find the edge in time is stopped.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive home 2 --method 17\n  ferrodrive home 1 --method 18 --within 5s")]
pub struct Home {
    /// Node-ID
    #[arg(value_parser = node)]
    pub(super) node: NodeId,
    /// Homing method of CiA 402, e.g. 17 (negative limit switch)
    #[arg(long, value_parser = |text: &str| whole(text, i8::MIN..=i8::MAX), allow_hyphen_values = true)]
    method: i8,
    /// Speed of the search, where the drive has an object for it
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

    /// Homes; refuses for drives without homing, with the reason.
    pub async fn run(&self, context: &Context) -> Result<MotionOutcome, Failure> {
        let drive = context.known_drive(self.node).await?;
        if let Some(model) = drive.description()
            && let Some(axis) = model.first_axis().filter(|axis| axis.homing.is_none())
        {
            return Err(self.refusal(model, axis));
        }
        let doing = format!("node {}: searching for its reference", self.node);
        let (motion, guard) = perform(context, &drive, &doing, &self.guard, &self.motion()).await?;
        let then = Then::goes_on_if(motion.reached_after.is_none());
        outcome(context, &drive, ("home with method", &self.method), motion, then, guard).await
    }

    fn refusal(&self, model: &Description, axis: &AxisDescription) -> Failure {
        let modes = axis.modes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let mode = ModeOfOperation::HOMING;
        Failure::new(format!("node {}: cannot home with method {}", self.node, self.method))
            .of_kind("no_such_mode")
            .at_node(self.node)
            .because(format!("the {} has no homing: 6060h takes {modes} only, not {}", model.title, mode.0))
            .next(format!(
                "move it to its reference, then set the position to zero there: ferrodrive objects {} position",
                model.name
            ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_refusal_names_the_modes_there_are() {
        let home = Home {
            node: NodeId::MAX,
            method: 17,
            profile_velocity: None,
            within: Duration::from_secs(60),
            no_wait: false,
            guard: GuardArgs::default(),
        };
        let model = words::models::resolve("zlac8030l").unwrap();
        let text = home.refusal(model, &model.axes[0]).to_string();
        assert!(text.contains("6060h takes 1") && text.contains("objects zlac8030l position"), "{text}");
    }
}

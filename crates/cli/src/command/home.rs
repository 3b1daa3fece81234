//! `ferrodrive home`: homing (CiA 402-2, mode 6), where a drive has it.

use canopen::NodeId;
use cia402::ModeOfOperation;

use crate::context::Context;
use crate::failure::Failure;
use crate::models::DriveProfile;
use crate::parse::node::node;

/// Find a drive's reference position
#[derive(Debug, clap::Args)]
pub(crate) struct Home {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Homing method of CiA 402, e.g. 17 (negative limit switch)
    #[arg(long, value_parser = clap::value_parser!(i8), allow_hyphen_values = true)]
    method: i8,
}

impl Home {
    /// Refuses for drives without homing, with the reason.
    pub(crate) async fn run(&self, context: &Context) -> Result<(), Failure> {
        let model = context.known_model_of(self.node).await?;
        Err(self.refusal(model))
    }

    fn refusal(&self, model: &DriveProfile) -> Failure {
        let modes = model.modes.iter().map(|mode| format!("{} ({})", mode.0, mode)).collect::<Vec<_>>().join(", ");
        let failure = Failure::new(format!("node {}: no homing with method {}", self.node, self.method));
        if model.modes.contains(&ModeOfOperation::HOMING) {
            return failure.because(format!("homing the {} from here is not supported", model.title));
        }
        failure
            .because(format!("the {} has no homing: 6060h takes {modes} only, and there is no 6098h", model.title))
            .next(format!(
                "move it to its reference, then set the position to zero there: ferrodrive write {} 2006 1",
                self.node
            ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_refusal_names_the_modes_there_are() {
        let home = Home { node: NodeId::MAX, method: 17 };
        let text = home.refusal(crate::models::find("zlac8030l").unwrap()).to_string();
        assert!(text.contains("6060h takes 1") && text.contains("write 127 2006 1"), "{text}");
    }
}

//! The drives that Ferrodrive knows, as the command line names them.

use canopen::NodeId;
pub(crate) use devices::{Description, MODELS, model as find};

/// The drives on the embedded virtual bus and their node-IDs: as delivered, but for the ZLIM42-C, whose 1 is the joint's.
pub(crate) const EMBEDDED: &[(&Description, u8)] =
    &[(&devices::zltech::ZLAC8030L, 4), (&devices::mjoint::M4230E17B50, 1), (&devices::zltech::ZLIM42C, 2)];

/// The names of all models, for messages.
pub(crate) fn names() -> String {
    MODELS.iter().map(|model| model.model).collect::<Vec<_>>().join(", ")
}

/// How the user says which of `models` a node is.
pub(crate) fn how_to_say(node: NodeId, models: &[&str]) -> String {
    let (first, others) = models.split_first().unwrap_or((&"MODEL", &[]));
    let others = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
    format!("--model {node}={first}{others}, or a machine file (--machine FILE)")
}

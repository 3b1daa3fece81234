//! The devices that Ferrodrive knows, as the command line names them.

use canopen::NodeId;
use sim::machine::models;

use crate::parse::suggest::{did_you_mean, near};

pub(crate) use devices::Description;

/// What a MODEL argument means: the name of a model.
pub(crate) fn resolve(text: &str) -> Result<&'static Description, String> {
    let known = || models().map(|model| model.name);
    models().find(|model| model.name.eq_ignore_ascii_case(text)).ok_or_else(|| {
        let near = near(text, known());
        format!("'{text}' is no model{}; expected one of: {}", did_you_mean(&near), names())
    })
}

/// The drives on the embedded virtual bus and their node-IDs: one of each kind that is delivered with a node-ID, at that
/// node-ID or the next one that is free.
pub(crate) fn embedded() -> Vec<(NodeId, &'static Description)> {
    let mut drives: Vec<(NodeId, &'static Description)> = Vec::new();
    for model in models() {
        let Some(delivered) = model.node_id.filter(|_| !drives.iter().any(|(_, other)| model.same_objects(other)))
        else {
            continue;
        };
        let free = |node: &NodeId| !drives.iter().any(|(taken, _)| taken == node);
        if let Some(node) = NodeId::all().skip_while(|node| *node < delivered).find(free) {
            drives.push((node, model));
        }
    }
    drives
}

/// The names of all models, for messages.
pub(crate) fn names() -> String {
    models().map(|model| model.name).collect::<Vec<_>>().join(", ")
}

/// How the user says which of `models` a node is.
pub(crate) fn how_to_say(node: NodeId, models: &[&str]) -> String {
    let (first, others) = models.split_first().unwrap_or((&"MODEL", &[]));
    let others = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
    format!("--model {node}={first}{others}, or a machine file (--machine FILE)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_bus_has_one_of_each_kind_at_different_nodes() {
        let drives: Vec<_> = embedded().into_iter().map(|(node, model)| (node.raw(), model.name)).collect();
        assert_eq!(drives, [(4, "zlac8030l"), (1, "m4230e17b50"), (2, "zlim42c")]);
    }
}

//! A drive to simulate, `MODEL@NODE`, and which model a node is, `NODE=MODEL`.

use canopen::NodeId;

use super::node::node;
use super::suggest::{did_you_mean, near};
use crate::models::{self, DriveProfile, MODELS};

/// A drive to put on a virtual bus.
#[derive(Clone, Copy)]
pub(crate) struct DriveSpec {
    /// Which drive.
    pub(crate) model: &'static DriveProfile,
    /// Its node-ID at the first start.
    pub(crate) node: NodeId,
}

/// `zlac8030l@4`.
pub(crate) fn drive_spec(text: &str) -> Result<DriveSpec, String> {
    let (name, number) =
        text.split_once('@').ok_or_else(|| format!("'{text}' is no drive; expected MODEL@NODE, e.g. zlac8030l@4"))?;
    Ok(DriveSpec { model: model(name)?, node: node(number)? })
}

/// `4=zlac8030l`.
pub(crate) fn node_model(text: &str) -> Result<(NodeId, &'static DriveProfile), String> {
    let (number, name) =
        text.split_once('=').ok_or_else(|| format!("'{text}' is incomplete; expected NODE=MODEL, e.g. 4=zlac8030l"))?;
    Ok((node(number)?, model(name)?))
}

/// `zlac8030l`.
pub(crate) fn model(name: &str) -> Result<&'static DriveProfile, String> {
    models::find(name).ok_or_else(|| {
        let near = near(name, MODELS.iter().map(|model| model.model));
        format!("'{name}' is no model{}; expected one of: {}", did_you_mean(&near), models::names())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_are_model_at_node() {
        let spec = drive_spec("zlac8030l@4").ok().unwrap();
        assert_eq!((spec.model.model, spec.node.raw()), ("zlac8030l", 4));
        assert_eq!(node_model("4=ZLAC8030L").ok().unwrap().1.model, "zlac8030l");
    }

    #[test]
    fn wrong_drives_say_what_is_known() {
        assert!(drive_spec("zlac8030@4").err().unwrap().contains("did you mean zlac8030l?"));
        assert!(drive_spec("zlac8030l").err().unwrap().contains("MODEL@NODE"));
        assert!(drive_spec("zlac8030l@128").err().unwrap().contains("1 to 127"));
        assert!(drive_spec("@4").err().unwrap().contains("zlac8030l"));
        assert!(node_model("zlac8030l").err().unwrap().contains("4=zlac8030l"));
    }
}

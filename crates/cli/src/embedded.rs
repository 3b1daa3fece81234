//! The embedded virtual bus and the drives on it.

use std::path::Path;
use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use master::Network;
use sim::{VirtualDrive, World};

use crate::failure::Failure;
use crate::models::DriveProfile;

/// Decides everything random on the embedded bus: runs are repeatable.
const SEED: u64 = 1;

/// Every drive boots well within a second.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// A world with drives, and which they are.
pub(crate) type Embedded = (World, Vec<(NodeId, &'static DriveProfile)>);

/// The world that `--bus sim` or `--bus sim:FILE.toml` means.
pub(crate) fn world(file: Option<&Path>) -> Result<Embedded, Failure> {
    if let Some(path) = file {
        return Err(Failure::usage(format!("machine files such as {} are not read yet", path.display())));
    }
    Ok((World::new(Bitrate::K500, SEED), Vec::new()))
}

/// A factory-fresh virtual drive of a model.
pub(crate) fn virtual_drive(
    model: &DriveProfile,
    node: NodeId,
    bitrate: Bitrate,
) -> Result<Box<dyn VirtualDrive>, Failure> {
    let _ = (node, bitrate);
    Err(Failure::new(format!("there is no virtual {} yet", model.model)))
}

/// Waits for the boot-up message of every drive.
pub(crate) async fn wait_until_booted(
    network: &Network,
    drives: &[(NodeId, &'static DriveProfile)],
) -> Result<(), Failure> {
    for (node, _) in drives {
        let booted = network.node(*node).wait(|node| node.facts.boot_up, BOOT_PATIENCE).await;
        booted.map_err(|_| Failure::new(format!("the virtual drive at node {node} did not boot")))?;
    }
    Ok(())
}

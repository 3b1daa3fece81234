//! The embedded virtual bus and the drives on it.

use std::time::Duration;

use can::Bitrate;
use canopen::NodeId;
use master::Network;
use sim::machine::Order;
use sim::{VirtualDrive, World};

use crate::failure::Failure;
use machine::file::SEED;
use words::models::{Description, embedded};

/// Every drive boots well within a second.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// After booting a drive looks at its supply, sensors and inputs for some tens of milliseconds before it judges them.
const SETTLING_TIME: Duration = Duration::from_millis(200);

/// A world with drives, and which they are.
pub(crate) type Embedded = (World, EmbeddedDrives);

/// The drives of such a world.
pub(crate) type EmbeddedDrives = Vec<(NodeId, &'static Description)>;

/// The world that `--bus sim` means: the drives of [`embedded`], factory-fresh but for node-ID and bit rate.
pub(crate) fn world() -> Result<Embedded, Failure> {
    let mut world = World::new(Bitrate::K500, SEED);
    let mut drives = Vec::new();
    for (node, model) in embedded() {
        let drive = ordered_drive(model, &Order::new(model, node, world.bitrate()))?;
        world.add_drive(node.raw(), drive).map_err(|error| Failure::new(error.to_string()).next(OWN_BUS))?;
        drives.push((node, model));
    }
    Ok((world, drives))
}

/// A virtual drive as it was ordered, without power.
pub(crate) fn ordered_drive(model: &'static Description, order: &Order) -> Result<Box<dyn VirtualDrive>, Failure> {
    sim::machine::order(model, order).map_err(|error| {
        let advice = format!("ferrodrive objects {} shows its objects and what they take", model.name);
        Failure::usage(error.to_string()).next(advice)
    })
}

/// What to do where the virtual bus of a command does not begin.
const OWN_BUS: &str = "name the drives in a machine file: --machine FILE.toml";

/// Waits until every drive has booted and looked about.
pub(crate) async fn wait_until_booted(
    network: &Network,
    drives: &[(NodeId, &'static Description)],
) -> Result<(), Failure> {
    if drives.is_empty() {
        return Ok(());
    }
    for (node, _) in drives {
        let booted = network.node(*node).wait(|node| node.facts.boot_up, BOOT_PATIENCE).await;
        booted.map_err(|_| {
            Failure::new(format!("the virtual drive at node {node} did not boot"))
                .of_kind("no_boot_up")
                .at_node(*node)
                .next("check that the machine file gives it power and the bit rate of the bus")
        })?;
    }
    network.sleep(SETTLING_TIME).await;
    Ok(())
}

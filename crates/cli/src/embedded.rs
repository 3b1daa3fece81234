//! The embedded virtual bus and the drives on it.

use std::path::Path;
use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use master::Network;
use sim::{VirtualDrive, World};

use crate::failure::Failure;
use crate::machine_file;
use crate::models::{DriveProfile, EMBEDDED};

/// Decides everything random on the embedded bus: runs are repeatable.
pub(crate) const SEED: u64 = 1;

/// Every drive boots well within a second.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// After booting a drive looks at its supply, sensors and inputs for some tens of milliseconds before it judges them.
const SETTLING_TIME: Duration = Duration::from_millis(200);

/// A world with drives, and which they are.
pub(crate) type Embedded = (World, Vec<(NodeId, &'static DriveProfile)>);

/// The world that `--bus sim` or `--bus sim:FILE.toml` means: the drives of [`EMBEDDED`], or what the file
/// says.
pub(crate) fn world(file: Option<&Path>) -> Result<Embedded, Failure> {
    if let Some(path) = file {
        return machine_file::load(path);
    }
    let mut world = World::new(Bitrate::K500, SEED);
    let mut drives = Vec::new();
    for (model, node) in EMBEDDED.iter().copied() {
        let node = NodeId::new(node).unwrap_or(NodeId::MIN);
        let drive = virtual_drive(model, node, world.bitrate())?;
        world.add_drive(node.raw(), drive).map_err(|error| Failure::new(error.to_string()))?;
        drives.push((node, model));
    }
    Ok((world, drives))
}

/// A factory-fresh virtual drive of a model, but for its node-ID and bit rate, without power.
pub(crate) fn virtual_drive(
    model: &DriveProfile,
    node: NodeId,
    bitrate: Bitrate,
) -> Result<Box<dyn VirtualDrive>, Failure> {
    match model.model {
        "zlac8030l" => Ok(Box::new(sim::machine::zlac8030l(node.raw(), baud_rate(model, ZLAC_BAUD_RATE, bitrate)?))),
        "zlim42c" => {
            let (node, rate) = (zlim_node(model, node)?, baud_rate(model, ZLIM_BAUD_RATE, bitrate)?);
            Ok(Box::new(sim::machine::zlim42c(node, rate)))
        }
        "zlim42c-82" => {
            let (node, rate) = (zlim_node(model, node)?, baud_rate(model, ZLIM_BAUD_RATE, bitrate)?);
            Ok(Box::new(sim::machine::zlim42c_82(node, rate)))
        }
        name => match drives::mjoint::Model::named(name) {
            Some(joint) => Ok(Box::new(sim::machine::mjoint(joint, node.raw(), bitrate))),
            None => Err(Failure::new(format!("there is no virtual {}", model.model))),
        },
    }
}

/// Bit rates of the ZL drives, by number.
const ZLAC_BAUD_RATE: Mux = Mux::new(0x200E, 0);
const ZLIM_BAUD_RATE: Mux = Mux::new(0x2009, 0);

/// A node-ID that a ZLIM42-C can have: 1 to 15 at its switches, 32 to 127 in 2008h.
fn zlim_node(model: &DriveProfile, node: NodeId) -> Result<u8, Failure> {
    match node.raw() {
        16..=31 => Err(Failure::usage(format!("a {} cannot be node {node}", model.model))
            .because("its switches have 1 to 15, and 2008h takes 32 to 127".to_owned())),
        node => Ok(node),
    }
}

/// The number that stands for a bit rate in a drive's object, by the words of the object's row.
fn baud_rate(model: &DriveProfile, object: Mux, bitrate: Bitrate) -> Result<u16, Failure> {
    let values = model.table.find(object).map_or(&[][..], |slot| model.table.row(slot).values);
    let words = format!("{} kbit/s", bitrate.bits_per_second() / 1000);
    let number =
        values.iter().find(|(_, meaning)| *meaning == words).and_then(|(number, _)| u16::try_from(*number).ok());
    number.ok_or_else(|| {
        let known = values.iter().map(|(_, meaning)| *meaning).collect::<Vec<_>>().join(", ");
        Failure::usage(format!("a {} cannot run at {bitrate}", model.model)).because(format!("{object} knows {known}"))
    })
}

/// Waits until every drive has booted and looked about.
pub(crate) async fn wait_until_booted(
    network: &Network,
    drives: &[(NodeId, &'static DriveProfile)],
) -> Result<(), Failure> {
    for (node, _) in drives {
        let booted = network.node(*node).wait(|node| node.facts.boot_up, BOOT_PATIENCE).await;
        booted.map_err(|_| Failure::new(format!("the virtual drive at node {node} did not boot")))?;
    }
    network.sleep(SETTLING_TIME).await;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bit_rate_that_the_drive_does_not_know_is_refused_with_those_it_knows() {
        assert_eq!(baud_rate(EMBEDDED[0].0, ZLAC_BAUD_RATE, Bitrate::K125).ok(), Some(3));
        let refusal = baud_rate(EMBEDDED[0].0, ZLAC_BAUD_RATE, Bitrate::K50).err().map(|failure| failure.to_string());
        assert!(refusal.is_some_and(|text| text.contains("cannot run at 50k") && text.contains("100 kbit/s")));
    }
}

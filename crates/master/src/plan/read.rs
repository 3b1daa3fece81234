//! What a node sends by itself, read from it.

use std::time::Duration;

use canopen::Mux;
use canopen::pdo::EventTrigger;
use devices::Timing;

use super::traffic::NodeTraffic;
use crate::drive::Drive;
use crate::error::Error;

/// In ms (CiA 301, 7.5.2.20).
const PRODUCER_HEARTBEAT_TIME: Mux = Mux::new(0x1017, 0);

impl NodeTraffic {
    /// Reads the heartbeat and the PDOs of a node; writes nothing. How fast it answers is what its model says.
    ///
    /// # Errors
    /// It does not answer. What it refuses it does not have.
    pub async fn of(drive: &Drive) -> Result<Self, Error> {
        let heartbeat = match drive.node().read::<u16>(PRODUCER_HEARTBEAT_TIME).await {
            Ok(ms) => Some(Duration::from_millis(ms.into())).filter(|time| !time.is_zero()),
            Err(Error::Aborted { .. }) => None,
            Err(error) => return Err(error),
        };
        let timing = drive.description().map_or(Timing::GUESSED, |model| model.timing);
        let event_trigger = drive.description().map_or(EventTrigger::Change, |model| model.pdo.event_trigger);
        let pdos = drive.pdos().await?;
        Ok(Self { node: drive.node().id(), pdos, in_cycle: None, event_trigger, heartbeat, timing })
    }
}

//! What a node sends on its own, read from it.

use std::time::Duration;

use canopen::CobId;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::pdo::{Direction, EventTrigger};
use cia402::ModeOfOperation;
use devices::{Description, Timing};

use super::open::CyclicError;
use crate::drive::Drive;
use crate::error::Error;
use crate::pdo::{PdoConfig, SignalError};
use crate::plan::NodeTraffic;

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
        let emcy = drive.description().is_none_or(Description::sends_emcy);
        let pdos = drive.pdos().await?;
        Ok(Self { node: drive.node().id(), pdos, in_cycle: None, event_trigger, heartbeat, emcy, timing })
    }

    /// The same once the drive is moved cycle by cycle in this mode: with the PDOs that [`Drive::configure_cyclic`] maps, or, if `position`,
    /// [`Drive::configure_cyclic_with_position`], as groups and bases do. A model with a fixed mapping has the RPDO with the set-point
    /// sent.
    ///
    /// # Errors
    /// The mode takes no set-point in cycles, or none of its RPDOs does.
    pub fn in_cycles(mut self, drive: &Drive, mode: ModeOfOperation, position: bool) -> Result<Self, CyclicError> {
        let target = drive.set_point_object(mode)?;
        let axes = drive.description().map_or(1, |model| model.axes.len());
        if let Some(mapped) = drive.pdos_of_cycle(mode, position)? {
            for (config, id) in &mut self.pdos {
                match mapped.iter().find(|mapped| mapped.pdo == config.pdo) {
                    Some(mapped) => {
                        *config = mapped.clone();
                        *id = CobId(id.0 & !CobId::INVALID);
                    }
                    None if config.pdo.direction == Direction::Tpdo && config.pdo.number.position() >= axes => {
                        *id = CobId(id.0 | CobId::INVALID);
                    }
                    None => {}
                }
            }
        }
        let carries = |(config, id): &&(PdoConfig, CobId)| {
            let is_rpdo = config.pdo.direction == Direction::Rpdo && id.is_valid();
            is_rpdo && config.map.0.iter().any(|record| record.mux == target)
        };
        // One that is acted upon with SYNC, if there is one, as the master takes it.
        let carriers = self.pdos.iter().filter(carries);
        let carrier = carriers.min_by_key(|(config, _)| !config.transmission.is_synchronous());
        self.in_cycle = carrier.map(|(config, _)| config.pdo.number);
        if self.in_cycle.is_some() {
            return Ok(self);
        }
        let rpdos = self.pdos.iter().filter(|(config, _)| config.pdo.direction == Direction::Rpdo);
        let carried = |config: &PdoConfig| config.map.0.iter().map(|record| record.mux).collect();
        let mapped = rpdos.map(|(config, _)| (config.pdo.number, carried(config))).collect();
        Err(SignalError::NotMapped { node: self.node, mux: target, direction: Direction::Rpdo, mapped }.into())
    }
}

//! What a node offers of its PDOs: setting them up, reading how they are set up, sending one.

use canopen::{AbortCode, CobId, Mux};

use super::config::{PdoConfig, TimerUnits};
use super::error::PdoError;
use super::former::FormerPdo;
use super::transaction::{apply, put_back, read, way_back};
use crate::core::RpdoTrigger;
use crate::error::Error;
use crate::network::Node;
use can::{CanId, Frame};
use canopen::pdo::{Direction, PdoId, PdoNumber};

impl Node {
    /// Has a PDO put back when the guard of the drive is given back, since it is going to be set up for a motion alone, with so many `objects`
    /// at most.
    ///
    /// # Errors
    /// [`PdoError`], before anything has changed.
    pub(crate) async fn note_former_pdo(
        &self,
        (config, cob_id): (PdoConfig, CobId),
        objects: u8,
        units: TimerUnits,
    ) -> Result<(), PdoError> {
        let before = way_back(self, (&config, cob_id), objects, units).await?;
        let was_used = self.uses_pdo(config.pdo);
        self.network().note_former_pdo(self.id(), FormerPdo { config, before, was_used });
        Ok(())
    }

    /// Whether a group or a base has set it up for its cycles, and will put it back ([`Network::put_back`](crate::Network::put_back)).
    pub fn is_to_put_back(&self, pdo: PdoId) -> bool {
        self.network().has_former_pdo(self.id(), pdo)
    }

    /// Puts it back.
    pub(crate) async fn put_back_pdo(&self, former: &FormerPdo) -> Result<(), Error> {
        // Not by the mapping of the motion any more, whatever becomes of it.
        self.forget_pdo(former.config.pdo);
        put_back(self, former).await?;
        if former.was_used {
            self.use_pdo(&former.config, former.before.cob_id);
        }
        Ok(())
    }

    fn forget_pdo(&self, pdo: PdoId) {
        self.network().with_core(|core| match pdo.direction {
            Direction::Tpdo => core.image_mut().remove_tpdo(self.id(), pdo.number),
            Direction::Rpdo => core.image_mut().remove_rpdo(self.id(), pdo.number),
        });
    }

    /// Sets up a PDO of the device and, when every value reads back right, sends or receives it by its mapping.
    ///
    /// # Errors
    /// [`PdoError`]; the device's PDO is then put back as it was, as far as it answers.
    pub async fn configure_pdo(&self, config: &PdoConfig, units: TimerUnits) -> Result<(), PdoError> {
        let cob_id = apply(self, config, units).await?;
        self.use_pdo(config, cob_id);
        Ok(())
    }

    /// Reads how a PDO of the device is set up and sends or receives it by that.
    ///
    /// # Errors
    /// Those of the SDO reads.
    pub async fn adopt_pdo(&self, pdo: PdoId, units: TimerUnits) -> Result<PdoConfig, Error> {
        let (config, cob_id) = read(self, pdo, units).await?;
        self.use_pdo(&config, cob_id);
        Ok(config)
    }

    /// Reads how a PDO of the device is set up, with its COB-ID, and changes nothing.
    ///
    /// # Errors
    /// Those of the SDO reads; [`Error::Aborted`] with the code of a missing object where the device has no such PDO.
    pub async fn pdo_config(&self, pdo: PdoId, units: TimerUnits) -> Result<(PdoConfig, CobId), Error> {
        read(self, pdo, units).await
    }

    /// Switches a PDO of the device off (bit 31 of its COB-ID), and sends or receives it no longer. A device that does not let
    /// its COB-ID be written goes on with it.
    ///
    /// # Errors
    /// Those of the SDO requests.
    pub async fn switch_pdo_off(&self, pdo: PdoId) -> Result<(), Error> {
        let object = Mux::new(pdo.parameter_index(), 1);
        let cob_id: u32 = self.read(object).await?;
        match self.write(object, cob_id | CobId::INVALID).await {
            Err(Error::Aborted { code: AbortCode::READ_ONLY, .. }) => return Ok(()),
            other => other?,
        }
        self.forget_pdo(pdo);
        Ok(())
    }

    /// Whether this master receives or sends a PDO as it was set up here: not once its mapping was written otherwise.
    pub fn uses_pdo(&self, pdo: PdoId) -> bool {
        self.network().look(|core| core.image().is_live(self.id(), pdo))
    }

    /// Receives or sends a PDO again whose mapping was written, and put back as it was.
    pub fn resume_pdo(&self, pdo: PdoId) {
        self.network().with_core(|core| core.image_mut().resume(self.id(), pdo));
    }

    fn use_pdo(&self, config: &PdoConfig, cob_id: CobId) {
        let (node, number, map) = (self.id(), config.pdo.number, config.map.clone());
        let id = cob_id.can_id().as_standard().filter(|_| cob_id.is_valid());
        self.network().with_core(|core| match (config.pdo.direction, id) {
            (Direction::Tpdo, Some(id)) => core.image_mut().set_tpdo(node, number, id, map),
            (Direction::Tpdo, None) => core.image_mut().remove_tpdo(node, number),
            (Direction::Rpdo, Some(id)) => {
                let synchronous = config.transmission.is_synchronous();
                let trigger = if synchronous { RpdoTrigger::Sync } else { RpdoTrigger::Write };
                core.image_mut().set_rpdo(node, number, id, map, trigger);
            }
            (Direction::Rpdo, None) => core.image_mut().remove_rpdo(node, number),
        });
    }

    /// Asks the device for a TPDO with a remote frame: what types 252 and 253 wait for. False if this master does not know the
    /// TPDO.
    pub fn request_tpdo(&self, number: PdoNumber) -> bool {
        let known = self.network().with_core(|core| core.image().tpdo_id(self.id(), number));
        if let Some((id, bytes)) = known {
            self.network().transmit(Frame::remote(CanId::standard(id), bytes as u8));
        }
        known.is_some()
    }

    /// Puts a value into the RPDOs that carry the object; false if none does. Sent by the PDO's transmission type.
    pub fn send_by_pdo(&self, mux: Mux, raw: u64) -> bool {
        self.network().with_core(|core| core.image_mut().write(self.id(), mux, raw))
    }
}

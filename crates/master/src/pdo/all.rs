//! All PDOs of a node, as they are set up.

use canopen::pdo::{Direction, PdoId, PdoNumber};
use canopen::{AbortCode, CobId, Mux};
use devices::Description;

use super::config::{PdoConfig, TimerUnits};
use crate::drive::Drive;
use crate::error::Error;

/// The PDOs of a node whose model is not known are asked for up to this one, and on until one is missing.
const ASKED_IN_ANY_CASE: u16 = 4;

impl Drive {
    /// How every PDO of the node is set up, TPDOs first: those of its model's table, else those that it has. Changes nothing.
    ///
    /// # Errors
    /// Those of the SDO reads; a PDO that is not there is not an error.
    pub async fn pdos(&self) -> Result<Vec<(PdoConfig, CobId)>, Error> {
        let units = self.description().map_or(TimerUnits::STANDARD, TimerUnits::of);
        let mut pdos = Vec::new();
        for direction in [Direction::Tpdo, Direction::Rpdo] {
            for number in (1..=PdoNumber::MAX).filter_map(PdoNumber::new) {
                let pdo = PdoId { direction, number };
                let has = |model: &Description| model.row(Mux::new(pdo.parameter_index(), 1)).is_some();
                if self.description().is_some_and(|model| !has(model)) {
                    continue;
                }
                match self.node().pdo_config(pdo, units).await {
                    Ok(config) => pdos.push(config),
                    Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT | AbortCode::NO_SUCH_SUB_INDEX, .. }) => {
                        if self.description().is_none() && number.number() >= ASKED_IN_ANY_CASE {
                            break;
                        }
                    }
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(pdos)
    }
}

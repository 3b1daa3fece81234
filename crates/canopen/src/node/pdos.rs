use super::identifiers::Identifiers;
use super::pdo_set::PdoSet;
use crate::od::{Storage, Table};
use crate::pdo::{Direction, PdoId, Rpdo, Tpdo};

/// The PDOs of a node.
#[derive(Clone)]
pub(super) struct Pdos<S: Storage> {
    pub(super) rpdos: S::Pdos<Rpdo>,
    pub(super) tpdos: S::Pdos<Tpdo>,
    /// The identifiers of the TPDOs, side by side.
    pub(super) tpdo_ids: S::Pdos<u32>,
    /// Active TPDOs that look at SYNC.
    pub(super) synchronous: PdoSet<S>,
    /// Active TPDOs that look at what the application changes.
    pub(super) watching: PdoSet<S>,
    /// RPDOs whose data waits for SYNC.
    pub(super) latched: PdoSet<S>,
    /// RPDOs whose last frame was too short.
    pub(super) short: PdoSet<S>,
}

impl<S: Storage> Pdos<S> {
    /// As many as the table has records for, none of them valid.
    pub(super) fn of(table: &Table) -> Self {
        let (rpdos, tpdos) = (count(table, Direction::Rpdo), count(table, Direction::Tpdo));
        Self {
            rpdos: S::pdos(rpdos, Rpdo::INVALID),
            tpdos: S::pdos(tpdos, Tpdo::INVALID),
            tpdo_ids: S::pdos(tpdos, Tpdo::INVALID.can_id().raw()),
            synchronous: PdoSet::none(tpdos),
            watching: PdoSet::none(tpdos),
            latched: PdoSet::none(rpdos),
            short: PdoSet::none(rpdos),
        }
    }

    /// Room for the identifiers of the RPDOs.
    pub(super) fn identifiers(&self) -> Identifiers<S> {
        Identifiers::none(self.rpdos.as_ref().len())
    }
}

/// How many PDOs a table has records for: the highest number of them.
fn count(table: &Table, direction: Direction) -> usize {
    let pdos = table.rows().iter().filter_map(|row| PdoId::of_object(row.index));
    pdos.filter(|(pdo, _)| pdo.direction == direction).map(|(pdo, _)| pdo.number.position() + 1).max().unwrap_or(0)
}

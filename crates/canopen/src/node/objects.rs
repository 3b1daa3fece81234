//! What a write to the communication objects (1000h to 1FFFh) must satisfy, and what it changes at once.

use super::identifiers::{Identifiers, Lane};
use super::{Node, NodeEvent, Via};
use crate::heartbeat;
use crate::od::{Slot, View};
use crate::pdo::PdoNumber;
use crate::pdo::parameter::{COB_ID, INHIBIT_TIME, TRANSMISSION_TYPE};
use crate::pdo::{
    Direction, Mapping, MappingRecord, Parameter, RPDO_MAPPING, RPDO_PARAMETER, Rpdo, TPDO_MAPPING, TPDO_PARAMETER,
    Tpdo, TransmissionType,
};
use crate::{AbortCode, CobId, Mux, connection_set};

/// A PDO record of a multiplexor.
#[derive(Clone, Copy)]
enum Record {
    Parameter(Direction, usize),
    Mapping(Direction, usize),
    Other,
}

impl Record {
    const fn of(index: u16) -> Self {
        let position = (index & 3) as usize;
        match index & !3 {
            RPDO_PARAMETER => Self::Parameter(Direction::Rpdo, position),
            RPDO_MAPPING => Self::Mapping(Direction::Rpdo, position),
            TPDO_PARAMETER => Self::Parameter(Direction::Tpdo, position),
            TPDO_MAPPING => Self::Mapping(Direction::Tpdo, position),
            _ => Self::Other,
        }
    }
}

impl<const N: usize> Node<N> {
    /// A peer's write: checks, stores, takes effect, is told to the owner.
    #[inline(always)]
    pub(super) fn write(&mut self, slot: Slot, raw: u32, via: Via) -> Result<(), AbortCode> {
        if self.dictionary.table().summary(slot).is_communication() {
            return self.write_communication(slot, raw, via);
        }
        let raw = self.dictionary.write(slot, raw)?;
        self.push(NodeEvent::Written { slot, raw, via });
        Ok(())
    }

    #[inline(never)]
    fn write_communication(&mut self, slot: Slot, raw: u32, via: Via) -> Result<(), AbortCode> {
        let row = self.dictionary.table().row(slot);
        let (mux, raw) = (row.mux(), raw & row.data_type.mask());
        self.dictionary.check_write(slot, raw)?;
        self.check_communication(mux, raw)?;
        self.dictionary.set_raw(slot, raw);
        self.take_up(mux);
        self.push(NodeEvent::Written { slot, raw, via });
        Ok(())
    }

    /// The device's own write to a communication object: unchecked, in effect at once, not told to the owner.
    pub fn write_own(&mut self, slot: Slot, raw: u32) {
        self.dictionary.set_raw(slot, raw);
        self.take_up(self.dictionary.table().row(slot).mux());
    }

    fn check_communication(&self, mux: Mux, raw: u32) -> Result<(), AbortCode> {
        let values = self.dictionary.view();
        match (mux.index, Record::of(mux.index)) {
            // A consumer of SYNC only: bit 30 would make it a producer.
            (0x1005, _) if raw & CobId::NO_RTR != 0 => Err(AbortCode::INVALID_VALUE),
            (0x1005, _) => CobId(raw & !CobId::INVALID).check_identifier(),
            (0x1014, _) => self.emcy_cob_id().check_change(CobId(raw), self.profile.pdo_changes_while_valid),
            (_, Record::Parameter(..)) => self.check_parameter(&values, mux, raw),
            (_, Record::Mapping(direction, _)) => self.check_mapping(&values, mux, raw, direction),
            _ => Ok(()),
        }
    }

    fn check_parameter(&self, values: &View<'_>, mux: Mux, raw: u32) -> Result<(), AbortCode> {
        let while_valid = self.profile.pdo_changes_while_valid;
        let parameter = Parameter::read(values, mux.index);
        match mux.sub_index {
            COB_ID => parameter.cob_id.check_change(CobId(raw), while_valid),
            TRANSMISSION_TYPE => TransmissionType::from_raw(raw as u8).map(|_| ()),
            INHIBIT_TIME if parameter.cob_id.is_valid() && !while_valid => Err(AbortCode::UNSUPPORTED_ACCESS),
            _ => Ok(()),
        }
    }

    /// Entries may be written while sub-index 00h is 0; sub-index 00h when all entries then in use fit.
    fn check_mapping(&self, values: &View<'_>, mux: Mux, raw: u32, direction: Direction) -> Result<(), AbortCode> {
        let parameter_index = mux.index - (RPDO_MAPPING - RPDO_PARAMETER);
        let is_valid = Parameter::read(values, parameter_index).cob_id.is_valid();
        if is_valid && !self.profile.pdo_changes_while_valid {
            return Err(AbortCode::UNSUPPORTED_ACCESS);
        }
        let rules = self.profile.mapping;
        if mux.sub_index == 0 {
            return Mapping::with_count(values, mux.index, direction, rules, raw as u8).map(|_| ());
        }
        if values.value(Mux::new(mux.index, 0)) != Ok(0) {
            return Err(AbortCode::UNSUPPORTED_ACCESS);
        }
        // 0 empties an entry; most devices do not count it in until something is there.
        if raw == 0 { Ok(()) } else { MappingRecord::from_raw(raw).resolve(values, direction, rules).map(|_| ()) }
    }

    /// A communication object was stored: it takes effect at once.
    fn take_up(&mut self, mux: Mux) {
        match (mux.index, Record::of(mux.index)) {
            (0x1005, _) => self.take_up_sync(),
            (0x1014 | 0x1015, _) => self.take_up_emcy(),
            (0x1017, _) => {
                self.heartbeat = heartbeat::Producer::from_write(self.heartbeat_period_ms(), self.now);
                self.offer_heartbeat();
            }
            (_, Record::Parameter(Direction::Rpdo, position) | Record::Mapping(Direction::Rpdo, position)) => {
                self.take_up_rpdo(position);
            }
            (_, Record::Parameter(Direction::Tpdo, position) | Record::Mapping(Direction::Tpdo, position)) => {
                let old = self.tpdos[position];
                self.take_up_tpdo(position);
                let tpdo = &mut self.tpdos[position];
                if self.state.allows_pdo() && tpdo.is_active() {
                    if old.is_active() { tpdo.take_over_from(&old, self.now) } else { tpdo.start(self.now) }
                }
            }
            _ => {}
        }
        self.reschedule();
    }

    /// All communication objects take effect.
    pub(super) fn take_up_objects(&mut self) {
        self.received = Identifiers::of_requests(self.node_id);
        self.take_up_sync();
        self.take_up_emcy();
        for position in 0..PdoNumber::PREDEFINED {
            self.take_up_rpdo(position);
            self.take_up_tpdo(position);
        }
    }

    pub(super) fn heartbeat_period_ms(&self) -> u16 {
        self.object(0x1017).unwrap_or(0) as u16
    }

    fn object(&self, index: u16) -> Option<u32> {
        self.dictionary.table().find(Mux::new(index, 0)).ok().map(|slot| self.dictionary.raw(slot))
    }

    fn take_up_sync(&mut self) {
        let cob_id = self.object(0x1005).map(CobId);
        self.received.set(Lane::SYNC, cob_id.and_then(|cob_id| cob_id.can_id().as_standard()));
    }

    /// 1014h, or what it would be by default on a device without it.
    fn emcy_cob_id(&self) -> CobId {
        self.object(0x1014).map_or(CobId(connection_set::emcy(self.node_id).raw()), CobId)
    }

    fn take_up_emcy(&mut self) {
        let cob_id = self.emcy_cob_id();
        self.emcy_id = (self.profile.emcy && cob_id.is_valid()).then(|| cob_id.can_id());
        self.emcy.set_inhibit_time(self.object(0x1015).unwrap_or(0) as u16);
    }

    fn take_up_rpdo(&mut self, position: usize) {
        let values = self.dictionary.view();
        let parameter = Parameter::read(&values, RPDO_PARAMETER + position as u16);
        let mapping = Mapping::read(&values, RPDO_MAPPING + position as u16, Direction::Rpdo, self.profile.mapping);
        // A mapping that does not resolve (a store of another firmware) maps nothing.
        let rpdo = Rpdo::configure(&parameter, mapping.unwrap_or(None));
        self.received.set(Lane::rpdo(position), rpdo.standard_id());
        self.latched_rpdos.set(position, false);
        self.rpdos[position] = rpdo;
    }

    fn take_up_tpdo(&mut self, position: usize) {
        let values = self.dictionary.view();
        let parameter = Parameter::read(&values, TPDO_PARAMETER + position as u16);
        let mapping = Mapping::read(&values, TPDO_MAPPING + position as u16, Direction::Tpdo, self.profile.mapping);
        let tpdo = Tpdo::configure(
            &parameter,
            mapping.unwrap_or(None),
            self.profile.event_trigger,
            self.profile.inhibit_unit_ns,
            self.profile.event_timer_unit_ns,
        );
        self.synchronous_tpdos.set(position, tpdo.is_active() && tpdo.is_synchronous());
        self.tpdos[position] = tpdo;
    }
}

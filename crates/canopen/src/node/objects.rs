//! What a write to the communication objects (1000h to 1FFFh) must satisfy, and what it changes at once.

use super::receive::number_at;
use super::{Node, NodeEvent, Via};
use crate::heartbeat;
use crate::object::{
    COB_ID_EMCY, COB_ID_TIME_STAMP_OBJECT, COMMUNICATION_CYCLE_PERIOD, INHIBIT_TIME_EMCY, PRODUCER_HEARTBEAT_TIME,
    SYNCHRONOUS_COUNTER_OVERFLOW_VALUE,
};
use crate::od::{Refusal, RowFacts, Slot, Storage, View};
use crate::pdo::parameter::{COB_ID, INHIBIT_TIME, SYNC_START_VALUE, TRANSMISSION_TYPE};
use crate::pdo::{
    AddressMode, Direction, Mapping, MappingRecord, Parameter, PdoId, RPDO_MAPPING, RPDO_PARAMETER, Rpdo, TPDO_MAPPING,
    TPDO_PARAMETER, Tpdo, TransmissionType,
};
use crate::{AbortCode, CobId, Mux, NmtState, connection_set, sdo, sync};

impl<S: Storage> Node<S> {
    /// A write of a server's client: checks, stores, takes effect, is reported to the owner, unless the owner is to be asked before.
    #[inline(always)]
    pub(super) fn write(&mut self, server: u8, slot: Slot, facts: &RowFacts, raw: u32) -> Result<(), Refusal> {
        if facts.summary.is_special() {
            return self.write_special(server, slot, raw);
        }
        let raw = self.dictionary.write_or_ask(slot, facts, raw)?;
        self.push(NodeEvent::Written { slot, raw, via: Via::Sdo });
        Ok(())
    }

    /// Of a communication object, or a value that is longer than a cell and waits in the dictionary.
    #[inline(never)]
    fn write_special(&mut self, server: u8, slot: Slot, raw: u32) -> Result<(), Refusal> {
        let table = self.dictionary.table();
        let (row, summary) = (table.row(slot), table.summary(slot));
        let raw = if summary.is_long() { raw } else { raw & row.data_type.mask() };
        let checked = if summary.is_long() {
            self.dictionary.check_staged(server, slot, raw as usize)
        } else {
            self.dictionary.check_or_ask(slot, raw)
        };
        match checked {
            Err(Refusal::Abort(code)) => return Err(code.into()),
            _ if summary.is_communication() => {
                if !(self.profile.acts_on)(row.mux()) && self.changes(server, slot, raw) {
                    return Err(AbortCode::INVALID_VALUE.into());
                }
                self.check_communication(row.mux(), raw)?;
            }
            _ => {}
        }
        checked?;
        self.commit(server, slot, raw);
        Ok(())
    }

    /// What a client wants to write is not what is there.
    fn changes(&self, server: u8, slot: Slot, raw: u32) -> bool {
        let values = self.dictionary.view();
        if values.table().summary(slot).is_long() {
            values.staged(server, raw as usize) != values.long_bytes(slot)
        } else {
            values.raw(slot) != raw
        }
    }

    /// A client's checked value is stored, takes effect and is reported to the owner.
    pub(super) fn commit(&mut self, server: u8, slot: Slot, raw: u32) {
        let table = self.dictionary.table();
        if table.summary(slot).is_long() {
            self.dictionary.store_staged(server, slot, raw as usize);
        } else {
            self.dictionary.set_raw(slot, raw);
        }
        if table.summary(slot).is_communication() {
            self.configure(table.row(slot).mux());
        }
        self.push(NodeEvent::Written { slot, raw: self.dictionary.raw(slot), via: Via::Sdo });
    }

    /// The device's own write to a communication object: unchecked, in effect at once, not reported to the owner.
    pub fn write_own(&mut self, slot: Slot, raw: u32) {
        self.dictionary.set_raw(slot, raw);
        self.configure(self.dictionary.table().row(slot).mux());
    }

    fn check_communication(&self, mux: Mux, raw: u32) -> Result<(), AbortCode> {
        let values = self.dictionary.view();
        match (mux.index, PdoId::of_object(mux.index)) {
            (0x1005, _) => self.check_sync_cob_id(CobId(raw)),
            (0x1019, _) => {
                let present = self.object(SYNCHRONOUS_COUNTER_OVERFLOW_VALUE).unwrap_or(0) as u8;
                let period_us = self.object(COMMUNICATION_CYCLE_PERIOD).unwrap_or(0);
                sync::check_overflow(present, raw as u8, period_us)
            }
            (0x1012, _) => self.check_time_cob_id(CobId(raw)),
            (0x1028, _) if mux.sub_index > 0 => {
                CobId(self.object(mux).unwrap_or(CobId::INVALID)).check_change(CobId(raw), false)
            }
            (0x1201..=0x12FF, _) => sdo::parameter::check(&values, mux, raw),
            (0x1016, _) if mux.sub_index > 0 => heartbeat::check_watched_once(&values, mux, raw),
            (0x1014, _) => self.emcy_cob_id().check_change(CobId(raw), self.profile.pdo_changes_while_valid),
            (_, Some((pdo, false))) => self.check_parameter(&values, mux, raw, pdo),
            (_, Some((pdo, true))) => self.check_mapping(&values, mux, raw, pdo),
            _ => Ok(()),
        }
    }

    /// 1012h: the identifier stays while TIME is consumed (bit 31) or generated (CiA 301, 7.5.2.15).
    fn check_time_cob_id(&self, new: CobId) -> Result<(), AbortCode> {
        CobId(new.0 & !CobId::INVALID).check_identifier()?;
        let present = CobId(self.object(COB_ID_TIME_STAMP_OBJECT).unwrap_or(0));
        let in_use = present.consumes() || present.generates();
        if in_use && present.can_id() != new.can_id() { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
    }

    fn check_parameter(&self, values: &View<'_>, mux: Mux, raw: u32, pdo: PdoId) -> Result<(), AbortCode> {
        let direction = pdo.direction;
        let while_valid = self.profile.pdo_changes_while_valid;
        let parameter = Parameter::read(values, mux.index);
        match mux.sub_index {
            COB_ID => {
                parameter.cob_id.check_change(CobId(raw), while_valid)?;
                let becomes_valid = CobId(raw).is_valid() && !parameter.cob_id.is_valid();
                if becomes_valid { self.check_multiplexed(pdo, parameter.transmission_type) } else { Ok(()) }
            }
            TRANSMISSION_TYPE => {
                let may_be_remote =
                    direction == Direction::Tpdo && self.profile.remote_requests && parameter.cob_id.allows_rtr();
                let wanted = TransmissionType::from_raw(raw as u8)?;
                if wanted.is_remote() && !may_be_remote {
                    return Err(AbortCode::INVALID_VALUE);
                }
                if parameter.cob_id.is_valid() { self.check_multiplexed(pdo, wanted) } else { Ok(()) }
            }
            SYNC_START_VALUE if direction == Direction::Tpdo && raw > u32::from(sync::MAX_COUNTER) => {
                Err(AbortCode::INVALID_VALUE)
            }
            INHIBIT_TIME | SYNC_START_VALUE if parameter.cob_id.is_valid() && !while_valid => {
                Err(AbortCode::UNSUPPORTED_ACCESS)
            }
            _ => Ok(()),
        }
    }

    /// A valid TPDO that is multiplexed is sent by events alone (CiA 301, 7.2.3).
    fn check_multiplexed(&self, pdo: PdoId, wanted: TransmissionType) -> Result<(), AbortCode> {
        let is_multiplexed = pdo.direction == Direction::Tpdo && self.address_mode(pdo.mapping_index()).is_some();
        if is_multiplexed && !wanted.is_event_driven() { Err(AbortCode::INVALID_VALUE) } else { Ok(()) }
    }

    /// Entries may be written while sub-index 00h is 0; sub-index 00h when all entries then in use fit.
    fn check_mapping(&self, values: &View<'_>, mux: Mux, raw: u32, pdo: PdoId) -> Result<(), AbortCode> {
        let is_valid = Parameter::read(values, pdo.parameter_index()).cob_id.is_valid();
        if is_valid && !self.profile.pdo_changes_while_valid {
            return Err(AbortCode::UNSUPPORTED_ACCESS);
        }
        let (direction, rules) = (pdo.direction, self.profile.mapping);
        if mux.sub_index == 0 {
            return Mapping::with_count(&self.dictionary, mux.index, direction, rules, raw as u8).map(|_| ());
        }
        if values.value(Mux::new(mux.index, 0)) != Ok(0) {
            return Err(AbortCode::UNSUPPORTED_ACCESS);
        }
        // 0 empties an entry; most devices do not count it in until something is there.
        if raw == 0 { Ok(()) } else { MappingRecord::from_raw(raw).resolve(values, direction, rules).map(|_| ()) }
    }

    /// A communication object was stored: it takes effect at once.
    fn configure(&mut self, mux: Mux) {
        match (mux.index, PdoId::of_object(mux.index)) {
            (0x1005 | 0x1006 | 0x1019, _) => {
                self.configure_sync();
                self.listen();
            }
            (0x1007, _) => self.configure_window(),
            (0x1201..=0x127F, _) => {
                self.configure_channels();
                self.listen();
            }
            (0x1014 | 0x1015, _) => self.configure_emcy(),
            (0x1017, _) => {
                self.heartbeat = heartbeat::Producer::from_write(self.heartbeat_period_ms(), self.now);
                self.offer_heartbeat();
            }
            (_, Some((PdoId { direction: Direction::Rpdo, number }, _))) => {
                self.configure_rpdo(number.position());
                self.listen();
            }
            (_, Some((PdoId { direction: Direction::Tpdo, number }, _))) => {
                let position = number.position();
                let old = self.pdos.tpdos.as_ref()[position];
                self.configure_tpdo(position);
                self.configure_window();
                let tpdo = &mut self.pdos.tpdos.as_mut()[position];
                if self.state.allows_pdo() && tpdo.is_active() {
                    if old.is_active() { tpdo.take_over_from(&old, self.now) } else { tpdo.start(self.now) }
                }
            }
            _ => {}
        }
        self.reschedule();
    }

    /// All communication objects take effect.
    pub(super) fn configure_objects(&mut self) {
        self.configure_sync();
        self.configure_emcy();
        for position in 0..self.pdos.rpdos.as_ref().len() {
            self.configure_rpdo(position);
        }
        for position in 0..self.pdos.tpdos.as_ref().len() {
            self.configure_tpdo(position);
        }
        self.configure_window();
        self.configure_channels();
        self.received.listen(self.node_id);
        self.listen_to_channels();
    }

    pub(super) fn heartbeat_period_ms(&self) -> u16 {
        self.object(PRODUCER_HEARTBEAT_TIME).unwrap_or(0) as u16
    }

    pub(super) fn object(&self, mux: Mux) -> Option<u32> {
        self.dictionary.table().find(mux).ok().map(|slot| self.dictionary.raw(slot))
    }

    /// Identifiers have changed. A node that is down stays deaf.
    fn listen(&mut self) {
        if self.state != NmtState::Initialising {
            self.received.listen(self.node_id);
            self.listen_to_channels();
        }
    }

    /// 1014h, or what it would be by default on a device without it.
    fn emcy_cob_id(&self) -> CobId {
        self.object(COB_ID_EMCY).map_or(CobId(connection_set::emcy(self.node_id).raw()), CobId)
    }

    fn configure_emcy(&mut self) {
        let cob_id = self.emcy_cob_id();
        self.emcy_id = (self.profile.emcy && cob_id.is_valid()).then(|| cob_id.can_id());
        self.emcy.set_inhibit_time(self.object(INHIBIT_TIME_EMCY).unwrap_or(0) as u16);
    }

    /// Of a multiplexed PDO.
    fn address_mode(&self, mapping: u16) -> Option<AddressMode> {
        self.profile.mapping.address_mode(self.object(Mux::new(mapping, 0))? as u8)
    }

    fn configure_rpdo(&mut self, position: usize) {
        let values = self.dictionary.view();
        let parameter = Parameter::read(&values, RPDO_PARAMETER + position as u16);
        let mapping =
            Mapping::read(&self.dictionary, RPDO_MAPPING + position as u16, Direction::Rpdo, self.profile.mapping);
        // A mapping that does not resolve (a store of another firmware) maps nothing.
        let multiplexed = self.address_mode(RPDO_MAPPING + position as u16);
        let timer_unit_ns = if self.profile.rpdo_deadline { self.profile.event_timer_unit_ns } else { 0 };
        let rpdo = Rpdo::configure(&parameter, mapping.unwrap_or(None), multiplexed, timer_unit_ns);
        if self.pdos.rpdos.as_ref()[position].is_late() {
            self.push(NodeEvent::RpdoInTime(number_at(position)));
        }
        self.received.set_rpdo(position, rpdo.standard_id());
        self.pdos.latched.set(position, false);
        self.pdos.rpdos.as_mut()[position] = rpdo;
    }

    fn configure_tpdo(&mut self, position: usize) {
        let values = self.dictionary.view();
        let parameter = Parameter::read(&values, TPDO_PARAMETER + position as u16);
        let mapping =
            Mapping::read(&self.dictionary, TPDO_MAPPING + position as u16, Direction::Tpdo, self.profile.mapping);
        let tpdo = Tpdo::configure(
            &parameter,
            mapping.unwrap_or(None),
            self.address_mode(TPDO_MAPPING + position as u16),
            self.profile.event_trigger,
            self.profile.inhibit_unit_ns,
            self.profile.event_timer_unit_ns,
        );
        self.pdos.synchronous.set(position, tpdo.is_active() && tpdo.is_synchronous());
        self.pdos.watching.set(position, tpdo.watches());
        self.pdos.tpdo_ids.as_mut()[position] = tpdo.can_id().raw();
        self.pdos.tpdos.as_mut()[position] = tpdo;
    }
}

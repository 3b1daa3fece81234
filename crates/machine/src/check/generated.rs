//! What Lely's `dcfgen` makes of a node of a `bus.yml`: the writes of its concise DCF (1F22h), in their order. It compares with the
//! data sheet, not with the device: what the sheet has already is not written.

use canopen::object::{GUARD_TIME, PRODUCER_HEARTBEAT_TIME};
use canopen::{Mux, NodeId};
use master::boot::Assignment;

use super::bus_yml::{Bus, Pdo, PdoId, Slave};
use super::device::Device;
use super::finding::Place;

/// A value that the master writes, and where the file asks for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planned {
    /// The object.
    pub object: Mux,
    /// Its value, lowest byte first.
    pub bytes: Vec<u8>,
    /// Where in the file.
    pub at: Place,
}

/// `cob_id: auto` from PDO 5 on: the next of these, for all nodes together.
const FIRST_FREE_COB_ID: i128 = 0x680;
const LAST_FREE_COB_ID: i128 = 0x6DF;

/// Bit 31 of a COB-ID: the PDO is switched off.
const OFF: i128 = 0x8000_0000;

/// The writes of all nodes, which share the free identifiers.
pub(super) struct Generator<'a> {
    bus: &'a Bus,
    next_cob_id: i128,
}

impl<'a> Generator<'a> {
    pub(super) const fn new(bus: &'a Bus) -> Self {
        Self { bus, next_cob_id: FIRST_FREE_COB_ID }
    }

    /// The writes to one node. An object that its sheet does not have is left out: the generator refuses the file for it, which is
    /// reported elsewhere.
    pub(super) fn writes(&mut self, slave: &Slave, device: &Device) -> Vec<Planned> {
        let Some(node) = slave.node() else { return Vec::new() };
        let mut writes = Writes { device, node, all: Vec::new() };
        self.host_watch(slave, &mut writes);
        if let Some(time) = &slave.heartbeat_producer_ms {
            writes.change(PRODUCER_HEARTBEAT_TIME, time.value.into(), time.at);
        }
        if let Some(time) = &slave.guard_time {
            writes.change(GUARD_TIME, time.value.into(), time.at);
        }
        for pdo in slave.pdos.iter().filter(|pdo| !pdo.is_transmit) {
            self.pdo(pdo, &mut writes);
        }
        for pdo in slave.pdos.iter().filter(|pdo| pdo.is_transmit) {
            self.pdo(pdo, &mut writes);
        }
        for write in &slave.sdo {
            writes.write(Mux::new(write.index, write.sub_index), write.value.into(), write.at);
        }
        writes.all
    }

    /// 1016h: the master's heartbeat in the entry that it has, or in a free one; else such an entry is switched off.
    fn host_watch(&self, slave: &Slave, writes: &mut Writes<'_>) {
        let master = &self.bus.master;
        let Some(own) = master.node_id.as_ref().map(|id| i128::from(id.value)) else { return };
        let entries: Vec<(u8, i128)> = (1..=127)
            .map_while(|sub_index| Some((sub_index, writes.device.value(Mux::new(0x1016, sub_index), None)?)))
            .collect();
        let watches = entries.iter().find(|(_, entry)| entry >> 16 & 0xFF == own);
        let period = master.heartbeat_producer_ms.as_ref().map_or(0, |time| time.value);
        let time = (period as f64 * master.heartbeat_multiplier) as i128;
        let consumes = slave.heartbeat_consumer.as_ref().filter(|said| said.value);
        match consumes {
            Some(said) if time > 0 => {
                let is_free = |entry: i128| entry & 0xFFFF == 0 || !(1..=127).contains(&(entry >> 16 & 0xFF));
                let entry = watches.or_else(|| entries.iter().find(|(_, entry)| is_free(*entry)));
                if let Some((sub_index, _)) = entry {
                    writes.write(Mux::new(0x1016, *sub_index), own << 16 | time & 0xFFFF, said.at);
                }
            }
            _ => {
                let at = slave.heartbeat_consumer.as_ref().map_or(slave.at, |said| said.at);
                if let Some((sub_index, _)) = watches.filter(|(_, entry)| entry & 0xFFFF != 0) {
                    writes.write(Mux::new(0x1016, *sub_index), own << 16, at);
                }
            }
        }
    }

    fn pdo(&mut self, pdo: &Pdo, writes: &mut Writes<'_>) {
        let parameter = (if pdo.is_transmit { 0x1800 } else { 0x1400 }) + pdo.number - 1;
        let object = |sub_index| Mux::new(parameter, sub_index);
        let Some(of_sheet) = writes.value(object(1)) else { return };
        let id = match pdo.cob_id {
            None => of_sheet,
            Some(PdoId::Value(id)) => id.into(),
            Some(PdoId::Auto) if pdo.number <= 4 => {
                let base = if pdo.is_transmit { 0x80 } else { 0x100 };
                i128::from(pdo.number) * 0x100 + base + i128::from(writes.node.raw())
            }
            Some(PdoId::Auto) => {
                let id = self.next_cob_id.min(LAST_FREE_COB_ID);
                self.next_cob_id += 1;
                id
            }
        };
        if of_sheet != id | OFF {
            writes.write(object(1), id | OFF, pdo.at);
        }
        // One that stays off gets no more.
        if id & OFF != 0 {
            return;
        }
        let of_tpdo = |value: Option<i64>| value.filter(|_| pdo.is_transmit);
        let parameters = [
            (2, pdo.transmission),
            (3, of_tpdo(pdo.inhibit_time)),
            (5, of_tpdo(pdo.event_timer)),
            (6, of_tpdo(pdo.sync_start)),
        ];
        for (sub_index, value) in parameters {
            if let Some(value) = value {
                writes.change(object(sub_index), value.into(), pdo.at);
            }
        }
        if let Some(mapping) = &pdo.mapping {
            let record = |sub_index| Mux::new(parameter + 0x200, sub_index);
            writes.write(record(0), 0, pdo.at);
            let bits = |(index, sub_index): (u16, u8)| {
                writes.device.eds.variable(index, sub_index).and_then(|variable| variable.data_type.bits())
            };
            let entries: Vec<i128> = mapping
                .iter()
                .filter_map(|place| {
                    Some(i128::from(place.0) << 16 | i128::from(place.1) << 8 | i128::from(bits(*place)?))
                })
                .collect();
            for (sub_index, entry) in (1..=64).zip(&entries) {
                writes.write(record(sub_index), *entry, pdo.at);
            }
            if !entries.is_empty() {
                writes.write(record(0), entries.len() as i128, pdo.at);
            }
        }
        if pdo.enabled != Some(false) {
            writes.write(object(1), id, pdo.at);
        }
    }
}

/// The writes to one node.
struct Writes<'a> {
    device: &'a Device,
    node: NodeId,
    all: Vec<Planned>,
}

impl Writes<'_> {
    fn value(&self, object: Mux) -> Option<i128> {
        self.device.value(object, Some(self.node))
    }

    /// Written unless the sheet has it so.
    fn change(&mut self, object: Mux, value: i128, at: Place) {
        if self.value(object) != Some(value) {
            self.write(object, value, at);
        }
    }

    fn write(&mut self, object: Mux, value: i128, at: Place) {
        let variable = self.device.eds.variable(object.index, object.sub_index);
        let Some(bits) = variable.and_then(|variable| variable.data_type.bits()) else { return };
        let size = usize::from(bits.div_ceil(8));
        self.all.push(Planned { object, bytes: value.to_le_bytes()[..size.min(16)].to_vec(), at });
    }
}

/// 1F81h as the generator writes it.
pub(super) fn assignment(slave: &Slave) -> Assignment {
    let verified = if slave.software_version.unwrap_or(0) != 0 { Assignment::VERIFY_SOFTWARE } else { 0 };
    let restored = if slave.restore_configuration != 0 { Assignment::RESTORE } else { 0 };
    Assignment(slave.assignment.0 | verified | restored)
}

use core::fmt;
use std::collections::BTreeMap;

use can::Frame;
use canopen::connection_set;
use canopen::od::{DefaultValue, Table};
use canopen::pdo::{Direction, PdoNumber};
use canopen::{CobId, Mux, NodeId};

use super::models::Models;
use super::value::Value;
use crate::core::{MappedObject, PdoMap, bits_of};
use crate::identify::Model;

/// A PDO frame split into its objects.
#[derive(Clone, Debug)]
pub struct Pdo {
    /// The device that receives or sends it.
    pub node: NodeId,
    /// RPDO or TPDO.
    pub direction: Direction,
    /// Counted from 0, as the objects 1400h and 1800h are.
    pub number: u16,
    /// Every mapped object that the frame is long enough for, with its bits.
    pub fields: Vec<(MappedObject, u64)>,
    /// The frame's bytes.
    pub bytes: Vec<u8>,
    /// Bytes that the mapping asks for; `None` if the mapping is not known.
    pub mapped_bytes: Option<usize>,
    model: Option<Model>,
}

impl Pdo {
    pub(super) fn unmapped(node: NodeId, direction: Direction, number: u16, frame: &Frame) -> Self {
        let bytes = frame.data().to_vec();
        Self { node, direction, number, fields: Vec::new(), bytes, mapped_bytes: None, model: None }
    }
}

impl fmt::Display for Pdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{} node {}:", self.direction, self.number, self.node)?;
        let model = self.model.map(|model| model.0);
        for (position, (object, raw)) in self.fields.iter().enumerate() {
            f.write_str(if position == 0 { " " } else { ", " })?;
            let bytes = raw.to_le_bytes();
            let length = usize::from(object.bits).div_ceil(8).min(bytes.len());
            write!(f, "{}", Value::new(object.mux, &bytes[..length], model))?;
        }
        match self.mapped_bytes {
            None => {
                self.bytes.iter().try_for_each(|byte| write!(f, " {byte:02X}"))?;
                f.write_str(" (mapping not known)")
            }
            Some(mapped) if mapped > self.bytes.len() => {
                write!(f, " (too short: {} of {mapped} bytes, the receiver ignores it)", self.bytes.len())
            }
            Some(0) => f.write_str(" nothing mapped"),
            Some(_) => Ok(()),
        }
    }
}

type Key = (u8, Direction, u16);

/// What is known of all PDOs on the bus.
#[derive(Clone, Debug, Default)]
pub(super) struct PdoBook {
    pdos: BTreeMap<Key, Known>,
    /// Valid PDOs with a known mapping by identifier.
    by_id: BTreeMap<u16, (Key, PdoMap)>,
}

/// What is known of one PDO.
#[derive(Clone, Debug, Default)]
struct Known {
    cob_id: Option<u32>,
    count: Option<u8>,
    records: BTreeMap<u8, u32>,
}

impl Known {
    /// The mapping, when the count and every counted record are known.
    fn map(&self) -> Option<PdoMap> {
        let records = (1..=self.count?).map(|sub| self.records.get(&sub).copied().map(MappedObject::from_record));
        records.collect::<Option<Vec<_>>>().map(PdoMap)
    }

    fn id(&self, (node, direction, number): Key) -> Option<u16> {
        match self.cob_id {
            Some(raw) if !CobId(raw).is_valid() || CobId(raw).is_extended() => None,
            Some(raw) => CobId(raw).can_id().as_standard(),
            None => predefined_id(NodeId::new(node)?, direction, number),
        }
    }
}

fn predefined_id(node: NodeId, direction: Direction, number: u16) -> Option<u16> {
    let number = PdoNumber::at(number.into())?;
    let id = match direction {
        Direction::Rpdo => connection_set::rpdo(number, node),
        Direction::Tpdo => connection_set::tpdo(number, node),
    };
    id?.as_standard()
}

impl PdoBook {
    pub(super) fn set(&mut self, node: NodeId, direction: Direction, number: u16, id: u16, map: &PdoMap) {
        let records = map.0.iter().enumerate().map(|(at, object)| (at as u8 + 1, object.to_record())).collect();
        let known = Known { cob_id: Some(u32::from(id)), count: Some(map.0.len() as u8), records };
        self.pdos.insert((node.raw(), direction, number), known);
        self.index();
    }

    /// Takes the factory values of a model's table.
    pub(super) fn load_defaults(&mut self, node: NodeId, table: &Table) {
        for row in table.rows() {
            let raw = match row.default {
                DefaultValue::Value(value) => row.data_type.raw(value),
                DefaultValue::NodeIdPlus(base) => base + u32::from(node.raw()),
                _ => continue,
            };
            self.note(node, row.mux(), raw);
        }
        self.index();
    }

    /// A value is known to be in the device.
    pub(super) fn learn(&mut self, node: NodeId, mux: Mux, bytes: &[u8]) {
        let mut cell = [0; 4];
        let Some(low) = cell.get_mut(..bytes.len()) else { return };
        low.copy_from_slice(bytes);
        if self.note(node, mux, u32::from_le_bytes(cell)) {
            self.index();
        }
    }

    pub(super) fn decode(&self, frame: &Frame, models: &Models) -> Option<Pdo> {
        let ((node, direction, number), map) = self.by_id.get(&frame.standard_data_id()?)?;
        let node = NodeId::new(*node)?;
        let data = u64::from_le_bytes(*frame.padded());
        let length = frame.data().len() as u32 * 8;
        let fields = map.fields().take_while(|(_, bits)| bits.end <= length);
        Some(Pdo {
            node,
            direction: *direction,
            number: *number,
            fields: fields.map(|(object, bits)| (object, bits_of(data, bits))).collect(),
            bytes: frame.data().to_vec(),
            mapped_bytes: Some(map.bytes()),
            model: models.get(node),
        })
    }

    /// True if the object says something about a PDO.
    fn note(&mut self, node: NodeId, mux: Mux, raw: u32) -> bool {
        let (direction, number, is_mapping) = match mux.index {
            0x1400..=0x15FF => (Direction::Rpdo, mux.index - 0x1400, false),
            0x1600..=0x17FF => (Direction::Rpdo, mux.index - 0x1600, true),
            0x1800..=0x19FF => (Direction::Tpdo, mux.index - 0x1800, false),
            0x1A00..=0x1BFF => (Direction::Tpdo, mux.index - 0x1A00, true),
            _ => return false,
        };
        let known = self.pdos.entry((node.raw(), direction, number)).or_default();
        match (is_mapping, mux.sub_index) {
            (false, 1) => known.cob_id = Some(raw),
            (false, _) => return false,
            (true, 0) => known.count = Some(raw as u8),
            (true, sub) => {
                known.records.insert(sub, raw);
            }
        }
        true
    }

    fn index(&mut self) {
        let valid = self.pdos.iter().filter_map(|(key, known)| Some((known.id(*key)?, (*key, known.map()?))));
        self.by_id = valid.collect();
    }
}

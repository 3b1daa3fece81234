use core::fmt;
use std::collections::BTreeMap;

use can::Frame;
use canopen::connection_set;
use canopen::od::{DefaultValue, Table};
use canopen::pdo::{Direction, PdoId};
use canopen::{CobId, Mux, NodeId};
use devices::Description;

use super::node_models::NodeModels;
use super::value::Value;
use crate::core::{PdoMap, bits_of};
use crate::identify::Model;
use canopen::pdo::MappingRecord;

/// A PDO frame split into its objects.
#[derive(Clone, Debug)]
pub struct Pdo {
    /// The device that receives or sends it.
    pub node: NodeId,
    /// Which one.
    pub pdo: PdoId,
    /// Every mapped object that the frame is long enough for, with its bits.
    pub fields: Vec<(MappingRecord, u64)>,
    /// The frame's bytes.
    pub bytes: Vec<u8>,
    /// Bytes that the mapping asks for; `None` if the mapping is not known.
    pub mapped_bytes: Option<usize>,
    pub(super) model: Option<Model>,
}

impl Pdo {
    /// The model of the node, as far as it is known.
    pub fn model(&self) -> Option<&'static Description> {
        self.model.map(|model| model.0)
    }

    pub(super) fn unmapped(node: NodeId, pdo: PdoId, model: Option<Model>, frame: &Frame) -> Self {
        let bytes = frame.data().to_vec();
        Self { node, pdo, fields: Vec::new(), bytes, mapped_bytes: None, model }
    }
}

/// `TPDO1`, and what a manual that counts otherwise calls it: `TPDO1 (in the manual TPDO0)`.
fn pdo_name(pdo: PdoId, model: Option<&Description>) -> String {
    let PdoId { direction, number } = pdo;
    match model.map(|model| model.pdo.first_in_manual) {
        None | Some(1) => pdo.to_string(),
        Some(first) => format!("{pdo} (in the manual {direction}{})", number.position() + usize::from(first)),
    }
}

impl fmt::Display for Pdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.map(|model| model.0);
        write!(f, "{} node {}:", pdo_name(self.pdo, model), self.node)?;
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

type Key = (u8, PdoId);

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
        let records = (1..=self.count?).map(|sub| self.records.get(&sub).copied().map(MappingRecord::from_raw));
        records.collect::<Option<Vec<_>>>().map(PdoMap)
    }

    fn id(&self, (node, pdo): Key) -> Option<u16> {
        match self.cob_id {
            Some(raw) if !CobId(raw).is_valid() || CobId(raw).is_extended() => None,
            Some(raw) => CobId(raw).can_id().as_standard(),
            None => predefined_id(NodeId::new(node)?, pdo),
        }
    }
}

fn predefined_id(node: NodeId, PdoId { direction, number }: PdoId) -> Option<u16> {
    let id = match direction {
        Direction::Rpdo => connection_set::rpdo(number, node),
        Direction::Tpdo => connection_set::tpdo(number, node),
    };
    id?.as_standard()
}

impl PdoBook {
    pub(super) fn set(&mut self, node: NodeId, pdo: PdoId, id: u16, map: &PdoMap) {
        let records = map.0.iter().enumerate().map(|(at, object)| (at as u8 + 1, object.raw())).collect();
        let known = Known { cob_id: Some(u32::from(id)), count: Some(map.0.len() as u8), records };
        self.pdos.insert((node.raw(), pdo), known);
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

    /// Identifiers of the PDOs of a node whose mapping is known.
    pub(super) fn ids_of(&self, node: NodeId) -> impl Iterator<Item = u16> + '_ {
        let of_node = self.by_id.iter().filter(move |(_, ((owner, _), _))| *owner == node.raw());
        of_node.map(|(id, _)| *id)
    }

    pub(super) fn decode(&self, frame: &Frame, models: &NodeModels) -> Option<Pdo> {
        let ((node, pdo), map) = self.by_id.get(&frame.standard_data_id()?)?;
        let node = NodeId::new(*node)?;
        let data = u64::from_le_bytes(*frame.padded());
        let length = frame.data().len() as u32 * 8;
        let fields = map.fields().take_while(|(_, bits)| bits.end <= length);
        Some(Pdo {
            node,
            pdo: *pdo,
            fields: fields.map(|(object, bits)| (object, bits_of(data, bits))).collect(),
            bytes: frame.data().to_vec(),
            mapped_bytes: Some(map.bytes()),
            model: models.get(node),
        })
    }

    /// True if the object describes a PDO.
    fn note(&mut self, node: NodeId, mux: Mux, raw: u32) -> bool {
        let Some((pdo, is_mapping)) = PdoId::of_object(mux.index) else { return false };
        let known = self.pdos.entry((node.raw(), pdo)).or_default();
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

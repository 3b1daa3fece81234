use core::fmt;
use std::collections::BTreeMap;

use can::Frame;
use canopen::connection_set;
use canopen::od::{DataType, DefaultValue, Table};
use canopen::pdo::multiplex::MAX_SIZE;
use canopen::pdo::{AddressMode, Direction, MappingRecord, Mpdo, PdoId};
use canopen::{CobId, Mux, NodeId};
use devices::Description;

use super::common::standard_row;
use super::node_models::NodeModels;
use super::value::DecodedValue;
use crate::core::{PdoMap, bits_of};
use crate::identify::Model;
use crate::pdo::PdoConfig;

/// A PDO frame split into its objects.
#[derive(Clone, Debug)]
pub struct Pdo {
    /// The device that receives or sends it.
    pub node: NodeId,
    /// Which one.
    pub pdo: PdoId,
    /// Whose object the frame names, of a multiplexed one (CiA 301, 7.2.3).
    pub multiplexed: Option<Mpdo>,
    /// Every mapped object that the frame is long enough for, with its bits; of a multiplexed one the object that it names.
    pub fields: Vec<(MappingRecord, u64)>,
    /// The frame's bytes.
    pub bytes: Vec<u8>,
    /// Bytes that the mapping asks for; `None` if the mapping is not known.
    pub mapped_bytes: Option<usize>,
    pub(super) model: Option<Model>,
}

impl Pdo {
    /// The node that has the objects: of a multiplexed PDO the one that the frame names. `None` if it is for all.
    pub const fn object_node(&self) -> Option<NodeId> {
        match self.multiplexed {
            Some(mpdo) => NodeId::new(mpdo.node),
            None => Some(self.node),
        }
    }

    /// The model of the node that has the objects, as far as it is known.
    pub fn model(&self) -> Option<&'static Description> {
        self.model.map(|model| model.0)
    }

    /// A frame of a PDO that is multiplexed. A shorter frame names no object.
    fn multiplexed(node: NodeId, pdo: PdoId, frame: &Frame, models: &NodeModels) -> Self {
        let multiplexed = Mpdo::parse(frame);
        let model = multiplexed.and_then(|mpdo| models.get(NodeId::new(mpdo.node)?));
        let field = multiplexed.map(|Mpdo { object: mux, data, .. }| {
            let bits = bits_in_frame(mux, model);
            (MappingRecord { mux, bits }, bits_of(u32::from_le_bytes(data).into(), 0..bits.into()))
        });
        let (fields, bytes) = (field.into_iter().collect(), frame.data().to_vec());
        Self { node, pdo, multiplexed, fields, bytes, mapped_bytes: Some(8), model }
    }

    pub(super) fn unmapped(node: NodeId, pdo: PdoId, model: Option<Model>, frame: &Frame) -> Self {
        let bytes = frame.data().to_vec();
        Self { node, pdo, multiplexed: None, fields: Vec::new(), bytes, mapped_bytes: None, model }
    }
}

/// Bits of an object of up to four bytes in the frame: by the model's table, or where that is not known by the standard's.
fn bits_in_frame(mux: Mux, model: Option<Model>) -> u8 {
    let standard = || standard_row(mux).map(|row| row.data_type);
    let data_type = model.map_or_else(standard, |model| model.0.row(mux).map(|row| row.data_type));
    data_type.map(DataType::bits).filter(|bits| (1..=MAX_BITS).contains(bits)).unwrap_or(MAX_BITS)
}

/// What a multiplexed PDO carries of one object at the most.
const MAX_BITS: u8 = 8 * MAX_SIZE as u8;

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
        match self.multiplexed {
            None => write!(f, "{} node {}:", pdo_name(self.pdo, model), self.node)?,
            Some(mpdo) => {
                write!(f, "{} node {}, multiplexed", self.pdo, self.node)?;
                match (mpdo.mode, self.object_node()) {
                    (AddressMode::Source, _) => write!(f, ", of node {}:", mpdo.node)?,
                    (AddressMode::Destination, Some(node)) => write!(f, ", to node {node}:")?,
                    (AddressMode::Destination, None) => f.write_str(", to all nodes:")?,
                }
            }
        }
        for (position, (object, raw)) in self.fields.iter().enumerate() {
            f.write_str(if position == 0 { " " } else { ", " })?;
            let bytes = raw.to_le_bytes();
            let length = usize::from(object.bits).div_ceil(8).min(bytes.len());
            write!(f, "{}", DecodedValue::new(object.mux, &bytes[..length], model))?;
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
    by_id: BTreeMap<u16, (Key, Content)>,
}

/// What the frames of a PDO carry.
#[derive(Clone, Debug)]
enum Content {
    Mapped(PdoMap),
    /// One object, which the frame names.
    Multiplexed,
}

/// What is known of one PDO.
#[derive(Clone, Debug, Default)]
struct Known {
    cob_id: Option<u32>,
    count: Option<u8>,
    records: BTreeMap<u8, u32>,
}

impl Known {
    /// When the count and every counted record are known.
    fn content(&self) -> Option<Content> {
        let count = self.count?;
        if AddressMode::from_count(count).is_some() {
            return Some(Content::Multiplexed);
        }
        let records = (1..=count).map(|sub| self.records.get(&sub).copied().map(MappingRecord::from_raw));
        records.collect::<Option<_>>().map(PdoMap).map(Content::Mapped)
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
    pub(super) fn set(&mut self, node: NodeId, config: &PdoConfig, id: u16) {
        let (pdo, map) = (config.pdo, &config.map);
        let count = config.multiplexed.map_or(map.0.len() as u8, AddressMode::count);
        let records = map.0.iter().enumerate().map(|(at, object)| (at as u8 + 1, object.raw())).collect();
        let known = Known { cob_id: Some(u32::from(id)), count: Some(count), records };
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
        let ((node, pdo), content) = self.by_id.get(&frame.standard_data_id()?)?;
        let (node, pdo) = (NodeId::new(*node)?, *pdo);
        let Content::Mapped(map) = content else { return Some(Pdo::multiplexed(node, pdo, frame, models)) };
        let data = u64::from_le_bytes(*frame.padded());
        let length = frame.data().len() as u32 * 8;
        let fields = map.fields().take_while(|(_, bits)| bits.end <= length);
        Some(Pdo {
            node,
            pdo,
            multiplexed: None,
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
        let valid = self.pdos.iter().filter_map(|(key, known)| Some((known.id(*key)?, (*key, known.content()?))));
        self.by_id = valid.collect();
    }
}

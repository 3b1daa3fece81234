//! Values of objects, for whom they are meant, and in what two such lists differ.

use std::collections::BTreeMap;

use canopen::od::{Access, DataType, DefaultValue, Entry, Kind};
use canopen::pdo::PdoId;
use canopen::{CobId, Mux, NodeId};
use devices::Description;
use devices::row::is_parameter;

use crate::identify::Identity;

/// Objects of a node and the values that they have or shall have.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Parameters {
    /// The device that they are of, as far as it is known.
    pub identity: Identity,
    /// The node that they are of, where it is known.
    pub node: Option<NodeId>,
    /// Each value as an SDO carries it.
    pub values: BTreeMap<Mux, Vec<u8>>,
}

/// Why an object of a list is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// It is a command or a set-point: writing it does something.
    Command,
    /// It chooses node-ID or bit rate, which was not asked for.
    Address,
    /// It can only be read, and has the value already.
    Fixed,
}

impl std::fmt::Display for Left {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Command => "a command or a set-point, not a parameter",
            Self::Address => "chooses node-ID or bit rate, which is changed only when asked for",
            Self::Fixed => "can only be read, and has this value",
        })
    }
}

/// An object in which two lists differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The object.
    pub object: Mux,
    /// Its value in the first list.
    pub first: Option<Vec<u8>>,
    /// Its value in the second.
    pub second: Option<Vec<u8>>,
}

impl Parameters {
    /// The same for another node of the same model: identifiers that the model derives from the node-ID follow it.
    /// Two nodes with the same identifiers would disturb each other.
    #[must_use]
    pub fn for_node(mut self, node: NodeId, model: Option<&Description>) -> Self {
        let (Some(model), Some(before)) = (model, self.node.filter(|before| *before != node)) else {
            self.node = Some(node);
            return self;
        };
        for (object, value) in &mut self.values {
            let derived = model.row(*object).is_some_and(|row| matches!(row.default, DefaultValue::NodeIdPlus(_)));
            if let (true, Ok(bytes)) = (derived, <[u8; 4]>::try_from(value.as_slice())) {
                let raw = u32::from_le_bytes(bytes);
                // The lowest seven bits are the node-ID's where the identifier is still derived from it (CiA 301, 7.3.5).
                if raw & 0x7F == u32::from(before.raw()) {
                    *value = (raw & !0x7F | u32::from(node.raw())).to_le_bytes().to_vec();
                }
            }
        }
        self.node = Some(node);
        self
    }
}

/// In what two lists differ, by object. Bit 30 of a TPDO's COB-ID counts as the same: some devices keep it set.
pub fn diff(first: &BTreeMap<Mux, Vec<u8>>, second: &BTreeMap<Mux, Vec<u8>>) -> Vec<Difference> {
    let mut objects: Vec<Mux> = first.keys().chain(second.keys()).copied().collect();
    objects.sort_unstable();
    objects.dedup();
    let differ = objects.into_iter().map(|object| Difference {
        object,
        first: first.get(&object).cloned(),
        second: second.get(&object).cloned(),
    });
    differ
        .filter(|found| match (&found.first, &found.second) {
            (Some(first), Some(second)) => !same(found.object, first, second),
            _ => true,
        })
        .collect()
}

/// Bytes as a number where they are few, else one after the other.
pub(super) fn hex(bytes: &[u8]) -> String {
    match bytes {
        [] => "nothing".to_owned(),
        [_, _, _, _, _, ..] => bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "),
        few => few.iter().rev().map(|byte| format!("{byte:02X}")).collect::<String>() + "h",
    }
}

/// Whether an object that was to have one value and has the other has what was wanted.
pub(super) fn same(object: Mux, first: &[u8], second: &[u8]) -> bool {
    if first == second {
        return true;
    }
    let is_tpdo = PdoId::of_object(object.index).is_some() && object.index & !0x1FF == 0x1800;
    match (<[u8; 4]>::try_from(first), <[u8; 4]>::try_from(second)) {
        (Ok(first), Ok(second)) if is_tpdo && object.sub_index == 1 => {
            (u32::from_le_bytes(first) ^ u32::from_le_bytes(second)) & !CobId::NO_RTR == 0
        }
        _ => false,
    }
}

/// The objects of a model that are its parameters: what it keeps in its store and can be written, or all that can be written
/// and is not a command, of a model that does not say what it keeps. Node-ID and bit rate are among them.
pub fn wanted_of(model: &Description) -> Vec<Mux> {
    let rows = || model.dictionary.rows().iter().filter(|row| is_parameter(row) && row.data_type != DataType::Domain);
    let any_kept = rows().any(Entry::is_kept);
    rows().filter(|row| !any_kept || row.is_kept()).map(Entry::mux).collect()
}

/// True for an object that is not written to configure a device: a command, a set-point.
pub fn is_command(object: Mux, model: Option<&Description>) -> bool {
    let by_standard = Entry::new(object.index, object.sub_index, DataType::Unsigned32, Access::ReadWrite, "", "");
    !is_parameter(&by_standard) || model.and_then(|model| model.row(object)).is_some_and(|row| row.command)
}

/// The value that an object of this row is delivered with, as an SDO carries it; `None` for what has no number.
pub fn default_of(row: &Entry, node: NodeId) -> Option<Vec<u8>> {
    let size = row.data_type.size();
    let little_endian = |raw: u64| raw.to_le_bytes().get(..size).map(<[u8]>::to_vec);
    match (row.default, row.data_type.kind()) {
        (DefaultValue::Value(value), Kind::Signed | Kind::Unsigned) => little_endian(value as u64),
        (DefaultValue::Unsigned(value), _) => little_endian(value),
        (DefaultValue::NodeIdPlus(base), _) => little_endian(u64::from(base) + u64::from(node.raw())),
        (DefaultValue::Real(value), Kind::Real) if size == 4 => Some((value as f32).to_le_bytes().to_vec()),
        (DefaultValue::Real(value), Kind::Real) => Some(value.to_le_bytes().to_vec()),
        (DefaultValue::Text(text), _) => Some(text.as_bytes().to_vec()),
        (DefaultValue::Bytes(bytes), _) => Some(bytes.to_vec()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(raw: u8) -> NodeId {
        NodeId::new(raw).expect("a node-ID")
    }

    #[test]
    fn identifiers_that_follow_the_node_id_follow_it_to_another_node() {
        let model = devices::model("zlac8030l").expect("a model");
        let emcy = Mux::new(0x1014, 0);
        let tpdo = Mux::new(0x1800, 1);
        let values = [(emcy, 0x84_u32), (tpdo, 0x8000_0184)].map(|(mux, raw)| (mux, raw.to_le_bytes().to_vec()));
        let of_four = Parameters { node: Some(node(4)), values: values.into(), ..Parameters::default() };
        let of_five = of_four.clone().for_node(node(5), Some(model));
        assert_eq!(of_five.values[&tpdo], 0x8000_0185_u32.to_le_bytes());
        assert_eq!(of_five.for_node(node(4), Some(model)), of_four);
    }

    #[test]
    fn commands_and_set_points_are_no_parameters_of_any_model() {
        let all: usize = devices::all().iter().map(|model| wanted_of(model).len()).sum();
        // A small drive has few of them; the tables as a whole have many.
        assert!(all > 10 * devices::all().iter().count(), "{all}");
        for model in devices::all().iter() {
            let wanted = wanted_of(model);
            assert!(!wanted.is_empty(), "{}", model.name);
            for command in [0x6040, 0x607A, 0x60FF, 0x6071, 0x1010, 0x1011] {
                assert!(wanted.iter().all(|mux| mux.index != command), "{} {command:04X}h", model.name);
            }
        }
    }

    #[test]
    fn bit_30_of_a_tpdo_is_the_devices_own() {
        let [cob, other] = [0x4000_0184_u32, 0x184].map(|raw| raw.to_le_bytes());
        assert!(same(Mux::new(0x1800, 1), &cob, &other));
        assert!(!same(Mux::new(0x1400, 1), &cob, &other), "an RPDO has none");
        assert!(!same(Mux::new(0x2000, 0), &cob, &other));
    }
}

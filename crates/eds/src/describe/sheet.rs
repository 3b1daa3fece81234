//! The data sheet of a model.

use canopen::NodeId;
use canopen::od::{DataType, Entry};
use cia402::SupportedModes;
use devices::Description;
use devices::names::standard_object;
use devices::variant::{Preset, Variant};

use super::names;
use super::sheet_values::{access, default, limits, plain};
use crate::{
    AccessType, BIT_RATES, DeviceInfo, Eds, FileInfo, List, Number, Object, ObjectType, TypeCode, Value, Variable,
};

/// For whom a sheet is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flavour {
    /// For any tool: what the device has.
    #[default]
    Standard,
    /// For ros2_canopen, whose CiA 402 driver reads 6502h and 6061h from the file without asking whether they are there, and
    /// takes the type of a mapped object from the file: both objects, and types as wide as they are mapped as delivered.
    Ros2Canopen,
}

/// Which device a sheet is of.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'a> {
    /// The model; with a choice that comes with other objects, what the model is then ([`Description::as_chosen`]).
    pub description: &'a Description,
    /// Its choices.
    pub variant: Variant,
    /// Values that it is delivered with besides.
    pub presets: &'a [Preset],
    /// The one node that the sheet is for; `None` for any, with `$NODEID`.
    pub node_id: Option<NodeId>,
    /// For whom.
    pub flavour: Flavour,
}

impl<'a> Sheet<'a> {
    /// Of the model as delivered, for any node.
    pub const fn of(description: &'a Description) -> Self {
        Self {
            description,
            variant: Variant::first_of(description.variations),
            presets: &[],
            node_id: None,
            flavour: Flavour::Standard,
        }
    }

    /// What an EDS says of it.
    pub fn eds(&self) -> Eds {
        let of_choices = self.variant.choices().flat_map(|(_, choice)| choice.factory);
        let presets: Vec<Preset> = of_choices.chain(self.presets).copied().collect();
        let rows = self.description.dictionary.rows();
        let mut objects: Vec<Object> =
            rows.chunk_by(|a, b| a.index == b.index).map(|rows| object(rows, &presets)).collect();
        if self.flavour == Flavour::Ros2Canopen {
            self.add_what_ros2_canopen_asks_for(&mut objects);
        }
        number_shared_names(&mut objects);
        if let Some(node_id) = self.node_id {
            objects.iter_mut().flat_map(|object| &mut object.variables).for_each(|variable| resolve(variable, node_id));
        }
        Eds {
            file: self.file_info(),
            device: self.device_info(&objects),
            dummies: (1..=7).map(|code| (TypeCode(code), false)).collect(),
            comments: self.comments(),
            objects,
            ..Eds::default()
        }
    }

    /// No date: the same description gives the same file.
    fn file_info(&self) -> FileInfo {
        let name = self.description.name;
        let suffix = if self.flavour == Flavour::Ros2Canopen { "_ros2_canopen" } else { "" };
        FileInfo {
            file_name: format!("{name}{suffix}.eds"),
            file_version: Some(1),
            file_revision: Some(0),
            eds_version: "4.0".into(),
            description: names::plain(&format!("{}, as in: {}", self.description.title, self.description.manual)),
            created_by: format!("Ferrodrive {}", env!("CARGO_PKG_VERSION")),
            ..FileInfo::default()
        }
    }

    fn comments(&self) -> Vec<String> {
        let mut lines = vec!["Written from the description of the model, not by its maker".to_owned()];
        if self.flavour == Flavour::Ros2Canopen {
            lines.push("Variant for ros2_canopen: has objects and types that the device does not have".into());
        }
        lines
    }

    fn device_info(&self, objects: &[Object]) -> DeviceInfo {
        let of = self.description;
        let count = |range: std::ops::RangeInclusive<u16>| {
            u16::try_from(objects.iter().filter(|object| range.contains(&object.index)).count()).ok()
        };
        DeviceInfo {
            vendor_name: vendor(of).to_owned(),
            vendor_number: Some(of.identity.vendor_id),
            product_name: names::plain(of.title),
            product_number: Some(of.identity.product_code),
            revision_number: Some(of.identity.revision_number),
            order_code: of.name.to_owned(),
            bit_rates: bit_rates(of),
            simple_boot_up_slave: true,
            lss: of.lss,
            granularity: if of.pdo.fixed_mapping { 0 } else { 8 },
            rpdos: count(0x1400..=0x15FF),
            tpdos: count(0x1800..=0x19FF),
            ..DeviceInfo::default()
        }
    }

    fn add_what_ros2_canopen_asks_for(&self, objects: &mut Vec<Object>) {
        widen_to_factory_mappings(objects);
        let Some(axis) = self.description.first_axis() else { return };
        let modes = axis.modes.iter().fold(SupportedModes::default(), |modes, mode| modes.with(*mode));
        add(objects, 0x6502, TypeCode::UNSIGNED32, Some(plain(modes.0.into())), false);
        add(objects, 0x6061, TypeCode::INTEGER8, None, true);
    }
}

/// Readers of such files look objects up by name: of two with one name they find one.
fn number_shared_names(objects: &mut [Object]) {
    names::number_shared(objects.iter_mut().map(|object| &mut object.name));
    for object in objects {
        match object.variables.as_mut_slice() {
            // A variable is called as its object is.
            [only] if !object.object_type.has_sub_objects() => only.name.clone_from(&object.name),
            parts => names::number_shared(parts.iter_mut().map(|part| &mut part.name)),
        }
    }
}

/// An object of the standards that the device does not have, unless it has.
fn add(objects: &mut Vec<Object>, index: u16, data_type: TypeCode, default: Option<Value>, mappable: bool) {
    let Err(at) = objects.binary_search_by_key(&index, |object| object.index) else { return };
    let name = standard_object(index).map_or("", |name| name.title);
    let value = Variable {
        line: 0,
        sub_index: 0,
        name: name.to_owned(),
        is_domain: false,
        data_type,
        access: AccessType::ReadOnly,
        default,
        low: None,
        high: None,
        pdo_mapping: mappable,
        flags: 0,
        value: None,
        denotation: String::new(),
        upload_file: String::new(),
        download_file: String::new(),
    };
    objects.insert(at, of_variables(index, name.to_owned(), ObjectType::Var, vec![value]));
}

fn of_variables(index: u16, name: String, object_type: ObjectType, variables: Vec<Variable>) -> Object {
    Object { line: 0, index, name, object_type, list: Some(List::of(index)), flags: 0, compact: None, variables }
}

/// All rows of one index.
fn object(rows: &[Entry], presets: &[Preset]) -> Object {
    let first = &rows[0];
    if let ([row], 0) = (rows, first.sub_index) {
        let kind = if row.data_type == DataType::Domain { ObjectType::Domain } else { ObjectType::Var };
        return of_variables(row.index, names::plain(row.title), kind, vec![variable(row, presets, false)]);
    }
    let mut variables: Vec<Variable> = rows.iter().map(|row| variable(row, presets, true)).collect();
    if first.sub_index > 0 {
        let highest = rows.last().map_or(0, |row| row.sub_index);
        let count = Entry::new(
            first.index,
            0,
            DataType::Unsigned8,
            canopen::od::Access::ReadOnly,
            "",
            "Highest sub-index supported",
        )
        .default(highest.into());
        variables.insert(0, variable(&count, &[], true));
    }
    // Arrays of the standard: lists of errors, store commands, heartbeats to watch.
    let kind =
        if matches!(first.index, 0x1003 | 0x1010 | 0x1011 | 0x1016) { ObjectType::Array } else { ObjectType::Record };
    let name = standard_object(first.index).map_or_else(|| names::words(first.name), |name| name.title.to_owned());
    of_variables(first.index, name, kind, variables)
}

fn variable(row: &Entry, presets: &[Preset], of_record: bool) -> Variable {
    let is_count = of_record && row.sub_index == 0;
    let default = default(row, presets).filter(|_| is_count || !is_measured(row));
    let (low, high) = limits(row, default.as_ref());
    Variable {
        line: 0,
        sub_index: row.sub_index,
        name: names::plain(row.title),
        is_domain: row.data_type == DataType::Domain,
        // Whatever a manual prints: a reader that asks for one byte takes the first of two.
        data_type: if is_count { TypeCode::UNSIGNED8 } else { TypeCode(row.data_type.code()) },
        access: access(row),
        default,
        low,
        high,
        pdo_mapping: row.pdo.is_allowed(),
        flags: 0,
        value: None,
        denotation: String::new(),
        upload_file: String::new(),
        download_file: String::new(),
    }
}

/// What a device reports of itself has no default: it is what it is at that moment.
fn is_measured(row: &Entry) -> bool {
    let read_only = row.access == canopen::od::Access::ReadOnly;
    let says_nothing = matches!(row.default, canopen::od::DefaultValue::Value(0));
    read_only && (row.index >= 0x2000 && says_nothing || matches!(row.index, 0x1001..=0x1003))
}

/// The maker, where there is one and the title begins with it: a word and no number.
fn vendor(of: &Description) -> &str {
    let first = of.title.split(' ').next().unwrap_or_default();
    let is_word = first.bytes().all(|letter| letter.is_ascii_alphabetic());
    if is_word && of.identity.vendor_id != 0 { first } else { "" }
}

/// Bit rates that the object of the bit rate lists, else the one as delivered; all of them where nothing is said.
fn bit_rates(of: &Description) -> Vec<u16> {
    let rate = |meaning: &str| meaning.strip_suffix(" kbit/s")?.parse::<u16>().ok();
    let rows = of.dictionary.rows().iter().filter(|row| row.name == "can_custom_communication_baud_rate");
    let mut rates: Vec<u16> = rows.flat_map(|row| row.values).filter_map(|(_, meaning)| rate(meaning)).collect();
    rates.extend(of.bitrate.map(|rate| (rate.bits_per_second() / 1_000) as u16));
    if rates.is_empty() {
        rates.extend(BIT_RATES);
    }
    rates.retain(|rate| BIT_RATES.contains(rate));
    rates.sort_unstable();
    rates.dedup();
    rates
}

fn resolve(variable: &mut Variable, node_id: NodeId) {
    for value in [&mut variable.default, &mut variable.low, &mut variable.high].into_iter().flatten() {
        if let Value::Number(number) = value {
            *number = Number::plain(number.at_node(node_id.raw()));
        }
    }
}

/// Gives each object the length with which it is mapped as delivered.
fn widen_to_factory_mappings(objects: &mut [Object]) {
    let of_pdos = |object: &&Object| matches!(object.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF);
    let records: Vec<u32> = objects
        .iter()
        .filter(of_pdos)
        .flat_map(|object| object.variables.iter().filter(|variable| variable.sub_index > 0))
        .filter_map(|variable| match variable.default {
            Some(Value::Number(number)) => u32::try_from(number.base).ok(),
            _ => None,
        })
        .collect();
    for record in records {
        let (index, sub_index, bits) = ((record >> 16) as u16, (record >> 8) as u8, record as u8);
        let mut all =
            objects.iter_mut().filter(|object| object.index == index).flat_map(|object| &mut object.variables);
        let Some(variable) = all.find(|variable| variable.sub_index == sub_index) else { continue };
        let signed = variable.data_type.range().is_some_and(|(low, _)| low < 0);
        if variable.data_type.bits() != Some(bits) {
            variable.data_type = match (bits, signed) {
                (8, true) => TypeCode::INTEGER8,
                (16, true) => TypeCode::INTEGER16,
                (32, true) => TypeCode::INTEGER32,
                (8, false) => TypeCode::UNSIGNED8,
                (16, false) => TypeCode::UNSIGNED16,
                (32, false) => TypeCode::UNSIGNED32,
                _ => variable.data_type,
            };
        }
    }
}

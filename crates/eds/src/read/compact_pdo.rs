//! `CompactPDO` of `[DeviceInfo]` (CiA 306-1): PDOs that a device has and its file does not list.
//!
//! Bit n - 1 says that the PDOs which `NrOfRXPDO` and `NrOfTXPDO` count, and no section describes, have sub-index n of the
//! communication parameter. They take the free numbers from the first one on. Their defaults, where CiA 301 has one, and
//! 64 entries of a mapping are what dcfgen (dcf-tools of Lely) makes of them too.

use super::reader::Reader;
use crate::value::Number;
use crate::{AccessType, List, Object, ObjectType, Refusal, TypeCode, Value, Variable};

/// Most PDOs each way (CiA 301, 7.5.2.35 and on).
const MOST_PDOS: u16 = 512;
/// Entries of a mapping.
const ENTRIES: u8 = 64;
/// From a communication parameter to its mapping.
const MAPPING: u16 = 0x200;

/// Name and type of a communication parameter's sub-indices, from 1 (CiA 301, table 71).
const PARAMETERS: [(&str, TypeCode); 6] = [
    ("COB-ID", TypeCode::UNSIGNED32),
    ("Transmission type", TypeCode::UNSIGNED8),
    ("Inhibit time", TypeCode::UNSIGNED16),
    ("Reserved", TypeCode::UNSIGNED8),
    ("Event timer", TypeCode::UNSIGNED16),
    ("SYNC start value", TypeCode::UNSIGNED8),
];

impl Reader {
    /// Adds the PDOs that the file counts and does not list, once all its objects are read.
    pub(super) fn compact_pdos(&mut self) -> Result<(), Refusal> {
        let device = &self.eds.device;
        let sub_indices: Vec<u8> = (1..=6).filter(|sub_index| device.compact_pdo & 1 << (sub_index - 1) != 0).collect();
        if sub_indices.is_empty() {
            return Ok(());
        }
        // RPDO n is heard on 200h + 100h (n - 1), TPDO n sent on 180h + 100h (n - 1), of the first four (CiA 301, 7.3.3).
        for (first, said, name, cob_id) in
            [(0x1400, device.rpdos, "RPDO", 0x200), (0x1800, device.tpdos, "TPDO", 0x180)]
        {
            let listed = |index| self.eds.object(index).is_some();
            let free: Vec<u16> = (0..MOST_PDOS).filter(|number| !listed(first + number)).collect();
            let missing = usize::from(said.unwrap_or(0)).saturating_sub(usize::from(MOST_PDOS) - free.len());
            let added: Vec<Object> = free
                .into_iter()
                .take(missing)
                .flat_map(|number| {
                    let identifier = (number < 4).then(|| cob_id + 0x100 * i128::from(number));
                    let title = format!("{name}{}", number + 1);
                    let mapping =
                        (!listed(first + MAPPING + number)).then(|| mapping(first + MAPPING + number, &title));
                    [Some(parameter(first + number, &title, identifier, &sub_indices)), mapping].into_iter().flatten()
                })
                .collect();
            let values = added.iter().map(|object| object.variables.len()).sum();
            self.take_values(self.compact_pdo_line, values)?;
            self.eds.objects.extend(added);
            self.eds.objects.sort_by_key(|object| object.index);
        }
        Ok(())
    }
}

fn parameter(index: u16, title: &str, identifier: Option<i128>, sub_indices: &[u8]) -> Object {
    let highest = sub_indices.last().copied().unwrap_or(0);
    let count =
        variable(0, "Highest sub-index supported".into(), TypeCode::UNSIGNED8, Some(Number::plain(highest.into())));
    let own = sub_indices.iter().map(|sub_index| {
        let (name, data_type) = PARAMETERS[usize::from(*sub_index) - 1];
        // Beyond the first four PDOs a device begins with none.
        let unused = Number::plain(0x8000_0000);
        let cob_id = identifier.map_or(unused, |base| Number { base, plus_node_id: true });
        variable(*sub_index, format!("{name} of {title}"), data_type, (*sub_index == 1).then_some(cob_id))
    });
    let variables = std::iter::once(Variable { access: AccessType::Const, ..count }).chain(own).collect();
    object(index, format!("{title} communication parameter"), variables)
}

fn mapping(index: u16, title: &str) -> Object {
    let none = Some(Number::plain(0));
    let count = variable(0, "Number of mapped objects".into(), TypeCode::UNSIGNED8, none);
    let entries =
        (1..=ENTRIES).map(|entry| variable(entry, format!("Mapped object {entry}"), TypeCode::UNSIGNED32, none));
    object(index, format!("{title} mapping parameter"), std::iter::once(count).chain(entries).collect())
}

fn object(index: u16, name: String, variables: Vec<Variable>) -> Object {
    let list = Some(List::of(index));
    Object { line: 0, index, name, object_type: ObjectType::Record, list, flags: 0, compact: None, variables }
}

fn variable(sub_index: u8, name: String, data_type: TypeCode, default: Option<Number>) -> Variable {
    Variable {
        line: 0,
        sub_index,
        name,
        is_domain: false,
        data_type,
        access: AccessType::ReadWrite,
        default: default.map(Value::Number),
        low: None,
        high: None,
        pdo_mapping: false,
        flags: 0,
        value: None,
        denotation: String::new(),
        upload_file: String::new(),
        download_file: String::new(),
    }
}

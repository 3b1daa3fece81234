//! A device configuration file made of a data sheet and the values of one device (CiA 306-1, clause 5).
//!
//! The sheet's lines stay as they are, comments included; `ParameterValue` lines, `[DeviceComissioning]` and the file's
//! name are added.

use std::collections::{BTreeMap, BTreeSet};

use canopen::Mux;
use canopen::od::DataType;

use crate::describe::value_of_bytes;
use crate::document::{Document, EditError};
use crate::{Commissioning, Eds, Number, Refusal, Value, Variable};

/// Objects that are not configuration: writing them starts, stops, stores, restores or clears something, or is what a master
/// sends while the device works. Source: CiA 301, 7.5.2; CiA 402-2.
const NO_CONFIGURATION: &[u16] = &[
    0x1003, 0x1010, 0x1011, 0x1020, 0x1021, 0x1023, 0x1F50, 0x1F51, 0x6040, 0x6042, 0x6071, 0x607A, 0x60C1, 0x60FE,
    0x60FF,
];

/// Blocks of the profile area, one an axis.
const BLOCK: u16 = 0x800;

/// A DCF that is being made.
#[derive(Clone, Debug)]
pub struct Configuration {
    document: Document,
    eds: Eds,
    /// Where the lines of a value stand.
    sections: BTreeMap<Mux, String>,
    /// Compact sub-objects have their values in a section of their own, as `sub-index=value`.
    compact: BTreeSet<Mux>,
    node_id: u8,
}

impl Configuration {
    /// Of the device with this node-ID, from a sheet.
    ///
    /// # Errors
    /// If the sheet cannot be read.
    pub fn new(document: Document, node_id: u8) -> Result<Self, Refusal> {
        let eds = Eds::read(&document)?.eds;
        let names: BTreeMap<u32, &str> = document.sections().map(|section| (section.line(), section.name())).collect();
        let (mut sections, mut compact) = (BTreeMap::new(), BTreeSet::new());
        for object in &eds.objects {
            for variable in &object.variables {
                let place = Mux::new(object.index, variable.sub_index);
                if object.compact.is_some() {
                    compact.insert(place);
                }
                if let Some(name) = names.get(&variable.line) {
                    sections.insert(place, (*name).to_owned());
                }
            }
        }
        Ok(Self { document, eds, sections, compact, node_id })
    }

    /// What the sheet says.
    pub const fn eds(&self) -> &Eds {
        &self.eds
    }

    /// The objects that are worth reading from the device: those that can be read and, for configuration, be written again.
    pub fn wanted(&self) -> Vec<Mux> {
        let is_wanted = |(index, variable): &(u16, &Variable)| {
            variable.access.is_readable() && variable.access.is_writable() && !is_left_out(*index, variable)
        };
        let place = |(index, variable): (u16, &Variable)| Mux::new(index, variable.sub_index);
        self.eds.variables().filter(is_wanted).map(place).collect()
    }

    /// The objects that could be read and written, and are not configuration: commands, set-points, what the sheet says not to
    /// scan or write, DOMAINs.
    pub fn left_out(&self) -> Vec<Mux> {
        let usable = |variable: &Variable| variable.access.is_readable() && variable.access.is_writable();
        let left_out = |(index, variable): &(u16, &Variable)| usable(variable) && is_left_out(*index, variable);
        let place = |(index, variable): (u16, &Variable)| Mux::new(index, variable.sub_index);
        self.eds.variables().filter(left_out).map(place).collect()
    }

    /// Notes the value that the device has, as an SDO carried it; unless `all`, only one that is not the default. True if the
    /// file has it now.
    ///
    /// # Errors
    /// If the value cannot be in a file, or its object is not in the sheet.
    pub fn set(&mut self, place: Mux, bytes: &[u8], all: bool) -> Result<bool, SetError> {
        let variable = self.eds.variable(place.index, place.sub_index).ok_or(SetError::NoSuchObject)?;
        let data_type = DataType::from_code(variable.data_type.0).ok_or(SetError::NoSuchObject)?;
        let expected = data_type.size();
        if expected > 0 && expected != bytes.len() {
            return Err(SetError::Length { expected, received: bytes.len() });
        }
        let value = value_of_bytes(data_type, bytes).unwrap_or(Value::Text(String::new()));
        if !all && is_same(&value, variable.default.as_ref(), self.node_id) {
            return Ok(false);
        }
        let text = value.in_file(place.index, variable.data_type);
        self.write(place, &text)?;
        Ok(true)
    }

    fn write(&mut self, place: Mux, text: &str) -> Result<(), SetError> {
        if !self.compact.contains(&place) {
            let section = self.sections.get(&place).ok_or(SetError::NoSuchObject)?;
            return Ok(self.document.set(section, "ParameterValue", text)?);
        }
        let section = format!("{:04X}Value", place.index);
        if self.document.section(&section).is_none() {
            self.document.add_section(&section)?;
            self.document.set(&section, "NrOfEntries", "0")?;
        }
        self.document.set(&section, &place.sub_index.to_string(), text)?;
        let counted = |key: &str| key.parse::<u8>().is_ok();
        let entries = self
            .document
            .section(&section)
            .map_or(0, |section| section.entries().filter(|entry| counted(entry.key)).count());
        Ok(self.document.set(&section, "NrOfEntries", &entries.to_string())?)
    }

    /// Says which device it is, and the name of the file.
    ///
    /// # Errors
    /// If a text does not fit into one line of the file.
    pub fn commission(&mut self, device: &Commissioning, file_name: &str) -> Result<(), EditError> {
        if let Some(of_sheet) = self.document.value("FileInfo", "FileName").map(str::to_owned) {
            self.document.set("FileInfo", "FileName", file_name)?;
            self.document.set("FileInfo", "LastEDS", &of_sheet)?;
        }
        let spelled = ["DeviceComissioning", "DeviceCommissioning"];
        let section = spelled.into_iter().find(|name| self.document.section(name).is_some());
        let section = match section {
            Some(name) => name,
            None => {
                self.document.add_section(spelled[0])?;
                spelled[0]
            }
        };
        let number = |number: Option<u32>| number.map(|number| number.to_string());
        let values = [
            ("NodeID", number(device.node_id.map(u32::from))),
            ("NodeName", Some(device.node_name.clone())),
            ("Baudrate", number(device.bit_rate.map(u32::from))),
            ("NetNumber", number(device.net_number)),
            ("NetworkName", Some(device.network_name.clone())),
            ("CANopenManager", Some(u8::from(device.is_manager).to_string())),
            ("LSS_SerialNumber", device.lss_serial_number.map(|serial| format!("0x{serial:08X}"))),
        ];
        for (key, value) in values {
            if let Some(value) = value {
                self.document.set(section, key, &value)?;
            }
        }
        Ok(())
    }

    /// The file.
    pub fn into_document(self) -> Document {
        self.document
    }
}

/// Why a value is not in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SetError {
    /// The sheet has no such object.
    NoSuchObject,
    /// The device's object has another length than the sheet's.
    Length {
        /// Bytes by the sheet.
        expected: usize,
        /// Bytes that came.
        received: usize,
    },
    /// The value does not fit into a line.
    Edit(EditError),
}

impl From<EditError> for SetError {
    fn from(error: EditError) -> Self {
        Self::Edit(error)
    }
}

impl std::fmt::Display for SetError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoSuchObject => f.write_str("the data sheet has no such object"),
            Self::Length { expected, received } => {
                write!(f, "the device has {received} bytes, by the data sheet there are {expected}")
            }
            Self::Edit(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SetError {}

fn is_left_out(index: u16, variable: &Variable) -> bool {
    let of_first_axis = if (0x6800..=0x9FFF).contains(&index) { 0x6000 + index % BLOCK } else { index };
    // ObjFlags: bit 0 not to be written, bit 1 not to be scanned.
    variable.is_domain || variable.flags & 3 != 0 || NO_CONFIGURATION.contains(&of_first_axis)
}

/// True if a device with this value is as delivered; a default that is not said is 0, or no text.
fn is_same(value: &Value, default: Option<&Value>, node_id: u8) -> bool {
    match (value, default) {
        (Value::Number(value), Some(Value::Number(default))) => value.base == default.at_node(node_id),
        (Value::Number(value), None) => *value == Number::plain(0),
        (Value::Real(value), None) => *value == 0.0,
        (Value::Text(value), None) => value.is_empty(),
        (value, Some(default)) => value == default,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEET: &str = "; by the maker\r\n[FileInfo]\r\nFileName=x.eds\r\n\r\n\
        [1014]\r\nParameterName=EMCY\r\nDataType=7\r\nAccessType=rw\r\nDefaultValue=$NODEID+0x80\r\nPDOMapping=0\r\n\r\n\
        [1010]\r\nParameterName=Store\r\nDataType=7\r\nAccessType=rw\r\n\r\n\
        [2000]\r\nParameterName=Gain\r\nDataType=3\r\nAccessType=rw\r\nDefaultValue=5\r\n; a remark\r\n\r\n\
        [2001]\r\nParameterName=State\r\nDataType=3\r\nAccessType=ro\r\n\r\n\
        [2002]\r\nParameterName=Secret\r\nDataType=3\r\nAccessType=wo\r\n\r\n\
        [2003]\r\nParameterName=Words\r\nObjectType=8\r\nDataType=6\r\nAccessType=rw\r\nCompactSubObj=2\r\n\r\n\
        [2004]\r\nParameterName=Big\r\nObjectType=2\r\nDataType=0xF\r\nAccessType=rw\r\n\r\n\
        [6840]\r\nParameterName=Controlword of the second axis\r\nDataType=6\r\nAccessType=rw\r\n";

    fn configuration() -> Configuration {
        Configuration::new(Document::parse(SHEET.as_bytes()).expect("small"), 5).expect("a sheet")
    }

    #[test]
    fn what_can_be_read_and_written_again_is_wanted() {
        let shown = |places: Vec<Mux>| places.iter().map(ToString::to_string).collect::<Vec<_>>();
        let configuration = configuration();
        assert_eq!(shown(configuration.wanted()), ["1014h:00", "2000h:00", "2003h:01", "2003h:02"]);
        assert_eq!(shown(configuration.left_out()), ["1010h:00", "2004h:00", "6840h:00"]);
    }

    #[test]
    fn only_what_differs_is_written_and_every_other_line_stays() {
        let mut made = configuration();
        let (emcy, gain) = (Mux::new(0x1014, 0), Mux::new(0x2000, 0));
        assert_eq!(made.set(emcy, &0x85_u32.to_le_bytes(), false), Ok(false), "the default on node 5");
        assert_eq!(made.set(gain, &(-7_i16).to_le_bytes(), false), Ok(true));
        let expected = SHEET.replace("DefaultValue=5\r\n", "DefaultValue=5\r\nParameterValue=-7\r\n");
        assert_eq!(made.clone().into_document().text(), expected);
        assert_eq!(made.set(emcy, &0x85_u32.to_le_bytes(), true), Ok(true));
        assert_eq!(made.into_document().value("1014", "ParameterValue"), Some("0x85"));
    }

    #[test]
    fn compact_sub_objects_have_a_section_for_their_values() {
        let mut made = configuration();
        assert_eq!(made.set(Mux::new(0x2003, 2), &[9, 0], false), Ok(true));
        assert_eq!(made.set(Mux::new(0x2003, 1), &[0, 0], false), Ok(false));
        let document = made.into_document();
        assert!(document.text().ends_with("\r\n[2003Value]\r\nNrOfEntries=1\r\n2=9\r\n"), "{}", document.text());
    }

    #[test]
    fn a_value_of_another_length_and_an_unknown_object_are_refused() {
        let mut made = configuration();
        let length = SetError::Length { expected: 2, received: 4 };
        assert_eq!(made.set(Mux::new(0x2000, 0), &[0; 4], false), Err(length));
        assert_eq!(made.set(Mux::new(0x3000, 0), &[0; 4], false), Err(SetError::NoSuchObject));
    }

    #[test]
    fn the_device_and_the_file_are_named() {
        let mut made = configuration();
        let device = Commissioning {
            node_id: Some(5),
            bit_rate: Some(500),
            lss_serial_number: Some(1),
            ..Commissioning::default()
        };
        made.commission(&device, "x.dcf").expect("it fits");
        let document = made.into_document();
        assert_eq!(document.value("FileInfo", "FileName"), Some("x.dcf"));
        assert_eq!(document.value("FileInfo", "LastEDS"), Some("x.eds"));
        let eds = Eds::read(&document).expect("a DCF").eds;
        assert_eq!(eds.commissioning, Some(device));
    }
}

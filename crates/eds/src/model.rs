//! What a file says, typed. Source: CiA 306-1, clauses 4.3 to 4.6 (EDS) and 5 (DCF).

use std::hash::{Hash, Hasher};

use crate::read::is_about_modules;
use crate::{TypeCode, Value};

/// An electronic data sheet, or a device configuration file, which has [`commissioning`](Self::commissioning) and values
/// beside.
#[derive(Clone, Debug, Default, PartialEq, Hash)]
pub struct Eds {
    /// `[FileInfo]`.
    pub file: FileInfo,
    /// `[DeviceInfo]`.
    pub device: DeviceInfo,
    /// `[DummyUsage]`: which data types may be mapped as placeholders, with their codes.
    pub dummies: Vec<(TypeCode, bool)>,
    /// `[Comments]`, line by line.
    pub comments: Vec<String>,
    /// All objects, ascending by index, each once.
    pub objects: Vec<Object>,
    /// `[DeviceComissioning]`, spelled with one m in the standard; only a DCF has it.
    pub commissioning: Option<Commissioning>,
    /// `[DynamicChannels]`: where programs of a programmable device keep their variables.
    pub dynamic_channels: Vec<DynamicChannel>,
    /// Sections about modules (see [`has_modules`](Self::has_modules)), and sections that CiA 306 does not know: kept as they
    /// are, not interpreted.
    pub kept: Vec<KeptSection>,
}

/// Who made the file, and when. Times and dates as the file writes them (`10:30AM`, `12-31-2024`).
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct FileInfo {
    /// Name of the file.
    pub file_name: String,
    /// Its version.
    pub file_version: Option<u8>,
    /// Its revision.
    pub file_revision: Option<u8>,
    /// Version of CiA 306: `4.0`.
    pub eds_version: String,
    /// What it describes.
    pub description: String,
    /// When it was made.
    pub creation_time: String,
    /// When it was made.
    pub creation_date: String,
    /// By whom.
    pub created_by: String,
    /// When it was changed.
    pub modification_time: String,
    /// When it was changed.
    pub modification_date: String,
    /// By whom.
    pub modified_by: String,
    /// The EDS that a DCF was made from.
    pub last_eds: String,
}

/// What the device is and supports.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct DeviceInfo {
    /// Name of its maker.
    pub vendor_name: String,
    /// 1018h:01.
    pub vendor_number: Option<u32>,
    /// Its name.
    pub product_name: String,
    /// 1018h:02.
    pub product_number: Option<u32>,
    /// 1018h:03.
    pub revision_number: Option<u32>,
    /// What to order.
    pub order_code: String,
    /// Bit rates in kbit/s, ascending.
    pub bit_rates: Vec<u16>,
    /// It can be the master that starts a network.
    pub simple_boot_up_master: bool,
    /// It can be a node that is started.
    pub simple_boot_up_slave: bool,
    /// Bits that a mapped object's length is a multiple of; 0 if the mapping cannot be changed.
    pub granularity: u8,
    /// 0 if there are no dynamic channels.
    pub dynamic_channels_supported: u32,
    /// Multiplexed PDOs.
    pub group_messaging: bool,
    /// RPDOs.
    pub rpdos: Option<u16>,
    /// TPDOs.
    pub tpdos: Option<u16>,
    /// LSS (CiA 305).
    pub lss: bool,
    /// Which sub-indices the communication parameters have of PDOs that are counted and not listed, bit 0 for sub-index 1; 0 for
    /// no such PDOs. They are among the objects.
    pub compact_pdo: u8,
}

/// `[DeviceComissioning]`: the one device that a DCF is about.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Commissioning {
    /// Its node-ID.
    pub node_id: Option<u8>,
    /// Its name.
    pub node_name: String,
    /// Its name in the plan.
    pub node_reference: String,
    /// kbit/s.
    pub bit_rate: Option<u16>,
    /// Number of the network.
    pub net_number: Option<u32>,
    /// Name of the network.
    pub network_name: String,
    /// Name of the network in the plan.
    pub network_reference: String,
    /// It is the CANopen manager.
    pub is_manager: bool,
    /// Serial number for LSS.
    pub lss_serial_number: Option<u32>,
}

/// One segment of `[DynamicChannels]`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct DynamicChannel {
    /// Number of the segment, from 1.
    pub number: u16,
    /// Data type of its variables.
    pub data_type: String,
    /// `ro` or `rww`: the direction as seen from the network.
    pub direction: String,
    /// The objects: `0xA080-0xA0BF`.
    pub range: String,
    /// Where they begin in the process image.
    pub offset: String,
    /// Most of them.
    pub max_count: String,
}

/// A section that is kept and not interpreted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptSection {
    /// Its line, from 1; 0 if it was not read from a file.
    pub line: u32,
    /// Its name.
    pub name: String,
    /// Its entries.
    pub entries: Vec<(String, String)>,
}

/// Which of the three lists an object stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum List {
    /// `[MandatoryObjects]`: 1000h, 1001h, 1018h.
    Mandatory,
    /// `[OptionalObjects]`: 1000h to 1FFFh and 6000h to FFFFh.
    Optional,
    /// `[ManufacturerObjects]`: 2000h to 5FFFh.
    Manufacturer,
}

impl List {
    /// All lists, in the order in which files have them.
    pub const ALL: [Self; 3] = [Self::Mandatory, Self::Optional, Self::Manufacturer];

    /// Its section.
    pub const fn section(self) -> &'static str {
        match self {
            Self::Mandatory => "MandatoryObjects",
            Self::Optional => "OptionalObjects",
            Self::Manufacturer => "ManufacturerObjects",
        }
    }

    /// Where an object belongs.
    pub const fn of(index: u16) -> Self {
        match index {
            0x1000 | 0x1001 | 0x1018 => Self::Mandatory,
            0x2000..=0x5FFF => Self::Manufacturer,
            _ => Self::Optional,
        }
    }
}

/// Kind of an object. Source: CiA 301, table 42.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ObjectType {
    /// A large variable amount of data, code 2.
    Domain,
    /// A definition of a type, code 5.
    DefType,
    /// A definition of a record type, code 6.
    DefStruct,
    /// A single value, code 7.
    #[default]
    Var,
    /// Several values of one type, code 8.
    Array,
    /// Several values, code 9.
    Record,
}

impl ObjectType {
    /// By code.
    pub const fn of(code: u16) -> Option<Self> {
        Some(match code {
            2 => Self::Domain,
            5 => Self::DefType,
            6 => Self::DefStruct,
            7 => Self::Var,
            8 => Self::Array,
            9 => Self::Record,
            _ => return None,
        })
    }

    /// Its code.
    pub const fn code(self) -> u8 {
        match self {
            Self::Domain => 2,
            Self::DefType => 5,
            Self::DefStruct => 6,
            Self::Var => 7,
            Self::Array => 8,
            Self::Record => 9,
        }
    }

    /// As the standard prints it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Domain => "DOMAIN",
            Self::DefType => "DEFTYPE",
            Self::DefStruct => "DEFSTRUCT",
            Self::Var => "VAR",
            Self::Array => "ARRAY",
            Self::Record => "RECORD",
        }
    }

    /// It has sub-objects.
    pub const fn has_sub_objects(self) -> bool {
        matches!(self, Self::DefStruct | Self::Array | Self::Record)
    }
}

/// An object: one value, or several below sub-indices.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its line, from 1; 0 if it was not read from a file.
    pub line: u32,
    /// Index.
    pub index: u16,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub object_type: ObjectType,
    /// The list that it stands in, if it does.
    pub list: Option<List>,
    /// Bit 0: not to be written by a configuration tool; bit 1: not to be scanned.
    pub flags: u32,
    /// `CompactSubObj`: so many sub-objects of one description; they are among the [`variables`](Self::variables).
    pub compact: Option<u8>,
    /// Its values, ascending by sub-index: one of sub-index 0 where there are no sub-objects.
    pub variables: Vec<Variable>,
}

impl Object {
    /// The variable of a sub-index.
    pub fn variable(&self, sub_index: u8) -> Option<&Variable> {
        let found = self.variables.binary_search_by_key(&sub_index, |variable| variable.sub_index);
        found.ok().map(|at| &self.variables[at])
    }
}

/// One value of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// The line of its section, from 1; 0 if it was not read from a file.
    pub line: u32,
    /// Sub-index.
    pub sub_index: u8,
    /// Its name.
    pub name: String,
    /// It is a DOMAIN, not a VAR.
    pub is_domain: bool,
    /// Its type.
    pub data_type: TypeCode,
    /// How it may be used.
    pub access: AccessType,
    /// Its value in a device as delivered.
    pub default: Option<Value>,
    /// Smallest value.
    pub low: Option<Value>,
    /// Largest value.
    pub high: Option<Value>,
    /// It may be mapped into PDOs.
    pub pdo_mapping: bool,
    /// Bit 0: not to be written by a configuration tool; bit 1: not to be scanned.
    pub flags: u32,
    /// `ParameterValue`: what a DCF wants it to be.
    pub value: Option<Value>,
    /// `Denotation`: its name in the plan of a DCF.
    pub denotation: String,
    /// `UploadFile`: where a DOMAIN is read to.
    pub upload_file: String,
    /// `DownloadFile`: where a DOMAIN is written from.
    pub download_file: String,
}

/// How an object may be used. Source: CiA 306-1, table 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AccessType {
    /// Read only.
    ReadOnly,
    /// Write only.
    WriteOnly,
    /// Read and write.
    ReadWrite,
    /// Read and write, a process input: mapped into TPDOs.
    ReadWriteInput,
    /// Read and write, a process output: mapped into RPDOs.
    ReadWriteOutput,
    /// Read only and never changing.
    Const,
}

impl AccessType {
    const ALL: [Self; 6] =
        [Self::ReadOnly, Self::WriteOnly, Self::ReadWrite, Self::ReadWriteInput, Self::ReadWriteOutput, Self::Const];

    /// By name, in any case of letters.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|access| access.name().eq_ignore_ascii_case(name))
    }

    /// As the standard spells it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ReadOnly => "ro",
            Self::WriteOnly => "wo",
            Self::ReadWrite => "rw",
            Self::ReadWriteInput => "rwr",
            Self::ReadWriteOutput => "rww",
            Self::Const => "const",
        }
    }

    /// It can be read by SDO.
    pub const fn is_readable(self) -> bool {
        !matches!(self, Self::WriteOnly)
    }

    /// It can be written by SDO.
    pub const fn is_writable(self) -> bool {
        !matches!(self, Self::ReadOnly | Self::Const)
    }

    /// It may be mapped into an RPDO, where mapping is allowed at all.
    pub const fn fits_rpdo(self) -> bool {
        matches!(self, Self::WriteOnly | Self::ReadWrite | Self::ReadWriteOutput)
    }

    /// It may be mapped into a TPDO, where mapping is allowed at all.
    pub const fn fits_tpdo(self) -> bool {
        !matches!(self, Self::WriteOnly | Self::ReadWriteOutput)
    }
}

// Where something stands in a file is not what the file says.

impl Hash for KeptSection {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Self { line: _, name, entries } = self;
        (name, entries).hash(state);
    }
}

impl Hash for Object {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Self { line: _, index, name, object_type, list, flags, compact, variables } = self;
        (index, name, object_type, list, flags, compact, variables).hash(state);
    }
}

impl Hash for Variable {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let Self {
            line: _,
            sub_index,
            name,
            is_domain,
            data_type,
            access,
            pdo_mapping,
            flags,
            default,
            low,
            high,
            value,
            denotation,
            upload_file,
            download_file,
        } = self;
        (sub_index, name, is_domain, data_type, access, pdo_mapping, flags).hash(state);
        (default, low, high, value, denotation, upload_file, download_file).hash(state);
    }
}

impl Variable {
    /// What it is to have: the value of a DCF, else what it is delivered with.
    pub const fn value_or_default(&self) -> Option<&Value> {
        match &self.value {
            Some(value) => Some(value),
            None => self.default.as_ref(),
        }
    }
}

impl Eds {
    /// True for a modular device, or with sections about its modules (CiA 306-1, clause 4.7). Their objects are not among
    /// [`objects`](Self::objects).
    pub fn has_modules(&self) -> bool {
        self.kept.iter().any(|section| is_about_modules(&section.name))
    }

    /// An object.
    pub fn object(&self, index: u16) -> Option<&Object> {
        self.objects.binary_search_by_key(&index, |object| object.index).ok().map(|at| &self.objects[at])
    }

    /// A variable of an object.
    pub fn variable(&self, index: u16, sub_index: u8) -> Option<&Variable> {
        self.object(index)?.variable(sub_index)
    }

    /// All variables with the index of their object, ascending.
    pub fn variables(&self) -> impl Iterator<Item = (u16, &Variable)> {
        self.objects.iter().flat_map(|object| object.variables.iter().map(|variable| (object.index, variable)))
    }

    /// True for a DCF: a file about one configured device.
    pub fn is_dcf(&self) -> bool {
        self.commissioning.is_some() || self.variables().any(|(_, variable)| variable.value.is_some())
    }
}

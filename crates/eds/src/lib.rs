//! Electronic data sheets of CANopen devices: EDS and DCF files (CiA 306-1).
//!
//! [`Document`](document::Document) is the file as it stands, line by line, to look at and to change a value without
//! touching the rest. [`Eds`] is what it says, typed: objects, defaults, limits, and in a DCF the values of one device.
//! Reading takes what real files have and reports what is not as the standard has it, with the line and what was taken
//! instead.
//!
//! ```
//! use eds::{Eds, Severity};
//!
//! let file = "[FileInfo]\nFileName=small.eds\n[MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n\
//!             [1000]\nParameterName=Device type\nObjectType=0x7\nDataType=0x0007\nAccessType=RO\n\
//!             DefaultValue=0x20192\nLowLimit=0x30000\n";
//! let reading = Eds::load(file.as_bytes())?;
//! assert_eq!(reading.eds.object(0x1000).map(|object| object.name.as_str()), Some("Device type"));
//! let first = reading.findings.iter().find(|finding| finding.line > 0).expect("the limit is wrong");
//! assert_eq!((first.line, first.severity()), (12, Severity::Error));
//! assert_eq!(first.taken_instead.as_deref(), Some("no low limit"));
//! # Ok::<(), eds::Refusal>(())
//! ```
//!
//! It does not look into modules (CiA 306-1, clause 4.7): their sections are kept as they are, with a finding, and a
//! description says that it is one of the device without them. XML device descriptions
//! (CiA 311) are not read.

mod check;
mod configuration;
mod data_type;
mod describe;
mod diff;
mod finding;
mod model;
mod parameter_values;
mod read;
mod rule;
mod severity;
mod value;
mod write;

pub mod document;

pub use configuration::{Configuration, SetError};
pub use data_type::{Form, TypeCode};
pub use describe::{Flavour, Sheet, Unkept, keep, keep_of};
pub use diff::{Difference, diff};
pub use finding::{Finding, Findings, Refusal};
pub use model::{
    AccessType, Commissioning, DeviceInfo, DynamicChannel, Eds, FileInfo, KeptSection, List, Object, ObjectType,
    Variable,
};
pub use parameter_values::{NotHeld, parameter_values};
pub use read::Reading;
pub use rule::{Explanation, Rule};
pub use severity::Severity;
pub use value::{Number, Value};
pub use write::write;

/// Bit rates that `[DeviceInfo]` has keys for, in kbit/s.
pub const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

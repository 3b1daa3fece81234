//! Process data objects (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38), named from the device's side.
//!
//! [`parameter`] is a PDO's communication record, [`mapping`] its mapping record, both read from the dictionary
//! when they are written; [`Rpdo`] and [`Tpdo`] then work on resolved cells.

mod form;
pub mod mapping;
pub mod multiplex;
mod number;
pub mod parameter;
mod rpdo;
mod tpdo;

pub use form::TpdoForm;
pub use mapping::{MAX_OBJECTS, Mapping, MappingRecord, MappingRules};
pub use multiplex::{AddressMode, Mpdo};
pub use number::{Direction, PdoId, PdoNumber};
pub use parameter::{Parameter, TransmissionType};
pub use rpdo::{Reception, Rpdo};
pub use tpdo::{EventTrigger, Tpdo};

/// RPDO communication records: 1400h + position.
pub const RPDO_PARAMETER: u16 = 0x1400;
/// RPDO mapping records: 1600h + position.
pub const RPDO_MAPPING: u16 = 0x1600;
/// TPDO communication records: 1800h + position.
pub const TPDO_PARAMETER: u16 = 0x1800;
/// TPDO mapping records: 1A00h + position.
pub const TPDO_MAPPING: u16 = 0x1A00;

//! Virtual drives for other programs: a served world, EEPROM images on disk.

pub(crate) mod eeprom;
pub(crate) mod keeper;
pub(crate) mod registers;
pub(crate) mod world;

//! The object table of the description, and in [`effects`] what a write sets in motion.

pub mod effects;

pub use devices::zltech::zlim42c::objects::*;

/// Room for the values and PDOs of the drive.
pub type TableStorage = canopen::od::Fixed<ROW_COUNT>;

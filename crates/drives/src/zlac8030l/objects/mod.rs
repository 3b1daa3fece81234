//! The object table of the description, and in [`effects`] what a write sets in motion.

mod conditions;
pub mod effects;

pub use conditions::{ABSOLUTE_TARGET_LIMIT, CONDITIONS};
pub use devices::zltech::zlac8030l::objects::*;

/// Room for the values and PDOs of the drive.
pub type TableStorage = canopen::od::Fixed<ROW_COUNT_2_01>;

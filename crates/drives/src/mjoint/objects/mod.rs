//! The object table of the description, and in [`effects`] what a write sets in motion.

mod conditions;
pub mod effects;

pub use conditions::CONDITIONS;
pub use devices::mjoint::objects::*;

/// Room for the values and PDOs of the drive.
pub type TableStorage = canopen::od::Fixed<ROW_COUNT_1_66>;

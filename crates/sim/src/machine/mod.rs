//! Virtual machines: a drive's firmware joined to the physics around it.
//!
//! `kernel` is what all machines share: [`Machine`], its supply, inputs, time and rest, and the [`Assembly`] that it asks of a
//! model. `models` holds a file for each model, and [`order`], which builds one by its description.

mod kernel;
mod models;

pub use kernel::Machine;
pub use kernel::assembly::{Assembly, ShaftFacts};
pub use kernel::quantity::QuantityRange;
pub use kernel::realism::{Noise, Realism};
pub use kernel::timing::TimingMode;
pub use models::*;

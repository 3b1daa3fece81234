//! What devices are, as const data: object tables, faults, units, rules, and where they depart from the standard.
//!
//! A [`Description`] is what masters, tools and the firmware itself read about a model. The makers' folders hold the manuals'
//! rows. There is no behaviour here: firmware is in crate `drives`.
//!
//! ```
//! use canopen::Mux;
//!
//! // Two drives of one maker answer the same identity, and mean another thing by the same object.
//! let servo = devices::model("zlac8030l").unwrap();
//! let stepper = devices::model("zlim42c").unwrap();
//! assert_eq!(servo.identity, stepper.identity);
//!
//! let object = Mux::new(0x2009, 0);
//! assert_eq!(servo.row(object).unwrap().name, "register_parameter_setting");
//! assert_eq!(stepper.row(object).unwrap().name, "can_custom_communication_baud_rate");
//!
//! // What a program written to the standard has to know beside that.
//! for departure in servo.departures(devices::all()) {
//!     println!("{departure}: {}", departure.remedy());
//! }
//! ```
#![no_std]

#[cfg(test)]
extern crate std;

mod axis;
mod catalogue;
mod departure;
mod description;
pub mod faults;
mod loops;
pub mod mjoint;
pub mod names;
mod placement;
pub mod row;
pub mod servo;
mod stated;
mod terminals;
mod timing;
mod units;
pub mod variant;
pub mod zltech;

pub use axis::*;
pub use catalogue::*;
pub use departure::{Departure, Remedy};
pub use description::*;
pub use loops::*;
pub use placement::*;
pub use stated::*;
pub use terminals::*;
pub use timing::*;
pub use units::*;

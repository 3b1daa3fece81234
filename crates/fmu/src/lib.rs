//! Virtual drives and an exact CAN bus as co-simulation FMUs: FMI 3.0 with the layered standard for buses (fmi-ls-bus 1.0).
//!
//! An importer of FMI 3.0, such as FMPy, loads the library of this crate and calls its C functions; what they do
//! stands in [`instance`] without a pointer, what they compute in [`drive`] and [`bus`]. `ferrodrive fmu` packs the archive.
//!
//! ```
//! use ferrodrive_fmu::config::{Config, DriveConfig};
//! use ferrodrive_fmu::instance::Instance;
//! use ferrodrive_fmu::variable::Value;
//!
//! let config = DriveConfig::new("zlac8030l@4");
//! let mut drive = Instance::of(Config::Drive(config), ".".as_ref(), false)?;
//! drive.enter_initialization(0.0)?;
//! drive.exit_initialization()?;
//! for step in 0..1500 {
//!     drive.step(f64::from(step) * 1e-3, 1e-3)?;
//! }
//! let Value::UInt16(statusword) = drive.get(208)? else { panic!() };
//! assert_eq!(statusword & 0x4F, 0x40); // it has booted: SWITCH ON DISABLED
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod abi;
pub mod axis;
pub mod bus;
pub mod call;
pub mod config;
pub mod drive;
pub mod fmi2;
pub mod instance;
mod joint;
mod journal;
pub mod operation;
pub mod package;
pub mod state;
mod surroundings;
pub mod unit;
pub mod variable;
pub mod xml;

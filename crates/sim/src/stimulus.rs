//! What the outer world does to a node: one value that is parsed from words, applied to a world, recorded, and printed again.
//!
//! ```
//! use sim::stimulus::{Source, Stimulus};
//!
//! let stimulus: Stimulus = "supply 48 limit 10".parse()?;
//! assert_eq!(stimulus, Stimulus::Supply(Source { voltage_v: Some(48.0), limit_a: Some(10.0), resistance_ohm: None }));
//! assert_eq!(stimulus.to_string(), "supply 48 limit 10");
//! # Ok::<(), sim::stimulus::StimulusError>(())
//! ```

mod body;
mod bus_fault;
mod error;
mod kinds;
mod load;
mod parse;
mod place;
mod print;
mod range;
mod way_back;
mod words;

pub use body::{BodyStimulus, GET_BODY};
pub use bus_fault::{BusFault, WireFault};
pub use error::StimulusError;
pub use kinds::{Component, MPDO_VALUES, ObjectValue, Power, PulseTrain, Source, Stimulus, TemperatureSensor};
pub use load::{Friction, LoadKind, LoadPart};
pub use parse::{FORMS, GET, RUN};
pub use place::Place;
pub use range::SwitchRange;
pub(crate) use words::excerpt;

#[cfg(test)]
mod tests;

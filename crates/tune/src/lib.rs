//! Motor drives identified from samples, and gains for their loops from one objective.
//!
//! In: [`Samples`] of a drive that follows a speed (set-point, current demand, position, all at one rate), and currents that
//! it takes at steady speeds. Out: a frequency [`Response`] with its coherence, the [`Mechanics`] and [`Friction`] behind it,
//! the [`Loop`] around it, and [`Proposal`]s of gains with their margins. A pure function of its input: no clock, no bus, no
//! drive.
//!
//! ```
//! use tune::{Excitation, Samples, identify, response};
//!
//! // An inertia of which 1 A makes 50 rad/s², in a loop of 2 A/(rad/s) that is computed each millisecond.
//! let excitation = Excitation::new(1e-3, 1.0, (1.0, 200.0))?;
//! let (mut speed, mut angle) = (0.0, 0.0);
//! let mut samples = Samples { period_s: 1e-3, ..Samples::default() };
//! for n in 0..4 * excitation.len() {
//!     let set_point = 10.0 + excitation.at(n);
//!     let current = 2.0 * (set_point - speed);
//!     samples.push(set_point, current, angle);
//!     // The current is held for the period.
//!     angle += (speed + 0.5e-3 * 50.0 * current) * 1e-3;
//!     speed += 1e-3 * 50.0 * current;
//! }
//! let response = response(&samples, Some(&excitation))?;
//! let found = identify(&response)?;
//! assert!((found.gain - 50.0).abs() < 0.5, "{found:?}");
//! assert!(found.elastic.is_none());
//! # Ok::<(), tune::Unusable>(())
//! ```
//!
//! Deliberately absent: units of any maker's parameters. What one count of a gain is worth is found from the samples
//! ([`Loop`]).

mod answer;
mod bode;
mod controller;
mod design;
mod excitation;
mod fourier;
mod friction;
mod least_squares;
mod mechanics;
mod open_loop;
mod response;
mod samples;

/// Speed per current at one frequency.
pub use rustfft::num_complex::Complex;

pub use answer::Disturbance;
pub use bode::bode;
pub use controller::{Loop, identify_loop};
pub use design::{Margins, Objective, Proposal, margins, propose, propose_position};
pub use excitation::Excitation;
pub use friction::{Friction, SteadyRun, fit_friction};
pub use mechanics::{Elastic, Mechanics, identify};
pub use open_loop::{Ramp, Turned};
pub use response::{BackEmf, Line, Response, distance, response};
pub use samples::{Samples, Unusable};

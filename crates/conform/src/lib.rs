//! A conformance test suite for CANopen devices: CiA 301, CiA 305 and CiA 402, case by case with the frames that show it.
//!
//! In: a [`master::Network`] on whose bus the node is, the frames that pass ([`Capture`]), and what the node is said to be
//! ([`devices::Description`], of a model or of an EDS). Out: a [`Report`] with a [`CaseResult`] for each [`Case`]. Nothing
//! here reads a clock or opens a socket: the suite runs in virtual time as on a real bus.
//!
//! What a case touches is put back after it, and the node is left in the NMT state in which it was found. Cases in which a
//! motor is energised run only with [`Options::allow_motion`].
//!
//! ```
//! use can::{Bitrate, Tap};
//! use canopen::NodeId;
//! use conform::{Capture, Options, Outcome, Subject, Suite};
//! use master::Network;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let node = NodeId::new(4).ok_or("no such node")?;
//! let model = devices::model("zlac8030l").ok_or("no such model")?;
//! let mut world = sim::World::new(Bitrate::K500, 1);
//! world.add_drive(4, Box::new(sim::machine::zlac8030l(4, 1)))?;
//! let (network, capture) = (Network::new(), Capture::new());
//! world.add_station(Tap::new(network.clone(), capture.clone()));
//!
//! let subject = Subject::of_model(node, model);
//! let suite = Suite::new(network, capture, subject, Options { only: vec!["SDO 05".into()], ..Options::default() });
//! let report = sim::block_on(&mut world, suite.run(|_| ()))??;
//! // CiA 301: a missing sub-index has its own abort code.
//! assert_eq!(report.cases[0].result, Outcome::Pass);
//! assert_eq!(report.cases[0].frames, ["604#4000100100000000", "584#8000100111000906"]);
//! # Ok(())
//! # }
//! ```

mod bench;
mod capture;
mod case;
mod cases;
mod finding;
mod html;
mod junit;
mod options;
mod report;
mod subject;
mod suite;

pub use bench::Restorer;
pub use capture::Capture;
pub use case::{Case, Group, Need};
pub use cases::all;
pub use html::{Circumstances, html};
pub use junit::junit;
pub use options::Options;
pub use report::{CaseResult, Outcome, Report, Summary};
pub use subject::Subject;
pub use suite::{CaseProgress, Suite, SuiteError, selected};

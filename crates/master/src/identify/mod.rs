//! Who is on the bus: what nodes say of themselves, and which model that can be.
//!
//! In: boot-up and heartbeat messages seen, and answers to 1000h and 1018h. Out: one [`Found`] per node. Nodes are
//! asked in windows, all of a window at the same time. Models may share an identity: an object that only some of them
//! have then makes a [`Guess`], never a certainty. What is not known is reported.

mod ask;
pub(crate) mod knowledge;

pub(crate) use ask::has;
pub use ask::{Found, SCAN_TIMEOUT, identity, knowledge};
pub use knowledge::{Guess, Identity, Knowledge, Model};

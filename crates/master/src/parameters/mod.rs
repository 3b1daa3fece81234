//! The parameters of a node as one thing: read, compared, written as a transaction, checked, put back.
//!
//! In: which objects shall have which values, and for which device that was meant. A [`Plan`] reads what the node has now,
//! refuses what cannot be done before anything is written, and lists the writes in the only order that CiA 301 allows. Out:
//! [`Applied`], with every value read back, or an [`ApplyError`] after everything written has been put back in reverse
//! order. A plan's [`undo`](Plan::undo) is known before its first write, so that a program can keep it on a disk and go
//! back after its own death.
//!
//! Nothing here moves a drive: commands and set-points are left out, and a drive in operation enabled is refused. Files are
//! not known here.

mod apply;
mod error;
mod order;
mod plan;
mod read;
mod undone;
mod values;

pub use apply::{Applied, Rounded};
pub use error::{ApplyError, PlanError, Unfit, Why};
pub use order::{ParameterStep, Purpose, from_any_state, in_order};
pub use plan::{Plan, PlanOptions};
pub use read::{Backup, Deviation, verify};
pub use undone::{NotPutBack, Undone, roll_back};
pub use values::is_command;
pub use values::{Difference, Left, Parameters, default_of, diff, wanted_of};

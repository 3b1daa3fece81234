//! The suite in virtual time: against every model, and against nodes that each have one defect.

mod bench;
mod complete;
mod models;
mod restoring;
mod wrong;

//! The suite in virtual time: against every model, and against nodes that each have one defect.

#![allow(clippy::possible_missing_else, reason = "the tables of wrong nodes have a defect a line")]

mod bench;
mod complete;
mod models;
mod restoring;
mod wrong;

//! What comes of a tuning that a session commands.

use canopen::NodeId;
use master::Drive;

use super::{Proposed, Request, TuneReport};
use crate::parameters::transactions::Refusal;

/// What was found of a drive and is proposed, or was tried.
#[derive(Debug)]
pub(crate) struct Tuned {
    pub(crate) request: Request,
    pub(crate) report: TuneReport,
    pub(crate) proposed: Proposed,
}

/// What came of a measurement or a trial.
pub(crate) struct TuneOutcome {
    pub(crate) node: NodeId,
    pub(crate) generation: u64,
    pub(crate) drive: Drive,
    pub(crate) outcome: Result<Tuned, Refusal>,
    /// What could not be put back.
    pub(crate) left: Vec<String>,
}

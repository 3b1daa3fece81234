//! A capture that a session has commanded, by itself or of a test motion: under way, and ended.

use std::cell::Cell;
use std::rc::Rc;

use canopen::NodeId;
use futures_util::future::AbortHandle;
use recording::Capture;
use serde_json::Value;

use crate::parameters::transactions::Refusal;
use crate::test_motion::Followed;

/// A capture that is under way.
pub(crate) struct CaptureRun {
    /// What came until now is enough; a test motion is ended by a stop instead.
    pub(crate) ended: Option<Rc<Cell<bool>>>,
    pub(crate) abort: AbortHandle,
}

/// A capture, its name in the report of the node, and how its points were followed.
pub(crate) type NamedCapture = (String, Capture, Option<Followed>);

/// What came of a capture.
pub(crate) struct CaptureOutcome {
    pub(crate) node: NodeId,
    /// The number of the motion, where it was one.
    pub(crate) generation: Option<u64>,
    /// Captures for the report of the node, and the answer.
    pub(crate) outcome: Result<(Vec<NamedCapture>, Value), Refusal>,
}

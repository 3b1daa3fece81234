//! A capture that a session has commanded: under way, and ended.

use std::cell::Cell;
use std::rc::Rc;

use canopen::NodeId;
use futures_util::future::AbortHandle;
use recording::Capture;
use serde_json::Value;

use crate::parameters::transactions::Refusal;

/// A capture that is under way.
pub(crate) struct CaptureRun {
    /// What came until now is enough.
    pub(crate) ended: Rc<Cell<bool>>,
    pub(crate) abort: AbortHandle,
}

/// What came of a capture.
pub(crate) struct CaptureOutcome {
    pub(crate) node: NodeId,
    pub(crate) outcome: Result<(Capture, Value), Refusal>,
}

//! Commands about captures of a node and its report, as JSON.

use serde::Deserialize;

use crate::test_motion::Order;

/// What is done with what can be measured of a node, and with what is known of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CaptureCommand {
    /// Lists what can be captured of a node.
    CaptureQuantities {},
    /// Captures, and puts everything back. The answer comes at the end.
    Capture(CaptureOrder),
    /// Ends the capture of a node: what came until then is its answer.
    EndCapture {},
    /// Moves a drive by a test motion and captures each run. The answer comes at the end, or when it was stopped: what came until then.
    TestMotion(TestMotionOrder),
    /// Reads a node for a report; the answer is a page.
    Report {
        /// Date and time of the report, as the reader has them.
        at: String,
        /// Who makes it.
        by: Option<String>,
    },
}

/// A capture: `{"quantities":["velocity","current"],"period_ms":1,"duration_ms":2000,"trigger":"velocity > 10","pre_ms":50}`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureOrder {
    /// By their names: `velocity`, `true_velocity`, `6041h`.
    pub quantities: Vec<String>,
    /// Time between two readings.
    pub period_ms: f64,
    /// Length, from the begin or from the trigger.
    pub duration_ms: f64,
    /// What begins it: `velocity > 10`; at once without one.
    pub trigger: Option<String>,
    /// What is kept of before the trigger.
    #[serde(default)]
    pub pre_ms: f64,
    /// TPDOs that are taken although they are in use: `tpdo1`.
    #[serde(default)]
    pub take: Vec<String>,
    /// What has no room in a TPDO is read by SDO.
    #[serde(default)]
    pub sdo: bool,
}

/// A test motion with what is captured of it: `{"motion":{"shape":"steps","speed_rpm":60,..},"quantities":[],"capture_ms":2}`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestMotionOrder {
    /// What is moved, how often, and its limits.
    pub motion: Order,
    /// As of a capture; empty: what its figures need.
    #[serde(default)]
    pub quantities: Vec<String>,
    /// Time between two readings; with each point, or every millisecond of steps, without it.
    pub capture_ms: Option<f64>,
    /// What has no room in a TPDO is read by SDO.
    #[serde(default)]
    pub sdo: bool,
}

impl CaptureCommand {
    pub(super) const WORDS: &[&str] = &["capture_quantities", "capture", "end_capture", "test_motion", "report"];

    /// Whether it changes the node: a capture maps its TPDOs, and may start it; a test motion moves it too.
    pub(super) const fn needs_control(&self) -> bool {
        matches!(self, Self::Capture(_) | Self::EndCapture {} | Self::TestMotion(_))
    }
}

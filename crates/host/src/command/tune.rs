//! Commands about gains and ramps of a node, as JSON.

use serde::Deserialize;

use crate::tune::{LoadOrder, Order};

/// What is done about the gains of a drive, or the ramps of a stepper.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum TuneCommand {
    /// What can be found for a node: gains, or ramps; and what is usual for that.
    TuneForm {},
    /// Moves a drive to measure it, and proposes gains. The answer comes at the end, or when it was stopped.
    Tune(Order),
    /// Writes the gains that were proposed last, and moves the drive to try them. The answer comes at the end, or when it was stopped.
    TryGains {},
    /// Computes ramps and currents of a stepper. Nothing moves.
    TuneRamps(LoadOrder),
}

impl TuneCommand {
    pub(super) const WORDS: &[&str] = &["tune_form", "tune", "try_gains", "tune_ramps"];

    /// Whether it moves the node.
    pub(super) const fn needs_control(&self) -> bool {
        matches!(self, Self::Tune(_) | Self::TryGains {})
    }
}

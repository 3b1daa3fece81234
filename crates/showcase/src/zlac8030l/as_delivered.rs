//! What the procedures take from the drive as it is delivered.

/// Node-ID as delivered (3.1).
pub(super) const NODE: u8 = 4;

/// Counts in a turn of the shaft: 4 edges of 1024 encoder lines (200Bh).
pub(super) const COUNTS_PER_TURN: f64 = 4096.0;

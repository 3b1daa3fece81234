//! Suppressors across a bus: they take what would raise it further.
//!
//! A motor that a load drives faster than its bus charges that bus through the diodes of the idle bridge, and the source takes
//! nothing back. The suppressors' heat goes into the heat sink that they sit on.

/// What never changes about them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClampModel {
    /// Voltage from which they conduct.
    pub from_v: f64,
    /// Voltage above that per ampere.
    pub resistance_ohm: f64,
}

impl ClampModel {
    /// What they take from a bus of this voltage.
    #[inline]
    pub(crate) fn power_w(&self, bus_v: f64) -> f64 {
        let above_v = bus_v - self.from_v;
        if above_v > 0.0 { bus_v * above_v / self.resistance_ohm } else { 0.0 }
    }
}

//! Holding brake on the motor's shaft: dry friction while it is engaged.
//!
//! A spring engages it, current releases it. It takes effect at once; the coil's delay is left to the drive's own
//! brake timing, which the model does not second-guess.

/// What never changes about a brake.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BrakeModel {
    /// Friction torque while engaged; zero for a motor without a brake.
    pub holding_nm: f64,
}

impl BrakeModel {
    /// Friction torque on the shaft.
    #[inline]
    pub fn torque_nm(&self, released: bool) -> f64 {
        if released { 0.0 } else { self.holding_nm }
    }
}

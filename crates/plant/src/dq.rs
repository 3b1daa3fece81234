//! A vector along and across the magnets.

/// A vector in the rotor's frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Dq {
    /// Along the magnets.
    pub d: f64,
    /// Across the magnets: the torque-producing axis.
    pub q: f64,
}

impl Dq {
    pub(crate) fn magnitude(self) -> f64 {
        libm::sqrt(self.d * self.d + self.q * self.q)
    }
}

//! A current that follows its target along a slope, as profile torque (CiA 402-2, clause 17) asks for.

use motion::slew::Slew;

/// The demanded current, on its way to the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Torque {
    slew: Slew,
}

impl Torque {
    /// One period; returns the demanded current in A. `slope_a_s` of 0 follows at once.
    pub(super) fn update(&mut self, target_a: f32, slope_a_s: f32, dt_s: f32) -> f32 {
        let rate = if slope_a_s > 0.0 { slope_a_s } else { f32::INFINITY };
        self.slew.toward(target_a, rate, dt_s)
    }

    /// The demanded current in A.
    pub(super) const fn demand_a(&self) -> f32 {
        self.slew.value
    }

    /// From zero again.
    pub(super) fn restart(&mut self) {
        self.slew.value = 0.0;
    }
}

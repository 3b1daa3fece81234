//! Cogging: the magnets' pull at the teeth, without any current.
//!
//! ```text
//! torque = -amplitude sin(n angle)        energy = -amplitude / n cos(n angle)
//! ```
//!
//! It takes nothing over a turn and gives nothing. A motor has none unless it is asked for.

use crate::angle::{Angle, Axis};

/// How much a motor cogs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cogging {
    /// Peak torque.
    pub amplitude_nm: f64,
    /// Places of rest in a turn: the least common multiple of magnets and teeth.
    pub per_turn: u32,
}

impl Cogging {
    /// Torque on the rotor at an angle.
    #[cold]
    pub fn torque_nm(&self, angle: Angle) -> f64 {
        -self.amplitude_nm * self.phase(angle).sin
    }

    /// Energy stored at an angle, none at a place of rest.
    pub fn energy_j(&self, angle: Angle) -> f64 {
        self.amplitude_nm / f64::from(self.per_turn) * (1.0 - self.phase(angle).cos)
    }

    fn phase(&self, angle: Angle) -> Axis {
        Axis::at_turns(angle.fraction() * f64::from(self.per_turn))
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_torque_is_the_slope_of_the_energy_and_both_repeat_with_each_tooth() {
        let cogging = Cogging { amplitude_nm: 0.05, per_turn: 270 };
        let at = |turns: f64| Angle::default().advanced_by(turns);
        for step in 0..500 {
            let turns = f64::from(step) * 1.1e-5;
            let slope = (cogging.energy_j(at(turns + 1e-7)) - cogging.energy_j(at(turns - 1e-7))) / (2e-7 * TAU);
            assert!((cogging.torque_nm(at(turns)) + slope).abs() < 1e-6, "{turns}");
            assert!((cogging.torque_nm(at(turns)) - cogging.torque_nm(at(turns + 4.0 / 270.0))).abs() < 1e-9);
        }
        assert!((cogging.torque_nm(at(0.25 / 270.0)) + 0.05).abs() < 1e-9, "it pulls back");
    }
}

//! Bleeder: burns what the braking motor feeds back, between two voltages, and guards its resistor.

/// How the bleeder is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BleederLimits {
    /// Used at all.
    pub enabled: bool,
    /// Bus voltage that switches it on.
    pub on_v: f32,
    /// Bus voltage that switches it off.
    pub off_v: f32,
    /// Conductance of the resistor.
    pub conductance_s: f32,
    /// Power that the resistor bears for ever.
    pub rated_w: f32,
    /// Energy beyond that power which it bears once: the switch stays open until it is given off.
    pub overload_j: f32,
}

/// Whether the switch is closed, and the energy that the resistor has yet to give off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bleeder {
    on: bool,
    stored_j: f32,
    overloaded: bool,
}

impl Bleeder {
    /// One period; returns whether the switch is closed.
    #[inline]
    pub fn update(&mut self, limits: &BleederLimits, bus_v: f32, dt_s: f32) -> bool {
        if !limits.enabled || bus_v <= limits.off_v {
            self.on = false;
        } else if bus_v >= limits.on_v {
            self.on = true;
        }
        if !self.on && self.stored_j == 0.0 {
            return false;
        }
        let heat_w = if self.on && !self.overloaded { bus_v * bus_v * limits.conductance_s } else { 0.0 };
        self.stored_j = (self.stored_j + (heat_w - limits.rated_w) * dt_s).max(0.0);
        self.overloaded = self.stored_j > limits.overload_j || (self.overloaded && self.stored_j > 0.0);
        self.on && !self.overloaded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: BleederLimits = BleederLimits {
        enabled: true,
        on_v: 70.0,
        off_v: 62.0,
        conductance_s: 0.2,
        rated_w: 100.0,
        overload_j: 1000.0,
    };

    #[test]
    fn switches_between_its_two_voltages() {
        let mut bleeder = Bleeder::default();
        let states = [65.0, 70.0, 65.0, 62.0, 65.0].map(|bus_v| bleeder.update(&LIMITS, bus_v, 50e-6));
        assert_eq!(states, [false, true, true, false, false]);
    }

    #[test]
    fn rests_when_the_resistor_has_taken_all_it_can() {
        let mut bleeder = Bleeder::default();
        let seconds = (0..200_000).filter(|_| bleeder.update(&LIMITS, 70.0, 1e-3)).count() as f32 * 1e-3;
        // 980 W while on: on average no more than 100 W of 200 s, and the energy once.
        assert!((seconds * 980.0 - 100.0 * 200.0).abs() < 1500.0, "{seconds} s on");
    }

    #[test]
    fn stays_off_when_it_is_not_fitted() {
        let limits = BleederLimits { enabled: false, ..LIMITS };
        assert!(!Bleeder::default().update(&limits, 75.0, 1e-3));
    }
}

//! Field weakening: more speed than the bus gives by itself, by a current against the magnets.
//!
//! The voltage that a motor needs grows with its speed, about `w (psi + L_d i_d)`. When the current loops ask for more than
//! the bus has, a regulator turns the current's vector from the q axis towards -d, up to a largest angle, and back as soon
//! as there is voltage to spare:
//!
//! ```text
//! i_d = -I sin(advance)      d advance/dt ~ asked / available - reserve
//! ```
//!
//! In go the magnitudes of both voltages, out comes the d current; what it leaves of the limit for torque is
//! [`torque_share`]. Meant for the rate of the velocity loop, well below the current loop's.

/// How it is set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldWeakeningGains {
    /// d current at the largest advance, A: the current's limit times the sine of the angle. 0 for no weakening.
    pub most_a: f32,
    /// Share of the available voltage that is regulated to, a little under 1 so that the current loops keep a grip.
    pub voltage_share: f32,
    /// Speed of the regulator: share of the largest advance per second and share of the voltage.
    pub integral_per_s: f32,
}

/// State: how much of the largest advance is used, 0 to 1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldWeakening {
    depth: f32,
}

impl FieldWeakening {
    /// One period: the d current set-point in A, zero or negative. `asked_v` is what the current loops asked for before any
    /// limit, `available_v` what the bus can give.
    pub fn update(&mut self, gains: &FieldWeakeningGains, asked_v: f32, available_v: f32, dt_s: f32) -> f32 {
        if !(available_v > 0.0 && asked_v.is_finite()) {
            self.reset();
            return 0.0;
        }
        let excess = asked_v / available_v - gains.voltage_share;
        self.depth = (self.depth + gains.integral_per_s * excess * dt_s).clamp(0.0, 1.0);
        -gains.most_a * self.depth
    }

    /// Back to the whole field.
    pub fn reset(&mut self) {
        self.depth = 0.0;
    }
}

/// What a d current leaves of a limit of the whole current for torque.
pub fn torque_share(limit_a: f32, direct_a: f32) -> f32 {
    libm::sqrtf((limit_a * limit_a - direct_a * direct_a).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: FieldWeakeningGains = FieldWeakeningGains { most_a: 5.0, voltage_share: 0.99, integral_per_s: 400.0 };
    const DT_S: f32 = 0.5e-3;

    #[test]
    fn on_a_motor_the_voltage_settles_at_its_share_and_the_current_at_the_closed_form() {
        // Unloaded, losses left out: v = w (psi + L i_d). 25 V are asked for, 20 V are there.
        let (omega, psi, inductance_h, available_v) = (4000.0, 6.25e-3, 0.4e-3, 20.0);
        let mut weakening = FieldWeakening::default();
        let mut direct_a = 0.0;
        for _ in 0..2000 {
            let asked_v = omega * (psi + inductance_h * direct_a);
            direct_a = weakening.update(&GAINS, asked_v, available_v, DT_S);
        }
        let expected = (0.99 * available_v / omega - psi) / inductance_h;
        assert!((direct_a - expected).abs() < 1e-3, "{direct_a} A, not {expected}");
    }

    #[test]
    fn it_ends_at_its_largest_current_and_goes_back_to_none() {
        let mut weakening = FieldWeakening::default();
        let mut direct_a = 0.0;
        for _ in 0..2000 {
            direct_a = weakening.update(&GAINS, 30.0, 20.0, DT_S);
        }
        assert_eq!(direct_a, -5.0);
        for _ in 0..2000 {
            direct_a = weakening.update(&GAINS, 10.0, 20.0, DT_S);
        }
        assert_eq!(direct_a, 0.0);
        assert_eq!(weakening.update(&GAINS, 10.0, 0.0, DT_S), 0.0, "without a bus there is nothing to weaken for");
    }

    #[test]
    fn both_currents_together_are_the_limit() {
        assert_eq!(torque_share(5.0, -3.0), 4.0);
        assert_eq!(torque_share(5.0, 0.0), 5.0);
        assert_eq!(torque_share(2.0, -3.0), 0.0);
    }
}

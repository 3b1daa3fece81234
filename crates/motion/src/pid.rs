//! Proportional-integral controller with anti-windup by back-calculation.
//!
//! ```text
//! u = kp e + I + feed_forward           out = clamp(u)
//! dI/dt = ki e + (ki / kp) (out - u)
//! ```
//!
//! The last term bleeds the integral as fast as the loop's own integral time `kp / ki` while the output is at its
//! limit, so that the loop leaves the limit as soon as the error turns. With `kp = 0` the integral is held instead.
//! There is no derivative term: each loop of the cascade closes around the measured derivative of the next.

/// Gains in the units of their loop: output per error, and output per error and second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PiGains {
    /// kp.
    pub proportional: f32,
    /// ki.
    pub integral_per_s: f32,
}

impl PiGains {
    /// From a gain and an integral time `kp / ki`.
    pub fn from_integral_time(proportional: f32, integral_time_s: f32) -> Self {
        PiGains { proportional, integral_per_s: proportional / integral_time_s }
    }

    /// Current loop of a winding, by cancelling its pole: `kp = w L`, `ki = w R` leave a first-order loop of
    /// bandwidth `w`.
    pub fn for_winding(bandwidth_rad_s: f32, resistance_ohm: f32, inductance_h: f32) -> Self {
        PiGains { proportional: bandwidth_rad_s * inductance_h, integral_per_s: bandwidth_rad_s * resistance_ohm }
    }

    /// Velocity loop around an inertia: output in amperes, error in rad/s.
    ///
    /// `kp = w J / Kt` puts the crossover at `w`; `separation` is how far below it the integral acts
    /// (`ki = kp w / separation`): 4 makes the closed loop critically damped, more makes it calmer.
    pub fn for_inertia(bandwidth_rad_s: f32, inertia_kg_m2: f32, torque_constant_nm_a: f32, separation: f32) -> Self {
        let proportional = bandwidth_rad_s * inertia_kg_m2 / torque_constant_nm_a;
        PiGains { proportional, integral_per_s: proportional * bandwidth_rad_s / separation }
    }
}

/// State: the integral, in units of the output.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pi {
    /// The integral part of the output.
    pub integral: f32,
}

impl Pi {
    /// One period with a symmetric limit; returns the limited output.
    #[inline]
    pub fn update(&mut self, gains: &PiGains, error: f32, feed_forward: f32, limit: f32, dt_s: f32) -> f32 {
        let wanted = self.propose(gains, error, feed_forward);
        let output = if wanted > limit {
            limit
        } else if wanted < -limit {
            -limit
        } else {
            wanted
        };
        self.settle(gains, error, wanted, output, dt_s);
        output
    }

    /// The output before any limit. For loops whose limit is shared: propose all, limit, then [`settle`](Pi::settle).
    #[inline]
    pub fn propose(&self, gains: &PiGains, error: f32, feed_forward: f32) -> f32 {
        gains.proportional * error + (self.integral + feed_forward)
    }

    /// Integrates, knowing what became of the proposed output.
    #[inline]
    pub fn settle(&mut self, gains: &PiGains, error: f32, wanted: f32, output: f32, dt_s: f32) {
        let rest = output - wanted;
        if rest == 0.0 {
            self.integral += gains.integral_per_s * error * dt_s;
        } else if gains.proportional > 0.0 {
            // ki dt (e + rest / kp), never more than the whole integral time at once.
            let share = (gains.integral_per_s * dt_s / gains.proportional).min(1.0);
            self.integral += share * (gains.proportional * error + rest);
        }
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        *self = Pi::default();
    }
}

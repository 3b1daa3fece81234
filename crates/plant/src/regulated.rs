//! A winding under its current loop: by the closed form, or in control periods while the voltage is used up.

use crate::current_loop::{ClosedForm, CurrentLoop, LoopData, short_steps};
use crate::pmsm::{Dq, INV_SQRT_3, PmsmData, PmsmInput, PmsmModel, PmsmOutput, Winding};

impl PmsmModel {
    /// Moves the winding by one step under its current loop on a bus.
    // Apart, so that the steps of control periods stay as small as they are.
    #[inline(never)]
    pub(crate) fn regulate(&self, data: &mut PmsmData, dt_s: f64, input: &PmsmInput, bus_v: f64) -> PmsmOutput {
        let settings = &data.current_loop.settings;
        let omega = f64::from(self.pole_pairs) * input.velocity_rad_s;
        let limit_v = bus_v * INV_SQRT_3 * settings.modulation_limit;
        let within = |wanted: Dq| wanted.d * wanted.d + wanted.q * wanted.q <= limit_v * limit_v;
        let (before_j, seen_a) = (self.magnetic_energy_j(data), settings.seen(data.current_a));
        let proposed_v = settings.wanted_v(data.current_loop.integral_v, seen_a, omega);
        let even = self.inductance_d_h == self.inductance_q_h;
        let means = if even && within(proposed_v) {
            if !data.current_loop.closed.is_of(self.inductance_q_h, dt_s, settings, input.resistance_ohm) {
                data.current_loop.closed = ClosedForm::new(self.inductance_q_h, dt_s, settings, input.resistance_ohm);
            }
            let solved = self.solve(&data.current_loop, seen_a, proposed_v, (omega, dt_s));
            within(solved.wanted_v).then(|| solved.take(data))
        } else {
            None
        };
        let means = match means {
            Some(means) => means,
            None => self.regulate_in_short_steps(data, dt_s, input, limit_v),
        };
        let heat_w = input.resistance_ohm * means.heat_w_per_ohm;
        let stored_w = (self.magnetic_energy_j(data) - before_j) / dt_s;
        PmsmOutput { bus_w: heat_w + means.torque_nm * input.velocity_rad_s + stored_w, ..means }
    }

    /// One step of both axes by their closed form; what they do to each other goes by the current that the other had, or has in
    /// the mean.
    #[inline]
    fn solve(&self, data: &LoopData, before: Dq, proposed_v: Dq, (omega, dt_s): (f64, f64)) -> Solved {
        let LoopData { integral_v, settings, closed, .. } = data;
        let CurrentLoop { setpoint_a, known, ahead, .. } = settings;
        // What of the voltage comes from where the frame stood before, which is little.
        let given_v = settings.late(proposed_v, omega);
        let late_v = Dq { d: given_v.d - proposed_v.d, q: given_v.q - proposed_v.q };
        let flux_q_wb = known.flux_linkage_wb - self.flux_linkage_wb * ahead.cos;
        let rest_q = omega * ((known.inductance_d_h - self.inductance_d_h) * before.d + flux_q_wb) + late_v.q;
        let (q, mean_q) = closed.step([before.q, integral_v.q], setpoint_a.q, rest_q, settings, dt_s);
        let flux_d_wb = self.flux_linkage_wb * ahead.sin;
        let rest_d = omega * ((self.inductance_q_h - known.inductance_q_h) * mean_q + flux_d_wb) + late_v.d;
        let (d, mean_d) = closed.step([before.d, integral_v.d], setpoint_a.d, rest_d, settings, dt_s);
        let (seen_a, integral_v) = (Dq { d: d[0], q: q[0] }, Dq { d: d[1], q: q[1] });
        // A ramp about its mean: the mean of the square is larger by a twelfth of the square of its height.
        let (rise_d, rise_q) = (d[0] - before.d, q[0] - before.q);
        let ramp = (rise_d * rise_d + rise_q * rise_q) * (1.0 / 12.0);
        Solved {
            seen_a,
            current_a: settings.true_of(seen_a),
            integral_v,
            wanted_v: settings.wanted_v(integral_v, seen_a, omega),
            means: PmsmOutput {
                torque_nm: self.torque_nm(settings.true_of(Dq { d: mean_d, q: mean_q })),
                heat_w_per_ohm: 1.5 * (mean_d * mean_d + mean_q * mean_q + ramp),
                ..PmsmOutput::default()
            },
        }
    }

    /// The same as the controller itself goes: proposes, is limited, integrates what is left of it.
    #[cold]
    #[inline(never)]
    fn regulate_in_short_steps(&self, data: &mut PmsmData, dt_s: f64, input: &PmsmInput, limit_v: f64) -> PmsmOutput {
        let settings = data.current_loop.settings;
        let steps = short_steps(dt_s);
        let share = 1.0 / f64::from(steps);
        let short_s = dt_s * share;
        let omega = f64::from(self.pole_pairs) * input.velocity_rad_s;
        let mut means = PmsmOutput::default();
        for _ in 0..steps {
            let seen_a = settings.seen(data.current_a);
            let wanted = settings.wanted_v(data.current_loop.integral_v, seen_a, omega);
            let voltage_v = within_circle(wanted, limit_v);
            let error = Dq { d: settings.setpoint_a.d - seen_a.d, q: settings.setpoint_a.q - seen_a.q };
            let integral_v = data.current_loop.integral_v;
            data.current_loop.integral_v = Dq {
                d: settings.settled(integral_v.d, error.d, voltage_v.d - wanted.d, short_s),
                q: settings.settled(integral_v.q, error.q, voltage_v.q - wanted.q, short_s),
            };
            (data.current_loop.wanted_v, data.current_loop.saturated) = (wanted, voltage_v != wanted);
            let mean = Winding::new(self, data, short_s, input)
                .mean_current(settings.true_of(settings.late(voltage_v, omega)));
            data.current_a = Dq { d: 2.0 * mean.d - data.current_a.d, q: 2.0 * mean.q - data.current_a.q };
            data.current_loop.seen_a = settings.seen(data.current_a);
            means.torque_nm += share * self.torque_nm(mean);
            means.heat_w_per_ohm += share * 1.5 * (mean.d * mean.d + mean.q * mean.q);
        }
        means
    }
}

/// Both axes at the end of a step, and its means.
struct Solved {
    seen_a: Dq,
    current_a: Dq,
    integral_v: Dq,
    wanted_v: Dq,
    means: PmsmOutput,
}

impl Solved {
    #[inline]
    fn take(self, data: &mut PmsmData) -> PmsmOutput {
        data.current_a = self.current_a;
        data.current_loop.seen_a = self.seen_a;
        data.current_loop.integral_v = self.integral_v;
        data.current_loop.wanted_v = self.wanted_v;
        data.current_loop.saturated = false;
        self.means
    }
}

/// What a bus can give of a voltage: d keeps its part first, as in `motion::limits`.
fn within_circle(Dq { d, q }: Dq, radius_v: f64) -> Dq {
    let radius_v = radius_v.max(0.0);
    let d = d.clamp(-radius_v, radius_v);
    let room = (radius_v * radius_v - d * d).max(0.0);
    Dq { d, q: if q * q <= room { q } else { libm::sqrt(room).copysign(q) } }
}

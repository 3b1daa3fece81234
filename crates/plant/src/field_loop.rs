//! A stepper's two currents under the loop that regulates them, seen from the field that the drive turns, in closed form.
//!
//! With the currents as one vector `i = d + j q` in the frame of a field that turns at `w`, a PI controller for each axis and a
//! voltage that comes `t` late, which the frame makes up for by its own angle:
//!
//! ```text
//! (L - kp t) di/dt = kp (i* - i) + u - (R + j w L) i - e          du/dt = ki (i* - i)
//! e = j w_rotor psi exp(j (rotor - field))
//! ```
//!
//! The delay is taken to its first order, and `u`, which is ten milliseconds slow, once a step; the rest is the exact solution over
//! a step. Where the bus has less than the controllers ask for, the voltage keeps their direction at the length that there is, gives
//! way to the swings of the current ([`GiveWay`]) and stands still for the step, some control periods long: that is the delay again.
//!
//! Deliberately absent: ripple, single phases, and the instability of gains at which the sampled loop swings by itself.

use crate::angle::Axis;
use crate::dq::Dq;

/// What of the inductance a late voltage leaves to the closed form, at the least.
const LEAST_INDUCTANCE_SHARE: f64 = 0.25;

/// What is asked of the loop, and how it is set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldLoop {
    /// Where the field stands at the beginning, electrical turns.
    pub from_turns: f64,
    /// How far it goes until the end, electrical turns.
    pub way_turns: f64,
    /// It goes by whole pulses: a pulse in electrical turns.
    pub pulse_turns: f64,
    /// Current along the field.
    pub amplitude_a: f64,
    /// Current across it that balances the detent: amplitude of its sine, four periods in an electrical turn.
    pub detent_a: f64,
    /// How far ahead that is asked for, electrical turns.
    pub detent_lead_turns: f64,
    /// Of both controllers, V/A.
    pub proportional: f64,
    /// Of both controllers, V/(A s).
    pub integral_per_s: f64,
    /// Share of the bus voltage that may be used.
    pub modulation_limit: f64,
    /// From sampling the currents to the middle of the period in which the voltage acts, s.
    pub voltage_lag_s: f64,
    /// What the voltage vector does at its limit.
    pub give_way: GiveWay,
}

/// How a voltage vector at its limit falls back for what swings of the current along it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GiveWay {
    /// How far, turns/A.
    pub turns_per_a: f64,
    /// Share of the current across it that counts beside the one along it.
    pub across_share: f64,
    /// Two low-passes, between which lies what swings: the share of the way that each goes in a control period.
    pub passed: [f64; 2],
    /// Share of their rate at which the controllers' integrals follow.
    pub integral_share: f64,
}

/// State of the loop.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FieldData {
    /// What is asked of it, and how it is set.
    pub settings: FieldLoop,
    /// The integral parts of the voltage.
    pub(crate) integral_v: Dq,
    /// How the currents changed in the last step, A/s.
    change_a_s: Dq,
    /// Current along a voltage vector at its limit, behind the two low-passes.
    along_a: Option<[f64; 2]>,
    free: Decay,
    limited: Decay,
    /// Control periods in the longest part of a step, and for which current, inertia and step that is so.
    pub(crate) longest: ([f64; 3], u32),
}

/// How much of a current is left after a step of a winding that decays at a rate, and what that was made for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Decay {
    made_for: [f64; 2],
    left: f64,
}

/// What acts on the currents during one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FieldStep {
    pub(crate) dt_s: f64,
    /// Control periods in it.
    pub(crate) periods: u32,
    /// How far the field turns in it, electrical.
    pub(crate) field_rad: f64,
    /// How far the rotor is expected to.
    pub(crate) rotor_rad: f64,
    /// Where the rotor stands from the field, in the middle.
    pub(crate) ahead: Axis,
    pub(crate) resistance_ohm: f64,
    pub(crate) inductance_h: f64,
    pub(crate) flux_linkage_wb: f64,
    /// The longest voltage vector.
    pub(crate) limit_v: f64,
}

/// What they did, as means over the step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FieldOutput {
    /// Current across the magnets.
    pub(crate) torque_a: f64,
    /// Current along the magnets: what holds the rotor to the field.
    pub(crate) holding_a: f64,
    /// Square of the current.
    pub(crate) heat_w_per_ohm: f64,
}

/// How a coupled shaft is expected to turn in its step, and what was computed for that.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Expected {
    pub(crate) velocity_rad_s: f64,
    /// Torque for each rad/s that it turns slower in the mean.
    pub(crate) give_nm_s: f64,
    pub(crate) current_nm: f64,
    pub(crate) motor_j: f64,
}

impl FieldData {
    /// The bridges do something else: the loop begins anew when it comes back.
    pub(crate) fn release(&mut self) {
        let Self { free, limited, longest, settings, .. } = *self;
        *self = Self { free, limited, longest, settings, ..Self::default() };
    }

    /// What resists a voltage that the rotor's speed induces: with the controllers, unless theirs is at its limit.
    pub(crate) fn seen_ohm(&self, resistance_ohm: f64) -> f64 {
        if self.along_a.is_some() { f64::INFINITY } else { resistance_ohm + self.settings.proportional }
    }

    /// What the controllers propose.
    #[inline]
    pub(crate) fn wanted_v(&self, wanted_a: Dq, current_a: Dq) -> Dq {
        let kp = self.settings.proportional;
        Dq {
            d: kp * (wanted_a.d - current_a.d) + self.integral_v.d,
            q: kp * (wanted_a.q - current_a.q) + self.integral_v.q,
        }
    }

    /// Current that is asked for, where the detent is balanced for this direction of the field.
    #[inline]
    pub(crate) fn wanted_a(&self, field: Axis) -> Dq {
        let FieldLoop { amplitude_a, detent_a, detent_lead_turns, .. } = self.settings;
        let Axis { sin, cos } = field.turned_by(Axis::at_small_rad(detent_lead_turns * core::f64::consts::TAU));
        let across_a = detent_a * four_times(sin, cos);
        Dq { d: amplitude_a - 0.5 * across_a * across_a / amplitude_a, q: across_a }
    }

    /// Moves the currents by one step.
    #[inline]
    pub(crate) fn step(&mut self, current_a: &mut Dq, wanted_a: Dq, wanted_v: Dq, step: &FieldStep) -> FieldOutput {
        let FieldStep { dt_s, field_rad, rotor_rad, resistance_ohm, inductance_h, limit_v, .. } = *step;
        let per_s = 1.0 / dt_s;
        let omega_l = field_rad * per_s * inductance_h;
        let slip = sinc(rotor_rad - field_rad);
        let emf_v = step.flux_linkage_wb * rotor_rad * per_s * slip;
        let Axis { sin, cos } = step.ahead;
        let square = wanted_v.d * wanted_v.d + wanted_v.q * wanted_v.q;
        let limited = square > limit_v * limit_v;
        // What drives the current, the resistance that it sees, and the inductance.
        let (drive_v, seen_ohm, seen_h) = if limited {
            let given_v = self.limited_v(wanted_a, *current_a, limit_v, step);
            (given_v, resistance_ohm, inductance_h)
        } else {
            self.along_a = None;
            let FieldLoop { proportional, voltage_lag_s, .. } = self.settings;
            let left_h = (inductance_h - proportional * voltage_lag_s).max(LEAST_INDUCTANCE_SHARE * inductance_h);
            let drive_v = Dq {
                d: proportional * wanted_a.d + self.integral_v.d,
                q: proportional * wanted_a.q + self.integral_v.q,
            };
            (drive_v, resistance_ohm + proportional, left_h)
        };
        let decay = if limited { &mut self.limited } else { &mut self.free };
        let left = decay.left(dt_s, seen_ohm / seen_h);
        let turn = Axis::at_small_rad(omega_l * dt_s / seen_h);
        let (drive_d, drive_q) = (drive_v.d + emf_v * sin, drive_v.q - emf_v * cos);
        // Where it goes: drive / (seen + j w L).
        let share = 1.0 / (seen_ohm * seen_ohm + omega_l * omega_l);
        let (real, imaginary) = (seen_ohm * share, omega_l * share);
        let end = Dq { d: drive_d * real + drive_q * imaginary, q: drive_q * real - drive_d * imaginary };
        let off = Dq { d: current_a.d - end.d, q: current_a.q - end.q };
        let (left_d, left_q) = (left * turn.cos, -left * turn.sin);
        let after = Dq { d: end.d + off.d * left_d - off.q * left_q, q: end.q + off.q * left_d + off.d * left_q };
        // The mean of what decays: off (1 - left) / (seen + j w L) * seen_h / dt.
        let (gone, scale) = (Dq { d: current_a.d - after.d, q: current_a.q - after.q }, seen_h * per_s);
        let mean = Dq {
            d: end.d + scale * (gone.d * real + gone.q * imaginary),
            q: end.q + scale * (gone.q * real - gone.d * imaginary),
        };
        if !limited {
            let gain = self.settings.integral_per_s * dt_s;
            self.integral_v.d += gain * (wanted_a.d - mean.d);
            self.integral_v.q += gain * (wanted_a.q - mean.q);
        }
        self.change_a_s = Dq { d: -per_s * gone.d, q: -per_s * gone.q };
        *current_a = after;
        FieldOutput {
            torque_a: slip * (mean.q * cos - mean.d * sin),
            holding_a: slip * (mean.d * cos + mean.q * sin),
            heat_w_per_ohm: mean.d * mean.d + mean.q * mean.q + (gone.d * gone.d + gone.q * gone.q) * (1.0 / 12.0),
        }
    }

    /// What the bus gives of a voltage that is longer, and the integrals: as in the firmware, whose control periods these are.
    fn limited_v(&mut self, wanted_a: Dq, current_a: Dq, limit_v: f64, step: &FieldStep) -> Dq {
        let FieldLoop { proportional, integral_per_s, give_way, voltage_lag_s, .. } = self.settings;
        // The voltage stands still from now on: in the middle it is half a step late by itself.
        let earlier_s = voltage_lag_s - 0.5 * step.dt_s;
        let current_a =
            Dq { d: current_a.d - earlier_s * self.change_a_s.d, q: current_a.q - earlier_s * self.change_a_s.q };
        let wanted_v = self.wanted_v(wanted_a, current_a);
        let share = limit_v / wanted_v.magnitude().max(limit_v).max(f64::MIN_POSITIVE);
        let given = Dq { d: wanted_v.d * share, q: wanted_v.q * share };
        if proportional > 0.0 {
            let rate = (integral_per_s * give_way.integral_share * step.dt_s / proportional).min(1.0);
            self.integral_v.d += rate * (proportional * (wanted_a.d - current_a.d) + given.d - wanted_v.d);
            self.integral_v.q += rate * (proportional * (wanted_a.q - current_a.q) + given.q - wanted_v.q);
        }
        let ahead = if step.field_rad < 0.0 { -1.0 } else { 1.0 };
        let across = ahead * (given.d * current_a.q - given.q * current_a.d);
        let along = given.d * current_a.d + given.q * current_a.q;
        let swing_a = (along - give_way.across_share * across) / limit_v.max(f64::MIN_POSITIVE);
        let mut passed = self.along_a.unwrap_or([swing_a; 2]);
        for (passed_a, share) in passed.iter_mut().zip(give_way.passed) {
            *passed_a += over_periods(share, step.periods) * (swing_a - *passed_a);
        }
        self.along_a = Some(passed);
        let back_turns = (give_way.turns_per_a * (passed[0] - passed[1])).clamp(-0.25, 0.25);
        let Axis { sin, cos } = Axis::at_small_rad(-ahead * back_turns * core::f64::consts::TAU);
        Dq { d: given.d * cos - given.q * sin, q: given.q * cos + given.d * sin }
    }
}

impl Decay {
    #[inline]
    fn left(&mut self, dt_s: f64, rate_per_s: f64) -> f64 {
        if self.made_for != [dt_s, rate_per_s] {
            *self = Self { made_for: [dt_s, rate_per_s], left: libm::exp(-dt_s * rate_per_s) };
        }
        self.left
    }
}

/// The sine of four times an angle.
#[inline]
pub(crate) fn four_times(sin: f64, cos: f64) -> f64 {
    4.0 * sin * cos * (1.0 - 2.0 * sin * sin)
}

/// What a low-pass goes of its way in several periods, by what it goes in one.
#[inline]
fn over_periods(share: f64, periods: u32) -> f64 {
    let twice = |share: f64| share * (2.0 - share);
    match periods {
        1 => share,
        2 => twice(share),
        4 => twice(twice(share)),
        _ => 1.0 - libm::pow(1.0 - share, f64::from(periods)),
    }
}

/// The mean of the cosine over an angle about zero, `sin(x/2) / (x/2)`.
#[inline]
fn sinc(turned_rad: f64) -> f64 {
    let half = 0.5 * turned_rad;
    if half.abs() < 0.1 {
        return 1.0 - half * half * (1.0 / 6.0);
    }
    Axis::at_turns(half / core::f64::consts::TAU).sin / half
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: FieldLoop = FieldLoop {
        from_turns: 0.0,
        way_turns: 0.0,
        pulse_turns: 1.0 / 80.0,
        amplitude_a: 1.2,
        detent_a: 0.0,
        detent_lead_turns: 0.0,
        proportional: 15.0,
        integral_per_s: 1500.0,
        modulation_limit: 0.98,
        voltage_lag_s: 75e-6,
        give_way: GiveWay { turns_per_a: 0.16, across_share: 0.15, passed: [0.07, 1.7e-3], integral_share: 0.3 },
    };
    const WANTED_A: Dq = Dq { d: 1.2, q: 0.0 };

    fn step(dt_s: f64, electrical_rad_s: f64, limit_v: f64) -> FieldStep {
        FieldStep {
            dt_s,
            periods: (dt_s / 50e-6 + 0.5) as u32,
            field_rad: electrical_rad_s * dt_s,
            rotor_rad: electrical_rad_s * dt_s,
            ahead: Axis::at_turns(-0.1),
            resistance_ohm: 1.85,
            inductance_h: 2.8e-3,
            flux_linkage_wb: 4.4e-3,
            limit_v,
        }
    }

    fn advance(field: &mut FieldData, current_a: &mut Dq, step: &FieldStep) -> FieldOutput {
        let wanted_v = field.wanted_v(WANTED_A, *current_a);
        field.step(current_a, WANTED_A, wanted_v, step)
    }

    #[test]
    fn a_step_is_what_its_differential_equations_give() {
        for electrical_rad_s in [0.0, 500.0, -2000.0] {
            let coarse = step(0.5e-3, electrical_rad_s, 1e3);
            let mut field = FieldData { settings: SETTINGS, ..FieldData::default() };
            let (mut current_a, mut by_euler) = (Dq::default(), (Dq::default(), Dq::default()));
            for _ in 0..20 {
                let mean_a = advance(&mut field, &mut current_a, &coarse).torque_a;
                // The same in ten thousand steps, straight from the equations at the top of this file.
                let (mut torque_a, steps) = (0.0, 10_000);
                let h = coarse.dt_s / f64::from(steps);
                let left_h = 2.8e-3 - 15.0 * 75e-6;
                let Axis { sin, cos } = coarse.ahead;
                for _ in 0..steps {
                    let (i, u) = by_euler;
                    let omega_l = electrical_rad_s * 2.8e-3;
                    let (emf_d, emf_q) = (-electrical_rad_s * 4.4e-3 * sin, electrical_rad_s * 4.4e-3 * cos);
                    let d = 15.0 * (1.2 - i.d) + u.d - 1.85 * i.d + omega_l * i.q - emf_d;
                    let q = -15.0 * i.q + u.q - 1.85 * i.q - omega_l * i.d - emf_q;
                    torque_a += (i.q * cos - i.d * sin) / f64::from(steps);
                    by_euler = (
                        Dq { d: i.d + h * d / left_h, q: i.q + h * q / left_h },
                        Dq { d: u.d + h * 1500.0 * (1.2 - i.d), q: u.q - h * 1500.0 * i.q },
                    );
                }
                let apart_a = Dq { d: current_a.d - by_euler.0.d, q: current_a.q - by_euler.0.q }.magnitude();
                // `u`, which is taken once a step, is the most of it.
                assert!(apart_a < 0.03, "{electrical_rad_s} rad/s: {current_a:?}, {by_euler:?}");
                assert!((mean_a - torque_a).abs() < 0.03, "{electrical_rad_s} rad/s: {mean_a}, {torque_a}");
            }
        }
    }

    #[test]
    fn at_the_limit_the_current_is_that_of_a_voltage_of_this_length_whatever_the_parts() {
        // A field that turns at 5000 rad/s and a rotor that stands in it at this angle: |i| by |v - e| / |Z|, and v along i* - i.
        for parts_s in [50e-6, 100e-6, 200e-6] {
            let at_limit = step(parts_s, 5000.0, 20.0);
            let mut field = FieldData { settings: SETTINGS, ..FieldData::default() };
            let mut current_a = Dq::default();
            for _ in 0..(1.0 / parts_s) as u32 {
                advance(&mut field, &mut current_a, &at_limit);
            }
            let Axis { sin, cos } = at_limit.ahead;
            let omega_l = 5000.0 * 2.8e-3;
            let given_v = Dq {
                d: 1.85 * current_a.d - omega_l * current_a.q - 22.0 * sin,
                q: 1.85 * current_a.q + omega_l * current_a.d + 22.0 * cos,
            };
            assert!((given_v.magnitude() - 20.0).abs() < 0.02, "{parts_s} s: {given_v:?}");
            let error_a = Dq { d: 1.2 - current_a.d, q: -current_a.q };
            let across = (given_v.d * error_a.q - given_v.q * error_a.d) / (20.0 * error_a.magnitude());
            assert!(across.abs() < 0.01, "{parts_s} s: {given_v:?} beside {error_a:?}");
        }
    }
}

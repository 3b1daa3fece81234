//! A current loop and its inverter as their closed form, for steps far longer than a control period of the loop.
//!
//! Both axes of the turning frame have a PI controller around the winding. What the motor's own motion induces, less what the
//! controller feeds forward of it, is taken as constant over a step, which leaves two linear equations for each axis:
//!
//! ```text
//! L di/dt = kp (i* - i) + u - R i + rest          du/dt = ki (i* - i)
//! ```
//!
//! They are solved exactly over the step: with `A` the matrix and `b` the constant part,
//! `x(h) = exp(Ah) x(0) + h phi1(Ah) b`, and the mean is `phi1(Ah) x(0) + h phi2(Ah) b`. Where the voltage of the bus does not
//! suffice, the equations are not linear any more: the step is then done in control periods, as the controller itself goes, with its
//! limit and its anti-windup. Currents and powers are means over the step, so that the balance of energies closes.
//!
//! Where the controller's angle is off, its frame stands beside the rotor's, and all of it is computed there: motors with one
//! inductance look the same from any frame but for the voltage that their magnets induce.
//!
//! Deliberately absent: ripple, dead time, the controller's sampling, a wire that is off.

use crate::angle::Axis;
use crate::dq::Dq;

/// A control period, s: so long are the steps of what goes on too fast for a step of a supervision period.
const SHORT_S: f64 = 50e-6;

/// How many of them are in a step.
pub(crate) fn short_steps(dt_s: f64) -> u32 {
    ((dt_s / SHORT_S + 0.5) as u32).max(1)
}

/// Whether a step is a long one.
pub(crate) fn is_long(dt_s: f64) -> bool {
    dt_s > 1.5 * SHORT_S
}

/// Relative change of the winding's resistance at which its closed form is made anew.
const RESISTANCE_STEP: f64 = 1e-4;
/// Terms of the series, which is summed for matrices of a norm up to a quarter: what is left out is below `0.25^9 / 11!`.
const TERMS: u32 = 8;

/// A current loop at work: what is asked of it, and how it is set.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CurrentLoop {
    /// Current that is asked for, in the loop's frame.
    pub setpoint_a: Dq,
    /// How far the magnets are ahead of the loop's frame: what the loop is off by in its angle.
    pub ahead: Axis,
    /// Of both controllers, V/A.
    pub proportional: f64,
    /// Of both controllers, V/(A s).
    pub integral_per_s: f64,
    /// What the controllers know of the motor, to feed it forward; zeros for nothing.
    pub known: KnownMotor,
    /// Share of `bus / sqrt(3)` that may be used.
    pub modulation_limit: f64,
    /// How late the voltage comes, while the rotor turns on.
    pub voltage_lag_s: f64,
}

/// The figures of a motor by which its own voltages are fed forward.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct KnownMotor {
    /// Inductance along the magnets.
    pub inductance_d_h: f64,
    /// Inductance across the magnets.
    pub inductance_q_h: f64,
    /// Flux linkage of the magnets.
    pub flux_linkage_wb: f64,
}

/// State of a current loop: its integrals, and what it made of the last step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LoopData {
    /// The integral parts of the voltage.
    pub integral_v: Dq,
    /// What is asked of it, and how it is set.
    pub settings: CurrentLoop,
    /// The current that the loop sees: in its own frame.
    pub seen_a: Dq,
    /// The voltage that was wanted last.
    pub wanted_v: Dq,
    /// The bus could not give it.
    pub saturated: bool,
    pub(crate) closed: ClosedForm,
}

type Matrix = [[f64; 2]; 2];

/// `exp(Ah)`, `phi1(Ah)` and `h phi2(Ah)` of one axis, and what they were made for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ClosedForm {
    made_for: [f64; 5],
    end: Matrix,
    mean: Matrix,
    mean_of_constant: Matrix,
}

/// Current and integral of an axis.
pub(crate) type AxisState = [f64; 2];

impl LoopData {
    /// The bridge does something else: the loop begins anew when it comes back.
    pub fn release(&mut self) {
        *self = Self { closed: self.closed, settings: self.settings, ..Self::default() };
    }
}

impl CurrentLoop {
    /// A vector of the rotor's frame in the loop's.
    #[inline]
    pub(crate) fn seen(&self, Dq { d, q }: Dq) -> Dq {
        let Axis { sin, cos } = self.ahead;
        Dq { d: d * cos - q * sin, q: q * cos + d * sin }
    }

    /// A vector of the loop's frame in the rotor's.
    #[inline]
    pub(crate) fn true_of(&self, Dq { d, q }: Dq) -> Dq {
        let Axis { sin, cos } = self.ahead;
        Dq { d: d * cos + q * sin, q: q * cos - d * sin }
    }

    /// A voltage by the time it comes, seen from where the frame stands then.
    #[inline]
    pub(crate) fn late(&self, Dq { d, q }: Dq, omega: f64) -> Dq {
        let Axis { sin, cos } = Axis::at_small_rad(omega * self.voltage_lag_s);
        Dq { d: d * cos + q * sin, q: q * cos - d * sin }
    }

    /// What the controllers propose.
    #[inline]
    pub(crate) fn wanted_v(&self, integral_v: Dq, current_a: Dq, omega: f64) -> Dq {
        let KnownMotor { inductance_d_h, inductance_q_h, flux_linkage_wb } = self.known;
        Dq {
            d: self.proportional * (self.setpoint_a.d - current_a.d) + integral_v.d
                - omega * inductance_q_h * current_a.q,
            q: self.proportional * (self.setpoint_a.q - current_a.q)
                + integral_v.q
                + omega * (inductance_d_h * current_a.d + flux_linkage_wb),
        }
    }

    /// An integral after one period: `rest` is what the limit took away. Back-calculation, as in `motion::pid`.
    pub(crate) fn settled(&self, integral_v: f64, error_a: f64, rest_v: f64, dt_s: f64) -> f64 {
        if rest_v == 0.0 {
            return integral_v + self.integral_per_s * error_a * dt_s;
        }
        if self.proportional <= 0.0 {
            return integral_v;
        }
        let share = (self.integral_per_s * dt_s / self.proportional).min(1.0);
        integral_v + share * (self.proportional * error_a + rest_v)
    }
}

impl ClosedForm {
    /// What it was made for has not changed; the resistance hardly.
    #[inline]
    pub(crate) fn is_of(&self, inductance_h: f64, dt_s: f64, settings: &CurrentLoop, resistance_ohm: f64) -> bool {
        let [for_s, for_h, for_proportional, for_integral, for_ohm] = self.made_for;
        for_s == dt_s
            && for_h == inductance_h
            && for_proportional == settings.proportional
            && for_integral == settings.integral_per_s
            && (resistance_ohm - for_ohm).abs() <= RESISTANCE_STEP * resistance_ohm
    }

    #[cold]
    #[inline(never)]
    pub(crate) fn new(inductance_h: f64, dt_s: f64, settings: &CurrentLoop, resistance_ohm: f64) -> Self {
        let CurrentLoop { proportional, integral_per_s, .. } = *settings;
        let made_for = [dt_s, inductance_h, proportional, integral_per_s, resistance_ohm];
        let per_h = 1.0 / inductance_h;
        let mut z = [[-(proportional + resistance_ohm) * per_h * dt_s, per_h * dt_s], [-integral_per_s * dt_s, 0.0]];
        // Halved until the series is short, and the functions doubled back again.
        let mut halvings = 0;
        while z.iter().flatten().any(|entry| entry.abs() > 0.125) && halvings < 40 {
            z = scaled(&z, 0.5);
            halvings += 1;
        }
        // phi2(z) = 1/2! + z/3! + z²/4! + ..., from the last term on.
        let mut phi2 = IDENTITY;
        for term in (3..3 + TERMS).rev() {
            phi2 = plus_identity(&scaled(&product(&z, &phi2), 1.0 / f64::from(term)));
        }
        phi2 = scaled(&phi2, 0.5);
        let mut phi1 = plus_identity(&product(&z, &phi2));
        let mut end = plus_identity(&product(&z, &phi1));
        for _ in 0..halvings {
            phi2 = scaled(&sum(&product(&phi1, &phi1), &scaled(&phi2, 2.0)), 0.25);
            phi1 = scaled(&product(&plus_identity(&end), &phi1), 0.5);
            end = product(&end, &end);
        }
        Self { made_for, end, mean: phi1, mean_of_constant: phi2 }
    }

    /// State at the end of a step, and the mean current of it.
    #[inline]
    pub(crate) fn step(
        &self,
        before: AxisState,
        setpoint_a: f64,
        rest_v: f64,
        settings: &CurrentLoop,
        dt_s: f64,
    ) -> (AxisState, f64) {
        let constant = [
            dt_s * (settings.proportional * setpoint_a + rest_v) / self.made_for[1],
            dt_s * settings.integral_per_s * setpoint_a,
        ];
        let row = |matrix: &Matrix, row: usize, x: &AxisState| matrix[row][0] * x[0] + matrix[row][1] * x[1];
        let after = [0, 1].map(|n| row(&self.end, n, &before) + row(&self.mean, n, &constant));
        (after, row(&self.mean, 0, &before) + row(&self.mean_of_constant, 0, &constant))
    }
}

const IDENTITY: Matrix = [[1.0, 0.0], [0.0, 1.0]];

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1].map(|row| [0, 1].map(|column| a[row][0] * b[0][column] + a[row][1] * b[1][column]))
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1].map(|row| [a[row][0] + b[row][0], a[row][1] + b[row][1]])
}

fn scaled(a: &Matrix, by: f64) -> Matrix {
    a.map(|row| row.map(|entry| entry * by))
}

fn plus_identity(a: &Matrix) -> Matrix {
    sum(a, &IDENTITY)
}

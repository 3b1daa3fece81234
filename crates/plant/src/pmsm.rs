//! Permanent-magnet synchronous motor in the rotor's dq frame, with its inverter seen as terminal conditions.
//!
//! Amplitude-invariant Clarke and Park transforms; the d axis is the magnets' north, the electrical angle is the
//! mechanical angle times the pole pairs:
//!
//! ```text
//! L_d di_d/dt = v_d - R i_d + w L_q i_q              w = pole_pairs * velocity
//! L_q di_q/dt = v_q - R i_q - w L_d i_d - w psi
//! torque      = 3/2 pole_pairs (psi i_q + (L_d - L_q) i_d i_q)
//! power       = 3/2 (v_d i_d + v_q i_q)
//! ```
//!
//! Integration is the implicit midpoint rule: second order, stable at every step length, and it keeps the balance
//! power = copper loss + torque * velocity + change of the magnetic energy to the last bits of a double.
//! Iron loss is left to the friction of [`mechanics`](crate::mechanics); saturation of the iron is not modelled.

use crate::angle::{Angle, Axis};
use crate::current_loop::LoopData;
pub use crate::dq::Dq;
use crate::flows::Flows;

/// Below this current an idle bridge is taken as not conducting.
const NO_CURRENT_A: f64 = 1e-9;
/// Line to line over phase.
pub(crate) const SQRT_3: f64 = 1.732_050_807_568_877_2;
pub(crate) const INV_SQRT_3: f64 = 0.577_350_269_189_625_8;
const HALF_SQRT_3: f64 = 0.866_025_403_784_438_6;

/// What never changes about a motor's winding and magnets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PmsmModel {
    /// Pole pairs: electrical turns per mechanical turn.
    pub pole_pairs: u32,
    /// Resistance of one phase, line to star point, at 20 °C.
    pub resistance_ohm: f64,
    /// Inductance along the magnets.
    pub inductance_d_h: f64,
    /// Inductance across the magnets.
    pub inductance_q_h: f64,
    /// Amplitude of the magnets' flux linkage with one phase.
    pub flux_linkage_wb: f64,
}

/// One of the three wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Phase U, whose axis is electrical angle zero.
    U,
    /// Phase V, a third of an electrical turn on.
    V,
    /// Phase W, two thirds of an electrical turn on.
    W,
}

impl Phase {
    /// The direction, a quarter turn from the phase's own axis, in which the other two wires can magnetise.
    fn axis_across(self) -> Axis {
        match self {
            Phase::U => Axis { sin: 1.0, cos: 0.0 },
            Phase::V => Axis { sin: -0.5, cos: -HALF_SQRT_3 },
            Phase::W => Axis { sin: -0.5, cos: HALF_SQRT_3 },
        }
    }
}

/// What the inverter does to the three wires during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Terminals {
    /// A voltage vector is applied: the mean over the switching periods of the step.
    Driven {
        /// Component along phase U's axis.
        alpha_v: f64,
        /// Component a quarter of an electrical turn on.
        beta_v: f64,
    },
    /// All three wires joined: the motor brakes on its own resistance, nothing reaches the bus.
    Shorted,
    /// All switches off. Running current flows on through the diodes into the bus until it is gone; after that the
    /// wires are open, unless the line-to-line back-emf exceeds the bus voltage and the bridge rectifies.
    ///
    /// The bridge is averaged to a voltage vector of `bus_v / sqrt(3)` against the current, which is exact at the
    /// point where conduction begins and 10 % under the six-step bridge's fundamental when it conducts
    /// continuously. The diodes' own drop is left out.
    Open {
        /// Voltage of the bus that the diodes conduct into.
        bus_v: f64,
    },
    /// A current loop drives the bridge; loop and bridge are one closed form ([`current_loop`](crate::current_loop)).
    Regulated {
        /// Voltage of the bus.
        bus_v: f64,
    },
}

impl Terminals {
    /// Three half bridges at these duty cycles on a bus; each is held to 0..=1, and what is not a number is zero.
    #[inline]
    pub fn from_duties(duty: [f64; 3], bus_v: f64) -> Self {
        let [u, v, w] = duty.map(|d| if d > 0.0 { d.min(1.0) } else { 0.0 });
        let third_v = bus_v * (1.0 / 3.0);
        Terminals::Driven { alpha_v: u * (2.0 * third_v) - (v + w) * third_v, beta_v: (v - w) * (bus_v * INV_SQRT_3) }
    }
}

/// State of the winding: its current.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PmsmData {
    /// Winding current in the rotor's frame.
    pub current_a: Dq,
    /// Of the loop that regulates it, where loop and bridge are one closed form; it begins anew with each other condition.
    pub current_loop: LoopData,
}

/// What acts on the winding during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PmsmInput {
    /// The inverter's doing.
    pub terminals: Terminals,
    /// A wire that has come off, if any.
    pub lost_phase: Option<Phase>,
    /// Resistance in each phase's path: copper at its present temperature, switches and wires.
    pub resistance_ohm: f64,
    /// The magnets' direction, at the electrical angle in the middle of the step.
    pub axis: Axis,
    /// Rotor velocity, mean over the step.
    pub velocity_rad_s: f64,
}

/// What the winding did during one step, as means over the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PmsmOutput {
    /// Torque on the rotor.
    pub torque_nm: f64,
    /// Power taken from the bus; negative while regenerating.
    pub bus_w: f64,
    /// Heat in the phases' resistance per ohm of it: the sum of the squares of the three currents.
    pub heat_w_per_ohm: f64,
    /// Magnetic energy of a wire that came off under current: burnt in the arc.
    pub arc_j: f64,
}

impl PmsmOutput {
    /// The step for the energy book, with what its shaft did.
    #[inline]
    pub(crate) fn flows(&self, friction_j: f64, load_j: f64) -> Flows {
        Flows { bus_w: self.bus_w, heat_w_per_ohm: self.heat_w_per_ohm, arc_j: self.arc_j, friction_j, load_j }
    }
}

impl PmsmModel {
    /// Torque per ampere of q current.
    pub fn torque_constant_nm_a(&self) -> f64 {
        1.5 * f64::from(self.pole_pairs) * self.flux_linkage_wb
    }

    /// Amplitude of a phase's back-emf per velocity, V s/rad.
    pub fn back_emf_constant_v_s(&self) -> f64 {
        f64::from(self.pole_pairs) * self.flux_linkage_wb
    }

    /// Highest velocity at which a bus can still push a current that makes torque: the phase amplitude
    /// `bus / sqrt(3)` over the back-emf constant.
    pub fn no_load_velocity_rad_s(&self, bus_v: f64) -> f64 {
        bus_v * INV_SQRT_3 / self.back_emf_constant_v_s()
    }

    /// Torque at this current.
    #[inline]
    pub fn torque_nm(&self, current_a: Dq) -> f64 {
        let saliency_h = self.inductance_d_h - self.inductance_q_h;
        1.5 * f64::from(self.pole_pairs) * (self.flux_linkage_wb + saliency_h * current_a.d) * current_a.q
    }

    /// Energy stored in the winding's inductance.
    pub fn magnetic_energy_j(&self, data: &PmsmData) -> f64 {
        let Dq { d, q } = data.current_a;
        0.75 * (self.inductance_d_h * d * d + self.inductance_q_h * q * q)
    }

    /// The three wires' currents, positive into the motor, while the magnets point along `axis`.
    #[inline]
    pub fn phase_current_a(&self, data: &PmsmData, axis: Axis) -> [f64; 3] {
        let Axis { sin, cos } = axis;
        let Dq { d, q } = data.current_a;
        let alpha = d * cos - q * sin;
        let beta = d * sin + q * cos;
        [alpha, -0.5 * alpha + HALF_SQRT_3 * beta, -0.5 * alpha - HALF_SQRT_3 * beta]
    }

    /// Electrical angle in turns (not wrapped: 0 up to the number of pole pairs).
    #[inline]
    pub fn electrical_turns(&self, angle: Angle) -> f64 {
        angle.fraction() * f64::from(self.pole_pairs)
    }

    /// Moves the current by one step.
    // Inlined by force: with every kind of motor in one program it has several callers, and none would get it.
    #[inline(always)]
    pub fn step(&self, data: &mut PmsmData, dt_s: f64, input: &PmsmInput) -> PmsmOutput {
        if let Some(phase) = input.lost_phase {
            return self.step_two_wires(data, dt_s, input, phase);
        }
        let winding = Winding::new(self, data, dt_s, input);
        match input.terminals {
            Terminals::Driven { alpha_v, beta_v } => {
                let Axis { sin, cos } = input.axis;
                let voltage_v = Dq { d: alpha_v * cos + beta_v * sin, q: beta_v * cos - alpha_v * sin };
                let mean = winding.mean_current(voltage_v);
                data.current_a = Dq { d: 2.0 * mean.d - data.current_a.d, q: 2.0 * mean.q - data.current_a.q };
                self.output(mean, 1.5 * (voltage_v.d * mean.d + voltage_v.q * mean.q))
            }
            Terminals::Shorted => {
                let mean = winding.mean_current(Dq::default());
                data.current_a = Dq { d: 2.0 * mean.d - data.current_a.d, q: 2.0 * mean.q - data.current_a.q };
                self.output(mean, 0.0)
            }
            Terminals::Open { bus_v } => self.step_diodes(data, dt_s, input, winding, bus_v),
            Terminals::Regulated { bus_v } => self.regulate(data, dt_s, input, bus_v),
        }
    }

    /// The idle bridge: a voltage of fixed magnitude against the current, so that a current dies exactly to zero,
    /// the same law as dry friction against a motion.
    fn step_diodes(
        &self,
        data: &mut PmsmData,
        dt_s: f64,
        input: &PmsmInput,
        winding: Winding<'_>,
        bus_v: f64,
    ) -> PmsmOutput {
        let counter_v = bus_v * INV_SQRT_3;
        let emf_v = self.back_emf_constant_v_s() * input.velocity_rad_s.abs();
        let before = data.current_a;
        if before.magnitude() < NO_CURRENT_A && emf_v <= counter_v {
            data.current_a = Dq::default();
            return PmsmOutput::default();
        }
        let half_s = 0.5 * dt_s;
        let free = winding.mean_current(Dq::default());
        let mean_inductance_h = 0.5 * (self.inductance_d_h + self.inductance_q_h);
        let shrink_a = half_s * counter_v / (mean_inductance_h + half_s * input.resistance_ohm);
        let scale = 1.0 - shrink_a / free.magnitude().max(NO_CURRENT_A);
        let mut mean = Dq { d: free.d * scale, q: free.q * scale };
        let mut after = Dq { d: 2.0 * mean.d - before.d, q: 2.0 * mean.q - before.q };
        if scale <= 0.0 || after.d * mean.d + after.q * mean.q <= 0.0 {
            after = Dq::default();
            mean = Dq { d: 0.5 * before.d, q: 0.5 * before.q };
        }
        data.current_a = after;
        self.output(mean, -1.5 * counter_v * mean.magnitude())
    }

    /// One wire off: the current can only flow along the axis `n` across the lost phase, and one equation is left,
    ///
    /// ```text
    /// L_n di/dt = v_n - (R + dL_n/dt) i - w psi n_q     L_n = L_d n_d^2 + L_q n_q^2
    /// ```
    ///
    /// What current the lost phase carried when it came off is gone at once: it burnt in the arc.
    fn step_two_wires(&self, data: &mut PmsmData, dt_s: f64, input: &PmsmInput, phase: Phase) -> PmsmOutput {
        let wires = phase.axis_across();
        let Axis { sin, cos } = input.axis;
        let n = Dq { d: wires.cos * cos + wires.sin * sin, q: wires.sin * cos - wires.cos * sin };
        let half_s = 0.5 * dt_s;
        let omega = f64::from(self.pole_pairs) * input.velocity_rad_s;
        let inductance_h = self.inductance_d_h * n.d * n.d + self.inductance_q_h * n.q * n.q;
        let inductance_rate = 2.0 * omega * (self.inductance_d_h - self.inductance_q_h) * n.d * n.q;
        let lag_h = inductance_h + half_s * (input.resistance_ohm + inductance_rate);
        let before = self.current_across(data, n, half_s * omega);
        let turn = half_s * omega;
        let arc_j = self.magnetic_energy_j(data) - 0.75 * inductance_h * before * before * (1.0 + turn * turn);
        let free = (inductance_h * before - half_s * omega * self.flux_linkage_wb * n.q) / lag_h;

        let (mean, after, bus_w) = match input.terminals {
            Terminals::Driven { alpha_v, beta_v } => {
                let voltage_v = alpha_v * wires.cos + beta_v * wires.sin;
                let mean = free + half_s * voltage_v / lag_h;
                (mean, 2.0 * mean - before, 1.5 * voltage_v * mean)
            }
            Terminals::Shorted => (free, 2.0 * free - before, 0.0),
            // The loop's closed form is that of three wires: the current ends.
            Terminals::Regulated { .. } => (0.5 * before, 0.0, 0.0),
            Terminals::Open { bus_v } => {
                // Two wires: the bridge conducts when the one line-to-line voltage exceeds the bus.
                let counter_v = bus_v * INV_SQRT_3;
                let size = (free.abs() - half_s * counter_v / lag_h).max(0.0);
                let mean = if free < 0.0 { -size } else { size };
                let after = 2.0 * mean - before;
                let (mean, after) = if after * mean <= 0.0 { (0.5 * before, 0.0) } else { (mean, after) };
                (mean, after, -1.5 * counter_v * mean.abs())
            }
        };
        // The state lives in the rotor's frame, which has turned on by half a step when the step ends.
        data.current_a = Dq { d: after * (n.d + turn * n.q), q: after * (n.q - turn * n.d) };
        PmsmOutput { arc_j, ..self.output(Dq { d: mean * n.d, q: mean * n.q }, bus_w) }
    }

    /// The current along the fixed axis at the start of a step, when the axis stood `turn` radians further on.
    fn current_across(&self, data: &PmsmData, n: Dq, turn: f64) -> f64 {
        let start = Dq { d: n.d - turn * n.q, q: n.q + turn * n.d };
        (data.current_a.d * start.d + data.current_a.q * start.q) / (start.d * start.d + start.q * start.q)
    }

    #[inline]
    fn output(&self, mean: Dq, bus_w: f64) -> PmsmOutput {
        PmsmOutput {
            torque_nm: self.torque_nm(mean),
            bus_w,
            heat_w_per_ohm: 1.5 * (mean.d * mean.d + mean.q * mean.q),
            arc_j: 0.0,
        }
    }
}

/// The two voltage equations over one step, ready to be solved for the mean current.
pub(crate) struct Winding<'a> {
    model: &'a PmsmModel,
    before: Dq,
    half_s: f64,
    omega: f64,
    resistance_ohm: f64,
}

impl<'a> Winding<'a> {
    #[inline]
    pub(crate) fn new(model: &'a PmsmModel, data: &PmsmData, dt_s: f64, input: &PmsmInput) -> Self {
        Winding {
            model,
            before: data.current_a,
            half_s: 0.5 * dt_s,
            omega: f64::from(model.pole_pairs) * input.velocity_rad_s,
            resistance_ohm: input.resistance_ohm,
        }
    }

    /// Implicit midpoint: `i_mean = i_before + dt/2 * f(i_mean)`, two linear equations in `i_mean`.
    #[inline]
    pub(crate) fn mean_current(&self, voltage_v: Dq) -> Dq {
        let PmsmModel { inductance_d_h: l_d, inductance_q_h: l_q, flux_linkage_wb: psi, .. } = *self.model;
        let (h, w) = (self.half_s, self.omega);
        let a = l_d + h * self.resistance_ohm;
        let b = l_q + h * self.resistance_ohm;
        let cross_d = h * w * l_q;
        let cross_q = h * w * l_d;
        // The matrix is inverted while the voltages are still being worked out.
        let scale = 1.0 / (a * b + cross_d * cross_q);
        let (dd, dq, qd, qq) = (b * scale, cross_d * scale, cross_q * scale, a * scale);
        let rhs_d = l_d * self.before.d + h * voltage_v.d;
        let rhs_q = l_q * self.before.q + h * (voltage_v.q - w * psi);
        Dq { d: dd * rhs_d + dq * rhs_q, q: qq * rhs_q - qd * rhs_d }
    }
}

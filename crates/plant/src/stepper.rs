//! Two-phase hybrid stepper: two windings on two H-bridges, a permanent-magnet rotor with teeth, and its detent.
//!
//! The phases stand a quarter of an electrical turn apart and do not couple; each obeys
//!
//! ```text
//! d/dt (L i + psi e) = v - R i        e = cos(a) in phase A, sin(a) in phase B;  a = teeth * angle
//! torque = teeth psi (i_b cos(a) - i_a sin(a)) - detent sin(4 a)
//! ```
//!
//! With 50 teeth a full step, a quarter of an electrical turn, is 1.8°. In the rotor's frame this is the motor of
//! [`pmsm`](crate::pmsm); [`StepperModel::three_phase_equivalent`] states the mapping. It has its own integrator
//! because at 3000 r/min a period is 8 steps of 50 µs: a voltage that stands still in the stator turns by 45° in the
//! rotor's frame. Here the equations are integrated between the two ends of the step in the stator, where the
//! magnets' share is the exact difference of their flux, and the mean current takes the curvature of the current into
//! account (Hermite's rule). The error per turn falls with the fourth power of the step; power = heat + torque *
//! velocity + change of the magnetic energy holds to the last bits of a double. Saturation, and the inductance's
//! small change with the angle, are not modelled; iron loss is left to the rotor's friction.

use crate::angle::Axis;
use crate::pmsm::PmsmModel;
use crate::rig::diode_v;

/// Below this current an idle bridge is taken as not conducting.
const NO_CURRENT_A: f64 = 1e-9;

/// What never changes about a stepper's windings, magnets and teeth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperModel {
    /// Rotor teeth: electrical turns per mechanical turn. A full step is a quarter of one: `teeth = steps / 4`.
    pub teeth: u32,
    /// Resistance of one phase at 20 °C.
    pub resistance_ohm: f64,
    /// Inductance of one phase.
    pub inductance_h: f64,
    /// Amplitude of the magnets' flux linkage with one phase.
    pub flux_linkage_wb: f64,
    /// Amplitude of the detent torque: four periods per electrical turn, at rest where one phase alone holds too.
    pub detent_nm: f64,
}

/// One of the two phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Phase A, whose axis is electrical angle zero.
    A,
    /// Phase B, a quarter of an electrical turn on.
    B,
}

/// What the two H-bridges do during one step, phase A first.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Bridges {
    /// All switches off: running current flows on through the diodes into the bus until it is gone; then a phase is
    /// open, unless its back-emf exceeds the bus voltage.
    #[default]
    Open,
    /// Both ends of each phase joined to one rail.
    Shorted,
    /// Switching with these duty cycles: a phase sees the bus voltage times -1 to 1, mean over the step.
    Driven([f64; 2]),
    /// Each bridge's own current chopper brings its phase to this current (A) by the end of the step, as far as the
    /// bus voltage reaches. This is the comparator in the bridge, faster than the step; its ripple is left out.
    Regulated([f64; 2]),
}

/// State of the windings: their currents.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepperData {
    /// Currents of phases A and B.
    pub current_a: [f64; 2],
}

/// The rotor's electrical rotation during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// The magnets' direction in the middle of the step.
    pub middle: Axis,
    half: Axis,
    half_rad: f64,
    /// `sin(half) / half`.
    sinc: f64,
}

impl Turn {
    /// A rotation that begins at a direction and turns on by twice `half_rad`.
    ///
    /// Both functions are summed from their series up to `x^10` and `x^11`: at 0.8 rad (6000 r/min in steps of 50 µs)
    /// the first terms left out are `0.8^12 / 12! = 1.4e-10`. Beyond that the full functions are used.
    #[inline]
    pub fn new(start: Axis, half_rad: f64) -> Self {
        let x = half_rad * half_rad;
        let (half, sinc) = if half_rad.abs() < 0.8 {
            // Pairs of terms side by side: a shorter wait than one term after the other.
            let square = x * x;
            let sinc = (1.0 - x * (1.0 / 6.0))
                + square
                    * ((1.0 / 120.0 - x * (1.0 / 5_040.0)) + square * (1.0 / 362_880.0 - x * (1.0 / 39_916_800.0)));
            let cos = (1.0 - x * 0.5)
                + square * ((1.0 / 24.0 - x * (1.0 / 720.0)) + square * (1.0 / 40_320.0 - x * (1.0 / 3_628_800.0)));
            (Axis { sin: half_rad * sinc, cos }, sinc)
        } else {
            let half = Axis::at_turns(half_rad / core::f64::consts::TAU);
            (half, half.sin / half_rad)
        };
        Turn { middle: start.turned_by(half), half, half_rad, sinc }
    }

    /// The magnets' direction at the end of the step.
    #[inline]
    pub fn end(&self) -> Axis {
        self.middle.turned_by(self.half)
    }
}

/// What acts on the windings during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepperInput {
    /// The bridges' doing.
    pub bridges: Bridges,
    /// Voltage of the bus.
    pub bus_v: f64,
    /// A phase whose wire has come off, if any.
    pub lost_phase: Option<Phase>,
    /// A phase whose two wires touch, if any: its winding sees no voltage, whatever the bridge does.
    pub shorted_phase: Option<Phase>,
    /// Resistance in each phase's path: copper at its present temperature, switches and wires.
    pub resistance_ohm: f64,
    /// How the rotor turns.
    pub turn: Turn,
}

/// What the windings did during one step, as means over the step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepperOutput {
    /// Torque of the currents on the rotor, without the detent.
    pub torque_nm: f64,
    /// Power taken from the bus; negative while regenerating.
    pub bus_w: f64,
    /// Heat in the phases' resistance per ohm of it.
    pub heat_w_per_ohm: f64,
    /// Magnetic energy of a phase whose wire came off under current: burnt in the arc.
    pub arc_j: f64,
}

/// What a stepper's torque follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// Windings, magnets and teeth.
    pub windings: StepperModel,
    /// Relative change of the windings' resistance per kelvin above 20 °C.
    pub resistance_per_k: f64,
    /// Resistance of the switches in the path of a phase.
    pub switch_resistance_ohm: f64,
}

impl Stepping {
    /// The most torque that a current of this amplitude makes at a speed, from a supply of so many volts with the windings at this
    /// temperature: `K I`, or what the voltage allows ([`StepperModel::pull_out_nm`]) where that is less.
    pub fn pull_out_nm(&self, current_a: f64, supply_v: f64, winding_c: f64, velocity_rad_s: f64) -> f64 {
        let winding_ohm = self.windings.resistance_ohm * (1.0 + self.resistance_per_k * (winding_c - 20.0));
        let resistance_ohm = winding_ohm + self.switch_resistance_ohm;
        let by_voltage = self.windings.pull_out_nm(supply_v, resistance_ohm, velocity_rad_s);
        by_voltage.min(self.windings.torque_constant_nm_a() * current_a)
    }
}

impl StepperModel {
    /// Torque per ampere of current across the magnets.
    pub fn torque_constant_nm_a(&self) -> f64 {
        f64::from(self.teeth) * self.flux_linkage_wb
    }

    /// Stiffness about a one-phase-on rest position at this amplitude of current, per mechanical radian: the slopes
    /// of both sines, `teeth (K I + 4 detent)`.
    pub fn stiffness_nm_rad(&self, current_a: f64) -> f64 {
        f64::from(self.teeth) * (self.torque_constant_nm_a() * current_a + 4.0 * self.detent_nm)
    }

    /// Highest torque at a velocity with a sinusoidal voltage of this amplitude on each phase, before friction: the
    /// synchronous motor's pull-out, `K (V / Z - R psi w / Z^2)` with `Z^2 = R^2 + (w L)^2`.
    pub fn pull_out_nm(&self, voltage_v: f64, resistance_ohm: f64, velocity_rad_s: f64) -> f64 {
        let omega = f64::from(self.teeth) * velocity_rad_s.abs();
        let reactance = omega * self.inductance_h;
        let impedance = libm::sqrt(resistance_ohm * resistance_ohm + reactance * reactance);
        let emf_share = resistance_ohm * self.flux_linkage_wb * omega / impedance;
        self.torque_constant_nm_a() * (voltage_v - emf_share) / impedance
    }

    /// The three-phase motor with the same dq equations: amplitude-invariant vectors of three phases carry 3/2 of the
    /// power of two, so that for the same voltage and flux the current is 2/3 and resistance and inductance are 3/2.
    pub fn three_phase_equivalent(&self) -> PmsmModel {
        PmsmModel {
            pole_pairs: self.teeth,
            resistance_ohm: 1.5 * self.resistance_ohm,
            inductance_d_h: 1.5 * self.inductance_h,
            inductance_q_h: 1.5 * self.inductance_h,
            flux_linkage_wb: self.flux_linkage_wb,
        }
    }

    /// Energy stored in the windings' inductance.
    pub fn magnetic_energy_j(&self, data: &StepperData) -> f64 {
        let [a, b] = data.current_a;
        0.5 * self.inductance_h * (a * a + b * b)
    }

    /// Potential energy of the detent while the magnets point along `axis`.
    pub fn detent_energy_j(&self, axis: Axis) -> f64 {
        let doubled = axis.turned_by(axis);
        -self.detent_nm / (4.0 * f64::from(self.teeth)) * doubled.turned_by(doubled).cos
    }

    /// Mean detent torque over a step: the exact fall of its potential energy per angle turned.
    #[inline]
    pub fn detent_torque_nm(&self, turn: &Turn) -> f64 {
        let Axis { sin, cos } = turn.middle;
        let sin_4 = 4.0 * sin * cos * (1.0 - 2.0 * sin * sin);
        // sin(4x) / 4x, from that of x.
        let sinc_4 = turn.sinc * turn.half.cos * (1.0 - 2.0 * turn.half.sin * turn.half.sin);
        -self.detent_nm * sin_4 * sinc_4
    }

    /// Moves the currents by one step.
    #[inline]
    pub fn step(&self, data: &mut StepperData, dt_s: f64, input: &StepperInput) -> StepperOutput {
        let Axis { sin, cos } = input.turn.middle;
        let solver = Solver::new(self, dt_s, input);
        let a = solver.phase(&mut data.current_a[0], cos, -sin, Phase::A);
        let b = solver.phase(&mut data.current_a[1], sin, cos, Phase::B);
        StepperOutput {
            torque_nm: self.torque_constant_nm_a() * (a.torque_a + b.torque_a),
            bus_w: a.bus_w + b.bus_w,
            heat_w_per_ohm: a.heat_w_per_ohm + b.heat_w_per_ohm,
            arc_j: a.arc_j + b.arc_j,
        }
    }
}

/// The voltage equation of one phase over one step, `x` being half the electrical rotation:
///
/// ```text
/// L (i1 - i0) + psi (e1 - e0) = dt (v - R m)
/// m = (i0 + i1) / 2 + dt / 12L (R (i1 - i0) + w psi (e'1 - e'0))        the mean current
/// e1 - e0 = 2 sin(x) q        w (e'1 - e'0) dt = -4 x sin(x) d          d, q: the middle axis seen from the phase
/// ```
struct Solver<'a> {
    input: &'a StepperInput,
    inductance_h: f64,
    dt_s: f64,
    inverse_dt: f64,
    /// `psi (e1 - e0) = swing * q`.
    swing_wb: f64,
    /// The magnets' part of the mean current is `bend * d`.
    bend_a: f64,
    /// `dt R / 12 L`.
    curvature: f64,
    lag_h: f64,
    inverse_lag: f64,
}

/// What one phase did.
#[derive(Default)]
struct PhaseOutput {
    /// Torque over the torque constant.
    torque_a: f64,
    bus_w: f64,
    heat_w_per_ohm: f64,
    arc_j: f64,
}

impl<'a> Solver<'a> {
    #[inline]
    fn new(model: &StepperModel, dt_s: f64, input: &'a StepperInput) -> Self {
        let drop_h = dt_s * input.resistance_ohm;
        let inverse_inductance = 1.0 / model.inductance_h;
        let curvature = drop_h * inverse_inductance * (1.0 / 12.0);
        let lag_h = model.inductance_h + drop_h * (0.5 + curvature);
        let turn = &input.turn;
        Solver {
            input,
            inductance_h: model.inductance_h,
            dt_s,
            inverse_dt: 1.0 / dt_s,
            swing_wb: 2.0 * model.flux_linkage_wb * turn.half.sin,
            bend_a: -model.flux_linkage_wb * turn.half_rad * turn.half.sin * inverse_inductance * (1.0 / 3.0),
            curvature,
            lag_h,
            inverse_lag: 1.0 / lag_h,
        }
    }

    #[inline(always)]
    fn phase(&self, current_a: &mut f64, d: f64, q: f64, phase: Phase) -> PhaseOutput {
        let before = *current_a;
        let index = phase as usize;
        if self.input.lost_phase == Some(phase) {
            *current_a = 0.0;
            return PhaseOutput { arc_j: 0.5 * self.inductance_h * before * before, ..PhaseOutput::default() };
        }
        let StepperInput { bus_v, resistance_ohm, .. } = *self.input;
        let bend_a = self.bend_a * d;
        let swing_wb = self.swing_wb * q;
        // What flux the phase takes without any voltage, and what the whole bus adds to it.
        let free_wb = -self.dt_s * resistance_ohm * (before + bend_a) - swing_wb;
        let shorted = self.input.shorted_phase == Some(phase);
        let (change, voltage_v) = match self.input.bridges {
            _ if shorted => (free_wb * self.inverse_lag, 0.0),
            Bridges::Open => return self.phase_through_diodes(current_a, q),
            Bridges::Shorted => (free_wb * self.inverse_lag, 0.0),
            Bridges::Driven(duty) => {
                let voltage_v = unit_or_nothing(duty[index]) * bus_v;
                ((free_wb + self.dt_s * voltage_v) * self.inverse_lag, voltage_v)
            }
            Bridges::Regulated(reference_a) => {
                let reference_a = if reference_a[index].is_finite() { reference_a[index] } else { 0.0 };
                let reach_wb = self.dt_s * bus_v;
                let lowest = (free_wb - reach_wb) * self.inverse_lag;
                let highest = (free_wb + reach_wb) * self.inverse_lag;
                let change = (reference_a - before).max(lowest).min(highest);
                (change, (change * self.lag_h - free_wb) * self.inverse_dt)
            }
        };
        *current_a = before + change;
        self.output(before, change, bend_a, voltage_v, d, q)
    }

    /// The idle bridge: the bus stands against the current, so that a current dies exactly to zero. The curvature
    /// that the magnets give the current is left out here, which makes this case second order.
    fn phase_through_diodes(&self, current_a: &mut f64, q: f64) -> PhaseOutput {
        let StepperInput { bus_v, resistance_ohm, .. } = *self.input;
        let bus_v = diode_v(bus_v);
        let before = *current_a;
        let swing_wb = self.swing_wb * q;
        let idle = before.abs() < NO_CURRENT_A;
        if idle && swing_wb.abs() <= bus_v * self.dt_s {
            *current_a = 0.0;
            return PhaseOutput::default();
        }
        let direction = if idle { -1_f64.copysign(swing_wb) } else { 1_f64.copysign(before) };
        let mut voltage_v = -direction * bus_v;
        let mut change = (self.dt_s * (voltage_v - resistance_ohm * before) - swing_wb) * self.inverse_lag;
        if (before + change) * direction <= 0.0 {
            change = -before;
            voltage_v = (swing_wb - before * self.lag_h) * self.inverse_dt + resistance_ohm * before;
        }
        *current_a = before + change;
        self.output(before, change, 0.0, voltage_v, 0.0, q)
    }

    /// Torque, power and heat of one phase.
    ///
    /// The work on the rotor is what the balance of power leaves: `psi m (e1 - e0) + L bend (i1 - i0)`.
    #[inline]
    fn output(&self, before: f64, change: f64, bend_a: f64, voltage_v: f64, d: f64, q: f64) -> PhaseOutput {
        let mean = before + change * (0.5 + self.curvature) + bend_a;
        let turn = &self.input.turn;
        PhaseOutput {
            torque_a: turn.sinc * q * mean - turn.half.sin * d * change * (1.0 / 6.0),
            bus_w: voltage_v * mean,
            heat_w_per_ohm: mean * mean + change * change * (1.0 / 12.0),
            arc_j: 0.0,
        }
    }
}

/// A duty cycle held to -1..=1; what is not a number is zero.
#[inline]
fn unit_or_nothing(duty: f64) -> f64 {
    if duty.is_nan() { 0.0 } else { duty.clamp(-1.0, 1.0) }
}

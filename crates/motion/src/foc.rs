//! Field-oriented control: phase currents in, three duty cycles out.
//!
//! The [frames](crate::frames)' transforms, one PI controller for each axis with optional feed-forward of the
//! back-emf and the cross-coupling, a circle limit to what the bus can give, inverse Park, and a zero-sequence shift
//! that centres the three voltages (equivalent to space-vector modulation): the phase amplitude reaches
//! `bus / sqrt(3)`.
//!
//! ```text
//! v_d = PI(i_d* - i_d) - w L_q i_q
//! v_q = PI(i_q* - i_q) + w L_d i_d + w psi
//! ```

use crate::angle::sin_cos_turns;
use crate::frames::{AlphaBeta, Dq, clarke, inverse_clarke, inverse_park, park};
use crate::limits::circle;
use crate::pid::{Pi, PiGains};

const INV_SQRT_3: f32 = 0.577_350_26;

/// Duty cycles, 0 to 1, that give a voltage vector on a bus: the phase voltages centred between the rails.
///
/// A vector within the circle `bus / sqrt(3)` is given exactly; one outside is clipped phase by phase.
#[inline]
pub fn modulate(voltage_v: AlphaBeta, bus_v: f32) -> [f32; 3] {
    if bus_v <= 0.0 {
        return [0.5; 3];
    }
    let per_volt = 1.0 / bus_v;
    let half_per_volt = 0.5 * per_volt;
    let phases = inverse_clarke(voltage_v);
    let centre = 0.5 - (highest(phases) + lowest(phases)) * half_per_volt;
    phases.map(|v| (v * per_volt + centre).clamp(0.0, 1.0))
}

/// Plain comparisons: `f32::max` pays for a rule about values that are not a number.
#[inline]
fn highest([u, v, w]: [f32; 3]) -> f32 {
    let of_two = if u > v { u } else { v };
    if of_two > w { of_two } else { w }
}

#[inline]
fn lowest([u, v, w]: [f32; 3]) -> f32 {
    let of_two = if u < v { u } else { v };
    if of_two < w { of_two } else { w }
}

/// What the controller knows of the motor and how it is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocGains {
    /// Controller of the d current: V/A and V/(A s).
    pub d: PiGains,
    /// Controller of the q current.
    pub q: PiGains,
    /// Feed-forward of the motor's own voltages; `None` leaves them to the integrals.
    pub feed_forward: Option<FeedForward>,
    /// Share of `bus / sqrt(3)` that may be used, 0 to 1; under 1 leaves time to measure phase currents.
    pub modulation_limit: f32,
    /// Time from sampling the currents to the middle of the period in which the voltage acts: the inverse Park
    /// transform looks ahead by as much. Half a period when the voltage acts at once.
    pub voltage_delay_s: f32,
}

/// Motor figures for the feed-forward.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FeedForward {
    /// Inductance along the magnets, H.
    pub inductance_d_h: f32,
    /// Inductance across the magnets, H.
    pub inductance_q_h: f32,
    /// Flux linkage of the magnets, Wb.
    pub flux_linkage_wb: f32,
}

/// What is measured each period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocInput {
    /// Currents of U, V, W, positive into the motor.
    pub phase_current_a: [f32; 3],
    /// Electrical angle in turns.
    pub electrical_turns: f32,
    /// Electrical angular velocity.
    pub electrical_rad_s: f32,
    /// Bus voltage.
    pub bus_v: f32,
}

/// What the controller decided.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FocOutput {
    /// Duty cycles of U, V, W, 0 to 1.
    pub duty: [f32; 3],
    /// The measured current in the rotor's frame.
    pub current_a: Dq,
    /// The voltage asked of the bus, after the limit.
    pub voltage_v: Dq,
    /// What the controllers wanted before the limit.
    pub wanted_v: Dq,
    /// The voltage limit was reached: the current cannot follow its set-point.
    pub saturated: bool,
}

/// State of the two current controllers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Foc {
    /// Controller of the d current.
    pub d: Pi,
    /// Controller of the q current.
    pub q: Pi,
}

impl Foc {
    /// One control period of `dt_s`.
    // Inlined by force: with every kind of motor in one program it has several callers, and none would get it.
    #[inline(always)]
    pub fn tick(&mut self, gains: &FocGains, setpoint_a: Dq, input: &FocInput, dt_s: f32) -> FocOutput {
        let (sin, cos) = sin_cos_turns(input.electrical_turns);
        let current_a = park(clarke(input.phase_current_a), sin, cos);
        let error = Dq { d: setpoint_a.d - current_a.d, q: setpoint_a.q - current_a.q };
        let known =
            gains.feed_forward.map_or(Dq::default(), |motor| motor.voltage_v(current_a, input.electrical_rad_s));

        let wanted =
            Dq { d: self.d.propose(&gains.d, error.d, known.d), q: self.q.propose(&gains.q, error.q, known.q) };
        let voltage_v = circle(wanted, input.bus_v * INV_SQRT_3 * gains.modulation_limit);
        self.d.settle(&gains.d, error.d, wanted.d, voltage_v.d, dt_s);
        self.q.settle(&gains.q, error.q, wanted.q, voltage_v.q, dt_s);

        let (sin, cos) = look_ahead(sin, cos, input.electrical_rad_s * gains.voltage_delay_s);
        let duty = modulate(inverse_park(voltage_v, sin, cos), input.bus_v);
        FocOutput { duty, current_a, voltage_v, wanted_v: wanted, saturated: voltage_v != wanted }
    }

    /// Forgets the past: for the moment the power stage is switched on.
    pub fn reset(&mut self) {
        *self = Foc::default();
    }
}

impl FeedForward {
    /// The voltages that the motor's own motion induces.
    #[inline]
    fn voltage_v(&self, current_a: Dq, electrical_rad_s: f32) -> Dq {
        Dq {
            d: -electrical_rad_s * self.inductance_q_h * current_a.q,
            q: electrical_rad_s * (self.inductance_d_h * current_a.d + self.flux_linkage_wb),
        }
    }
}

/// Turns a sine and cosine on by a small angle: third-order series, error under 1e-5 up to a quarter of a radian.
#[inline]
fn look_ahead(sin: f32, cos: f32, rad: f32) -> (f32, f32) {
    let x = rad * rad;
    let (s, c) = (rad * (1.0 - x * (1.0 / 6.0)), 1.0 - x * (0.5 - x * (1.0 / 24.0)));
    (sin * c + cos * s, cos * c - sin * s)
}

use core::time::Duration;

use canopen::Mux;

use crate::units::Quantity;

/// How the loops of an axis are set, and what shows them: what finding gains takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loops {
    /// What the speed loop asks of the current loop, in A, where an object shows it with its sign.
    pub demand: Option<Quantity>,
    /// Proportional gain of the speed loop.
    pub speed_proportional: Mux,
    /// Integral part of the speed loop.
    pub speed_integral: Integral,
    /// Time constant of the filter of the measured speed, in s, where it has an object.
    pub speed_filter: Option<Quantity>,
    /// Gain of the position loop, in 1/s, where it is known which object has it.
    pub position_proportional: Option<Quantity>,
    /// Gain of the current loop, in V/A, and its integral gain, in V/(A s), where they have objects.
    pub current: Option<(Quantity, Quantity)>,
    /// Objects, and the values with which a set-point of speed takes effect at once.
    pub without_ramps: &'static [(Mux, i64)],
    /// How often the loops are computed.
    pub period: Duration,
    /// What the speed loop is, where no object shows what it asks for.
    pub stated: Option<StatedLoop>,
    /// Gains change by so many counts, where their last digits mean something else.
    pub gain_step: i64,
    /// A speed of the motor at which it can be measured, r/min.
    pub usual_rpm: f64,
    /// What its speed loop may ask for meanwhile, A.
    pub usual_a: f64,
    /// Torque per ampere of the demand, N m/A, where no motor of the model's own says it.
    pub torque_constant_nm_a: Option<f64>,
    /// Rated torque in mN m and rated current in mA (CiA 402-2, 6076h and 6075h), where the demand counts by them.
    pub rated: Option<[Mux; 2]>,
}

/// A speed loop that cannot be measured from outside, as it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedLoop {
    /// What one count of the proportional gain is worth, A/(rad/s), as an amplitude.
    pub a_s_rad: f64,
    /// What one count of the integral time is worth, s.
    pub integral_s: f64,
    /// Time constant of the filter of the speed, s.
    pub filter_s: f64,
    /// What comes late in it, the filter apart, s.
    pub late_s: f64,
    /// Amplitude of a phase's current for each ampere of the actual current.
    pub amplitude: f64,
}

/// How the integral part of a loop is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integral {
    /// As a gain of its own.
    Gain(Mux),
    /// As a time, which the proportional gain is divided by.
    Time(Mux),
}

impl Integral {
    /// The object.
    pub const fn object(self) -> Mux {
        match self {
            Self::Gain(object) | Self::Time(object) => object,
        }
    }
}

/// How a stepper without an encoder is kept in step: by a current and ramps that leave torque. Its ramps are
/// [`Units::ramps`](crate::Units), its microsteps [`Units::counts_per_turn`](crate::Units).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoop {
    /// Its number chooses the current while it runs.
    pub current: Mux,
    /// Amplitude of the phase current by that number, A.
    pub currents_a: &'static [f32],
    /// Where it is chosen how much of that current flows at standstill, and the shares by its value.
    pub standstill: (Mux, &'static [f64]),
    /// Most pulses in a second.
    pub step_frequency_hz: f64,
    /// Pulses in a turn from which its microsteps shake the rotor little.
    pub smooth_pulses: u32,
    /// Speed with which a motion begins, without a ramp.
    pub start_speed: Quantity,
    /// Speed from which it stops without one.
    pub end_speed: Quantity,
}

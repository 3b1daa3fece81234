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
    /// Gain of the position loop, in 1/s.
    pub position_proportional: Quantity,
    /// Gain of the current loop, in V/A, and its integral gain, in V/(A s), where they have objects.
    pub current: Option<(Quantity, Quantity)>,
    /// Objects, and the values with which a set-point of speed takes effect at once.
    pub without_ramps: &'static [(Mux, i64)],
    /// How often the loops are computed.
    pub period: Duration,
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

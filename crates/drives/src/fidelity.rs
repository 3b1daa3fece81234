use core::fmt;
use core::str::FromStr;

/// How much of a drive is computed.
///
/// The firmware is the same: objects, faults, power states, trajectories and outer loops. What differs is where it hands over to
/// the power stage ([`engine::actuator::servo`](crate::engine::actuator::servo)), and how often it is asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fidelity {
    /// Every control period: encoder edges, commutation, current loop, duty cycles.
    #[default]
    Full,
    /// Every supervision period: the currents that the loops ask for, which a power stage follows by itself.
    Mechanical,
}

impl Fidelity {
    /// Which of two periods, or of their counts, a tick stands for: a control period or a supervision period.
    pub const fn tick<T: Copy>(self, control: T, supervision: T) -> T {
        match self {
            Self::Full => control,
            Self::Mechanical => supervision,
        }
    }
}

impl FromStr for Fidelity {
    type Err = ParseFidelityError;

    fn from_str(text: &str) -> Result<Self, ParseFidelityError> {
        match text {
            "full" => Ok(Self::Full),
            "mechanical" => Ok(Self::Mechanical),
            _ => Err(ParseFidelityError),
        }
    }
}

impl fmt::Display for Fidelity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Full => "full",
            Self::Mechanical => "mechanical",
        })
    }
}

/// Not the name of a fidelity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParseFidelityError;

impl fmt::Display for ParseFidelityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected full or mechanical")
    }
}

impl core::error::Error for ParseFidelityError {}

//! Why words are not a stimulus.

/// Why words are not a stimulus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StimulusError {
    /// The first word is unknown.
    #[error(
        "unknown command {0:?} for a node; expected power, input, switch, load, rotor, supply, temperature, fault, \
         battery, pulses, quadrature, duty, clock, cable, bus, set or get"
    )]
    Unknown(String),
    /// Missing, surplus or unknown words.
    #[error("expected: {0}")]
    Usage(&'static str),
    /// Not a finite number, or one that makes no sense.
    #[error("invalid {what} {text:?}; expected: {usage}")]
    BadValue {
        /// What was given.
        text: String,
        /// What it should be.
        what: &'static str,
        /// The whole command.
        usage: &'static str,
    },
    /// A switch that could never be active.
    #[error("the range from {low} to {high} is empty; give the lower bound first")]
    EmptyRange {
        /// Lower bound as given.
        low: i64,
        /// Upper bound as given.
        high: i64,
    },
}

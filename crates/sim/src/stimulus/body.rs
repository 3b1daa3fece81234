//! What the outer world does to a machine that several drives move: the words after `body NAME`.

use std::fmt;
use std::str::FromStr;

use super::error::StimulusError;
use super::words::{number, value};

/// What the outer world changes at a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyStimulus {
    /// `body NAME slope 5 90`: the ground under a base rises by so many degrees, towards that direction.
    Slope {
        /// Degrees.
        slope_deg: f64,
        /// Degrees from the x axis.
        uphill_deg: f64,
    },
    /// `body NAME payload 2`: kg at the tool's point of an arm.
    Payload(f64),
    /// `body NAME grip 0.1`: greatest force over weight; `None` for wheels that never slip.
    Grip(Option<f64>),
    /// `body NAME mass 60`: mass of a base in kg, as when it is loaded.
    Mass(f64),
}

const SLOPE: &str = "body NAME slope DEGREES [DEGREES UPHILL]";
const PAYLOAD: &str = "body NAME payload KG";
const GRIP: &str = "body NAME grip SHARE|off";
const MASS: &str = "body NAME mass KG";
/// The form of the question that every such machine answers.
pub const GET_BODY: &str = "body NAME get";

/// Every form of these words.
pub(super) const FORMS: [&str; 5] = [SLOPE, GRIP, MASS, PAYLOAD, GET_BODY];

const ANY: &str = "body NAME slope|grip|mass|payload VALUE, or body NAME get";

impl FromStr for BodyStimulus {
    type Err = StimulusError;

    /// The words after the name.
    fn from_str(text: &str) -> Result<Self, StimulusError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let any = |text: &str, what, usage| number(text, what, f64::MIN, usage);
        match words[..] {
            ["slope", degrees] => Ok(Self::Slope { slope_deg: any(degrees, "slope", SLOPE)?, uphill_deg: 0.0 }),
            ["slope", degrees, uphill] => {
                let (slope_deg, uphill_deg) = (any(degrees, "slope", SLOPE)?, any(uphill, "direction", SLOPE)?);
                Ok(Self::Slope { slope_deg, uphill_deg })
            }
            ["grip", "off"] => Ok(Self::Grip(None)),
            ["grip", share] => Ok(Self::Grip(Some(value(share, "grip", GRIP)?))),
            ["mass", mass] => Ok(Self::Mass(value(mass, "mass", MASS)?)),
            ["payload", payload] => Ok(Self::Payload(value(payload, "payload", PAYLOAD)?)),
            _ => Err(StimulusError::Usage(ANY)),
        }
    }
}

impl fmt::Display for BodyStimulus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slope { slope_deg, uphill_deg } => write!(f, "slope {slope_deg} {uphill_deg}"),
            Self::Grip(Some(grip)) => write!(f, "grip {grip}"),
            Self::Grip(None) => f.write_str("grip off"),
            Self::Mass(mass_kg) => write!(f, "mass {mass_kg}"),
            Self::Payload(payload_kg) => write!(f, "payload {payload_kg}"),
        }
    }
}

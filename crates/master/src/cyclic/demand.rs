use core::fmt;

use canopen::Mux;
use cia402::{PowerState, Statusword};

use crate::core::CycleLoss;
use crate::limits::{AskedNumber, HeldBy, Limits};
use crate::units::{Amperes, Angle, Rpm, Shown, Turns};

/// What a drive is to do in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// No power on the motor: by the drive's shutdown ramp, if it turns. Ends what a [`Refusal`] has latched.
    Off,
    /// Powered, at its last set-point in a position mode, else at speed or current zero.
    Hold,
    /// The next point of a path. Position modes only.
    Position(Angle),
    /// Turn at this speed. Velocity modes only.
    Velocity(Rpm),
    /// Push with this current. Torque modes only.
    Current(Amperes),
    /// Quick stop (605Ah).
    QuickStop,
    /// Power off, and rising edges of the fault reset bit until the fault is gone.
    ResetFault,
}

impl Demand {
    /// True if the drive is to have power.
    pub(super) const fn wants_power(self) -> bool {
        matches!(self, Self::Hold | Self::Position(_) | Self::Velocity(_) | Self::Current(_))
    }
}

/// Why a demand was not carried out in a cycle. The drive was given [`Demand::Hold`] instead, unless noted otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// SYNC is neither produced nor followed, or no cycle has begun yet.
    NoCycle,
    /// None of the drive's TPDOs has come yet, or not for some cycles.
    NotHeard,
    /// The RPDO of the drive got another mapping: it has to be opened again, and is stopped by SDO.
    Remapped,
    /// The drive was stopped, because the program, the drive or SYNC had stayed away. Until [`Demand::Off`].
    Stopped(CycleLoss),
    /// The drive is at fault: [`crate::Drive::explain_refusal`] asks it why. Until [`Demand::ResetFault`].
    Fault(Statusword),
    /// The drive left Operation enabled on its own, or by another master's command. Until [`Demand::Off`].
    LostOperation(Option<PowerState>),
    /// The value is of another kind than the mode's.
    WrongKind,
    /// The value is not a number, or more than the mapped bits hold.
    NoNumber,
    /// The value is outside what the object takes, or would be held back by another object.
    OutOfLimits {
        /// What was asked for, in counts.
        asked: i64,
        /// What comes into effect.
        bound: Bound,
    },
    /// The way from the last set-point to this one is more than the drive's highest speed covers in a cycle.
    StepTooLarge {
        /// The way, in counts.
        way: i64,
        /// The longest way, in counts.
        longest: i64,
        /// Where the highest speed stands.
        bound: Bound,
    },
}

/// The values of an object that come into effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The object.
    pub object: Mux,
    /// Its name.
    pub name: &'static str,
    /// Smallest value, in counts.
    pub low: i64,
    /// Largest value, in counts.
    pub high: i64,
    /// What sets them, where the model's table does not.
    pub by: Option<HeldBy>,
}

impl From<Limits> for Bound {
    fn from(limits: Limits) -> Self {
        let Limits { object, name, low, high, held_to, resolution, .. } = limits;
        let held = held_to.filter(|(most, _)| *most < high || -most > low);
        let most = held.map_or(i64::MAX, |(most, _)| most.saturating_abs());
        let by = held.map(|(_, by)| by).or(resolution.map(HeldBy::Setting));
        Self { object, name, low: low.max(-most), high: high.min(most), by }
    }
}

/// `60FFh:00 target_velocity, which takes -500 to 500, by 200Ah:00 max_motor_speed = 500`.
impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { object, name, low, high, by } = self;
        write!(f, "{object} {name}, which takes {low} to {high}")?;
        by.map_or(Ok(()), |setting| write!(f, ", by {setting}"))
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCycle => f.write_str("no cycle has begun: produce or follow SYNC, and step in its cycles"),
            Self::NotHeard => {
                f.write_str("its TPDO does not come: check that it is operational and sends with each SYNC")
            }
            Self::Remapped => f.write_str("one of its PDOs got another mapping: open it again. It was stopped"),
            Self::Stopped(loss) => write!(f, "it was stopped, since {loss}. Switch it off to start again"),
            Self::Fault(statusword) => {
                write!(f, "it is at fault (statusword {:04X}h): remove the cause, then reset the fault", statusword.0)
            }
            Self::LostOperation(Some(state)) => {
                write!(f, "it left Operation enabled and is in {}. Switch it off to start again", state.name())
            }
            Self::LostOperation(None) => {
                f.write_str("its statusword shows no state any more. Switch it off to start again")
            }
            Self::WrongKind => {
                f.write_str("its mode takes set-points of another kind; the drive holds its position instead")
            }
            Self::NoNumber => {
                f.write_str("the set-point is not a number that its object can hold. The drive is held instead")
            }
            Self::OutOfLimits { asked, bound } => {
                write!(f, "{} is out of range for {bound}. The drive is held instead", AskedNumber(*asked))
            }
            Self::StepTooLarge { way, longest, bound } => write!(
                f,
                "a step of {way} counts is more than the {longest} that the highest speed covers in a cycle, by {bound}. The \
                 drive is held instead"
            ),
        }
    }
}

/// What a drive shows in one cycle, and what became of the demand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CyclicState {
    /// 6041h, if it came lately.
    pub statusword: Option<Statusword>,
    /// The power state that it shows; of a drive without the state machine, the one that comes closest.
    pub power: Option<PowerState>,
    /// Its statusword shows that the power stage is on (CiA 402-2, figure 5).
    pub is_live: bool,
    /// The drive has power and follows its set-points.
    pub follows: bool,
    /// Where the shaft is, if that is mapped.
    pub position: Option<Turns>,
    /// How fast it turns, if that is mapped.
    pub velocity: Option<Rpm>,
    /// The motor's current, if that is mapped.
    pub current: Option<Amperes>,
    /// Cycles since the statusword came: 1 in a cycle that has just begun.
    pub age: Option<u64>,
    /// Why the demand was not carried out; `None` also while the drive is being enabled.
    pub refused: Option<Refusal>,
}

impl CyclicState {
    /// True if the drive is heard, and shows that its power stage is off.
    pub const fn is_without_power(&self) -> bool {
        self.statusword.is_some() && !self.is_live
    }
}

/// `Operation enabled, at 12.5 turns, 60 r/min`.
impl fmt::Display for CyclicState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.power.map_or("not heard", PowerState::name))?;
        if let Some(Turns(turns)) = self.position {
            write!(f, ", at {} turns", Shown(turns))?;
        }
        if let Some(speed) = self.velocity {
            write!(f, ", {speed}")?;
        }
        if let Some(current) = self.current {
            write!(f, ", {current}")?;
        }
        self.refused.map_or(Ok(()), |refusal| write!(f, "; refused: {refusal}"))
    }
}

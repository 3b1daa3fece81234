//! What can be joined to an output shaft, beyond a torque and an inertia: the words after `load`.

use std::fmt;

use super::error::StimulusError;
use super::range::SwitchRange;
use super::words::{bound_word, excerpt, number, range, value};

/// One thing at an output shaft. Torques and angles are those of that shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadPart {
    /// `load friction 0.2 viscous 0.01 static 0.3 stribeck 0.5`: friction of the load beside the motor's own.
    Friction(Friction),
    /// `load pulley 2 0.05`: a weight in kg on a drum of this radius in m. Positive motion lifts it; with a negative radius, lowers it.
    Pulley {
        /// kg.
        mass_kg: f64,
        /// m, signed.
        radius_m: f64,
    },
    /// `load spring 5`, `load spring 5 -90`: a torsion spring in N·m/rad that is at rest where the shaft is now, or so many degrees on.
    Spring {
        /// N·m/rad.
        stiffness_nm_rad: f64,
        /// Degrees from where the shaft is now.
        rest_deg: f64,
    },
    /// `load stop -5000 max`, `load stop -5000 5000 1000 2`: end stops at these actual positions in the drive's counts, fixed in the
    /// machine from then on.
    Stop {
        /// The way that is left free.
        range: SwitchRange,
        /// N·m/rad; `None` for what a stop usually has.
        stiffness_nm_rad: Option<f64>,
        /// N·m·s/rad; `None` for what damps it well.
        damping_nm_s_rad: Option<f64>,
    },
    /// `load fan 2 300`: a torque in N·m at a speed in r/min, less or more with its square.
    Fan {
        /// N·m.
        torque_nm: f64,
        /// r/min of the output shaft.
        speed_rpm: f64,
    },
    /// `load gear 10 0.5`: all of it hangs behind a gear: turns of the shaft per turn of the load, and degrees of backlash there.
    Gear {
        /// Turns of the shaft per turn of the load.
        ratio: f64,
        /// Degrees at the load.
        backlash_deg: f64,
        /// N·m/rad at the load; `None` for what such gears have.
        stiffness_nm_rad: Option<f64>,
    },
    /// `load friction off` and so on: takes one of them away.
    Off(LoadKind),
    /// `load none`: takes all of them away, torque and inertia too.
    None,
}

/// Friction of a load, as torques at the motor's shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// N·m in motion.
    pub coulomb_nm: f64,
    /// N·m·s/rad.
    pub viscous_nm_s: f64,
    /// N·m that break it loose; that in motion, unless given.
    pub static_nm: Option<f64>,
    /// Velocity in rad/s at which the excess of a friction at rest has fallen to 1/e.
    pub stribeck_rad_s: Option<f64>,
}

/// Which thing at a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadKind {
    /// Friction of the load.
    Friction,
    /// Weight on a drum.
    Pulley,
    /// Spring.
    Spring,
    /// End stops.
    Stop,
    /// Fan.
    Fan,
    /// Gear.
    Gear,
}

const FRICTION: &str =
    "NODE load friction N·m [viscous N·m·s/rad] [static N·m] [stribeck rad/s], or NODE load friction off";
const PULLEY: &str = "NODE load pulley KG METRES, or NODE load pulley off";
const SPRING: &str = "NODE load spring N·m/rad [DEGREES], or NODE load spring off";
const STOP: &str = "NODE load stop LOW|min HIGH|max [N·m/rad [N·m·s/rad]], or NODE load stop off";
const FAN: &str = "NODE load fan N·m R/MIN, or NODE load fan off";
const GEAR: &str = "NODE load gear RATIO DEGREES [N·m/rad], or NODE load gear off";
const NONE: &str = "NODE load none";

/// Every form of these words.
pub(super) const FORMS: [&str; 7] = [FRICTION, PULLEY, SPRING, STOP, FAN, GEAR, NONE];

impl LoadPart {
    /// The words after `load`; `None` if they begin with none of these.
    pub(super) fn parse(words: &[&str]) -> Option<Result<Self, StimulusError>> {
        let (&first, rest) = words.split_first()?;
        if first == "none" {
            return Some(if rest.is_empty() { Ok(Self::None) } else { Err(StimulusError::Usage(NONE)) });
        }
        let kind = LoadKind::ALL.into_iter().find(|kind| kind.word() == first)?;
        if rest == ["off"] {
            return Some(Ok(Self::Off(kind)));
        }
        Some(match kind {
            LoadKind::Friction => friction(rest).map(Self::Friction),
            LoadKind::Pulley => pulley(rest),
            LoadKind::Spring => spring(rest),
            LoadKind::Stop => stop(rest),
            LoadKind::Fan => fan(rest),
            LoadKind::Gear => gear(rest),
        })
    }
}

fn friction(words: &[&str]) -> Result<Friction, StimulusError> {
    let Some((coulomb, pairs)) = words.split_first() else { return Err(StimulusError::Usage(FRICTION)) };
    let mut friction = Friction { coulomb_nm: value(coulomb, "friction", FRICTION)?, ..Friction::default() };
    for pair in pairs.chunks(2) {
        match pair {
            ["viscous", text] => friction.viscous_nm_s = value(text, "viscous friction", FRICTION)?,
            ["static", text] => friction.static_nm = Some(value(text, "friction", FRICTION)?),
            ["stribeck", text] => friction.stribeck_rad_s = Some(value(text, "velocity", FRICTION)?),
            ["viscous" | "static" | "stribeck"] | [] => return Err(StimulusError::Usage(FRICTION)),
            [word, ..] => {
                let (text, what) = (excerpt(word), "term of friction");
                return Err(StimulusError::BadValue { text, what, usage: FRICTION });
            }
        }
    }
    Ok(friction)
}

fn pulley(words: &[&str]) -> Result<LoadPart, StimulusError> {
    let [mass, radius] = words else { return Err(StimulusError::Usage(PULLEY)) };
    Ok(LoadPart::Pulley {
        mass_kg: value(mass, "mass", PULLEY)?,
        radius_m: number(radius, "radius", f64::MIN, PULLEY)?,
    })
}

fn spring(words: &[&str]) -> Result<LoadPart, StimulusError> {
    let (stiffness, rest) = match words {
        [stiffness] => (stiffness, None),
        [stiffness, rest] => (stiffness, Some(*rest)),
        _ => return Err(StimulusError::Usage(SPRING)),
    };
    Ok(LoadPart::Spring {
        stiffness_nm_rad: value(stiffness, "stiffness", SPRING)?,
        rest_deg: rest.map_or(Ok(0.0), |rest| number(rest, "angle", f64::MIN, SPRING))?,
    })
}

fn stop(words: &[&str]) -> Result<LoadPart, StimulusError> {
    let [low, high, more @ ..] = words else { return Err(StimulusError::Usage(STOP)) };
    if more.len() > 2 {
        return Err(StimulusError::Usage(STOP));
    }
    let nth = |n: usize, what| more.get(n).map(|text| value(text, what, STOP)).transpose();
    Ok(LoadPart::Stop {
        range: range(low, high, STOP)?,
        stiffness_nm_rad: nth(0, "stiffness")?,
        damping_nm_s_rad: nth(1, "damping")?,
    })
}

fn fan(words: &[&str]) -> Result<LoadPart, StimulusError> {
    let [torque, speed] = words else { return Err(StimulusError::Usage(FAN)) };
    Ok(LoadPart::Fan { torque_nm: value(torque, "torque", FAN)?, speed_rpm: value(speed, "speed", FAN)? })
}

fn gear(words: &[&str]) -> Result<LoadPart, StimulusError> {
    let (ratio, backlash, stiffness) = match words {
        [ratio, backlash] => (ratio, backlash, None),
        [ratio, backlash, stiffness] => (ratio, backlash, Some(*stiffness)),
        _ => return Err(StimulusError::Usage(GEAR)),
    };
    Ok(LoadPart::Gear {
        ratio: value(ratio, "ratio", GEAR)?,
        backlash_deg: value(backlash, "backlash", GEAR)?,
        stiffness_nm_rad: stiffness.map(|text| value(text, "stiffness", GEAR)).transpose()?,
    })
}

impl fmt::Display for LoadPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let optional =
            |f: &mut fmt::Formatter<'_>, value: Option<f64>| value.map_or(Ok(()), |value| write!(f, " {value}"));
        match *self {
            Self::Friction(Friction { coulomb_nm, viscous_nm_s, static_nm, stribeck_rad_s }) => {
                write!(f, "load friction {coulomb_nm}")?;
                if viscous_nm_s != 0.0 {
                    write!(f, " viscous {viscous_nm_s}")?;
                }
                static_nm.map_or(Ok(()), |value| write!(f, " static {value}"))?;
                stribeck_rad_s.map_or(Ok(()), |value| write!(f, " stribeck {value}"))
            }
            Self::Pulley { mass_kg, radius_m } => write!(f, "load pulley {mass_kg} {radius_m}"),
            Self::Spring { stiffness_nm_rad, rest_deg } => {
                write!(f, "load spring {stiffness_nm_rad}")?;
                optional(f, Some(rest_deg).filter(|rest_deg| *rest_deg != 0.0))
            }
            Self::Stop { range, stiffness_nm_rad, damping_nm_s_rad } => {
                write!(f, "load stop {} {}", bound_word(range.low, "min"), bound_word(range.high, "max"))?;
                optional(f, stiffness_nm_rad)?;
                optional(f, damping_nm_s_rad)
            }
            Self::Fan { torque_nm, speed_rpm } => write!(f, "load fan {torque_nm} {speed_rpm}"),
            Self::Gear { ratio, backlash_deg, stiffness_nm_rad } => {
                write!(f, "load gear {ratio} {backlash_deg}")?;
                optional(f, stiffness_nm_rad)
            }
            Self::Off(kind) => write!(f, "load {} off", kind.word()),
            Self::None => f.write_str("load none"),
        }
    }
}

impl LoadKind {
    /// Each of them.
    pub const ALL: [Self; 6] = [Self::Friction, Self::Pulley, Self::Spring, Self::Stop, Self::Fan, Self::Gear];

    /// How it is called in a command.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Pulley => "pulley",
            Self::Spring => "spring",
            Self::Stop => "stop",
            Self::Fan => "fan",
            Self::Gear => "gear",
        }
    }
}

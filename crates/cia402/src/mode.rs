use core::fmt;

/// Modes of operation, objects 6060h and 6061h. Open: drives have modes of their own. Source: CiA 402-2, table 46.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ModeOfOperation(pub i8);

impl ModeOfOperation {
    /// No mode chosen.
    pub const NONE: Self = Self(0);
    /// Profile position.
    #[doc(alias = "PP")]
    pub const PROFILE_POSITION: Self = Self(1);
    /// Velocity (frequency converters).
    pub const VELOCITY: Self = Self(2);
    /// Profile velocity.
    #[doc(alias = "PV")]
    pub const PROFILE_VELOCITY: Self = Self(3);
    /// Profile torque.
    #[doc(alias = "PT")]
    pub const PROFILE_TORQUE: Self = Self(4);
    /// Homing.
    pub const HOMING: Self = Self(6);
    /// Interpolated position.
    pub const INTERPOLATED_POSITION: Self = Self(7);

    /// The standard's name; `None` for numbers it reserves or leaves to manufacturers.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self.0 {
            0 => "no mode",
            1 => "profile position",
            2 => "velocity",
            3 => "profile velocity",
            4 => "profile torque",
            6 => "homing",
            7 => "interpolated position",
            8 => "cyclic synchronous position",
            9 => "cyclic synchronous velocity",
            10 => "cyclic synchronous torque",
            _ => return None,
        })
    }
}

impl fmt::Display for ModeOfOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({name})", self.0),
            None => self.0.fmt(f),
        }
    }
}

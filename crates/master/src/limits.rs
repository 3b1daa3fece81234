//! What an object of a drive takes, as data. Who asks the drive for it: [`crate::Drive::limits`].

use core::fmt;

use canopen::Mux;

/// What an object of a drive takes at this time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The object.
    pub object: Mux,
    /// Its name.
    pub name: &'static str,
    /// Unit of one count at a resolution of 1; empty for none.
    pub unit: &'static str,
    /// Smallest value that is taken, in counts.
    pub low: i64,
    /// Largest value that is taken, in counts.
    pub high: i64,
    /// The only values, with what they mean, where not all between are taken.
    pub listed: &'static [(i64, &'static str)],
    /// What divides the unit and has multiplied the limits.
    pub resolution: Option<Setting>,
    /// What holds back what a value effects, and from which magnitude on, in counts.
    pub held_to: Option<(i64, HeldBy)>,
    /// What raises what a smaller value but 0 effects, and to which magnitude, in counts.
    pub raised_to: Option<(i64, Setting)>,
}

/// An object that has a say in the limits of another, and its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The object.
    pub object: Mux,
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: i64,
    /// The drive goes by the value that was stored at its last restart, which is not to be read.
    pub since_restart: bool,
}

/// What keeps a value from acting as it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldBy {
    /// An object.
    Setting(Setting),
    /// The highest speed of the motor, by its manual.
    Motor,
}

impl HeldBy {
    /// The object, where it is one.
    pub const fn setting(self) -> Option<Setting> {
        if let Self::Setting(setting) = self { Some(setting) } else { None }
    }
}

impl fmt::Display for HeldBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setting(setting) => setting.fmt(f),
            Self::Motor => f.write_str("the highest speed of its motor"),
        }
    }
}

/// A number that was asked for, as it is shown. A conversion ends at the bounds of 64 bits, and what was asked for is beyond.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AskedNumber(pub(crate) i64);

impl fmt::Display for AskedNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            i64::MIN | i64::MAX => f.write_str("a value of more than 64 bits"),
            number => number.fmt(f),
        }
    }
}

impl Limits {
    /// True if the drive takes this value.
    pub fn take(&self, value: i64) -> bool {
        let listed = self.listed.is_empty() || self.listed.iter().any(|(known, _)| *known == value);
        (self.low..=self.high).contains(&value) && listed
    }

    /// The magnitude that this value effects in place of its own, and by which setting, if one holds it back or raises it.
    pub fn changed(&self, value: i64) -> Option<(i64, HeldBy)> {
        let magnitude = value.unsigned_abs();
        let held = self.held_to.filter(|(most, _)| magnitude > most.unsigned_abs());
        let raised = self.raised_to.filter(|(least, _)| value != 0 && magnitude < least.unsigned_abs());
        held.or(raised.map(|(least, setting)| (least, HeldBy::Setting(setting))))
    }

    /// How many counts make one of the unit.
    pub fn counts_per_unit(&self) -> i64 {
        self.resolution.map_or(1, |setting| setting.value.max(1))
    }
}

/// `-1000 to 1000 in units of r/min, by 202Fh:05 velocity_resolution = 1; acts up to 500, by 200Ah:00 max_motor_speed = 500`.
impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.listed.is_empty() {
            write!(f, "{} to {}", self.low, self.high)?;
        }
        for (place, (value, meaning)) in self.listed.iter().enumerate() {
            write!(f, "{}{value} ({meaning})", if place == 0 { "" } else { ", " })?;
        }
        match (self.unit, self.counts_per_unit()) {
            ("", _) => {}
            (unit, 1) => write!(f, " in units of {unit}")?,
            (unit, counts) => write!(f, " in units of {unit} / {counts}")?,
        }
        if let Some(setting) = self.resolution {
            write!(f, ", by {setting}")?;
        }
        if let Some((most, by)) = self.held_to {
            write!(f, "; it acts up to {most}, by {by}")?;
        }
        match self.raised_to {
            Some((least, setting)) => write!(f, "; smaller values (except 0) act as {least}, by {setting}"),
            None => Ok(()),
        }
    }
}

/// `202Fh:05 velocity_resolution = 10 (a change acts from the next restart on)`.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} = {}", self.object, self.name, self.value)?;
        if self.since_restart { f.write_str(" (a change acts from the next restart on)") } else { Ok(()) }
    }
}

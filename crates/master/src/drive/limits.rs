//! What an object takes at this time, and why: limits that stand in the model's table, moved by the objects that the row
//! names ([`Entry::resolution`], [`Entry::held_to`]). Their values are read from the drive, and no rule is written here a
//! second time.

use core::fmt;

use canopen::Mux;
use canopen::od::{Entry, HeldTo};

use super::Drive;
use super::state::refused_is_none;
use crate::error::Error;

/// What an object of a drive takes at this time.
#[derive(Clone, Debug, PartialEq)]
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
    pub held_to: Option<(i64, Setting)>,
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

impl Limits {
    /// True if the drive takes this value.
    pub fn take(&self, value: i64) -> bool {
        let listed = self.listed.is_empty() || self.listed.iter().any(|(known, _)| *known == value);
        (self.low..=self.high).contains(&value) && listed
    }

    /// The setting that holds this value back, if one does.
    pub fn holding_back(&self, value: i64) -> Option<Setting> {
        let (most, setting) = self.held_to?;
        (value.unsigned_abs() > most.unsigned_abs()).then_some(setting)
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
        match self.held_to {
            Some((most, setting)) => write!(f, "; it acts up to {most}, by {setting}"),
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

impl Drive {
    /// What an object takes at this time. Asks the drive for the objects that have a say in it.
    ///
    /// # Errors
    /// [`Error::UnknownModel`]; [`Error::Aborted`] with the code of a missing object where the model has none; those of the
    /// SDO reads.
    pub async fn limits(&self, object: Mux) -> Result<Limits, Error> {
        let row = self.row(object, "tell its limits")?;
        self.limits_of(row).await
    }

    pub(super) async fn limits_of(&self, row: &'static Entry) -> Result<Limits, Error> {
        let resolution = match row.resolution {
            Some(object) => Some(self.setting(object).await?),
            None => None,
        };
        let scale = resolution.map_or(1, |setting| setting.value.max(1));
        let held_to = match row.held_to {
            Some(HeldTo { object, counts }) => {
                // A drive that does not tell holds nothing back that could be named.
                let setting = refused_is_none(self.setting(object).await)?;
                setting.map(|setting| (setting.value * counts * scale, setting))
            }
            None => None,
        };
        let (low, high) = row.limits_at(scale);
        let (object, Entry { name, unit, values: listed, .. }) = (row.mux(), *row);
        Ok(Limits { object, name, unit, low, high, listed, resolution, held_to })
    }

    async fn setting(&self, object: Mux) -> Result<Setting, Error> {
        let value = self.read_number(object).await?;
        let profile = self.known("tell its limits")?;
        let name = profile.row(object).map_or("", |row| row.name);
        let since_restart = profile.storage.effective_after_restart.contains(&object);
        Ok(Setting { object, name, value, since_restart })
    }

    /// Checks a value against the object's limits, and gives its row. The drive is only asked about limits that move where
    /// the value is beyond those that hold in any case.
    pub(super) async fn check_number(&self, mux: Mux, value: i64) -> Result<&'static Entry, Error> {
        let row = self.row(mux, "write an object by its model's table")?;
        let (low, high) = row.limits_at(1);
        let listed = row.values.is_empty() || row.meaning(value).is_some();
        if (low..=high).contains(&value) && listed {
            return Ok(row);
        }
        let limits = self.limits_of(row).await?;
        if limits.take(value) { Ok(row) } else { Err(self.out_of_limits(value, limits)) }
    }

    /// As [`check_number`](Self::check_number), for what is to be effected: a value that the drive would take and hold back
    /// is refused too.
    pub(super) async fn check_effect(&self, mux: Mux, value: i64) -> Result<&'static Entry, Error> {
        let row = self.check_number(mux, value).await?;
        if row.held_to.is_none() || value == 0 {
            return Ok(row);
        }
        let limits = self.limits_of(row).await?;
        if limits.holding_back(value).is_none() { Ok(row) } else { Err(self.out_of_limits(value, limits)) }
    }

    fn out_of_limits(&self, asked: i64, limits: Limits) -> Error {
        Error::OutOfLimits { node: self.node.id(), asked, limits: Box::new(limits) }
    }
}

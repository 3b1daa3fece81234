//! What a capture has a column of: an object of the drive, or what is true of a virtual one; and where it comes from.

use std::fmt;

use canopen::pdo::PdoId;
use master::Drive;
use recording::{ending_of, is_called};
use sim::recorder::{LiveValues, Signal};
use words::failure::Failure;
use words::suggest::{did_you_mean, near};

use super::quantity::{Quantity, short_names};

/// What a capture has of a drive, under its name in a record.
#[derive(Clone, Debug, PartialEq)]
pub enum Measurand {
    /// What the drive itself says.
    Object(Quantity),
    /// A true value, from the simulation of a virtual drive.
    World(TrueValue),
}

/// A value of the world around a virtual drive.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueValue {
    /// `true_velocity_rpm`: the name that records of the world have for it, marked.
    pub name: String,
    /// Which of the world's signals.
    pub signal: Signal,
    /// Where it is sampled.
    pub values: LiveValues,
}

/// What names of true values begin with: `true_velocity`.
pub const TRUE: &str = "true_";

impl Measurand {
    /// As [`Quantity::named`], or with [`TRUE`] before it a signal of the world by its name in a record, with its unit or without.
    ///
    /// # Errors
    /// Those of [`Quantity::named`]; a true value of a drive that is not in a world of this program; the world has no such signal.
    pub async fn named(drive: &Drive, world: Option<&LiveValues>, text: &str) -> Result<Self, Failure> {
        let wanted = text.trim().to_ascii_lowercase().replace('-', "_");
        let Some(signal) = wanted.strip_prefix(TRUE) else {
            return Quantity::named(drive, text).await.map(Self::Object);
        };
        let node = drive.node().id();
        let found = Signal::ALL.into_iter().find(|known| is_called(known.name(), signal));
        let found = found.ok_or_else(|| {
            let names = || Signal::ALL.iter().map(|signal| signal.name());
            let stems = || Signal::ALL.iter().filter_map(|of| of.name().strip_suffix(ending_of(of.unit())));
            let guess = did_you_mean(&near(signal, names().chain(stems())));
            let all = names().map(|name| format!("{TRUE}{name}")).collect::<Vec<_>>().join(", ");
            Failure::usage(format!("a virtual drive has no true value '{signal}'{guess}"))
                .at_node(node)
                .next(format!("name one of: {all}"))
        })?;
        let values = world.cloned().ok_or_else(|| {
            Failure::new(format!("node {node}: {wanted} cannot be captured on this bus"))
                .of_kind("no_true_values")
                .at_node(node)
                .because("a drive sends what it measures; what is true beside that is known of a virtual drive alone, to the program whose world it is in")
                .next(format!("without {TRUE} the names mean what the drive says: {}", short_names()))
                .next("on --bus sim or --bus sim:FILE.toml they can be captured; a bus of `ferrodrive sim` has them in its own record: ferrodrive sim --record FILE")
        })?;
        Ok(Self::World(TrueValue { name: format!("{TRUE}{}", found.name()), signal: found, values }))
    }

    /// Its name in a record, with the unit in it.
    pub fn name(&self) -> &str {
        match self {
            Self::Object(quantity) => &quantity.name,
            Self::World(value) => &value.name,
        }
    }

    /// Its unit as people write it; empty for what has none.
    pub fn unit(&self) -> &str {
        match self {
            Self::Object(quantity) => &quantity.unit,
            Self::World(value) => value.signal.unit(),
        }
    }

    /// What the drive says itself.
    pub const fn quantity(&self) -> Option<&Quantity> {
        match self {
            Self::Object(quantity) => Some(quantity),
            Self::World(_) => None,
        }
    }
}

/// What was had of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub enum Way {
    /// By this TPDO.
    Tpdo(PdoId),
    /// By SDO, one request after the other.
    Sdo,
    /// From the world that the virtual drive is in.
    World,
}

impl fmt::Display for Way {
    /// `TPDO1`, `SDO`, `world`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tpdo(pdo) => pdo.fmt(f),
            Self::Sdo => f.write_str("SDO"),
            Self::World => f.write_str("world"),
        }
    }
}

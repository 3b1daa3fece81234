//! What an FMU is of: written into its resources when it is packed, read when it is instantiated.

use std::path::Path;

use can::Bitrate;
use serde::{Deserialize, Serialize};
use sim::Rule;
use words::drive::{DriveSpec, drive_spec_in};

/// The name of the file in the FMU's resources.
pub const FILE: &str = "ferrodrive.toml";
/// The nodes that a bus FMU may have: one for each node-ID.
pub const MAX_NODES: u8 = 127;

/// What is in an FMU.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Config {
    /// One drive with its motor, load and supply.
    Drive(DriveConfig),
    /// A CAN bus.
    Bus(BusConfig),
    /// One drive with a master that leads it, for FMI 2.0.
    Axis(AxisConfig),
}

/// A drive.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveConfig {
    /// `MODEL@NODE,option=value`, as the command line takes it; a file is looked for in the resources.
    pub drive: String,
    /// Bit rate at the first start, in bit/s.
    pub bitrate: u32,
    /// How it announces what it has to send.
    pub clock: TxClock,
    /// What crosses its shaft: with [`Rule::Torque`] its load's torque comes in and its motion goes out; else the importer moves the joint,
    /// and the drive's torque goes out.
    #[serde(default = "torque_in", skip_serializing_if = "is_torque_in", with = "rule")]
    pub rule: Rule,
}

const fn torque_in() -> Rule {
    Rule::Torque
}

fn is_torque_in(rule: &Rule) -> bool {
    *rule == Rule::Torque
}

/// A rule by its word.
mod rule {
    use serde::{Deserialize, Deserializer, Serializer, de::Error};
    use sim::Rule;

    pub(super) fn serialize<S: Serializer>(rule: &Rule, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(rule.word())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rule, D::Error> {
        let word = String::deserialize(deserializer)?;
        word.parse().map_err(|()| D::Error::custom(format!("rule {word:?}: expected {}", Rule::NAMES)))
    }
}

/// A drive and its master.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisConfig {
    /// What the drive follows.
    pub mode: TargetKind,
    /// The drive; it announces nothing.
    pub drive: DriveConfig,
}

/// What a drive follows that is led by a master.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TargetKind {
    /// A speed.
    #[default]
    Velocity,
    /// A path of positions.
    Position,
    /// A motor current.
    Torque,
}

impl TargetKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Velocity, Self::Position, Self::Torque];

    /// As people type it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Position => "position",
            Self::Torque => "torque",
        }
    }
}

/// A bus.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusConfig {
    /// How many nodes can be joined to it.
    pub nodes: u8,
    /// Its bit rate in bit/s, also of nodes that do not state one.
    pub bitrate: u32,
    /// How it announces what it has to deliver.
    pub clock: TxClock,
}

/// The kind of the clock of what is sent (fmi-ls-bus, "Tx Clocks").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TxClock {
    /// The FMU states when the next frame is due, and the importer steps to that instant: exact times.
    #[default]
    Countdown,
    /// Frames wait for the end of the importer's step.
    Triggered,
}

/// Why an FMU cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The file in the resources is missing or torn.
    #[error("{0}; pack the FMU anew with `ferrodrive fmu`")]
    File(String),
    /// A drive that is not known.
    #[error("{0}")]
    Drive(String),
    /// A model that cannot be led so.
    #[error("a {0} has no mode in which it follows a new {1} in each cycle")]
    NoMode(&'static str, &'static str),
    /// A bit rate that the bus cannot have.
    #[error("{0} bit/s is not a bit rate of CAN; expected 10000 to 1000000, e.g. 500000")]
    Bitrate(u32),
    /// A number of nodes that the bus cannot have.
    #[error("a bus of {0} nodes is not possible; expected 2 to {MAX_NODES}")]
    Nodes(u8),
}

impl Config {
    /// Reads the file in a folder of resources.
    ///
    /// # Errors
    /// That it is missing, or what of it makes no sense.
    pub fn read(resources: &Path) -> Result<Self, ConfigError> {
        let path = resources.join(FILE);
        let text = std::fs::read_to_string(&path)
            .map_err(|error| ConfigError::File(format!("cannot read {}: {error}", path.display())))?;
        toml::from_str(&text).map_err(|error| ConfigError::File(format!("{}: {}", path.display(), error.message())))
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        // A struct of numbers and texts always has a form in TOML.
        toml::to_string(self).unwrap_or_default()
    }

    /// The kind of its clocks.
    pub const fn clock(&self) -> TxClock {
        match self {
            Self::Drive(drive) => drive.clock,
            Self::Bus(bus) => bus.clock,
            Self::Axis(_) => TxClock::Triggered,
        }
    }

    /// The drive that is in it.
    pub const fn drive(&self) -> Option<&DriveConfig> {
        match self {
            Self::Drive(drive) | Self::Axis(AxisConfig { drive, .. }) => Some(drive),
            Self::Bus(_) => None,
        }
    }
}

impl DriveConfig {
    /// A drive as the command line takes it, at 500 kbit/s, with frames at the end of each step and a torque at its shaft.
    pub fn new(drive: impl Into<String>) -> Self {
        Self { drive: drive.into(), bitrate: 500_000, clock: TxClock::Triggered, rule: Rule::Torque }
    }

    /// The drive that is meant; files are looked for in `resources`.
    ///
    /// # Errors
    /// What of it is not known.
    pub fn spec(&self, resources: &Path) -> Result<DriveSpec, ConfigError> {
        let folder = if self.file().is_some() { resources } else { Path::new("") };
        drive_spec_in(&self.drive, folder).map_err(|unresolved| ConfigError::Drive(unresolved.into()))
    }

    /// The file that describes it; `None` for a model that is built in.
    pub fn file(&self) -> Option<&str> {
        let place = self.drive.split(',').next()?;
        let (model, _) = place.rsplit_once('@')?;
        Path::new(model).extension().map(|_| model)
    }
}

/// A bit rate that a bus can have.
///
/// # Errors
/// That it cannot.
pub fn bitrate(bits_per_second: u32) -> Result<Bitrate, ConfigError> {
    Bitrate::new(bits_per_second).ok_or(ConfigError::Bitrate(bits_per_second))
}

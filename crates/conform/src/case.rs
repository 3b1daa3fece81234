//! What a case is: a row of a table, and the conditions under which it says something about a device.

use std::fmt;
use std::pin::Pin;

use canopen::Mux;
use canopen::sdo::parameter::is_further_server;
use cia402::ModeOfOperation;
use devices::PowerStyle;

use crate::bench::Bench;
use crate::finding::Verdict;
use crate::options::Options;
use crate::subject::Subject;

/// One case of the suite.
#[derive(Clone, Copy)]
pub struct Case {
    /// CiA's number where it is public (`SDO 07`), but for OD 07 and OD 08, which ask more; from 51 on, and `402-..`, ours.
    pub id: &'static str,
    /// What is asked, in a line.
    pub title: &'static str,
    /// Where the standard says what is expected.
    pub clause: &'static str,
    /// What a device has to have for it.
    pub needs: &'static [Need],
    /// Keys of the departures ([`devices::Departure::key`]) by which a device fails it as its maker's manual states.
    pub departures: &'static [&'static str],
    pub(crate) run: RunCase,
}

pub(crate) type RunCase = for<'a> fn(&'a mut Bench) -> Pin<Box<dyn Future<Output = Verdict> + 'a>>;

/// A part of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each has its title")]
pub enum Group {
    Sdo,
    Pdo,
    Dictionary,
    Emcy,
    Sync,
    Guarding,
    Heartbeat,
    HeartbeatAndGuarding,
    Other,
    State,
    Transition,
    Lss,
    Cia402,
}

impl Group {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 13] = [
        (Self::Sdo, "SDO", "service data objects"),
        (Self::Pdo, "PDO", "process data objects"),
        (Self::Dictionary, "OD", "object dictionary"),
        (Self::Emcy, "EMCY", "emergency messages"),
        (Self::Sync, "SYNC", "synchronisation"),
        (Self::Guarding, "GUARD", "node and life guarding"),
        (Self::HeartbeatAndGuarding, "HBG", "heartbeat against guarding"),
        (Self::Heartbeat, "HB", "heartbeat"),
        (Self::Other, "OTHER", "storing, restricted identifiers"),
        (Self::State, "STATE", "NMT states"),
        (Self::Transition, "TRANS", "NMT transitions"),
        (Self::Lss, "LSS", "layer setting services"),
        (Self::Cia402, "402", "drives"),
    ];

    /// The first part of its cases' numbers.
    pub fn prefix(self) -> &'static str {
        self.row().1
    }

    /// What its cases are about.
    pub fn title(self) -> &'static str {
        self.row().2
    }

    fn row(self) -> (Self, &'static str, &'static str) {
        let row = Self::ALL.into_iter().find(|(group, ..)| *group == self);
        row.unwrap_or(Self::ALL[0])
    }
}

impl Case {
    /// Its group.
    pub fn group(&self) -> Group {
        let prefix = self.id.split([' ', '-']).next().unwrap_or_default();
        let row = Group::ALL.into_iter().find(|(_, known, _)| *known == prefix);
        row.map_or(Group::Other, |(group, ..)| group)
    }

    /// The need that the subject does not meet.
    pub(crate) fn unmet(&self, subject: &Subject, options: &Options) -> Option<Need> {
        let unmet = || self.needs.iter().copied().filter(|need| !need.is_met(subject, options));
        // What the device lacks says more than what was not allowed.
        unmet().find(|need| !matches!(need, Need::Motion | Need::Store)).or_else(|| unmet().next())
    }
}

impl fmt::Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.id, self.title)
    }
}

/// What a device has to have, by its description, for a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// An object of this index.
    Index(u16),
    /// An object of this index that can be written.
    Writable(u16),
    /// This sub-index of an object.
    Sub(u16, u8),
    /// An SDO server beside the first one.
    FurtherServer,
    /// An error that the suite can bring about: a heartbeat that stays away, or a receive PDO that is too short.
    AnError,
    /// A receive PDO.
    Rpdo,
    /// A transmit PDO.
    Tpdo,
    /// LSS.
    Lss,
    /// An axis with the power state machine of CiA 402.
    PowerStates,
    /// An axis.
    Axis,
    /// A mode of operation.
    Mode(ModeOfOperation),
    /// The leave to energise and move a motor.
    Motion,
    /// The leave to store parameters.
    Store,
}

impl Need {
    /// An option allows it, whatever the device has.
    pub(crate) const fn is_an_option(self) -> bool {
        matches!(self, Self::Motion | Self::Store)
    }

    fn is_met(self, subject: &Subject, options: &Options) -> bool {
        let description = subject.description;
        let axis = description.first_axis();
        match self {
            Self::Index(index) => description.has_index(index),
            Self::Writable(index) => subject.row(index, 0).is_some_and(|row| row.access.is_writable()),
            Self::Sub(index, sub_index) => subject.row(index, sub_index).is_some(),
            Self::FurtherServer => subject.rows().any(|row| is_further_server(row.index)),
            Self::AnError => description.has_index(0x1016) || subject.pdos(0x1400).next().is_some(),
            Self::Rpdo => subject.pdos(0x1400).next().is_some(),
            Self::Tpdo => subject.pdos(0x1800).next().is_some(),
            Self::Lss => description.lss,
            Self::PowerStates => axis.is_some_and(|axis| axis.power == PowerStyle::Cia402),
            Self::Axis => axis.is_some(),
            Self::Mode(mode) => axis.is_some_and(|axis| axis.modes.contains(&mode)),
            Self::Motion => options.allow_motion,
            Self::Store => options.allow_store,
        }
    }

    /// The object by which a device shows it.
    pub(crate) const fn object(self) -> Option<Mux> {
        match self {
            Self::Index(index) | Self::Writable(index) => Some(Mux::new(index, 0)),
            Self::Sub(index, sub_index) => Some(Mux::new(index, sub_index)),
            Self::AnError => Some(Mux::new(0x1016, 0)),
            Self::PowerStates => Some(Mux::new(0x6041, 0)),
            _ => None,
        }
    }
}

/// Why a case does not apply.
impl fmt::Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Index(index) => write!(f, "the device has no object {index:04X}h"),
            Self::Writable(index) => write!(f, "the device has no object {index:04X}h that can be written"),
            Self::Sub(index, sub_index) => write!(f, "the device has no object {}", Mux::new(*index, *sub_index)),
            Self::FurtherServer => f.write_str("the device has no SDO server beside the first one: 1201h to 127Fh"),
            Self::AnError => {
                f.write_str("the device has neither 1016h nor a receive PDO: nothing brings an error about")
            }
            Self::Rpdo => f.write_str("the device has no receive PDO"),
            Self::Tpdo => f.write_str("the device has no transmit PDO"),
            Self::Lss => f.write_str("the device is not said to have LSS"),
            Self::PowerStates => f.write_str("the device has no power state machine of CiA 402"),
            Self::Axis => f.write_str("the device is not a drive"),
            Self::Mode(mode) => {
                write!(f, "the device does not have mode {} ({})", mode.0, mode.name().unwrap_or("the maker's"))
            }
            Self::Motion => f.write_str("energises the motor: give --allow-motion"),
            Self::Store => f.write_str("stores parameters in the device's memory: give --allow-store"),
        }
    }
}

/// A row of a table of cases.
macro_rules! case {
    ($id:literal, $title:literal, $clause:literal, [$($need:expr),*], [$($departure:literal),*], $run:expr) => {
        $crate::case::Case {
            id: $id,
            title: $title,
            clause: $clause,
            needs: &[$($need),*],
            departures: &[$($departure),*],
            run: |bench| Box::pin($run(bench)),
        }
    };
}
pub(crate) use case;

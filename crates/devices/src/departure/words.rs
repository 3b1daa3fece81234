//! Departures in words: a name for programs, what is so, and what to do.

use core::fmt;

use canopen::Mux;
use canopen::pdo::TpdoForm;
use cia402::ModeOfOperation;

use super::Departure;
use crate::axis::BitPattern;
use crate::description::{HostWatch, ParameterStorage, PdoRules, Write};

impl Departure {
    /// Its name for programs: `no_error_history`.
    pub const fn key(&self) -> &'static str {
        match self {
            Self::Stated(stated) => stated.key,
            Self::IdentityShared(_) => "identity_shared",
            Self::SiblingStoresWith { .. } => "sibling_stores_with",
            Self::NoErrorHistory(_) => "no_error_history",
            Self::NoStoreParameters(_) => "no_store_parameters",
            Self::NoEmcy(_) => "no_emcy",
            Self::NoHeartbeatConsumer(_) => "no_heartbeat_consumer",
            Self::VersionIsNumber(_) => "version_is_number",
            Self::SubIndexZero(..) => "sub_index_zero",
            Self::StartsOperational => "starts_operational",
            Self::HeartbeatTellsAlarm => "heartbeat_tells_alarm",
            Self::PdoTimers(_) => "pdo_timers",
            Self::PdosCountedFrom(_) => "pdos_counted_from",
            Self::TpdoAnswersRpdo => "tpdo_answers_rpdo",
            Self::FixedMapping => "fixed_mapping",
            Self::AnotherFormInTpdos(_) => "another_form_in_tpdos",
            Self::WatchesForSilence { .. } => "watches_for_silence",
            Self::NoSupportedDriveModes(..) => "no_supported_drive_modes",
            Self::NoModeDisplay(..) => "no_mode_display",
            Self::EchoesControlword(_) => "echoes_controlword",
            Self::NewSetPointClearsItself(_) => "new_set_point_clears_itself",
            Self::StatusBit(..) => "status_bit",
            Self::HomingStartsWithMode(_) => "homing_starts_with_mode",
            Self::HomingShownBy { .. } => "homing_shown_by",
            Self::RampsAreTimes(_) => "ramps_are_times",
            Self::OtherUnit { .. } => "other_unit",
            Self::VelocityUnits { .. } => "velocity_units",
            Self::OtherType { .. } => "other_type",
            Self::OtherAccess { .. } => "other_access",
            Self::SubIndexCount { .. } => "sub_index_count",
        }
    }

    /// The object that it is about: where the standard has it, if the device has not.
    pub const fn object(&self) -> Option<Mux> {
        Some(match self {
            Self::Stated(stated) => stated.object,
            Self::IdentityShared(_) => Mux::new(0x1018, 0),
            Self::NoErrorHistory(_) => Mux::new(0x1003, 0),
            Self::NoStoreParameters(_) => Mux::new(0x1010, 0),
            Self::NoEmcy(_) => Mux::new(0x1014, 0),
            Self::NoHeartbeatConsumer(_) => Mux::new(0x1016, 0),
            Self::StartsOperational | Self::HeartbeatTellsAlarm => return None,
            Self::PdoTimers(_) => Mux::new(0x1800, 3),
            Self::PdosCountedFrom(_) => Mux::new(0x1400, 0),
            Self::TpdoAnswersRpdo => Mux::new(0x1800, 2),
            Self::FixedMapping => Mux::new(0x1600, 0),
            Self::AnotherFormInTpdos(TpdoForm { object, .. }) => *object,
            Self::VersionIsNumber(object)
            | Self::SubIndexZero(object, _)
            | Self::SiblingStoresWith { object, .. }
            | Self::WatchesForSilence { object, .. }
            | Self::NoSupportedDriveModes(object, _)
            | Self::NoModeDisplay(object, _)
            | Self::EchoesControlword(object)
            | Self::NewSetPointClearsItself(object)
            | Self::StatusBit(object, ..)
            | Self::HomingStartsWithMode(object)
            | Self::HomingShownBy { statusword: object, .. }
            | Self::RampsAreTimes(object)
            | Self::OtherUnit { object, .. }
            | Self::OtherType { object, .. }
            | Self::OtherAccess { object, .. }
            | Self::SubIndexCount { object, .. }
            | Self::VelocityUnits { actual: (object, _), .. } => *object,
        })
    }

    /// What a program written to the standard has to do; prints as a sentence without a full stop.
    pub const fn remedy(&self) -> Remedy<'_> {
        Remedy(self)
    }
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stated(stated) => f.write_str(stated.what),
            Self::IdentityShared(_) => f.write_str("another model answers the same identity"),
            Self::SiblingStoresWith { object, name, sibling } => {
                write!(f, "{object} is {name}; the {sibling}, of the same identity, stores its parameters with it")
            }
            Self::NoErrorHistory(_) => f.write_str("no object 1003h (error history)"),
            Self::NoStoreParameters(_) => f.write_str("no objects 1010h and 1011h (store and restore parameters)"),
            Self::NoEmcy(_) => f.write_str("no EMCY messages"),
            Self::NoHeartbeatConsumer(_) => f.write_str("no object 1016h: heartbeats are produced, not consumed"),
            Self::VersionIsNumber(object) => write!(f, "{object} is a number, not a text"),
            Self::SubIndexZero(object, data_type) => {
                write!(f, "sub-index 00h of the maker's records, from {object} on, is {}", data_type.name())
            }
            Self::StartsOperational => f.write_str("NMT operational from boot-up on"),
            Self::HeartbeatTellsAlarm => {
                f.write_str("heartbeats say 04h while there is an alarm; it does not mean stopped")
            }
            Self::PdoTimers(PdoRules { inhibit_unit_ns, event_timer_unit_ns, .. }) => {
                let (inhibit, event) = (Milliseconds(*inhibit_unit_ns), Milliseconds(*event_timer_unit_ns));
                write!(f, "one count of a PDO's inhibit time is {inhibit}, of its event timer {event}")
            }
            Self::PdosCountedFrom(first) => write!(f, "the manual counts PDOs from {first}: RPDO1 is its RPDO{first}"),
            Self::TpdoAnswersRpdo => f.write_str("TPDO n answers RPDO n; nothing is sent unasked"),
            Self::FixedMapping => f.write_str("the mapping of PDOs is fixed"),
            Self::AnotherFormInTpdos(TpdoForm { object, data_type, unit, .. }) => {
                write!(f, "{object} is {} in TPDOs, in units of {}", data_type.name(), One(unit))
            }
            Self::WatchesForSilence { object, default_ms } => {
                write!(
                    f,
                    "the motor stops when no frame for the drive comes for a time ({object}, as delivered {default_ms} ms)"
                )
            }
            Self::NoSupportedDriveModes(object, _) => {
                write!(f, "no object {:04X}h (supported drive modes)", object.index)
            }
            Self::NoModeDisplay(object, _) => write!(f, "no object {:04X}h (mode display)", object.index),
            Self::EchoesControlword(_) => f.write_str("the statusword echoes the controlword: no CiA 402 states"),
            Self::NewSetPointClearsItself(_) => f.write_str("bit 4 acts on each write of a 1 and clears itself"),
            Self::StatusBit(_, bit, words) => write!(f, "statusword bit {bit} is \"{words}\""),
            Self::HomingStartsWithMode(object) => write!(f, "homing starts when 6 is written to {object}"),
            Self::HomingShownBy { .. } => f.write_str("bits 12 and 13 show nothing of homing"),
            Self::RampsAreTimes(object) => {
                write!(f, "ramps are times, not accelerations: {:04X}h and what follows it are in ms", object.index)
            }
            Self::OtherUnit { object, unit, standard } => {
                write!(f, "one count of {object} is {}, not {standard}", One(unit))
            }
            Self::OtherType { object, here, standard } => {
                write!(f, "{object} is {}, not {}", here.name(), standard.name())
            }
            Self::OtherAccess { object, here, standard } => {
                write!(f, "{object} is {} by SDO, not {}", here.name(), standard.name())
            }
            Self::SubIndexCount { object, says, highest } => {
                write!(f, "{object} says {says}; the highest sub-index is {highest}")
            }
            Self::VelocityUnits { actual: (actual, unit), target: (target, other) } => {
                write!(f, "one count of {actual} is {}, of {target} {}", One(unit), One(other))
            }
        }
    }
}

/// What to do about a departure, in words.
#[derive(Clone, Copy)]
pub struct Remedy<'a>(&'a Departure);

impl fmt::Display for Remedy<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Departure::Stated(stated) => f.write_str(stated.remedy),
            Departure::IdentityShared(Some(object)) => {
                write!(f, "say which model it is; that {object} is there speaks for this one and proves nothing")
            }
            Departure::IdentityShared(None) => f.write_str("say which model it is; their objects are the same"),
            Departure::SiblingStoresWith { .. } => f.write_str("know the model before parameters are stored"),
            Departure::NoErrorHistory(Some(code)) | Departure::NoEmcy(Some(code)) => {
                write!(f, "read the present code from {code}")
            }
            Departure::NoErrorHistory(None) | Departure::NoEmcy(None) => f.write_str("read 1001h:00 from time to time"),
            Departure::NoStoreParameters(storage) => write_storage(f, storage),
            Departure::NoHeartbeatConsumer(HostWatch::Silence { time }) => {
                write!(f, "set {time} for what the drive does when its host is gone")
            }
            Departure::NoHeartbeatConsumer(_) => {
                f.write_str("nothing in the device notices that its host is gone: stop the motor by other means")
            }
            Departure::VersionIsNumber(_) => f.write_str("read it as the number that the dictionary says"),
            Departure::SubIndexZero(..) => f.write_str("take the length of the answer, not one byte"),
            Departure::StartsOperational => {
                f.write_str("expect its PDOs at once, and configure what must not be sent before it is switched on")
            }
            Departure::HeartbeatTellsAlarm => f.write_str("take 04h in a heartbeat for an alarm; SDO goes on"),
            Departure::PdoTimers(_) => f.write_str("convert the times that are written to 1400h to 19FFh"),
            Departure::PdosCountedFrom(_) => f.write_str("go by the index: 1400h and 1800h are the first"),
            Departure::TpdoAnswersRpdo => f.write_str("send RPDO n to get it; there is no change of state to wait for"),
            Departure::AnotherFormInTpdos(TpdoForm { data_type, .. }) => {
                write!(f, "read it as {} where it is mapped, and as the dictionary says by SDO", data_type.name())
            }
            Departure::FixedMapping => f.write_str("choose among the PDOs as they are mapped"),
            Departure::WatchesForSilence { object, .. } => {
                write!(f, "send it something in time while the motor turns, or write 0 to {object}")
            }
            Departure::NoSupportedDriveModes(_, modes) => write_modes(f, modes),
            Departure::NoModeDisplay(_, shown) => write!(f, "read the mode back from {shown}"),
            Departure::EchoesControlword(_) => {
                f.write_str("enable it with one write of 0Fh, and take the bits as they are named")
            }
            Departure::NewSetPointClearsItself(_) => {
                f.write_str("write bit 4 once for each set-point, and wait for no acknowledge")
            }
            Departure::StatusBit(_, bit, _) => write!(f, "do not take bit {bit} for what the standard says"),
            Departure::HomingStartsWithMode(_) => f.write_str("set the method and speeds before the mode"),
            Departure::HomingShownBy { attained, failed, .. } => {
                write!(f, "found: {}; not found: {}", Bits(*attained), Bits(*failed))
            }
            Departure::RampsAreTimes(_) => f.write_str("write the time that the change of speed is to take"),
            Departure::OtherType { here, .. } => {
                write!(
                    f,
                    "read, write and map it as {}: with another length it is refused or means something else",
                    here.name()
                )
            }
            Departure::OtherAccess { .. } => {
                f.write_str("take what the dictionary says, and expect an abort for the rest")
            }
            Departure::SubIndexCount { .. } => {
                f.write_str("do not count on each sub-index up to it: one that is missing is answered with 0609 0011h")
            }
            Departure::OtherUnit { .. } | Departure::VelocityUnits { .. } => f.write_str("convert with these units"),
        }
    }
}

fn write_modes(f: &mut fmt::Formatter<'_>, modes: &[ModeOfOperation]) -> fmt::Result {
    f.write_str("do not ask; it has modes ")?;
    let mut separator = "";
    modes.iter().try_for_each(|mode| {
        write!(f, "{separator}{}", mode.0)?;
        separator = ", ";
        Ok(())
    })
}

fn write_storage(f: &mut fmt::Formatter<'_>, storage: &ParameterStorage) -> fmt::Result {
    let ParameterStorage { save, restore, .. } = storage;
    match save {
        Some(Write { object, value }) => write!(f, "store with {value} to {object}")?,
        None => f.write_str("nothing is stored: write parameters at each start")?,
    }
    if let Some(Write { object, value }) = restore {
        write!(f, ", restore with {value}")?;
        if save.map(|save| save.object) != Some(*object) {
            write!(f, " to {object}")?;
        }
    }
    if let Some(Write { object, value }) = storage.stores_each_write() {
        write!(f, "; as delivered each write is stored ({object} = {value})")?;
    }
    Ok(())
}

/// Bits of a word, as `bit 8 on, 14 off`.
struct Bits(BitPattern);

impl fmt::Display for Bits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let BitPattern { mask, value } = self.0;
        let mut separator = "bit ";
        (0..16).filter(|bit| mask >> bit & 1 == 1).try_for_each(|bit| {
            write!(f, "{separator}{bit} {}", if value >> bit & 1 == 1 { "on" } else { "off" })?;
            separator = ", ";
            Ok(())
        })
    }
}

/// A unit with a number in front.
struct One(&'static str);

impl fmt::Display for One {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counted = self.0.starts_with(|first: char| first.is_ascii_digit());
        if counted { f.write_str(self.0) } else { write!(f, "1 {}", self.0) }
    }
}

/// A time that is given in ns.
struct Milliseconds(u64);

impl fmt::Display for Milliseconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms", self.0 as f64 / 1e6)
    }
}

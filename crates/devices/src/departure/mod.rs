//! Where a device departs from what a program written to CiA 301 and CiA 402 expects, and what such a program has to do.
//!
//! In: a [`Description`]. Out: [`Departure`]s, which print as what is so. Most of it follows from the description's other fields and from the dictionary; the rest is stated beside them.

mod objects;
mod words;

pub use words::Remedy;

use canopen::od::{Access, DataType, DefaultValue};
use canopen::pdo::{EventTrigger, TpdoForm};
use canopen::{Mux, NmtState};
use cia402::{ModeOfOperation, object};

use crate::axis::{AxisDescription, BitPattern, HomingStart, NewSetPoint, PowerStyle};
use crate::catalogue::Catalogue;
use crate::description::{Description, HostWatch, ParameterStorage, PdoRules};
use crate::stated::Stated;
use crate::units::{Ramps, Scale};

/// One way in which a device departs from the standard. Prints as what is so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Departure {
    /// Said in the description.
    Stated(Stated),
    /// Another model answers the same identity and has other objects. The object distinguishes them.
    IdentityShared(Option<Mux>),
    /// A model of the same identity stores its parameters with an object that is another here.
    SiblingStoresWith {
        /// The object.
        object: Mux,
        /// What it is here.
        name: &'static str,
        /// The model that stores with it.
        sibling: &'static str,
    },
    /// No 1003h.
    NoErrorHistory(Option<Mux>),
    /// No 1010h and 1011h: how parameters are stored instead.
    NoStoreParameters(ParameterStorage),
    /// No 1014h.
    NoEmcy(Option<Mux>),
    /// No 1016h.
    NoHeartbeatConsumer(HostWatch),
    /// A text of the standard that is a number here.
    VersionIsNumber(Mux),
    /// Sub-index 00h of the maker's records is not UNSIGNED8: the first of them.
    SubIndexZero(Mux, DataType),
    /// Operational from boot-up on.
    StartsOperational,
    /// Heartbeats say 04h while there is an alarm.
    HeartbeatTellsAlarm,
    /// The PDOs' timers have other units.
    PdoTimers(PdoRules),
    /// The manual calls PDO 1 of CiA 301 by this number.
    PdosCountedFrom(u8),
    /// TPDO n answers RPDO n.
    TpdoAnswersRpdo,
    /// The mapping cannot be changed.
    FixedMapping,
    /// TPDOs show an object in another type and scale than SDO does.
    AnotherFormInTpdos(TpdoForm),
    /// It stops when no frame for it comes for a time, as delivered.
    WatchesForSilence {
        /// The object that sets it.
        object: Mux,
        /// As delivered, ms.
        default_ms: i64,
    },
    /// No 6502h; the modes that it has.
    NoSupportedDriveModes(Mux, &'static [ModeOfOperation]),
    /// No 6061h; where the mode is shown.
    NoModeDisplay(Mux, Mux),
    /// The statusword echoes the controlword.
    EchoesControlword(Mux),
    /// Bit 4 of the controlword clears itself.
    NewSetPointClearsItself(Mux),
    /// A bit of the statusword that the standard gives another meaning.
    StatusBit(Mux, u16, &'static str),
    /// Homing starts with the write of its mode.
    HomingStartsWithMode(Mux),
    /// How homing's end is shown, where it is not by bits 12 and 13.
    HomingShownBy {
        /// The statusword.
        statusword: Mux,
        /// Found.
        attained: BitPattern,
        /// Not found.
        failed: BitPattern,
    },
    /// 6083h to 6085h are times.
    RampsAreTimes(Mux),
    /// An object has another unit than the standard gives it.
    OtherUnit {
        /// The object.
        object: Mux,
        /// One count of it here.
        unit: &'static str,
        /// One count of it by the standard.
        standard: &'static str,
    },
    /// An object of the standard has another type.
    OtherType {
        /// The object.
        object: Mux,
        /// Its type here.
        here: DataType,
        /// Its type by the standard.
        standard: DataType,
    },
    /// An object of the standard can be read or written where the standard says otherwise.
    OtherAccess {
        /// The object.
        object: Mux,
        /// What SDO may do here.
        here: Access,
        /// What SDO may do by the standard.
        standard: Access,
    },
    /// Sub-index 00h of a record is not the highest sub-index that there is.
    SubIndexCount {
        /// Sub-index 00h.
        object: Mux,
        /// What it says.
        says: i64,
        /// What is so.
        highest: u8,
    },
    /// Target and actual velocity have different units.
    VelocityUnits {
        /// Where the actual velocity is, and its unit.
        actual: (Mux, &'static str),
        /// Where the target velocity is, and its unit.
        target: (Mux, &'static str),
    },
}

impl Description {
    /// All departures, those of the communication first. Which models answer the same identity is asked of `known`.
    pub fn departures(&self, known: Catalogue<'_>) -> impl Iterator<Item = Departure> {
        let axes = self.axes.iter().flat_map(|axis| self.of_axis(axis));
        let stated = self.stated_departures.iter().copied().map(Departure::Stated);
        let forms = self.pdo.mapping.tpdo_forms.iter().copied().map(Departure::AnotherFormInTpdos);
        let of_device = self.of_identity(known).into_iter().chain(self.of_communication()).flatten();
        of_device.chain(forms).chain(self.of_objects()).chain(axes).chain(stated)
    }

    /// Where the [`manual`](Self::manual) states a departure; `None` where that is not known.
    pub fn section_of(&self, departure: &Departure) -> Option<&'static str> {
        let stated = self.sections.iter().find(|part| part.departure == departure.key());
        stated.map(|part| part.section).or_else(|| self.section(departure.object()?.index))
    }

    fn of_identity(&self, known: Catalogue<'_>) -> [Option<Departure>; 2] {
        let shared = known.same_identity(self).any(|other| other.name != self.name);
        let siblings = known.same_identity(self).filter(|other| !other.same_objects(self));
        let stores = siblings.filter_map(|sibling| {
            let save = sibling.storage.save?;
            let row = self.row(save.object).filter(|_| self.storage.save.map(|own| own.object) != Some(save.object))?;
            Some(Departure::SiblingStoresWith { object: save.object, name: row.name, sibling: sibling.name })
        });
        [shared.then_some(Departure::IdentityShared(self.distinguishing_object)), { stores }.next()]
    }

    fn of_communication(&self) -> [Option<Departure>; 14] {
        let lacks = |index| !self.has_index(index);
        let when = |so: bool, departure| so.then_some(departure);
        let number = |index| {
            let row = self.row(Mux::new(index, 0))?;
            (row.data_type != DataType::VisibleString).then_some(Departure::VersionIsNumber(row.mux()))
        };
        let standard = PdoRules::CIA_301;
        let timers = (self.pdo.inhibit_unit_ns, self.pdo.event_timer_unit_ns)
            != (standard.inhibit_unit_ns, standard.event_timer_unit_ns);
        let count = self.dictionary.rows().windows(2).find(|rows| {
            // A record: its sub-index 00h is followed by another of the same index.
            rows[0].sub_index == 0 && rows[1].index == rows[0].index && rows[0].data_type != DataType::Unsigned8
        });
        [
            number(0x1008).or(number(0x1009)),
            number(0x100A),
            when(lacks(0x1003), Departure::NoErrorHistory(self.faults.code)),
            when(lacks(0x1010), Departure::NoStoreParameters(self.storage)),
            when(!self.sends_emcy(), Departure::NoEmcy(self.faults.code)),
            when(lacks(0x1016), Departure::NoHeartbeatConsumer(self.host_watch)),
            count.map(|rows| Departure::SubIndexZero(rows[0].mux(), rows[0].data_type)),
            when(self.nmt.start_state == NmtState::Operational, Departure::StartsOperational),
            when(self.nmt.heartbeat_tells_alarm, Departure::HeartbeatTellsAlarm),
            when(timers, Departure::PdoTimers(self.pdo)),
            when(self.pdo.first_in_manual != 1, Departure::PdosCountedFrom(self.pdo.first_in_manual)),
            when(self.pdo.event_trigger == EventTrigger::AnswersRpdo, Departure::TpdoAnswersRpdo),
            when(self.pdo.fixed_mapping, Departure::FixedMapping),
            self.silence(),
        ]
    }

    fn silence(&self) -> Option<Departure> {
        let HostWatch::Silence { time: object } = self.host_watch else { return None };
        match self.row(object)?.default {
            DefaultValue::Value(0) => None,
            DefaultValue::Value(default_ms) => Some(Departure::WatchesForSilence { object, default_ms }),
            _ => None,
        }
    }

    fn of_axis(&self, axis: &'static AxisDescription) -> impl Iterator<Item = Departure> + use<> {
        let lacks = |index| !self.has_index(axis.object(Mux::new(index, 0)).index);
        let when = |so: bool, departure| so.then_some(departure);
        let place = |index| axis.object(Mux::new(index, 0));
        let (controlword, statusword) = (place(0x6040), place(0x6041));
        let echoes = matches!(axis.power, PowerStyle::EchoesControlword { .. });
        let clears = axis.new_set_point == NewSetPoint::ClearsItself;
        let found = [
            when(lacks(0x6502), Departure::NoSupportedDriveModes(place(0x6502), axis.modes)),
            when(lacks(0x6061), Departure::NoModeDisplay(place(0x6061), axis.mode_display)),
            when(echoes, Departure::EchoesControlword(statusword)),
            when(clears, Departure::NewSetPointClearsItself(controlword)),
        ];
        let bits = axis.statusword_bits.iter().filter(move |(mask, _)| !echoes && *mask & STANDARD_BITS != 0);
        let bits = bits.map(move |(mask, words)| Departure::StatusBit(statusword, mask.trailing_zeros() as u16, words));
        found.into_iter().chain(of_homing(axis)).chain(self.of_units(axis)).flatten().chain(bits)
    }
}

/// Bits of the statusword to which CiA 402-2, 8.4.2 gives a meaning in all modes or in each; 8, 14 and 15 are the maker's.
const STANDARD_BITS: u16 = !(1 << 8 | 1 << 14 | 1 << 15);

fn of_homing(axis: &AxisDescription) -> [Option<Departure>; 2] {
    let Some(rules) = axis.homing else { return [None; 2] };
    let (mode, statusword) = (axis.object(object::MODES_OF_OPERATION), axis.object(object::STATUSWORD));
    let (attained, failed) = (rules.attained, rules.failed);
    let standard = attained.mask & HOMING_BITS == HOMING_BITS
        && attained.value & HOMING_BITS == ATTAINED
        && failed.mask & failed.value & ERROR != 0;
    [
        (rules.start == HomingStart::ModeWrite).then_some(Departure::HomingStartsWithMode(mode)),
        (!standard).then_some(Departure::HomingShownBy { statusword, attained, failed }),
    ]
}

/// Homing attained and homing error (CiA 402-2, 12.3).
const ATTAINED: u16 = 1 << 12;
const ERROR: u16 = 1 << 13;
const HOMING_BITS: u16 = ATTAINED | ERROR;

/// Objects of CiA 402-2 whose unit is not left to the device, with that unit.
const FIXED_UNITS: [(u16, &str); 4] = [
    (0x6071, "a thousandth of the rated torque 6076h"),
    (0x6077, "a thousandth of the rated torque 6076h"),
    (0x6078, "a thousandth of the rated current 6075h"),
    (0x6079, "1 mV"),
];

impl Description {
    fn of_units(&self, axis: &AxisDescription) -> [Option<Departure>; 6] {
        let units = axis.units;
        let ramps = match units.ramps {
            Some(Ramps::Times { acceleration, .. }) => Some(Departure::RampsAreTimes(acceleration)),
            _ => None,
        };
        let unit = |object| self.row(object).map_or("", |row| row.unit);
        let velocities = match (units.target_velocity, units.actual_velocity) {
            (Some(target), Some(actual)) if target.scale != actual.scale => Some(Departure::VelocityUnits {
                actual: (actual.object, unit(actual.object)),
                target: (target.object, unit(target.object)),
            }),
            _ => None,
        };
        let [a, b, c, d] = FIXED_UNITS.map(|(index, standard)| {
            let object = axis.object(Mux::new(index, 0));
            let measured = [units.target_current, units.actual_current, units.bus_voltage].into_iter().flatten();
            let quantity = measured.into_iter().find(|quantity| quantity.object == object)?;
            let follows = matches!(quantity.scale, Scale::Rated { .. }) || unit(object) == "mV";
            (!follows).then_some(Departure::OtherUnit { object, unit: unit(object), standard })
        });
        [ramps, velocities, a, b, c, d]
    }
}

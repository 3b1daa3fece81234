//! What masters and tools have to know about a model before they talk to it, as const data.
//!
//! Two of the drives answer the same identity, and the drives differ in units, in how they store parameters and in
//! what an object number means. A [`Description`] says it all; [`model`] finds one by name.

use can::Bitrate;
use canopen::od::{Entry, Table};
use canopen::pdo::MappingRules;
use canopen::{EmcyErrorCode, Mux, NmtState};
use cia402::{ModeOfOperation, PowerState, Statusword};

use crate::faults::FaultRow;
use crate::mjoint;
use crate::variant::Variation;
use crate::zltech::{ZLAC8030L, ZLIM42C, ZLIM42C_82};

/// All models.
pub static MODELS: [&Description; 7] = [
    &ZLAC8030L,
    &mjoint::M4230E17B50,
    &mjoint::M4230E17B80,
    &mjoint::M8025E25B50,
    &mjoint::M8025E25B80,
    &ZLIM42C,
    &ZLIM42C_82,
];

/// The model of this name (`zlac8030l`), in any case of letters.
pub fn model(name: &str) -> Option<&'static Description> {
    MODELS.iter().find(|profile| profile.model.eq_ignore_ascii_case(name)).copied()
}

/// The models that answer this identity: more than one may.
pub fn models_by_identity(identity: Identity) -> impl Iterator<Item = &'static Description> + use<> {
    MODELS.iter().copied().filter(move |profile| profile.identity == identity)
}

/// True if two rows give an object the same name, type, unit and meanings.
pub fn reads_alike(a: &Entry, b: &Entry) -> bool {
    (a.name, a.data_type, a.unit, a.values) == (b.name, b.data_type, b.unit, b.values)
}

/// One model of drive.
#[derive(Clone, Copy)]
pub struct Description {
    /// Name to type: `zlac8030l`.
    pub model: &'static str,
    /// Name to print.
    pub title: &'static str,
    /// The manual that all of this is read from.
    pub manual: &'static str,
    /// What 1000h and 1018h answer.
    pub identity: Identity,
    /// An object that, by their manuals, no model of the same identity and other objects has. That it is there speaks for
    /// the model and proves nothing: the next firmware of the other may have it too.
    pub hallmark: Option<Mux>,
    /// The object table.
    pub table: &'static Table,
    /// Node-ID as delivered.
    pub node_id: u8,
    /// Bit rate as delivered.
    pub bitrate: Bitrate,
    /// Modes that 6060h accepts.
    pub modes: &'static [ModeOfOperation],
    /// Where the present mode is shown: 6061h, or 6060h where there is no such object.
    pub mode_display: Mux,
    /// How it is enabled, and how it shows that.
    pub power: PowerStyle,
    /// Bits of the statusword that mean something of this model's own, in words.
    pub statusword_bits: &'static [(u16, &'static str)],
    /// How it finds its reference position, where it does.
    pub homing: Option<HomingRules>,
    /// How it notices that its host has gone.
    pub host_watch: HostWatch,
    /// What raw values are worth.
    pub units: Units,
    /// How parameters are stored.
    pub storage: ParameterStorage,
    /// Fault codes.
    pub faults: Faults,
    /// PDO rules.
    pub pdo: PdoRules,
    /// Where the model departs from the standard or from its own manual.
    pub quirks: &'static [Quirk],
    /// At which points drives of this model may differ.
    pub variations: &'static [Variation],
}

impl Description {
    /// The power state that a statusword shows, or for a drive without the state machine the one that comes closest.
    pub const fn power_state(&self, statusword: Statusword) -> Option<PowerState> {
        self.power.state(statusword)
    }

    /// The row of an object, if the model has it.
    pub fn row(&self, mux: Mux) -> Option<&'static Entry> {
        self.table.find(mux).ok().map(|slot| self.table.row(slot))
    }

    /// The models that answer the same identity, this one among them.
    pub fn answering_alike(&self) -> impl Iterator<Item = &'static Self> + use<> {
        models_by_identity(self.identity)
    }

    /// The models that answer the same identity and have the same objects, this one among them.
    pub fn with_same_objects(&self) -> impl Iterator<Item = &'static Self> + use<> {
        let table = self.table;
        self.answering_alike().filter(move |other| core::ptr::eq(other.table, table))
    }

    /// True if every model that answers the same identity has this object and means the same by this value of it.
    pub fn shares(&self, mux: Mux, value: i64) -> bool {
        let own = self.row(mux);
        self.answering_alike().all(|other| match (own, other.row(mux)) {
            (Some(own), Some(row)) => {
                let form = |row: &Entry| (row.name, row.data_type, row.unit, row.meaning(value));
                form(own) == form(row)
            }
            _ => false,
        })
    }

    /// The NMT state that a boot-up message or a heartbeat of this model stands for. A boot-up message is followed by
    /// pre-operational without a word (CiA 301, 7.3.2.2.1), but for models that start by themselves.
    pub fn nmt_state(&self, said: NmtState) -> NmtState {
        match said {
            NmtState::Initialising if self.has(Quirk::StartsOperational) => NmtState::Operational,
            NmtState::Initialising => NmtState::PreOperational,
            _ if self.tells_alarm(said) => NmtState::Operational,
            said => said,
        }
    }

    /// True if a heartbeat with this state says that there is an alarm.
    pub fn tells_alarm(&self, said: NmtState) -> bool {
        said == NmtState::Stopped && self.has(Quirk::HeartbeatTellsAlarm)
    }

    /// The fault that an EMCY message with this error code tells of.
    pub fn fault_told_by(&self, code: EmcyErrorCode) -> Option<&'static FaultRow> {
        self.faults.table.iter().find(|row| row.emcy == code && code != EmcyErrorCode::NO_ERROR)
    }

    /// True if the model departs in this way.
    pub fn has(&self, quirk: Quirk) -> bool {
        quirk.is_in(self.quirks)
    }
}

/// How a drive notices that its host has gone, and stops by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostWatch {
    /// It does not: it goes on with what it was told last.
    None,
    /// By silence: it stops when no frame for it has come for a time.
    Silence {
        /// Where the time is, in ms; 0 is off.
        time: Mux,
    },
    /// By a heartbeat (CiA 301, 7.2.8.2.2): it stops when that stays away. The first one arms the watch, a write to the
    /// consumer entry disarms it.
    Heartbeat {
        /// The consumer entry, as 1016h: bits 16 to 23 whose heartbeat, bits 0 to 15 the time in ms; 0 is off.
        consumer: Mux,
        /// The fault code of a drive that it has stopped. With the next heartbeat such a drive goes on with what it was
        /// told before.
        fault: u16,
    },
}

/// How a drive is enabled, and how its statusword shows that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerStyle {
    /// The power state machine of CiA 402-2, 8.2.
    Cia402,
    /// No states: the statusword mirrors the controlword. One write of 0Fh enables, 0 disables.
    Mirror {
        /// Bits of the statusword that are set while the drive follows its host.
        following: u16,
        /// Bit that is set while the power stage drives the motor.
        live: u16,
        /// Bit that is set while there is an alarm.
        alarm: u16,
    },
}

impl PowerStyle {
    /// True if the statusword tells of a fault, or of an alarm, which need not have stopped the drive.
    pub const fn is_faulted(self, statusword: Statusword) -> bool {
        match self {
            Self::Cia402 => matches!(statusword.state(), Some(PowerState::Fault)),
            Self::Mirror { alarm, .. } => statusword.has(alarm),
        }
    }

    /// The power state that a statusword shows, or the one of CiA 402 that comes closest: an alarm is a fault only when
    /// it has taken the power off the motor, and a live motor that follows nobody is switched on.
    pub const fn state(self, statusword: Statusword) -> Option<PowerState> {
        match self {
            Self::Cia402 => statusword.state(),
            Self::Mirror { following, live, alarm } => {
                Some(match (statusword.has(following | live), statusword.has(live), statusword.has(alarm)) {
                    (true, ..) => PowerState::OperationEnabled,
                    (false, true, _) => PowerState::SwitchedOn,
                    (false, false, true) => PowerState::Fault,
                    (false, false, false) => PowerState::SwitchOnDisabled,
                })
            }
        }
    }
}

/// How a drive finds its reference position (mode 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingRules {
    /// Where the method is.
    pub method: Mux,
    /// Speed of the search in r/min, where it has an object of its own.
    pub search_speed: Option<Quantity>,
    /// What starts it.
    pub start: HomingStart,
    /// How the statusword tells that it was found.
    pub attained: BitPattern,
    /// How the statusword tells that it was not.
    pub failed: BitPattern,
}

/// What starts homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingStart {
    /// A rising edge of controlword bit 4 in mode 6.
    ControlwordBit4,
    /// The write of mode 6, each time.
    ModeWrite,
}

/// Some bits of a word, and how they have to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitPattern {
    /// Bits that matter.
    pub mask: u16,
    /// Their values.
    pub value: u16,
}

impl BitPattern {
    /// True if the bits that matter are so.
    pub const fn matches(self, statusword: Statusword) -> bool {
        statusword.0 & self.mask == self.value
    }
}

/// What a drive says that it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// 1000h.
    pub device_type: u32,
    /// 1018h:01.
    pub vendor_id: u32,
    /// 1018h:02.
    pub product_code: u32,
    /// 1018h:03.
    pub revision_number: u32,
}

/// What raw values are worth. A field is `None` where the model has no such object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Counts of position in one turn of the motor's shaft.
    pub counts_per_turn: CountsPerTurn,
    /// Target velocity, in r/min.
    pub target_velocity: Quantity,
    /// Actual velocity, in r/min.
    pub actual_velocity: Quantity,
    /// Profile velocity of position moves, in r/min.
    pub profile_velocity: Quantity,
    /// Acceleration and deceleration of profiles.
    pub ramps: Ramps,
    /// Target motor current (torque), in A.
    pub target_current: Option<Quantity>,
    /// Actual motor current, in A.
    pub actual_current: Option<Quantity>,
    /// Bus voltage, in V.
    pub bus_voltage: Option<Quantity>,
    /// Motor temperature, in degC.
    pub motor_temperature: Option<Quantity>,
    /// Driver temperature, in degC.
    pub driver_temperature: Option<Quantity>,
}

/// An object that holds a physical value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Where it is.
    pub object: Mux,
    /// Physical units in one count, at a resolution of 1 where the object's row has one
    /// ([`Entry::resolution`]).
    pub per_count: f64,
}

impl Quantity {
    /// An object and its scale.
    pub const fn new(index: u16, sub_index: u8, per_count: f64) -> Self {
        Self { object: Mux::new(index, sub_index), per_count }
    }
}

/// Counts of position in one turn of the motor's shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CountsPerTurn {
    /// Always this many.
    Fixed(u32),
    /// The value of an object times a factor.
    Object {
        /// Where it is.
        object: Mux,
        /// Counts in one unit of it.
        factor: u32,
        /// Its factory value.
        default: u32,
    },
    /// The value of an object is the place in a table.
    Table {
        /// Where it is.
        object: Mux,
        /// Counts per turn by value.
        counts: &'static [u16],
        /// Its factory value.
        default: u32,
    },
}

/// How acceleration and deceleration are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramps {
    /// As the time of the velocity change, in ms.
    Milliseconds {
        /// Where the acceleration time is.
        acceleration: Mux,
        /// Where the deceleration time is.
        deceleration: Mux,
        /// Where the quick stop's time is.
        quick_stop: Mux,
    },
    /// As one acceleration in (r/min)/s.
    Acceleration {
        /// Where it is, for speeding up and slowing down.
        both: Mux,
        /// From this value on there is no ramp.
        none_from: u32,
    },
}

/// How parameters are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterStorage {
    /// The write that stores all parameters.
    pub save: Write,
    /// The write that restores factory settings, where there is one.
    pub restore: Option<Write>,
    /// The object and value that make each write be stored by itself, and whether it is so as delivered.
    pub save_on_write: Option<(Write, bool)>,
    /// Objects that take effect after a restart only.
    pub effective_after_restart: &'static [Mux],
}

/// A value to write to an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Write {
    /// Where to.
    pub object: Mux,
    /// What.
    pub value: u32,
}

/// How faults are told.
#[derive(Clone, Copy)]
pub struct Faults {
    /// The object with the present code.
    pub code: Mux,
    /// The code is a bit field: several faults at once.
    pub bit_field: bool,
    /// All faults.
    pub table: &'static [FaultRow],
}

/// What may be done with PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoRules {
    /// Nanoseconds in one count of the inhibit time.
    pub inhibit_unit_ns: u64,
    /// Nanoseconds in one count of the event timer.
    pub event_timer_unit_ns: u64,
    /// Objects in one PDO.
    pub max_objects: u8,
    /// A PDO's records may be changed while the PDO is valid.
    pub remap_while_valid: bool,
    /// The mapping cannot be changed at all.
    pub fixed_mapping: bool,
    /// What the manual calls PDO 1 of CiA 301, whose objects are 1400h and 1800h: 1, or 0.
    pub first_in_manual: u8,
    /// What entries of a mapping are taken.
    pub mapping: MappingRules,
    /// Error code of the EMCY message when an RPDO has fewer bytes than are mapped; `None` for none. It is not used in
    /// either case. Of a longer one the mapped bytes are used, and nothing is told.
    pub short_rpdo: Option<EmcyErrorCode>,
}

/// A way in which a model differs from what a program written to the standard expects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quirk {
    /// No 6502h (supported drive modes): it answers 0602 0000h.
    NoSupportedDriveModes,
    /// No 1010h and 1011h: parameters are stored through an object of the maker's.
    NoStandardStore,
    /// No 1003h (error history).
    NoErrorHistory,
    /// No 1016h: heartbeats are produced, not consumed.
    NoHeartbeatConsumer,
    /// The device type says stepper though the motor is a servo.
    DeviceTypeSaysStepper,
    /// Another model answers the same identity: it has to be told.
    IdentityShared,
    /// The torque target 6071h is a current in mA, not a share of the rated torque.
    TorqueTargetIsCurrent,
    /// The actual torque 6077h is a current in another unit than the target.
    TorqueActualIsCurrent,
    /// The unit of the actual velocity is not that of the target.
    VelocityUnitsDiffer,
    /// Accelerations are times.
    RampsAreTimes,
    /// Inhibit time and event timer are in 0.5 ms.
    PdoTimersInHalfMilliseconds,
    /// Sub-index 00h of the maker's records is UNSIGNED16.
    SubIndexZeroIsUnsigned16,
    /// 1009h and 100Ah are numbers, not texts.
    VersionsAreNumbers,
    /// Bit 13 of the statusword in profile position is 1 when in position, the reverse of a following error.
    InPositionInBit13,
    /// Statusword bit 15 in profile position is 1 when in position.
    InPositionInBit15,
    /// Statusword bit 7 is set in fault.
    WarningBitInFault,
    /// Nothing measures the rotor: actual position and velocity are the commanded ones, and a stall goes unnoticed.
    NoPositionSensor,
    /// The motor is energised from Switched on, not only in Operation enabled.
    EnergisedWhenSwitchedOn,
    /// Homing attained is statusword bit 8; bits 12 and 13 tell nothing of homing. Failed: 8 off, 10 on, 14 off.
    HomingAttainedInBit8,
    /// 2009h is the bit rate, where the model of the same identity stores its parameters.
    BitRateWhereSiblingSaves,
    /// A watch over the host stops the motor when no frame comes for a time, as delivered.
    HostWatchdogOnByDefault,
    /// The brake output is never moved by the drive itself.
    BrakeIsManual,
    /// The statusword mirrors the controlword: there are no states of CiA 402.
    NoPowerStateMachine,
    /// NMT operational from boot-up on.
    StartsOperational,
    /// Heartbeats say 04h while there is an alarm; it does not mean stopped.
    HeartbeatTellsAlarm,
    /// TPDO n is sent once for each RPDO n, and never by itself.
    TpdoAnswersRpdo,
    /// No EMCY messages.
    NoEmcy,
    /// No 6061h (mode display).
    NoModeDisplay,
    /// Homing starts with the write of its mode.
    HomingStartsWithMode,
    /// Bit 4 of the controlword acts on each write of a 1 and clears itself.
    NewSetPointClearsItself,
    /// The actual velocity has another length and unit in TPDOs than by SDO.
    SpeedInTpdoDiffers,
}

impl Quirk {
    /// True if it is among `quirks`.
    pub const fn is_in(self, quirks: &[Self]) -> bool {
        let mut at = 0;
        while at < quirks.len() {
            if quirks[at] as u8 == self as u8 {
                return true;
            }
            at += 1;
        }
        false
    }

    /// In words, for people.
    pub const fn text(self) -> &'static str {
        match self {
            Self::NoSupportedDriveModes => "no object 6502h (supported drive modes)",
            Self::NoStandardStore => {
                "no objects 1010h and 1011h: parameters are stored through an object of the maker's"
            }
            Self::NoErrorHistory => "no object 1003h (error history)",
            Self::NoHeartbeatConsumer => "no object 1016h: heartbeats are produced, not consumed",
            Self::DeviceTypeSaysStepper => "1000h says stepper though the motor is a servo",
            Self::IdentityShared => "another model answers the same identity: the model has to be told",
            Self::TorqueTargetIsCurrent => "6071h is a current in mA, not a share of the rated torque",
            Self::TorqueActualIsCurrent => "6077h is a current in 0.1 A, while the target 6071h is in mA",
            Self::VelocityUnitsDiffer => "606Ch is in 0.1 r/min, while 60FFh is in r/min (or finer)",
            Self::RampsAreTimes => "6083h, 6084h and 6085h are times in ms, not accelerations",
            Self::PdoTimersInHalfMilliseconds => "inhibit time and event timer of PDOs are in 0.5 ms",
            Self::SubIndexZeroIsUnsigned16 => "sub-index 00h of the maker's records is UNSIGNED16",
            Self::VersionsAreNumbers => "1009h and 100Ah are numbers, not texts",
            Self::InPositionInBit13 => "statusword bit 13 in profile position is 1 when in position",
            Self::InPositionInBit15 => "statusword bit 15 in profile position is 1 when in position",
            Self::NoPositionSensor => {
                "6064h and 606Ch are commanded values: nothing measures the rotor, a stall is not seen"
            }
            Self::EnergisedWhenSwitchedOn => "the motor is energised from switched on",
            Self::HomingAttainedInBit8 => "homing attained is statusword bit 8; failed is bit 8 off, 10 on, 14 off",
            Self::BitRateWhereSiblingSaves => {
                "2009h is the bit rate; the ZLAC8030L, of the same identity, saves with it"
            }
            Self::WarningBitInFault => "statusword bit 7 is set in fault",
            Self::HostWatchdogOnByDefault => {
                "the motor stops when no frame for the drive comes for a time (2000h, 1 s)"
            }
            Self::BrakeIsManual => "the drive never moves the brake output by itself",
            Self::NoPowerStateMachine => "the statusword mirrors the controlword: no CiA 402 states; 0Fh enables",
            Self::StartsOperational => "NMT operational from boot-up on",
            Self::HeartbeatTellsAlarm => "heartbeats say 04h while there is an alarm; it does not mean stopped",
            Self::TpdoAnswersRpdo => "TPDO n answers RPDO n; nothing is sent unasked",
            Self::NoEmcy => "no EMCY messages",
            Self::NoModeDisplay => "no object 6061h (mode display)",
            Self::HomingStartsWithMode => "homing starts when 6 is written to 6060h",
            Self::NewSetPointClearsItself => "controlword bit 4 acts on each write of a 1 and clears itself",
            Self::SpeedInTpdoDiffers => "606Ch has 16 bits of 0.1 r/min by SDO and 32 bits of r/min in TPDO3",
        }
    }
}

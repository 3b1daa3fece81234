use can::Bitrate;
use canopen::od::{Entry, Table};
use canopen::pdo::{EventTrigger, MappingRules};
use canopen::{EmcyErrorCode, Mux, NmtState, NodeId};

use crate::axis::AxisDescription;
use crate::faults::{FaultRow, Faults};
use crate::stated::Stated;
use crate::timing::Timing;
use crate::variant::{Pick, Variant, Variation};

/// One model of device: what masters, tools and the firmware itself have to know about it, as const data.
#[derive(Clone, Copy)]
pub struct Description {
    /// Name to type: `zlac8030l`.
    pub name: &'static str,
    /// Name to print.
    pub title: &'static str,
    /// The manual, or the file, that all of this is read from.
    pub manual: &'static str,
    /// What 1000h and 1018h answer.
    pub identity: Identity,
    /// Where that says what of its objects, by indexes; none for a file, which is read as a whole.
    pub sections: &'static [Section],
    /// An object that, by their manuals, no model of the same identity and other objects has. That it is there speaks for
    /// the model and proves nothing: the next firmware of the other may have it too.
    pub distinguishing_object: Option<Mux>,
    /// The objects.
    pub dictionary: &'static Table,
    /// Node-ID as delivered, where the manual says it.
    pub node_id: Option<NodeId>,
    /// Bit rate as delivered, where the manual says it.
    pub bitrate: Option<Bitrate>,
    /// Its axes, the first one first. A device that is not a drive has none.
    pub axes: &'static [AxisDescription],
    /// How it notices that its host has gone.
    pub host_watch: HostWatch,
    /// How parameters are stored.
    pub storage: ParameterStorage,
    /// Fault codes.
    pub faults: Faults,
    /// What its NMT states and heartbeats mean.
    pub nmt: NmtRules,
    /// Whether it is an LSS slave (CiA 305): node-ID and bit rate by its identity and serial number.
    pub lss: bool,
    /// Whether it has SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), which the standard leaves to the device.
    pub sdo_block_transfer: bool,
    /// PDO rules.
    pub pdo: PdoRules,
    /// How long it takes to start, to answer and to store.
    pub timing: Timing,
    /// Where the model departs from the standard in ways that nothing else here shows. All of them:
    /// [`departures`](Self::departures).
    pub stated_departures: &'static [Stated],
    /// At which points devices of this model may differ.
    pub variations: &'static [Variation],
    /// The choices that come with other objects, and what the model is then.
    pub editions: &'static [Edition],
}

/// A part of a manual, and the objects, or the departure, that it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// The first index.
    pub from: u16,
    /// The last one.
    pub to: u16,
    /// The departure that it states, by its [key](crate::Departure::key); empty for a part that describes objects.
    pub departure: &'static str,
    /// By the manual's own numbers or headings.
    pub section: &'static str,
}

impl Section {
    /// The objects of these indexes, ends included.
    pub const fn of(from: u16, to: u16, section: &'static str) -> Self {
        Self { from, to, departure: "", section }
    }

    /// A departure that is not stated where the object is described that it is about, or is about none.
    pub const fn stating(departure: &'static str, section: &'static str) -> Self {
        Self { from: 1, to: 0, departure, section }
    }
}

impl Description {
    /// Where the [`manual`](Self::manual) describes the objects of an index; `None` where that is not known.
    pub fn section(&self, index: u16) -> Option<&'static str> {
        self.sections.iter().find(|part| (part.from..=part.to).contains(&index)).map(|part| part.section)
    }

    /// The only bit rate that it has: as delivered, where neither an object nor LSS changes it.
    pub fn only_bitrate(&self) -> Option<Bitrate> {
        self.bitrate.filter(|_| self.storage.address.len() < 2 && !self.lss)
    }

    /// The first axis; `None` for a device that is not a drive.
    pub const fn first_axis(&self) -> Option<&'static AxisDescription> {
        self.axes.first()
    }

    /// What a device of this model is that took these choices.
    pub fn as_chosen(&'static self, variant: &Variant) -> &'static Self {
        let edition = self.editions.iter().find(|edition| variant.is(edition.pick));
        edition.map_or(self, |edition| edition.description)
    }

    /// True if this is `model`, or what it is with another choice.
    pub fn is_edition_of(&self, model: &Self) -> bool {
        let same = |other: &Self| core::ptr::eq(self, other);
        same(model) || model.editions.iter().any(|edition| same(edition.description))
    }

    /// The row of an object, if the model has it.
    pub fn row(&self, mux: Mux) -> Option<&'static Entry> {
        self.dictionary.find(mux).ok().map(|slot| self.dictionary.row(slot))
    }

    /// True if the model has an object of this index.
    pub const fn has_index(&self, index: u16) -> bool {
        let rows = self.dictionary.rows();
        let (mut low, mut high) = (0, rows.len());
        while low < high {
            let middle = (low + high) / 2;
            if rows[middle].index < index {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low < rows.len() && rows[low].index == index
    }

    /// True if it sends EMCY messages: it has their identifier, 1014h (CiA 301, 7.5.2.17).
    pub const fn sends_emcy(&self) -> bool {
        self.has_index(0x1014)
    }

    /// True if the two have the same objects.
    pub fn same_objects(&self, other: &Self) -> bool {
        core::ptr::eq(self.dictionary, other.dictionary)
    }

    /// The NMT state that a boot-up message or a heartbeat of this model stands for. A boot-up message is followed by
    /// pre-operational without a word (CiA 301, 7.3.2.2.1), but for models that start by themselves.
    pub fn nmt_state(&self, said: NmtState) -> NmtState {
        match said {
            NmtState::Initialising => self.nmt.start_state,
            _ if self.tells_alarm(said) => NmtState::Operational,
            said => said,
        }
    }

    /// True if a heartbeat with this state says that there is an alarm.
    pub fn tells_alarm(&self, said: NmtState) -> bool {
        said == NmtState::Stopped && self.nmt.heartbeat_tells_alarm
    }

    /// The fault that an EMCY message with this error code reports.
    pub fn fault_reported_by(&self, code: EmcyErrorCode) -> Option<&'static FaultRow> {
        self.faults.table.iter().find(|row| row.emcy == code && code != EmcyErrorCode::NO_ERROR)
    }
}

/// Its name: a whole description is hundreds of rows.
impl core::fmt::Debug for Description {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

/// What a model is when one of its choices was taken that comes with other objects: another firmware, say.
#[derive(Clone, Copy, Debug)]
pub struct Edition {
    /// The choice.
    pub pick: Pick,
    /// What the model is then. It has the same name and variations; an object that both have has the same slot in both
    /// ([`Table::amended`]).
    pub description: &'static Description,
}

/// What a device says that it is.
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

/// What a device's NMT states and heartbeats mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NmtRules {
    /// The state that it is in after boot-up.
    pub start_state: NmtState,
    /// Heartbeats say 04h while there is an alarm; it does not mean stopped.
    pub heartbeat_tells_alarm: bool,
}

impl NmtRules {
    /// Pre-operational after boot-up; a heartbeat says the state.
    pub const CIA_301: Self = Self { start_state: NmtState::PreOperational, heartbeat_tells_alarm: false };
}

/// How a drive notices that its host has gone, and stops by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostWatch {
    /// It does not: it goes on with the last command.
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
        /// The fault code of a drive that it has stopped. With the next heartbeat such a drive goes on with its last
        /// command.
        fault: u16,
    },
}

/// How parameters are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterStorage {
    /// The write that stores all parameters, where there is one.
    pub save: Option<Write>,
    /// What the object of `save` reads once the store is done, of a device that says the end of it there; else its answer says it.
    pub saved: Option<u32>,
    /// The write that restores factory settings, where there is one.
    pub restore: Option<Write>,
    /// The object and value that make each write be stored by itself, and whether it is so as delivered.
    pub save_on_write: Option<(Write, bool)>,
    /// Objects that take effect after a restart only.
    pub effective_after_restart: &'static [Mux],
    /// Objects that choose its node-ID, the first one, and its bit rate: who writes them has to look for the device elsewhere afterwards.
    pub address: &'static [Mux],
}

impl ParameterStorage {
    /// The write with which it stores each further one by itself, where it is delivered so.
    pub const fn stores_each_write(&self) -> Option<Write> {
        match self.save_on_write {
            Some((write, true)) => Some(write),
            _ => None,
        }
    }

    /// None: nothing is kept without supply.
    pub const NONE: Self = Self {
        save: None,
        saved: None,
        restore: None,
        save_on_write: None,
        effective_after_restart: &[],
        address: &[],
    };

    /// 1010h:01 and 1011h:01 with their signatures "save" and "load" (CiA 301, 7.5.2.13 and 7.5.2.14).
    pub const CIA_301: Self = Self {
        save: Some(Write { object: Mux::new(0x1010, 1), value: u32::from_le_bytes(*b"save") }),
        restore: Some(Write { object: Mux::new(0x1011, 1), value: u32::from_le_bytes(*b"load") }),
        ..Self::NONE
    };
}

/// A value to write to an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Write {
    /// The object that is written.
    pub object: Mux,
    /// The value, in as many bytes as the object has.
    pub value: u32,
}

/// What may be done with PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoRules {
    /// Nanoseconds in one count of the inhibit time.
    pub inhibit_unit_ns: u64,
    /// Nanoseconds in one count of the event timer.
    pub event_timer_unit_ns: u64,
    /// The event timer of an RPDO is a deadline for the next one, and missing it an error that is reported (CiA 301, 7.5.2.35).
    pub rpdo_deadline: bool,
    /// Objects in one PDO.
    pub max_objects: u8,
    /// Remote frames that ask for a TPDO are answered where bit 30 of its COB-ID allows it, and transmission types 252 and 253
    /// are taken (CiA 301, 7.2.2.4.3).
    pub remote_requests: bool,
    /// A PDO's records may be changed while the PDO is valid.
    pub remap_while_valid: bool,
    /// The mapping cannot be changed at all.
    pub fixed_mapping: bool,
    /// What the manual calls PDO 1 of CiA 301, whose objects are 1400h and 1800h: 1, or 0.
    pub first_in_manual: u8,
    /// What entries of a mapping are taken.
    pub mapping: MappingRules,
    /// What makes the device send TPDOs of type 254 and 255.
    pub event_trigger: EventTrigger,
    /// Error code of the EMCY message when an RPDO has fewer bytes than are mapped; `None` for none. It is not used in
    /// either case. Of a longer one the mapped bytes are used, and nothing is reported.
    pub short_rpdo: Option<EmcyErrorCode>,
}

impl PdoRules {
    /// What CiA 301 says: inhibit time in 100 us, event timer in 1 ms, PDOs to be made invalid before they are changed.
    pub const CIA_301: Self = Self {
        inhibit_unit_ns: 100_000,
        event_timer_unit_ns: 1_000_000,
        rpdo_deadline: true,
        max_objects: 64,
        remote_requests: true,
        remap_while_valid: false,
        fixed_mapping: false,
        mapping: MappingRules::CIA_301,
        event_trigger: EventTrigger::Change,
        first_in_manual: 1,
        short_rpdo: Some(EmcyErrorCode::PDO_NOT_PROCESSED),
    };
}

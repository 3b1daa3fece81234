//! What a described device does by the profile that 1000h names: CiA 401 (inputs and outputs), CiA 406 (encoders), or none, where
//! objects are stored and answered.

use canopen::AbortCode;
use canopen::Mux;
use canopen::object::{COB_ID_SYNC_MESSAGE, COMMUNICATION_CYCLE_PERIOD};
use canopen::od::{Condition, Dictionary, Slot, Storage, View};
use devices::Description;

use super::encoder::{self, CYCLIC_TIMER, Encoder};
use super::io::{self, Io};
use super::services::no_effect;

/// The event timer of the first TPDO.
const EVENT_TIMER: Mux = Mux::new(0x1800, 5);

/// The profile of a device, with what it remembers.
#[derive(Clone, Copy, Debug)]
pub(super) enum Profile {
    /// No objects that act.
    None,
    /// CiA 401.
    Io(Io),
    /// CiA 406.
    Encoder(Encoder),
}

/// Whether a profile does something with an object of a device so described, beyond CiA 301.
pub(super) fn acts_on(description: &Description, mux: Mux) -> bool {
    match Profile::of(description) {
        Profile::None => false,
        Profile::Io(_) => io::acts_on(mux),
        Profile::Encoder(_) => encoder::acts_on(mux),
    }
}

/// What a device so described refuses for its profile: writes to objects of the profile that nothing acts on, and what the profile says.
pub fn profile_conditions(description: &'static Description) -> impl Iterator<Item = (Slot, Condition)> {
    let table = description.dictionary;
    let has_profile = !matches!(Profile::of(description), Profile::None);
    let rows = table.iter().filter(move |(_, row)| {
        let of_profile = (0x6000..=0x67FF).contains(&row.index);
        has_profile && of_profile && row.access.is_writable() && !acts_on(description, row.mux())
    });
    let is_deaf_to_sync = table.find(COB_ID_SYNC_MESSAGE).is_err();
    // A drive has it for the set-points that it interpolates, too.
    let period = table.find(COMMUNICATION_CYCLE_PERIOD).ok().filter(|_| is_deaf_to_sync);
    let period = period.map(|slot| (slot, Condition::Change(no_effect)));
    let own = Profile::of(description).is_encoder().then(|| encoder::conditions(table)).into_iter().flatten();
    rows.map(|(slot, _)| (slot, Condition::Change(refused))).chain(own).chain(period)
}

/// Nothing would come of it.
pub(crate) fn refused(_: &View<'_>, _: u32) -> Result<(), AbortCode> {
    Err(AbortCode::READ_ONLY)
}

impl Profile {
    /// By the low word of 1000h, of a device that is not a drive. Makers leave its value open: then the objects decide.
    pub(super) fn of(description: &Description) -> Self {
        let has = |index, sub_index| description.row(Mux::new(index, sub_index)).is_some();
        let is_left_open = description.identity.device_type & 0xFFFF == 0;
        let channels = || [0x6000, 0x6200, 0x6401, 0x6411].into_iter().any(|index| has(index, 1));
        match description.identity.device_type & 0xFFFF {
            _ if !description.axes.is_empty() => Self::None,
            406 => Self::Encoder(Encoder::NONE),
            401 => Self::Io(Io::NONE),
            _ if is_left_open && has(0x6004, 0) && has(0x6501, 0) => Self::Encoder(Encoder::NONE),
            _ if is_left_open && channels() => Self::Io(Io::NONE),
            _ => Self::None,
        }
    }

    pub(super) const fn is_encoder(&self) -> bool {
        matches!(self, Self::Encoder(_))
    }

    pub(super) fn restart(&mut self, values: &mut Dictionary<impl Storage>) {
        match self {
            Self::None => {}
            Self::Io(io) => io.restart(values),
            Self::Encoder(encoder) => encoder.show(values),
        }
    }

    pub(super) fn lines(&self, values: &Dictionary<impl Storage>) -> [u8; 2] {
        match self {
            Self::Io(_) => [Io::input_lines(values), Io::output_lines(values)],
            _ => [0; 2],
        }
    }

    pub(super) fn levels(&self, values: &Dictionary<impl Storage>) -> [u64; 2] {
        match self {
            Self::Io(io) => [io.inputs(), io.output_levels(values)],
            _ => [0; 2],
        }
    }

    pub(super) fn analogue(&self, values: &Dictionary<impl Storage>) -> impl Iterator<Item = (Mux, i64)> {
        matches!(self, Self::Io(_)).then(|| Io::analogue(values)).into_iter().flatten()
    }

    pub(super) fn set_input(&mut self, values: &mut Dictionary<impl Storage>, line: u8, level: bool) {
        if let Self::Io(io) = self {
            io.set_input(values, line, level);
        }
    }

    pub(super) fn see_shaft(&mut self, values: &mut Dictionary<impl Storage>, turns: f64, turns_s: f64) {
        if let Self::Encoder(encoder) = self {
            encoder.see(values, turns, turns_s);
        }
    }

    /// The outer world has set an object.
    pub(super) fn measured(&mut self, values: &Dictionary<impl Storage>, mux: Mux) {
        if let Self::Io(io) = self {
            io.measured(values, mux);
        }
    }

    /// A host has; a communication object that follows from it, with its value.
    pub(super) fn written(&mut self, values: &mut Dictionary<impl Storage>, mux: Mux) -> Option<(Slot, u32)> {
        match self {
            Self::None => None,
            Self::Io(io) => {
                io.written(values, mux);
                None
            }
            Self::Encoder(encoder) => {
                encoder.written(values, mux);
                let timer_ms = values.view().value(CYCLIC_TIMER).ok().filter(|_| mux == CYCLIC_TIMER)?;
                Some((values.table().find(EVENT_TIMER).ok()?, u32::try_from(timer_ms).ok()?))
            }
        }
    }

    /// The node has left NMT operational, or its host is lost.
    pub(super) fn fail(&mut self, values: &mut Dictionary<impl Storage>) {
        if let Self::Io(io) = self {
            io.fail(values);
        }
    }

    /// Whether changes of mapped objects are events now: by CiA 401 not each is.
    pub(super) const fn take_event(&mut self) -> bool {
        match self {
            Self::Io(io) => io.take_event(),
            Self::None | Self::Encoder(_) => true,
        }
    }
}

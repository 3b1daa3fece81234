use can::{Frame, Instant};

use super::{AddressMode, Mapping, Mpdo, Parameter};

/// A receive PDO: to the device. Source: CiA 301, 7.2.2.5.1.
#[derive(Clone, Copy, Debug)]
pub struct Rpdo {
    id: Option<u16>,
    synchronous: bool,
    mapping: Option<Mapping>,
    /// In place of a mapping.
    multiplexed: Option<AddressMode>,
    latched: Option<u64>,
    deadline: Deadline,
}

/// Deadline monitoring by the event timer (CiA 301, 7.5.2.35, sub-index 05h): begun by each reception.
#[derive(Clone, Copy, Debug)]
struct Deadline {
    /// 0 is off.
    time_ns: u64,
    until: Instant,
    missed: bool,
}

impl Deadline {
    const OFF: Self = Self { time_ns: 0, until: Instant::FAR_FUTURE, missed: false };
}

/// What becomes of a received RPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reception {
    /// The data takes effect now.
    Apply(u64),
    /// The data is to wait for the next SYNC: [`Rpdo::latch`].
    Latch(u64),
    /// Fewer bytes than mapped: nothing of it is used.
    TooShort,
    /// One object, which the data names ([`Mpdo::from_bits`]). It takes effect now, whatever the transmission type is.
    Multiplexed(u64),
    /// No object is mapped.
    NothingMapped,
}

impl Rpdo {
    /// Not valid.
    pub const INVALID: Self =
        Self { id: None, synchronous: false, mapping: None, multiplexed: None, latched: None, deadline: Deadline::OFF };

    /// Takes a changed record; what was latched is dropped. The event timer, in units of `timer_unit_ns`, is a deadline from
    /// the next reception on; a unit of 0 is a device whose event timers do nothing here.
    pub fn configure(
        parameter: &Parameter,
        mapping: Option<Mapping>,
        multiplexed: Option<AddressMode>,
        timer_unit_ns: u64,
    ) -> Self {
        Self {
            id: parameter.standard_id(),
            synchronous: parameter.transmission_type.is_synchronous(),
            mapping,
            multiplexed,
            latched: None,
            deadline: Deadline { time_ns: u64::from(parameter.event_timer) * timer_unit_ns, ..Deadline::OFF },
        }
    }

    /// The identifier to listen to, if the PDO is valid.
    pub const fn standard_id(&self) -> Option<u16> {
        self.id
    }

    /// The mode of its addresses, if it is multiplexed.
    pub const fn address_mode(&self) -> Option<AddressMode> {
        self.multiplexed
    }

    /// What is mapped into it, in order; `None` where nothing is.
    pub const fn mapping(&self) -> Option<&Mapping> {
        self.mapping.as_ref()
    }

    /// A frame with the PDO's identifier arrived while operational. Bytes beyond the mapping are ignored.
    #[inline]
    pub fn receive(&mut self, frame: &Frame) -> Reception {
        let Some(mapping) = &self.mapping else { return self.receive_multiplexed(frame) };
        if frame.dlc() < mapping.length() {
            return Reception::TooShort;
        }
        let data = u64::from_le_bytes(*frame.padded());
        if self.synchronous { Reception::Latch(data) } else { Reception::Apply(data) }
    }

    #[cold]
    fn receive_multiplexed(&self, frame: &Frame) -> Reception {
        match (self.multiplexed, Mpdo::parse(frame)) {
            (None, _) => Reception::NothingMapped,
            (Some(_), None) => Reception::TooShort,
            (Some(_), Some(mpdo)) => Reception::Multiplexed(mpdo.bits()),
        }
    }

    /// It has an event timer.
    #[inline]
    pub const fn is_timed(&self) -> bool {
        self.deadline.time_ns != 0
    }

    /// A frame came at `now` that was long enough: the event timer starts anew. True if the deadline had been missed.
    pub fn restart_timer(&mut self, now: Instant) -> bool {
        self.deadline.until = now.plus_nanos(self.deadline.time_ns);
        core::mem::take(&mut self.deadline.missed)
    }

    /// Time has reached `now`. True if the deadline was missed by now, which is reported once.
    pub fn handle_timeout(&mut self, now: Instant) -> bool {
        let missed = now >= self.deadline.until;
        if missed {
            self.deadline = Deadline { until: Instant::FAR_FUTURE, missed: true, ..self.deadline };
        }
        missed
    }

    /// When the event timer ends; [`Instant::FAR_FUTURE`] while it does not run.
    pub const fn deadline(&self) -> Instant {
        self.deadline.until
    }

    /// The deadline was missed, and no frame has come since.
    pub const fn is_late(&self) -> bool {
        self.deadline.missed
    }

    /// Operational is left: what was latched is dropped, and nothing is awaited.
    pub const fn stop(&mut self) {
        self.latched = None;
        self.deadline.until = Instant::FAR_FUTURE;
    }

    /// This data waits for the next SYNC, in place of what waited before.
    #[inline]
    pub const fn latch(&mut self, data: u64) {
        self.latched = Some(data);
    }

    /// At SYNC: the data that waited for it.
    #[inline]
    pub const fn take_latched(&mut self) -> Option<u64> {
        self.latched.take()
    }
}

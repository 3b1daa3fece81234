use can::{CanId, Frame, Instant};

use super::{AddressMode, Mapping, Mpdo, Parameter, TransmissionType};
use crate::od::{Dictionary, Storage};

/// What makes a device send a TPDO of type 254 or 255, apart from its event timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventTrigger {
    /// A mapped value differs from the one last sent.
    Change,
    /// As `Change`, but type 255 with an event timer is sent by that timer alone.
    ChangeOr255ByTimer,
    /// TPDO n answers RPDO n; nothing is sent by itself.
    AnswersRpdo,
}

/// A transmit PDO: from the device. Source: CiA 301, 7.2.2.5.2 and 7.5.2.37.
///
/// Wanting to send and being allowed to are apart: an event makes it *due*, the inhibit time holds it back. However
/// many events come meanwhile, one frame is sent. Event-driven data is read when the frame is taken, synchronous
/// data at its SYNC.
#[derive(Clone, Copy, Debug)]
pub struct Tpdo {
    id: CanId,
    mapping: Option<Mapping>,
    /// In place of a mapping.
    multiplexed: Option<AddressMode>,
    schedule: Schedule,
    due: Option<Cause>,
    answers_rpdo: bool,
    data: u64,
    /// The data is of a SYNC since operational was entered.
    sampled: bool,
    allows_rtr: bool,
    /// Of a synchronous one: the counter of the SYNC from which on SYNCs are counted; 0 for the next.
    start_value: u8,
    inhibit_ns: u64,
    inhibited_until: Instant,
    timer_ns: u64,
    timer_at: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Schedule {
    /// At the first SYNC after an event.
    Acyclic { event: bool },
    /// At every `period`-th SYNC; `left` more until then.
    Cyclic { period: u8, left: u8 },
    /// For the SYNC with the start value; acyclic then where `period` is 0, else cyclic.
    Waiting { period: u8 },
    /// When a remote frame asks for it; its data is of the SYNC before where `at_sync` is set.
    Remote { at_sync: bool },
    /// By events; `on_change` if a changed value is one.
    Event { on_change: bool },
}

/// Why a TPDO is to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cause {
    /// Its event timer, which then keeps its grid.
    Timer,
    /// Anything else: the event timer starts anew.
    Event,
}

impl Tpdo {
    /// Not valid.
    pub const INVALID: Self = Self {
        id: CanId::standard(0),
        mapping: None,
        multiplexed: None,
        schedule: Schedule::Event { on_change: false },
        due: None,
        answers_rpdo: false,
        data: 0,
        sampled: false,
        allows_rtr: false,
        start_value: 0,
        inhibit_ns: 0,
        inhibited_until: Instant::ZERO,
        timer_ns: 0,
        timer_at: Instant::FAR_FUTURE,
    };

    /// A TPDO at rest, with the times in units of `inhibit_unit_ns` and `timer_unit_ns`.
    pub fn configure(
        parameter: &Parameter,
        mapping: Option<Mapping>,
        multiplexed: Option<AddressMode>,
        trigger: EventTrigger,
        inhibit_unit_ns: u64,
        timer_unit_ns: u64,
    ) -> Self {
        let Some(id) = parameter.standard_id() else { return Self::INVALID };
        let answers_rpdo = trigger == EventTrigger::AnswersRpdo;
        let by_timer = trigger == EventTrigger::ChangeOr255ByTimer && parameter.event_timer != 0;
        let schedule = match parameter.transmission_type {
            _ if answers_rpdo => Schedule::Event { on_change: false },
            TransmissionType::SynchronousAcyclic => Schedule::Acyclic { event: false },
            TransmissionType::SynchronousCyclic(period) => Schedule::Cyclic { period, left: period },
            TransmissionType::RemoteSynchronous => Schedule::Remote { at_sync: true },
            TransmissionType::RemoteEventDriven => Schedule::Remote { at_sync: false },
            TransmissionType::EventDrivenManufacturer => Schedule::Event { on_change: true },
            TransmissionType::EventDrivenProfile => Schedule::Event { on_change: !by_timer },
        };
        // The inhibit time is for types 254 and 255 (CiA 301, 7.5.2.37).
        let is_event_driven = matches!(schedule, Schedule::Event { .. });
        let counts_syncs = matches!(schedule, Schedule::Acyclic { .. } | Schedule::Cyclic { .. });
        Self {
            id: CanId::standard(id),
            mapping,
            multiplexed: multiplexed.filter(|_| is_event_driven),
            schedule,
            answers_rpdo,
            allows_rtr: parameter.cob_id.allows_rtr(),
            start_value: if counts_syncs { parameter.sync_start_value } else { 0 },
            inhibit_ns: if is_event_driven { u64::from(parameter.inhibit_time) * inhibit_unit_ns } else { 0 },
            timer_ns: u64::from(parameter.event_timer) * timer_unit_ns,
            ..Self::INVALID
        }
    }

    /// The identifier that it is sent with.
    pub const fn can_id(&self) -> CanId {
        self.id
    }

    /// True if it is valid and maps something.
    pub const fn is_active(&self) -> bool {
        self.mapping.is_some()
    }

    /// The mode of its addresses, if it is multiplexed: such a TPDO is of type 254 or 255, and sends what it is
    /// [given](Self::multiplex) only.
    pub const fn address_mode(&self) -> Option<AddressMode> {
        self.multiplexed
    }

    /// Of a multiplexed TPDO while operational: this is to be sent. False if what it was given before has not been sent yet.
    pub const fn multiplex(&mut self, mpdo: &Mpdo) -> bool {
        let takes = self.due.is_none();
        if takes {
            self.data = mpdo.bits();
            self.due = Some(Cause::Event);
        }
        takes
    }

    /// True if SYNC is what sends it; else events do.
    pub const fn is_synchronous(&self) -> bool {
        !matches!(self.schedule, Schedule::Event { .. } | Schedule::Remote { at_sync: false })
    }

    /// True if it waits for a SYNC with a certain counter after each start.
    pub const fn has_start_value(&self) -> bool {
        self.start_value != 0
    }

    /// True if what the application changes can send it.
    pub const fn watches(&self) -> bool {
        self.is_active() && matches!(self.schedule, Schedule::Acyclic { .. } | Schedule::Event { on_change: true })
    }

    /// Operational is entered, or the PDO became active while operational: counts as an event, so that event-driven
    /// data is sent once. SYNCs and the event timer count from here.
    pub fn start(&mut self, now: Instant) {
        if !self.is_active() {
            return;
        }
        self.sampled = false;
        self.restart_counting(now);
        match &mut self.schedule {
            Schedule::Acyclic { event } => *event = true,
            Schedule::Cyclic { .. } | Schedule::Waiting { .. } | Schedule::Remote { .. } => {}
            Schedule::Event { .. } => self.due = (!self.answers_rpdo).then_some(Cause::Event),
        }
    }

    /// Stays active under a changed record: what was due or inhibited remains so.
    pub fn take_over_from(&mut self, old: &Self, now: Instant) {
        self.due = old.due;
        self.data = old.data;
        self.inhibited_until = old.inhibited_until;
        self.restart_counting(now);
    }

    fn restart_counting(&mut self, now: Instant) {
        match &mut self.schedule {
            Schedule::Acyclic { .. } if self.start_value != 0 => self.schedule = Schedule::Waiting { period: 0 },
            Schedule::Cyclic { period, .. } if self.start_value != 0 => {
                self.schedule = Schedule::Waiting { period: *period };
            }
            Schedule::Acyclic { .. } | Schedule::Waiting { .. } | Schedule::Remote { .. } => {}
            Schedule::Cyclic { period, left } => *left = *period,
            Schedule::Event { .. } if self.timer_ns > 0 => self.timer_at = now.plus_nanos(self.timer_ns),
            Schedule::Event { .. } => {}
        }
    }

    /// Operational is left: nothing is due any more.
    pub const fn stop(&mut self) {
        self.due = None;
        self.timer_at = Instant::FAR_FUTURE;
    }

    /// Of one with a start value, before [`handle_sync`](Self::handle_sync): a SYNC with this counter counts as the first one
    /// where it is the start value, and any SYNC without a counter does (CiA 301, 7.5.2.37, sub-index 06h).
    pub fn hear_counter(&mut self, counter: Option<u8>) {
        let Schedule::Waiting { period } = self.schedule else { return };
        if counter.is_none_or(|counter| counter == self.start_value) {
            self.schedule = match period {
                0 => Schedule::Acyclic { event: true },
                period => Schedule::Cyclic { period, left: period },
            };
        }
    }

    /// A remote frame asks for it while operational (CiA 301, 7.2.2.4.3). True if a frame is to be sent: of type 252 not
    /// before its first SYNC, and none at all where bit 30 of the COB-ID is set.
    pub fn handle_remote<S: Storage>(&mut self, values: &Dictionary<S>) -> bool {
        let Some(mapping) = self.mapping.as_ref().filter(|_| self.allows_rtr) else { return false };
        let sample = match self.schedule {
            Schedule::Event { .. } => false,
            Schedule::Remote { at_sync: true } if !self.sampled => return false,
            Schedule::Remote { at_sync } => !at_sync,
            Schedule::Acyclic { .. } | Schedule::Cyclic { .. } | Schedule::Waiting { .. } => !self.sampled,
        };
        if sample {
            self.data = mapping.gather(values);
        }
        self.due = Some(Cause::Event);
        true
    }

    /// The synchronous window is over (1007h): what was sampled at its SYNC and is not sent yet is discarded.
    pub const fn discard_late(&mut self) {
        self.due = None;
    }

    /// A SYNC arrived while operational. True if a frame is to be sent; its data is sampled here.
    #[inline]
    pub fn handle_sync<S: Storage>(&mut self, values: &Dictionary<S>) -> bool {
        let Some(mapping) = &self.mapping else { return false };
        let send = match &mut self.schedule {
            Schedule::Acyclic { event } => core::mem::take(event),
            Schedule::Cyclic { period, left } => {
                *left -= 1;
                let reached = *left == 0;
                if reached {
                    *left = *period;
                }
                reached
            }
            Schedule::Event { .. } | Schedule::Waiting { .. } => return false,
            Schedule::Remote { .. } => {
                self.data = mapping.gather(values);
                self.sampled = true;
                return false;
            }
        };
        if send {
            self.data = mapping.gather(values);
            self.sampled = true;
            self.due = Some(Cause::Event);
        }
        send
    }

    /// Looks whether a mapped value differs from the one last sent. True if that made the TPDO due.
    #[inline]
    pub fn notice_change<S: Storage>(&mut self, values: &Dictionary<S>) -> bool {
        let Some(mapping) = &self.mapping else { return false };
        match &mut self.schedule {
            Schedule::Event { on_change: true } if self.due.is_none() && mapping.gather(values) != self.data => {
                self.due = Some(Cause::Event);
                true
            }
            Schedule::Acyclic { event: event @ false } => {
                *event = mapping.gather(values) != self.data;
                false
            }
            _ => false,
        }
    }

    /// RPDO n of the same number was received. True if that made the TPDO due.
    #[inline]
    pub fn handle_rpdo(&mut self) -> bool {
        let answers = self.answers_rpdo && self.is_active();
        if answers {
            self.due = Some(Cause::Event);
        }
        answers
    }

    /// Time has reached `now`: serves the event timer.
    pub fn handle_timeout(&mut self, now: Instant) {
        if now < self.timer_at || self.timer_ns == 0 {
            return;
        }
        let missed = now.nanos_since(self.timer_at) / self.timer_ns;
        self.timer_at = self.timer_at.plus_nanos((missed + 1).saturating_mul(self.timer_ns));
        self.due = self.due.or(Some(Cause::Timer));
    }

    /// True if a frame may be sent at `now`.
    #[inline]
    pub fn is_ready(&self, now: Instant) -> bool {
        self.due.is_some() && now >= self.inhibited_until
    }

    /// When after `now` it next needs attention; [`Instant::FAR_FUTURE`] for never.
    #[inline]
    pub fn deadline(&self, now: Instant) -> Instant {
        let is_held_back = self.due.is_some() && now < self.inhibited_until;
        if is_held_back { self.timer_at.min(self.inhibited_until) } else { self.timer_at }
    }

    /// The frame to offer at `now`. The inhibit time counts from here until the runner reports the transmission.
    #[inline]
    pub fn take<S: Storage>(&mut self, values: &Dictionary<S>, now: Instant) -> Option<Frame> {
        let Some(mapping) = self.mapping.as_ref() else { return self.take_multiplexed(now) };
        let cause = self.due.take();
        if let Schedule::Event { .. } = self.schedule {
            self.data = mapping.gather(values);
            if self.timer_ns > 0 && cause == Some(Cause::Event) {
                self.timer_at = now.plus_nanos(self.timer_ns);
            }
        }
        self.inhibited_until = now.plus_nanos(self.inhibit_ns);
        Some(Frame::of_bits(self.id, self.data, mapping.length()))
    }

    #[cold]
    fn take_multiplexed(&mut self, now: Instant) -> Option<Frame> {
        self.due.take()?;
        self.inhibited_until = now.plus_nanos(self.inhibit_ns);
        self.multiplexed.map(|_| Frame::of_bits(self.id, self.data, 8))
    }

    /// The wire took the frame at `now`: the inhibit time counts from here. False if there is none, which changes nothing.
    #[inline]
    pub fn handle_transmitted(&mut self, now: Instant) -> bool {
        let is_held_back = self.inhibit_ns != 0 || now < self.inhibited_until;
        if is_held_back {
            self.inhibited_until = now.plus_nanos(self.inhibit_ns);
        }
        is_held_back
    }
}

//! One station's CAN controller: mailboxes, whether it takes part, and what is wrong with it.

use can::{Bitrate, Frame, Instant};

use super::{BUS_OFF_SEQUENCES, ErrorCounters, ErrorState, IDLE_BITS, Segment};
use crate::Prng;
use crate::fault::NodeFaults;

/// How a station's CAN controller is set up.
#[derive(Clone, Copy, Debug)]
pub struct ControllerOptions {
    /// Transmit mailboxes. Among the frames in them the lowest identifier goes first, equal ones in
    /// the order given. One mailbox sends strictly in the order given.
    pub mailboxes: usize,
}

impl ControllerOptions {
    /// A microcontroller's: three mailboxes.
    pub const MICROCONTROLLER: Self = Self { mailboxes: 3 };
    /// A CAN adapter behind a queue, as a computer has it: frames go out in the order given.
    pub const ADAPTER: Self = Self { mailboxes: 1 };
}

/// Frames that a late node may hold back before its firmware finds no room any more.
const LATE_QUEUE: usize = 64;

/// One station's controller: mailboxes, error counters and whether it takes part.
#[derive(Clone, Debug)]
pub(crate) struct Controller {
    options: ControllerOptions,
    /// `None`: no power.
    pub(crate) bitrate: Option<Bitrate>,
    pub(crate) presence: Presence,
    pub(crate) counters: ErrorCounters,
    mailboxes: Vec<Mailbox>,
    offered: u64,
    pub(crate) faults: NodeFaults,
    babble_at: Instant,
    pub(crate) suspended_until: Instant,
    pub(crate) sending: Option<Sending>,
    /// The wire of its own while its cable is cut.
    pub(crate) alone: Option<Segment>,
    backlog_until: Instant,
    /// Frames lost to overrun.
    pub(crate) overruns: u64,
}

/// Whether a controller takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Presence {
    /// No power.
    Off,
    /// Counts sequences of recessive bits: one after joining the wire, 128 after bus-off.
    Waiting { sequences: u32, since: Instant },
    /// Takes part in frames that start at or after `since`.
    Active { since: Instant },
}

/// What a controller has on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sending {
    /// The mailbox with this number.
    Mailbox(u64),
    /// A frame of its fault's.
    Babble,
}

#[derive(Clone, Debug)]
struct Mailbox {
    key: u32,
    number: u64,
    ready_at: Instant,
    frame: Frame,
}

impl Controller {
    pub(crate) fn new(options: ControllerOptions) -> Self {
        Self {
            options,
            bitrate: None,
            presence: Presence::Off,
            counters: ErrorCounters::default(),
            mailboxes: Vec::with_capacity(options.mailboxes),
            offered: 0,
            faults: NodeFaults::default(),
            babble_at: Instant::ZERO,
            suspended_until: Instant::ZERO,
            sending: None,
            alone: None,
            backlog_until: Instant::ZERO,
            overruns: 0,
        }
    }

    /// Starts afresh at a bit rate, or goes without power.
    pub(crate) fn restart(&mut self, bitrate: Option<Bitrate>, now: Instant) {
        self.bitrate = bitrate;
        self.presence = match bitrate {
            Some(_) => Presence::Waiting { sequences: 1, since: now },
            None => Presence::Off,
        };
        self.counters = ErrorCounters::default();
        self.mailboxes.clear();
        self.sending = None;
        self.suspended_until = now;
        self.backlog_until = now;
    }

    /// Its presence when its cable is joined: one sequence of recessive bits to wait for; bus-off counts anew.
    pub(crate) fn rejoined(&self, now: Instant) -> Presence {
        match (self.presence, self.error_state()) {
            (Presence::Off, _) => Presence::Off,
            (_, ErrorState::BusOff) => Presence::Waiting { sequences: BUS_OFF_SEQUENCES, since: now },
            _ => Presence::Waiting { sequences: 1, since: now },
        }
    }

    pub(crate) fn set_faults(&mut self, faults: NodeFaults, now: Instant) {
        self.faults = faults;
        self.babble_at = now;
    }

    pub(crate) fn is_active_since(&self, start: Instant) -> bool {
        matches!(self.presence, Presence::Active { since } if since <= start)
    }

    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.presence, Presence::Waiting { .. })
    }

    pub(crate) fn bit_ns(&self) -> u64 {
        self.bitrate.map_or(0, Bitrate::bit_nanos)
    }

    pub(crate) fn has_room(&self) -> bool {
        let capacity = if self.faults.late.is_some() { LATE_QUEUE } else { self.options.mailboxes };
        self.presence != Presence::Off && self.mailboxes.len() < capacity
    }

    pub(crate) fn offer(&mut self, frame: Frame, now: Instant, prng: &mut Prng) {
        let mut ready_at = now;
        if let Some(delay) = self.faults.late {
            let last = self.mailboxes.iter().map(|mailbox| mailbox.ready_at).max().unwrap_or(now);
            ready_at = now.plus_nanos(delay.draw(prng)).max(last);
        }
        self.mailboxes.push(Mailbox { key: frame.arbitration_key(), number: self.offered, ready_at, frame });
        self.offered += 1;
    }

    /// Empties its mailboxes but for the one that is on the wire.
    pub(crate) fn withdraw(&mut self) -> Vec<Frame> {
        let on_wire = |mailbox: &Mailbox| self.sending == Some(Sending::Mailbox(mailbox.number));
        let (kept, taken) = self.mailboxes.drain(..).partition(on_wire);
        self.mailboxes = kept;
        Vec::into_iter(taken).map(|mailbox: Mailbox| mailbox.frame).collect()
    }

    /// When it would next start a frame on an idle wire; `FAR_FUTURE` if it has nothing to send or may not.
    pub(crate) fn next_start(&self) -> Instant {
        if !matches!(self.presence, Presence::Active { .. }) || self.faults.silent {
            return Instant::FAR_FUTURE;
        }
        let mail = self.mailboxes.iter().map(|mailbox| mailbox.ready_at).min();
        let babble = self.faults.babble.map(|_| self.babble_at);
        match mail.into_iter().chain(babble).min() {
            Some(ready_at) => ready_at.max(self.suspended_until),
            None => Instant::FAR_FUTURE,
        }
    }

    /// The frame it would start at `now`.
    pub(crate) fn candidate(&self, now: Instant) -> Option<(Sending, Frame)> {
        let ready = self.mailboxes.iter().filter(|mailbox| mailbox.ready_at <= now);
        let mail = ready.min_by_key(|mailbox| (mailbox.key, mailbox.number));
        let babble = self.faults.babble.filter(|_| self.babble_at <= now);
        match (mail, babble) {
            (Some(mail), Some(babble)) if babble.frame.arbitration_key() < mail.key => {
                Some((Sending::Babble, babble.frame))
            }
            (Some(mail), _) => Some((Sending::Mailbox(mail.number), mail.frame)),
            (None, Some(babble)) => Some((Sending::Babble, babble.frame)),
            (None, None) => None,
        }
    }

    /// The frame on the wire got through at `now`; returns it if it was the firmware's.
    pub(crate) fn sent(&mut self, now: Instant) -> Option<Frame> {
        match self.sending.take()? {
            Sending::Babble => {
                let gap_ns = self.faults.babble.map_or(0, |babble| babble.gap_ns);
                self.babble_at = now.plus_nanos(gap_ns);
                None
            }
            Sending::Mailbox(number) => {
                let place = self.mailboxes.iter().position(|mailbox| mailbox.number == number)?;
                Some(self.mailboxes.remove(place).frame)
            }
        }
    }

    /// A frame came in at `now`: false if it was lost to overrun.
    pub(crate) fn fetch(&mut self, now: Instant) -> bool {
        let Some(overrun) = self.faults.overrun else { return true };
        let backlog_ns = self.backlog_until.nanos_since(now);
        if backlog_ns > overrun.service_ns.saturating_mul(u64::from(overrun.depth.saturating_sub(1))) {
            self.overruns += 1;
            return false;
        }
        self.backlog_until = self.backlog_until.max(now).plus_nanos(overrun.service_ns);
        true
    }

    /// When a waiting controller takes part, if the wire stays recessive.
    pub(crate) fn active_at(&self, recessive_since: Instant) -> Instant {
        match self.presence {
            Presence::Waiting { sequences, since } => {
                let sequence_ns = IDLE_BITS * self.bit_ns();
                recessive_since.max(since).plus_nanos(sequence_ns * u64::from(sequences))
            }
            _ => Instant::FAR_FUTURE,
        }
    }

    /// A frame starts at `now`: a waiting controller counts the recessive sequences before it.
    pub(crate) fn count_idle(&mut self, recessive_since: Instant, now: Instant) {
        let sequence_ns = IDLE_BITS * self.bit_ns();
        if let Presence::Waiting { sequences, since } = &mut self.presence {
            let seen = now.nanos_since(recessive_since.max(*since)) / sequence_ns.max(1);
            *sequences = sequences.saturating_sub(seen as u32).max(1);
        }
    }

    pub(crate) fn error_state(&self) -> ErrorState {
        self.counters.state()
    }
}

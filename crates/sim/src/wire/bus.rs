//! The wire and the controllers on it: how time passes there, and how frames end.
//!
//! How a frame starts and what will become of it is in `delivery`, nodes with a cut cable are in `alone`.

use std::collections::VecDeque;

use can::{Bitrate, ERROR_FRAME_BITS, Frame, INTERFRAME_SPACE_BITS, Instant};

use super::controller::{Controller, Presence};
use super::{
    BUS_OFF_SEQUENCES, ControllerOptions, ErrorCause, ErrorCounters, ErrorState, SUSPEND_BITS, Segment, Statistics,
    Transmission, WireEvent,
};
use crate::Prng;
use crate::fault::{Corruption, NodeFaults};

/// The wire and one controller for each station, numbered in the order they were added.
///
/// # Contract
/// For an instant `now`: first [`advance`](Self::advance), and if a frame passed,
/// [`conclude`](Self::conclude) for every controller; then [`offer`](Self::offer) what stations have to
/// send; then, when all of that instant is said, [`arbitrate`](Self::arbitrate). The next instant that
/// matters is [`next_event`](Self::next_event).
#[derive(Clone, Debug)]
pub struct Bus {
    pub(super) bitrate: Bitrate,
    pub(super) controllers: Vec<Controller>,
    /// When each controller on the main wire could start a frame; apart from the rest, as this is scanned often.
    pub(super) starts: Vec<Instant>,
    pub(super) main: Segment,
    /// Controllers whose cable is cut.
    pub(super) cut: Vec<usize>,
    pub(super) any_foreign: bool,
    pub(super) corruption: Corruption,
    pub(super) prng: Prng,
    /// As it began: something has been decided by chance if it is another one now.
    fresh: Prng,
    pub(super) events: VecDeque<WireEvent>,
    waiting: usize,
    statistics: Statistics,
}

/// A frame that got through on the main wire.
#[derive(Clone, Copy, Debug)]
pub struct Delivered {
    /// The frame.
    pub frame: Frame,
    /// Its sender.
    pub source: usize,
    /// Start of frame.
    pub start: Instant,
    /// Its last bit.
    pub end: Instant,
}

/// A controller's part in a frame that got through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Its firmware's frame: the mailbox is free again.
    Transmitted(Frame),
    /// It has the frame for its firmware.
    Received,
    /// Not on the wire, at another bit rate, off, or the frame was lost to overrun.
    Nothing,
}

impl Bus {
    /// Whether chance has decided anything on it so far.
    pub(crate) fn has_drawn(&self) -> bool {
        self.prng != self.fresh
    }

    /// A bus at `bitrate` with no node on it. `seed` decides all random faults.
    pub fn new(bitrate: Bitrate, seed: u64) -> Self {
        Self {
            bitrate,
            controllers: Vec::new(),
            starts: Vec::new(),
            main: Segment::default(),
            cut: Vec::new(),
            any_foreign: false,
            corruption: Corruption::none(),
            prng: Prng::new(seed),
            fresh: Prng::new(seed),
            events: VecDeque::new(),
            waiting: 0,
            statistics: Statistics::default(),
        }
    }

    /// Adds a controller without power; [`restart`](Self::restart) puts it on the wire.
    pub fn add(&mut self, options: ControllerOptions) -> usize {
        self.controllers.push(Controller::new(options));
        self.starts.push(Instant::FAR_FUTURE);
        self.controllers.len() - 1
    }

    /// The bit rate of the bus.
    pub fn bitrate(&self) -> Bitrate {
        self.bitrate
    }

    /// The bit rate at which controller `i` works; `None` without power.
    pub fn bitrate_of(&self, i: usize) -> Option<Bitrate> {
        self.controllers[i].bitrate
    }

    /// Restarts controller `i` at a bit rate with cleared counters and mailboxes, or takes its power (`None`).
    pub fn restart(&mut self, i: usize, bitrate: Option<Bitrate>, now: Instant) {
        self.leave_frame(i, now);
        self.controllers[i].restart(bitrate, now);
        self.set_presence(i, self.controllers[i].presence);
        if let Some(segment) = &mut self.controllers[i].alone {
            *segment = Segment { free_at: now, recessive_since: now, ..Segment::default() };
        }
        let rate = self.bitrate;
        self.any_foreign = self.controllers.iter().any(|it| it.bitrate.is_some_and(|other| other != rate));
        self.update_start(i);
    }

    /// Sets what is wrong with controller `i`.
    pub fn set_faults(&mut self, i: usize, faults: NodeFaults, now: Instant) {
        self.controllers[i].set_faults(faults, now);
        self.update_start(i);
    }

    /// What is wrong with controller `i`.
    pub fn faults(&self, i: usize) -> &NodeFaults {
        &self.controllers[i].faults
    }

    /// How the wire is disturbed, to change it.
    pub fn corruption_mut(&mut self) -> &mut Corruption {
        &mut self.corruption
    }

    /// Sets how the wire is disturbed from the next frame on.
    pub fn set_corruption(&mut self, corruption: Corruption) {
        self.corruption = corruption;
    }

    /// True if controller `i` can take another frame.
    pub fn has_room(&self, i: usize) -> bool {
        self.controllers[i].has_room()
    }

    /// Puts a frame into a mailbox of controller `i`. It is dropped if there is no room.
    pub fn offer(&mut self, i: usize, frame: Frame, now: Instant) {
        if self.controllers[i].has_room() {
            self.controllers[i].offer(frame, now, &mut self.prng);
            self.update_start(i);
        }
    }

    /// Takes out of controller `i` what it offered and does not send at present, in the order given.
    pub fn withdraw(&mut self, i: usize) -> Vec<Frame> {
        let frames = self.controllers[i].withdraw();
        self.update_start(i);
        frames
    }

    /// When something happens next if no node offers anything; `None` for never.
    pub fn next_event(&self) -> Option<Instant> {
        let main = match &self.main.transmission {
            Some(transmission) => transmission.end,
            None => {
                let start = self.starts.iter().copied().min().unwrap_or(Instant::FAR_FUTURE);
                let start = if start == Instant::FAR_FUTURE { start } else { start.max(self.main.free_at) };
                start.min(self.next_activation())
            }
        };
        let earliest = self.cut.iter().map(|&i| self.next_event_alone(i)).fold(main, Instant::min);
        (earliest != Instant::FAR_FUTURE).then_some(earliest)
    }

    /// Starts frames on wires that are idle at `now`.
    pub fn arbitrate(&mut self, now: Instant) {
        if self.main.transmission.is_none() {
            if self.waiting > 0 && self.next_activation() <= now {
                self.activate_waiting(now);
            }
            if self.main.free_at <= now && self.starts.iter().any(|start| *start <= now) {
                self.start_frame(now);
            }
        }
        for place in 0..self.cut.len() {
            self.start_alone(self.cut[place], now);
        }
    }

    /// Ends what is due at `now`. If a frame got through, [`conclude`](Self::conclude) it for every controller.
    pub fn advance(&mut self, now: Instant) -> Option<Delivered> {
        for place in 0..self.cut.len() {
            self.end_alone(self.cut[place], now);
        }
        let transmission = self.main.transmission.take_if(|transmission| transmission.end <= now)?;
        let Transmission { frame, source, start, end, bit_ns, failure } = transmission;
        let Some(cause) = failure else {
            self.main.recessive_since = Instant::from_nanos(end.as_nanos() - 8 * bit_ns);
            self.main.free_at = end.plus_nanos(u64::from(INTERFRAME_SPACE_BITS) * bit_ns);
            self.statistics.frames += 1;
            self.statistics.busy_ns += self.main.free_at.nanos_since(start);
            self.events.push_back(WireEvent::Frame { start, end, source, frame });
            return Some(Delivered { frame, source, start, end });
        };
        self.main.recessive_since = end.plus_nanos(6 * bit_ns);
        self.main.free_at = end.plus_nanos(u64::from(ERROR_FRAME_BITS) * bit_ns);
        self.statistics.errors += 1;
        self.statistics.busy_ns += self.main.free_at.nanos_since(start);
        self.events.push_back(WireEvent::Error { at: end, source, frame, cause });
        for i in 0..self.controllers.len() {
            self.count_failure(i, start, end, cause);
        }
        None
    }

    /// What `passed` means to controller `i`; to be called once for each controller.
    pub fn conclude(&mut self, i: usize, passed: &Delivered) -> Role {
        let foreign = self.is_foreign(i);
        let controller = &mut self.controllers[i];
        if controller.alone.is_some() || !controller.is_active_since(passed.start) {
            return Role::Nothing;
        }
        if controller.sending.is_some() {
            let frame = controller.sent(passed.end);
            self.count(i, passed.end, ErrorCounters::transmit_success);
            self.suspend_if_passive(i);
            return frame.map_or(Role::Nothing, Role::Transmitted);
        }
        if foreign {
            self.count(i, passed.end, ErrorCounters::first_receive_error);
            return Role::Nothing;
        }
        if controller.counters.rec() > 0 {
            self.count(i, passed.end, ErrorCounters::receive_success);
        }
        if self.controllers[i].fetch(passed.end) { Role::Received } else { Role::Nothing }
    }

    /// The next thing that happened, oldest first.
    pub fn poll_event(&mut self) -> Option<WireEvent> {
        self.events.pop_front()
    }

    /// Counts up to `now`.
    pub fn statistics(&self, now: Instant) -> Statistics {
        Statistics { at: now, ..self.statistics }
    }

    /// Whether controller `i` sends the frame that is on the wire; several do where they began the same identifier at once.
    pub fn is_sending(&self, i: usize) -> bool {
        self.controllers[i].sending.is_some()
    }

    /// Error counters of controller `i`.
    pub fn counters(&self, i: usize) -> ErrorCounters {
        self.controllers[i].counters
    }

    /// Frames controller `i` lost to overrun.
    pub fn overruns(&self, i: usize) -> u64 {
        self.controllers[i].overruns
    }

    pub(super) fn on_main_wire(&self, i: usize) -> bool {
        self.controllers[i].alone.is_none()
    }

    pub(super) fn is_foreign(&self, i: usize) -> bool {
        self.any_foreign && self.controllers[i].bitrate.is_some_and(|rate| rate != self.bitrate)
    }

    /// Changes the counters of controller `i` and draws the consequences.
    pub(super) fn count(&mut self, i: usize, at: Instant, change: impl FnOnce(&mut ErrorCounters)) {
        let controller = &mut self.controllers[i];
        let before = controller.error_state();
        change(&mut controller.counters);
        let state = controller.error_state();
        if state == before {
            return;
        }
        if state == ErrorState::BusOff {
            controller.sending = None;
            self.set_presence(i, Presence::Waiting { sequences: BUS_OFF_SEQUENCES, since: at });
        }
        self.events.push_back(WireEvent::State { at, controller: i, state });
        self.update_start(i);
    }

    /// Looks again when controller `i` could start a frame.
    pub(super) fn update_start(&mut self, i: usize) {
        let controller = &self.controllers[i];
        self.starts[i] = if controller.alone.is_some() { Instant::FAR_FUTURE } else { controller.next_start() };
    }

    /// Changes whether controller `i` takes part.
    pub(super) fn set_presence(&mut self, i: usize, presence: Presence) {
        self.controllers[i].presence = presence;
        self.waiting = self.controllers.iter().filter(|controller| controller.is_waiting()).count();
        self.update_start(i);
    }

    /// Takes controller `i` out of the frame on the wire, be it sender or the only one to acknowledge.
    pub(super) fn leave_frame(&mut self, i: usize, now: Instant) {
        let was_sending = self.controllers[i].sending.take().is_some();
        let still_sent = self.controllers.iter().any(|it| it.alone.is_none() && it.sending.is_some());
        if self.controllers[i].alone.is_some() {
            return;
        }
        let presence = self.controllers[i].presence;
        self.controllers[i].presence = Presence::Off;
        if let Some(transmission) = self.main.transmission.as_ref() {
            let ack_slot = transmission.end.as_nanos().saturating_sub(8 * transmission.bit_ns);
            let unacknowledged = transmission.failure.is_none()
                && now.as_nanos() < ack_slot
                && !self.is_acknowledged(transmission.start);
            let change = if was_sending && !still_sent {
                Some((now.min(transmission.end), ErrorCause::Abandoned))
            } else if unacknowledged {
                Some((Instant::from_nanos(ack_slot), ErrorCause::NotAcknowledged))
            } else {
                None
            };
            if let (Some((end, cause)), Some(transmission)) = (change, self.main.transmission.as_mut()) {
                transmission.end = end;
                transmission.failure = Some(cause);
            }
        }
        self.controllers[i].presence = presence;
    }

    /// The waiting controller `i` has seen enough recessive bits.
    pub(super) fn activate(&mut self, i: usize, now: Instant) {
        self.set_presence(i, Presence::Active { since: now });
        let controller = &mut self.controllers[i];
        if controller.error_state() == ErrorState::BusOff {
            controller.counters = ErrorCounters::default();
            let state = ErrorState::ErrorActive;
            self.events.push_back(WireEvent::State { at: now, controller: i, state });
        }
    }

    fn next_activation(&self) -> Instant {
        if self.waiting == 0 {
            return Instant::FAR_FUTURE;
        }
        let on_main = self.controllers.iter().filter(|controller| controller.alone.is_none());
        let activations = on_main.map(|controller| controller.active_at(self.main.recessive_since));
        activations.min().unwrap_or(Instant::FAR_FUTURE)
    }

    fn activate_waiting(&mut self, now: Instant) {
        for i in 0..self.controllers.len() {
            if self.on_main_wire(i) && self.controllers[i].active_at(self.main.recessive_since) <= now {
                self.activate(i, now);
            }
        }
    }

    /// A frame starts: controllers that wait for recessive bits count those that have passed.
    pub(super) fn waiting_count_idle(&mut self, now: Instant) {
        if self.waiting > 0 {
            let since = self.main.recessive_since;
            let on_main = self.controllers.iter_mut().filter(|controller| controller.alone.is_none());
            on_main.for_each(|controller| controller.count_idle(since, now));
        }
    }

    /// What an attempt that failed does to controller `i` (fault confinement).
    fn count_failure(&mut self, i: usize, start: Instant, at: Instant, cause: ErrorCause) {
        let foreign = self.is_foreign(i);
        let controller = &mut self.controllers[i];
        let sending = controller.sending.take().is_some();
        let waited = !sending && !controller.is_active_since(start);
        if controller.alone.is_some() || waited || controller.faults.silent {
            return;
        }
        match (cause, sending) {
            (ErrorCause::NotAcknowledged, true) => self.count(i, at, ErrorCounters::acknowledge_error),
            // A node at the odd bit rate errs alone, and the others' flags answer its own.
            (ErrorCause::BitRate, false) if foreign => self.count(i, at, ErrorCounters::first_receive_error),
            // All that comes within the arbitration field: a good sender takes it for a lost arbitration and
            // then sees a stuff error as a receiver.
            (ErrorCause::BitRate, true) if !foreign => self.count(i, at, ErrorCounters::receive_error),
            (_, true) => self.count(i, at, ErrorCounters::transmit_error),
            (_, false) => self.count(i, at, ErrorCounters::receive_error),
        }
        if sending {
            self.suspend_if_passive(i);
        }
    }

    /// An error-passive node that sent waits longer before it sends again (suspend transmission).
    fn suspend_if_passive(&mut self, i: usize) {
        let controller = &mut self.controllers[i];
        if controller.error_state() == ErrorState::ErrorPassive {
            controller.suspended_until = self.main.free_at.plus_nanos(SUSPEND_BITS * controller.bit_ns());
        }
        self.update_start(i);
    }
}

//! What becomes of a frame, decided when it starts: every node that has a part in it is known by then.

use can::{Frame, Instant, frame_bits};

use super::collision::{contents, first_difference};
use super::controller::{Presence, Sending};
use super::{Bus, ErrorCause, ErrorState, Transmission};

/// Bits after the acknowledge slot: acknowledge delimiter and end of frame.
pub(crate) const BITS_AFTER_ACK_SLOT: u64 = 1 + 7;

/// Bits after which a node at another rate and the others have noticed each other: a stuff error
/// needs six equal bits.
const FOREIGN_BITS: u64 = 6;

impl Bus {
    /// Arbitration among all that may start at `now` on the main wire.
    pub(super) fn start_frame(&mut self, now: Instant) {
        self.waiting_count_idle(now);
        let foreign = self.start_foreign(now);
        let winner = self.most_urgent(now);
        let senders = winner.map_or(0, |(_, frame)| self.mark_senders(frame.arbitration_key(), now));
        let disputed = foreign.is_some() || self.foreign_listener_objects(now);
        match foreign.or(winner) {
            Some((source, frame)) if disputed => self.clash_of_bit_rates(source, frame, now),
            Some((source, frame)) if senders > 1 => {
                let (source, frame, collision) = self.resolve_contents(source, frame, now);
                self.transmit(source, frame, collision, now);
            }
            Some((source, frame)) => self.transmit(source, frame, None, now),
            None => {}
        }
    }

    /// Nodes at another bit rate start all the same: they cannot read what the others send.
    fn start_foreign(&mut self, now: Instant) -> Option<(usize, Frame)> {
        if !self.any_foreign {
            return None;
        }
        let mut first = None;
        for i in 0..self.controllers.len() {
            if self.starts[i] <= now && self.is_foreign(i) {
                let started = self.take_candidate(i, now);
                first = first.or(started.map(|(_, frame)| (i, frame)));
            }
        }
        first
    }

    /// The frame with the lowest arbitration key, and the first node that sends it.
    fn most_urgent(&self, now: Instant) -> Option<(usize, Frame)> {
        let mut winner: Option<(u32, usize, Frame)> = None;
        for i in 0..self.controllers.len() {
            if self.starts[i] > now || self.is_foreign(i) {
                continue;
            }
            let Some((_, frame)) = self.controllers[i].candidate(now) else { continue };
            let key = frame.arbitration_key();
            if winner.is_none_or(|(least, ..)| key < least) {
                winner = Some((key, i, frame));
            }
        }
        winner.map(|(_, i, frame)| (i, frame))
    }

    /// Marks all that send the identifier with this arbitration key at `now`; returns how many.
    fn mark_senders(&mut self, key: u32, now: Instant) -> usize {
        let mut senders = 0;
        for i in 0..self.controllers.len() {
            if self.starts[i] > now || self.is_foreign(i) {
                continue;
            }
            let controller = &mut self.controllers[i];
            let candidate = controller.candidate(now).filter(|(_, frame)| frame.arbitration_key() == key);
            controller.sending = candidate.map(|(sending, _)| sending);
            senders += usize::from(candidate.is_some());
        }
        senders
    }

    /// Puts the winner on the wire. `collision` is the bit in which another sender's contents differ.
    fn transmit(&mut self, source: usize, frame: Frame, collision: Option<u32>, now: Instant) {
        let bits = frame_bits(&frame);
        let collision = collision.map(|bit| (bit, ErrorCause::Collision));
        let by_wire = self.corruption.strike(bits, &mut self.prng);
        let by_sender = self.controllers[source].faults.strike(bits, &mut self.prng);
        let disturbed = by_wire.into_iter().chain(by_sender).min().map(|bit| (bit, ErrorCause::Disturbed));
        let unacknowledged =
            (!self.is_acknowledged(now)).then_some((bits - BITS_AFTER_ACK_SLOT as u32, ErrorCause::NotAcknowledged));
        // The first error ends the frame.
        let failures = [collision, disturbed, unacknowledged].into_iter().flatten();
        let failure = failures.min_by_key(|(bit, _)| *bit);
        let (length, failure) = failure.map_or((bits, None), |(bit, cause)| (bit, Some(cause)));
        let bit_ns = self.bitrate.bit_nanos();
        let end = now.plus_nanos(u64::from(length) * bit_ns);
        self.main.transmission = Some(Transmission { frame, source, start: now, end, bit_ns, failure });
    }

    /// True if a node other than the senders acknowledges a frame that started at `start`.
    pub(super) fn is_acknowledged(&self, start: Instant) -> bool {
        (0..self.controllers.len()).any(|i| {
            let controller = &self.controllers[i];
            self.on_main_wire(i)
                && !self.is_foreign(i)
                && controller.is_active_since(start)
                && controller.sending.is_none()
                && !controller.faults.silent
        })
    }

    /// Sorts out senders of one identifier: who remains, and the bit at which an error flag ends it all.
    ///
    /// A sender that reads dominant for recessive has a bit error. Its error flag destroys the frame if
    /// it is error-active; if it is passive, the other frame goes on unharmed.
    fn resolve_contents(&mut self, mut source: usize, mut frame: Frame, now: Instant) -> (usize, Frame, Option<u32>) {
        let senders: Vec<(usize, Frame)> = (0..self.controllers.len())
            .filter(|&i| self.controllers[i].sending.is_some())
            .filter_map(|i| self.controllers[i].candidate(now).map(|(_, frame)| (i, frame)))
            .collect();
        for (i, other) in &senders {
            if contents(other) < contents(&frame) {
                (source, frame) = (*i, *other);
            }
        }
        let mut ended_at: Option<u32> = None;
        for (i, other) in senders {
            let Some(bit) = first_difference(&frame, &other) else { continue };
            if self.controllers[i].error_state() == ErrorState::ErrorActive {
                ended_at = Some(ended_at.map_or(bit, |earlier| earlier.min(bit)));
            } else {
                self.controllers[i].sending = None;
                self.count(i, now, |counters| counters.transmit_error());
                if self.controllers[i].is_active_since(now) {
                    // Busy with its passive error flag: this frame is not for it.
                    self.set_presence(i, Presence::Active { since: now.plus_nanos(1) });
                }
            }
        }
        (source, frame, ended_at)
    }

    /// An error-active listener at another bit rate takes every frame for an error and signals it.
    fn foreign_listener_objects(&self, now: Instant) -> bool {
        self.any_foreign
            && (0..self.controllers.len()).any(|i| {
                let controller = &self.controllers[i];
                self.on_main_wire(i)
                    && self.is_foreign(i)
                    && !controller.faults.silent
                    && controller.is_active_since(now)
                    && controller.error_state() == ErrorState::ErrorActive
            })
    }

    fn clash_of_bit_rates(&mut self, source: usize, frame: Frame, now: Instant) {
        let on_wire = (0..self.controllers.len()).filter(|&i| self.on_main_wire(i) && self.is_foreign(i));
        let slowest_ns = on_wire.map(|i| self.controllers[i].bit_ns()).max().unwrap_or(0);
        let bit_ns = slowest_ns.max(self.bitrate.bit_nanos());
        let end = now.plus_nanos(FOREIGN_BITS * bit_ns);
        let failure = Some(ErrorCause::BitRate);
        self.main.transmission = Some(Transmission { frame, source, start: now, end, bit_ns, failure });
    }

    /// Marks a babble or mailbox frame as on a wire of its own.
    pub(super) fn take_candidate(&mut self, i: usize, now: Instant) -> Option<(Sending, Frame)> {
        let candidate = self.controllers[i].candidate(now)?;
        self.controllers[i].sending = Some(candidate.0);
        Some(candidate)
    }
}

//! A node whose cable is cut: a wire of its own, with no node to acknowledge.

use can::{ERROR_FRAME_BITS, Instant, frame_bits};

use super::delivery::BITS_AFTER_ACK_SLOT;
use super::{Bus, ErrorCause, ErrorState, SUSPEND_BITS, Segment, Transmission, WireEvent};

impl Bus {
    /// Cuts the cable of controller `i`: it goes on alone. Nothing happens if it is cut already.
    pub fn cut(&mut self, i: usize, now: Instant) {
        if self.controllers[i].alone.is_some() {
            return;
        }
        let was_sending = self.controllers[i].sending.is_some();
        self.leave_frame(i, now);
        let mut segment = Segment { free_at: now, recessive_since: now, ..Segment::default() };
        if was_sending {
            // Alone it reads no acknowledge, or a bit error from the loose end.
            self.count(i, now, |counters| counters.transmit_error());
            let controller = &self.controllers[i];
            segment.free_at = now.plus_nanos(u64::from(ERROR_FRAME_BITS) * controller.bit_ns());
        }
        self.controllers[i].alone = Some(segment);
        self.cut.push(i);
        self.update_start(i);
    }

    /// Joins a cut cable again. The node waits for an idle wire before it takes part.
    pub fn join(&mut self, i: usize, now: Instant) {
        if self.controllers[i].alone.take().is_none() {
            return;
        }
        self.cut.retain(|&cut| cut != i);
        self.controllers[i].sending = None;
        self.set_presence(i, self.controllers[i].rejoined(now));
    }

    /// True while the cable of controller `i` is cut.
    pub fn is_cut(&self, i: usize) -> bool {
        self.controllers[i].alone.is_some()
    }

    pub(super) fn next_event_alone(&self, i: usize) -> Instant {
        let controller = &self.controllers[i];
        let Some(segment) = &controller.alone else { return Instant::FAR_FUTURE };
        match &segment.transmission {
            Some(transmission) => transmission.end,
            None if controller.is_waiting() => controller.active_at(segment.recessive_since),
            None => controller.next_start().max(segment.free_at),
        }
    }

    /// Starts what the lone node wants to send.
    pub(super) fn start_alone(&mut self, i: usize, now: Instant) {
        let Some(segment) = &self.controllers[i].alone else { return };
        if segment.transmission.is_some() {
            return;
        }
        if self.controllers[i].active_at(segment.recessive_since) <= now {
            self.activate(i, now);
        }
        let controller = &self.controllers[i];
        let free_at = controller.alone.as_ref().map_or(Instant::FAR_FUTURE, |segment| segment.free_at);
        if free_at.max(controller.next_start()) > now {
            return;
        }
        let bit_ns = controller.bit_ns();
        let Some((_, frame)) = self.take_candidate(i, now) else { return };
        let bits = u64::from(frame_bits(&frame)) - BITS_AFTER_ACK_SLOT;
        let end = now.plus_nanos(bits * bit_ns);
        let failure = Some(ErrorCause::NotAcknowledged);
        if let Some(segment) = &mut self.controllers[i].alone {
            segment.transmission = Some(Transmission { frame, source: i, start: now, end, bit_ns, failure });
        }
    }

    /// Ends the lone node's attempt: no acknowledge came.
    pub(super) fn end_alone(&mut self, i: usize, now: Instant) {
        let Some(segment) = &mut self.controllers[i].alone else { return };
        let due = segment.transmission.take_if(|transmission| transmission.end <= now);
        let Some(Transmission { end, bit_ns, frame, .. }) = due else { return };
        segment.recessive_since = end.plus_nanos(6 * bit_ns);
        segment.free_at = end.plus_nanos(u64::from(ERROR_FRAME_BITS) * bit_ns);
        let free_at = segment.free_at;
        let controller = &mut self.controllers[i];
        controller.sending = None;
        self.count(i, end, |counters| counters.acknowledge_error());
        let controller = &mut self.controllers[i];
        if controller.error_state() == ErrorState::ErrorPassive {
            controller.suspended_until = free_at.plus_nanos(SUSPEND_BITS * bit_ns);
        }
        let cause = ErrorCause::NotAcknowledged;
        self.events.push_back(WireEvent::Error { at: end, source: i, frame, cause });
    }
}

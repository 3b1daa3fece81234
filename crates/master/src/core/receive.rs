use std::ops::Range;

use can::Frame;
use canopen::emcy::Emcy;
use canopen::heartbeat::Heartbeat;
use canopen::nmt::NmtRequest;
use canopen::sdo::wire::{Payload, Request};
use canopen::{Mux, NmtState, NodeId, connection_set};

use super::Core;
use super::answers::ENOUGH;
use super::event::Event;
use super::facts::OtherWrite;
use super::request::{Failure, Outcome};
use super::twins::Twins;

/// What a node's frames change.
impl Core {
    pub(super) fn note_outcome(&mut self, node: NodeId, mux: Mux, outcome: &Outcome) {
        let now = self.now;
        let facts = &mut self.member_mut(node).facts;
        match *outcome {
            Ok(_) | Err(Failure::BadAnswer(_) | Failure::QueueFull) => facts.unanswered = 0,
            Err(Failure::Aborted(code)) => {
                facts.unanswered = 0;
                self.events.push(Event::Aborted(node, mux, code), now);
            }
            Err(Failure::NoAnswer { waited, .. }) => {
                facts.unanswered = facts.unanswered.saturating_add(1);
                // Silence of a node that was never heard is not an event: a scan meets it a hundred times.
                if facts.seen_at.is_some() {
                    self.events.push(Event::NoAnswer(node, mux, waited), now);
                }
            }
        }
    }

    /// Another client asks a node: what it writes to the device profile may be why a motion of this program ends.
    pub(super) fn handle_other_request(&mut self, node: NodeId, frame: &Frame) {
        /// The areas of standardised device profiles (CiA 301, 7.4).
        const DEVICE_PROFILE: Range<u16> = 0x6000..0xA000;
        let at = self.now;
        let member = self.member_mut(node);
        member.answers.asked(frame, at);
        if let Request::InitiateDownload(object, payload) = Request::parse(frame.padded())
            && DEVICE_PROFILE.contains(&object.index)
        {
            let value = match payload {
                Payload::Expedited { length, mut bytes } => {
                    // Bytes beyond the length mean nothing.
                    bytes.iter_mut().skip(length.unwrap_or(u8::MAX).into()).for_each(|byte| *byte = 0);
                    Some(u32::from_le_bytes(bytes))
                }
                Payload::Segmented { .. } => None,
            };
            member.facts.other_write = Some(OtherWrite { at, object, value });
        }
    }

    pub(super) fn handle_sdo_reply(&mut self, node: NodeId, frame: &Frame) {
        let now = self.now;
        let member = self.member_mut(node);
        member.facts.answered_at = Some(now);
        // Two devices are seen by the answers of their default server, to any client.
        let is_default = frame.id() == connection_set::sdo_reply(node);
        if is_default && let Some(second) = member.answers.answered(frame, now) {
            member.facts.second_answers = second;
            if second == ENOUGH {
                self.note_twins(node, Twins::Answers);
            }
        }
        if self.busy.contains(node) {
            self.member_mut(node).channel.handle_frame(frame, now);
            self.settle(node);
            self.find_due();
        }
    }

    pub(super) fn handle_heartbeat(&mut self, node: NodeId, frame: &Frame) {
        let now = self.now;
        let Some(heartbeat) = Heartbeat::parse(frame) else { return };
        let mut byte = heartbeat.state;
        let guarded = match self.presence.guard(node) {
            Some(guard) if heartbeat.is_boot_up() => {
                guard.booted();
                true
            }
            Some(guard) => {
                let Some(state) = guard.answer(byte) else { return };
                byte = state;
                true
            }
            None => false,
        };
        let Some(state) = NmtState::from_heartbeat_byte(byte) else { return };
        let facts = &mut self.member_mut(node).facts;
        let before = facts.nmt_state.replace(state);
        let twins = match state {
            NmtState::Initialising => facts.heartbeats.booted(now),
            // Answers come when they are asked for: their times say nothing of two devices.
            _ if guarded => None,
            state => facts.heartbeats.heard(state, now),
        };
        let back = facts.note_heartbeat(state, now);
        let deadline = facts.heartbeat_watch.and_then(|watch| watch.deadline);
        if state == NmtState::Initialising {
            self.events.push(Event::BootUp(node), now);
        } else if before != Some(state) {
            self.events.push(Event::NmtState(node, state), now);
        }
        if back {
            self.events.push(Event::HeartbeatBack(node), now);
        }
        if let Some(twins) = twins {
            self.note_twins(node, twins);
        }
        if let Some(deadline) = deadline {
            self.heartbeat_check = self.heartbeat_check.min(deadline);
            self.due = self.due.min(deadline);
        }
    }

    fn note_twins(&mut self, node: NodeId, twins: Twins) {
        if self.member_mut(node).facts.note_twins(twins) {
            self.events.push(Event::TwoDevices(node, twins), self.now);
        }
    }

    /// Another master commands a state: the heartbeats that follow show it.
    pub(super) fn handle_nmt(&mut self, frame: &Frame) {
        if let Ok(request) = NmtRequest::parse(frame) {
            self.note_nmt(request);
        }
    }

    pub(super) fn handle_emcy(&mut self, node: NodeId, frame: &Frame) {
        let Some(emcy) = Emcy::parse(frame) else { return };
        let now = self.now;
        self.member_mut(node).facts.push_emcy(emcy, now);
        self.events.push(Event::Emcy(node, emcy), now);
    }
}

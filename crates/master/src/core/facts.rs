use std::collections::VecDeque;
use std::time::Duration;

use can::Instant;
use canopen::emcy::{Emcy, EmcyErrorCode};
use canopen::{Mux, NmtCommand, NmtState};
use devices::Description;

use super::twins::{Heartbeats, Twins};

/// How many emergency messages are kept for each node.
const EMCY_KEPT: usize = 8;

/// What has been seen of one node on the bus, without asking it.
#[derive(Clone, Debug, Default)]
pub struct NodeFacts {
    /// State of its last boot-up or heartbeat message.
    pub nmt_state: Option<NmtState>,
    /// That of the last one that did not say "stopped", which is an alarm of some models.
    pub(super) nmt_state_before: Option<NmtState>,
    /// When its last boot-up message came, and how many have come.
    pub boot_up: Option<(Instant, u32)>,
    /// When its last heartbeat or boot-up message came.
    pub heartbeat_at: Option<Instant>,
    /// The last NMT command that it was sent, by this master or by another that was heard, and when; forgotten at its boot-up.
    pub nmt_sent: Option<(Instant, NmtCommand)>,
    /// When any frame of its predefined connection set came (CiA 301, 7.3.3).
    pub seen_at: Option<Instant>,
    /// When its last SDO answer came, to whichever client.
    pub answered_at: Option<Instant>,
    /// The heartbeat that is expected of it, if it is being watched.
    pub heartbeat_watch: Option<HeartbeatWatch>,
    /// SDO requests in a row that it has not answered.
    pub unanswered: u32,
    /// When the last frame for it alone left this master: an SDO request or an RPDO.
    pub talked_to_at: Option<Instant>,
    /// When it was last written to: an SDO download had ended, or an RPDO left. What it sent before does not reflect
    /// that.
    pub written_at: Option<Instant>,
    /// The last request of another SDO client to write an object of the device profile; forgotten at its boot-up.
    pub other_write: Option<OtherWrite>,
    /// It has answered SDO block transfer with 0504 0001h, and has not booted since: then it may be another device, or another firmware.
    pub refuses_blocks: bool,
    /// SDO answers that no client had asked for.
    pub second_answers: u32,
    /// Two devices have this node-ID: what first spoke for it.
    pub twins: Option<Twins>,
    pub(super) heartbeats: Heartbeats,
    emcys: VecDeque<(Instant, Emcy)>,
}

/// A request to write that was heard on the bus. Source: CiA 301, 7.2.4.3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OtherWrite {
    /// When it came.
    pub at: Instant,
    /// The object.
    pub object: Mux,
    /// The value, where it came in the request.
    pub value: Option<u32>,
}

/// Watch over a node's heartbeat, or over its answers to node guarding. Source: CiA 301, 7.2.8.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeartbeatWatch {
    /// Longest time without one: of guarding the guard time, times the life time factor.
    pub time: Duration,
    /// It is asked for by remote frames: node guarding.
    pub asked: bool,
    /// When it counts as lost; `None` once it is lost, and of a heartbeat until the first one has come.
    pub deadline: Option<Instant>,
    /// The heartbeat has been lost and has not come back.
    pub lost: bool,
}

impl NodeFacts {
    /// The shortest time between two of its last heartbeats: less than its period where there are two devices.
    pub fn shortest_heartbeat_interval(&self) -> Option<Duration> {
        self.heartbeats.shortest()
    }

    /// Notes what speaks for two devices; true if that is new.
    pub(super) fn note_twins(&mut self, twins: Twins) -> bool {
        let is_new = self.twins.is_none();
        self.twins.get_or_insert(twins);
        is_new
    }

    /// The emergency messages kept, oldest first, with the time each came.
    pub fn emcys(&self) -> impl DoubleEndedIterator<Item = &(Instant, Emcy)> {
        self.emcys.iter()
    }

    /// True if an error with such a code has come since the node has last reported that it has none.
    pub(crate) fn has_shown(&self, is_meant: impl Fn(EmcyErrorCode) -> bool) -> bool {
        let codes = self.emcys.iter().rev().map(|(_, emcy)| emcy.code);
        codes.take_while(|code| *code != EmcyErrorCode::NO_ERROR).any(is_meant)
    }

    /// The newest emergency message.
    pub fn last_emcy(&self) -> Option<&(Instant, Emcy)> {
        self.emcys.back()
    }

    /// Time since the last heartbeat or boot-up message.
    pub fn heartbeat_age(&self, now: Instant) -> Option<Duration> {
        self.heartbeat_at.map(|at| now - at)
    }

    pub(super) fn push_emcy(&mut self, emcy: Emcy, now: Instant) {
        if self.emcys.len() == EMCY_KEPT {
            self.emcys.pop_front();
        }
        self.emcys.push_back((now, emcy));
    }

    /// Notes a heartbeat or boot-up message; true if a lost heartbeat has come back.
    pub(super) fn note_heartbeat(&mut self, state: NmtState, now: Instant) -> bool {
        self.heartbeat_at = Some(now);
        let booted = state == NmtState::Initialising;
        if state != NmtState::Stopped {
            self.nmt_state_before = Some(state);
        }
        if booted {
            self.boot_up = Some((now, self.boot_up.map_or(1, |(_, count)| count.saturating_add(1))));
            self.nmt_sent = None;
            self.other_write = None;
            self.refuses_blocks = false;
        }
        let Some(watch) = &mut self.heartbeat_watch else { return false };
        // Boot-up does not arm the watch: the node may have lost its heartbeat time (CiA 301, 7.2.8.3.2.2). To be asked it needs none.
        watch.deadline = (!booted || watch.asked).then(|| now + watch.time);
        !booted && core::mem::take(&mut watch.lost)
    }

    /// The state that it must be in: by the last NMT command, or by what it has sent since, as a node of
    /// this model means it (as the standard says, if the model is not known); `None` where neither shows it.
    pub fn probable_state(&self, description: Option<&Description>) -> Option<NmtState> {
        let commanded = self.nmt_sent.and_then(|(at, command)| Some((at, state_after(command)?)));
        let said = self.nmt_state.and_then(|said| match description {
            // Such a heartbeat shows an alarm in place of the state, which is then that of the last command, or of before the alarm. A program
            // that has heard neither does not know it.
            Some(description) if description.tells_alarm(said) => {
                let before = self.nmt_state_before.map(|said| description.nmt_state(said));
                commanded.map(|(_, state)| state).or(before)
            }
            Some(description) => Some(description.nmt_state(said)),
            None if said == NmtState::Initialising => Some(NmtState::PreOperational),
            None => Some(said),
        });
        let since = commanded.filter(|(at, _)| self.heartbeat_at.is_none_or(|heard| heard < *at));
        since.map(|(_, state)| state).or(said)
    }

    /// True once when the watched heartbeat has not come in time.
    pub(super) fn check_heartbeat(&mut self, now: Instant) -> bool {
        let Some(watch) = &mut self.heartbeat_watch else { return false };
        if watch.deadline.is_none_or(|deadline| deadline > now) {
            return false;
        }
        watch.deadline = None;
        watch.lost = true;
        true
    }
}

/// The state that a command leads to; `None` for a reset, which the boot-up message reports.
const fn state_after(command: NmtCommand) -> Option<NmtState> {
    match command {
        NmtCommand::Start => Some(NmtState::Operational),
        NmtCommand::Stop => Some(NmtState::Stopped),
        NmtCommand::EnterPreOperational => Some(NmtState::PreOperational),
        NmtCommand::ResetNode | NmtCommand::ResetCommunication => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(at: u64) -> Instant {
        Instant::from_millis(at)
    }

    /// CiA 301, 7.2.8.3.2.2: monitoring begins with the first heartbeat.
    #[test]
    fn a_heartbeat_arms_the_watch_and_a_boot_up_message_does_not() {
        let watch = HeartbeatWatch { time: Duration::from_millis(100), asked: false, deadline: None, lost: false };
        let mut facts = NodeFacts { heartbeat_watch: Some(watch), ..NodeFacts::default() };
        assert!(!facts.note_heartbeat(NmtState::Initialising, ms(0)));
        assert!(!facts.check_heartbeat(ms(1000)), "it need not send any");
        assert!(!facts.note_heartbeat(NmtState::Operational, ms(1000)));
        assert!(!facts.check_heartbeat(ms(1099)));
        // One that boots may have lost its heartbeat time.
        assert!(!facts.note_heartbeat(NmtState::Initialising, ms(1099)));
        assert!(!facts.check_heartbeat(ms(5000)));
        facts.note_heartbeat(NmtState::PreOperational, ms(5000));
        assert!(facts.check_heartbeat(ms(5100)) && !facts.check_heartbeat(ms(6000)), "lost, once");
        assert!(facts.note_heartbeat(NmtState::PreOperational, ms(6000)), "it is back");
    }
}

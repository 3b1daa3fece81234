//! The way back of a capture: the drive's TPDOs, its NMT state and SYNC as they were, whatever ends it, with what was seen of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::Instant;
use canopen::{Mux, NmtCommand, NmtState, NodeId};
use devices::Description;
use master::parameters::roll_back;
use master::{Drive, Node};

use crate::network::params::journal::Kept;

/// Puts back what a capture has changed. A clone outlives a capture that is given up, for the caller that ends it; without one,
/// the journal stays on the disk, for `params rollback`.
#[derive(Clone, Debug)]
pub struct Restorer {
    node: Node,
    description: Option<&'static Description>,
    changed: Arc<Mutex<Changed>>,
}

#[derive(Debug, Default)]
pub(super) struct Changed {
    /// The writes that lead back, in their order.
    pub(super) undo: Vec<(Mux, Vec<u8>)>,
    /// Their copy on the disk.
    pub(super) journal: Option<Kept>,
    /// The node was not operational.
    pub(super) started: bool,
    /// Identifiers of the TPDOs that came, and the time between two of each.
    pub(super) sending: Option<(Vec<u16>, Duration)>,
    /// What was seen of its way back to pre-operational; `None` where it was not commanded.
    left_operational: Option<SeenBy>,
    /// SYNC is sent for the capture alone.
    pub(super) sync: bool,
}

/// By what a node was seen to be pre-operational again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeenBy {
    /// Its heartbeat has that state.
    Heartbeat,
    /// TPDOs that came until then have stopped.
    Silence,
    /// Nothing that it sends shows it.
    Nothing,
}

impl SeenBy {
    /// In a word, for programs.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::Silence => "silence",
            Self::Nothing => "nothing",
        }
    }

    /// In words, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Heartbeat => "by its heartbeat it is pre-operational again",
            Self::Silence => "commanded to be pre-operational again, it has stopped sending PDOs",
            Self::Nothing => "it was commanded to be pre-operational again, which nothing that it sends confirms",
        }
    }
}

/// How long a node may take to show that it is pre-operational.
const PATIENCE: Duration = Duration::from_secs(1);
/// How often is looked for that.
const LOOK: Duration = Duration::from_millis(10);
/// Frames that are kept between two looks: whether one came is what counts.
const FEW: usize = 8;

impl Restorer {
    /// Of a drive of which nothing has been changed yet.
    pub fn of(drive: &Drive) -> Self {
        Self { node: drive.node().clone(), description: drive.description(), changed: Arc::default() }
    }

    /// The node that it is of.
    pub const fn node(&self) -> NodeId {
        self.node.id()
    }

    /// True for a clone of this one.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.changed, &other.changed)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Changed> {
        self.changed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts everything back, and says what could not be. What is done is not done again.
    pub async fn restore(&self) -> Vec<String> {
        let (undo, started, sync) = {
            let changed = self.lock();
            (changed.undo.clone(), changed.started, changed.sync)
        };
        let mut left = Vec::new();
        // Before SYNC ends and the TPDOs are changed: that they stop shows what the command did.
        if started {
            left.extend(self.leave_operational().await.err());
        }
        if sync {
            self.node.network().sync(None);
            self.lock().sync = false;
        }
        if undo.is_empty() {
            return left;
        }
        let undone = roll_back(&self.node, &undo, |_| None).await;
        left.extend(undone.not_put_back.iter().map(|left| format!("{}: {}", left.object, left.why)));
        if undone.not_put_back.is_empty() {
            let journal = {
                let mut changed = self.lock();
                changed.undo.clear();
                changed.journal.take()
            };
            left.extend(journal.and_then(|journal| journal.remove().err()).map(|failure| failure.to_string()));
        }
        left
    }

    /// What was seen of the node's way back to pre-operational; `None` where it was not commanded to go there.
    pub fn left_operational(&self) -> Option<SeenBy> {
        self.lock().left_operational
    }

    /// Commands the node to be pre-operational, as it was, and looks whether it is.
    async fn leave_operational(&self) -> Result<(), String> {
        let network = self.node.network();
        let sending = self.lock().sending.clone();
        let log = sending.as_ref().map(|(ids, _)| network.log_frames(ids, FEW));
        self.node.nmt(NmtCommand::EnterPreOperational);
        let commanded = network.now();
        let (mut heard_at, mut frames) = (commanded, Vec::new());
        let seen = loop {
            network.sleep(LOOK).await;
            let (now, facts) = (network.now(), self.node.facts());
            if let Some(log) = &log {
                log.take(&mut frames);
                heard_at = frames.drain(..).map(|frame| frame.at).fold(heard_at, Instant::max);
            }
            let has_beaten = facts.heartbeat_at.is_some_and(|at| at > commanded);
            // The heartbeat of some models shows an alarm in place of the state.
            let shows_state =
                self.description.zip(facts.nmt_state).is_none_or(|(model, said)| !model.tells_alarm(said));
            let state = facts.probable_state(self.description);
            if has_beaten && shows_state && state == Some(NmtState::PreOperational) {
                break Ok(SeenBy::Heartbeat);
            }
            let quiet = sending.as_ref().is_some_and(|(_, period)| now - heard_at > *period * 2 + LOOK);
            // A heartbeat says more than silence does: it is waited for where there is one.
            let booted_at = facts.boot_up.map(|(at, _)| at);
            let waits = facts.heartbeat_at > booted_at && now - commanded < PATIENCE;
            match (quiet, &sending) {
                (true, _) if !waits => break Ok(SeenBy::Silence),
                (_, None) if !waits => break Ok(SeenBy::Nothing),
                _ if now - commanded > PATIENCE * 2 => break Err("NMT state: it still sends PDOs".to_owned()),
                _ => {}
            }
        };
        let mut changed = self.lock();
        changed.started = seen.is_err();
        changed.left_operational = seen.as_ref().ok().copied();
        seen.map(drop)
    }
}

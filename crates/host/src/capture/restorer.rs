//! The way back of a capture, a test motion or a tuning, whatever ends it: the shaft at rest, SYNC, the drive's NMT state and what was
//! written to it as they were, with what was seen of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use canopen::pdo::PdoId;
use canopen::{Mux, NodeId};
use master::parameters::{Undone, roll_back};
use master::{Drive, Node};

use crate::network::params::journal::Kept;
use crate::network::params::pre_operational::{SeenBy, leave_operational};
use crate::stopping::bring_to_rest;
use words::failure::Failure;

/// Puts back what a capture, a test motion or a tuning has changed. A clone outlives one that is given up, for the caller that ends it;
/// without one, the journal stays on the disk, for `params rollback`.
#[derive(Clone, Debug)]
pub struct Restorer {
    drive: Drive,
    changed: Arc<Mutex<Changed>>,
}

#[derive(Debug, Default)]
pub(super) struct Changed {
    /// What is being moved.
    motion: Option<Moving>,
    /// What was written, the oldest first.
    written: Vec<WrittenObjects>,
    /// The node was not operational.
    pub(super) started: bool,
    /// Identifiers of the TPDOs that came, and the time between two of each.
    pub(super) sending: Option<(Vec<u16>, Duration)>,
    /// What was seen of its way back to pre-operational; `None` where it was not commanded.
    left_operational: Option<SeenBy>,
    /// SYNC is sent for the capture alone.
    pub(super) sync: bool,
}

/// A shaft that may be in motion.
#[derive(Clone, Copy, Debug)]
struct Moving {
    /// SYNC is sent for it.
    in_cycles: bool,
    /// The program had its guard before.
    was_guarded: bool,
}

/// Objects that were written together.
#[derive(Debug)]
struct WrittenObjects {
    /// The writes that lead back, in their order.
    undo: Arc<[(Mux, Vec<u8>)]>,
    /// Their copy on the disk.
    journal: Option<Kept>,
    /// Of PDOs whose mapping is among them, those that this program received or sent.
    used: Arc<[PdoId]>,
    /// PDOs that a group or a base had taken for its cycles: what it puts back, when it ends, is what they had before either.
    of_group: Arc<[PdoId]>,
}

impl Restorer {
    /// Of a drive of which nothing has been changed yet.
    pub fn of(drive: &Drive) -> Self {
        Self { drive: drive.clone(), changed: Arc::default() }
    }

    const fn node(&self) -> &Node {
        self.drive.node()
    }

    /// The node-ID of its drive.
    pub const fn id(&self) -> NodeId {
        self.node().id()
    }

    /// True for a clone of this one.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.changed, &other.changed)
    }

    /// True where nothing is to be put back.
    pub fn is_done(&self) -> bool {
        let Changed { motion, written, started, sync, .. } = &*self.lock();
        motion.is_none() && written.is_empty() && !started && !sync
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Changed> {
        self.changed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The drive is going to be moved, by set-points in cycles of an own SYNC or by its own ramps. Called before a guard of the motion's
    /// own begins: the way back ends that.
    pub fn begin_motion(&self, in_cycles: bool) {
        let was_guarded = self.node().network().guarded(self.node().id()).is_some();
        self.lock().motion.get_or_insert(Moving { in_cycles, was_guarded });
    }

    /// The motion was ended by its own means; of one that was not seen to stand, or whose guard is still armed, the way back stays.
    pub(crate) fn end_motion(&self) {
        let (network, id) = (self.node().network(), self.node().id());
        let (moves, is_guarded) = (network.moved().contains(id), network.guarded(id).is_some());
        self.lock().motion.take_if(|motion| !moves && (motion.was_guarded || !is_guarded));
    }

    /// Objects are going to be written, and these writes lead back.
    pub(crate) fn note_written(&self, undo: Vec<(Mux, Vec<u8>)>, journal: Option<Kept>) {
        let pdos = undo.iter().filter_map(|(mux, _)| PdoId::of_object(mux.index)).collect::<Vec<_>>();
        let mapped = pdos.iter().filter(|(_, is_mapping)| *is_mapping).map(|(pdo, _)| *pdo);
        let mut used: Vec<_> = mapped.filter(|pdo| self.node().uses_pdo(*pdo)).collect();
        used.dedup();
        let pdos = pdos.into_iter().map(|(pdo, _)| pdo);
        let of_group = pdos.filter(|pdo| self.node().is_to_put_back(*pdo)).collect();
        self.lock().written.push(WrittenObjects { undo: undo.into(), journal, used: used.into(), of_group });
    }

    /// What was written last stays.
    ///
    /// # Errors
    /// Its journal cannot be deleted.
    pub(crate) fn keep_newest(&self) -> Result<(), Failure> {
        let newest = self.lock().written.pop();
        newest.and_then(|newest| newest.journal).map_or(Ok(()), Kept::remove)
    }

    /// Puts back what was written last. Its journal stays where not all of it could be.
    ///
    /// # Errors
    /// The journal cannot be deleted.
    pub(crate) async fn put_back_newest(&self) -> Result<Undone, Failure> {
        let newest = self.lock().written.len().saturating_sub(1);
        let (undone, deleted) = self.put_back(newest).await;
        deleted.map(|()| undone)
    }

    /// Puts back what was written as the one with this index, and whether its journal could be deleted.
    async fn put_back(&self, at: usize) -> (Undone, Result<(), Failure>) {
        // It stays noted until it is done: this may be given up on the way.
        let found = self
            .lock()
            .written
            .get(at)
            .map(|written| (Arc::clone(&written.undo), Arc::clone(&written.used), Arc::clone(&written.of_group)));
        let Some((undo, used, of_group)) = found else {
            return (Undone::default(), Ok(()));
        };
        // Of a group that has ended meanwhile.
        let is_back = |pdo: &PdoId| of_group.contains(pdo) && !self.node().is_to_put_back(*pdo);
        let is_left = |(mux, _): &&(Mux, Vec<u8>)| PdoId::of_object(mux.index).is_none_or(|(pdo, _)| !is_back(&pdo));
        let writes: Vec<_> = undo.iter().filter(is_left).cloned().collect();
        let undone = roll_back(self.node(), &writes, |_| None).await;
        if !undone.not_put_back.is_empty() {
            return (undone, Ok(()));
        }
        used.iter().filter(|pdo| !is_back(pdo)).for_each(|pdo| self.node().resume_pdo(*pdo));
        // A clone may have done the same meanwhile.
        let done = self.lock().written.extract_if(.., |written| Arc::ptr_eq(&written.undo, &undo)).next();
        (undone, done.and_then(|done| done.journal).map_or(Ok(()), Kept::remove))
    }

    /// Puts back all that was written, the newest first: what could not be, in words, and why journals of what was could not be deleted.
    /// One that fails keeps none of the others from being tried.
    pub(crate) async fn put_back_written(&self) -> (Vec<String>, Vec<Failure>) {
        let (mut left, mut undeleted) = (Vec::new(), Vec::new());
        let count = self.lock().written.len();
        for at in (0..count).rev() {
            let (undone, deleted) = self.put_back(at).await;
            left.extend(undone.not_put_back.iter().map(|left| format!("{}: {}", left.object, left.why)));
            undeleted.extend(deleted.err());
        }
        (left, undeleted)
    }

    /// Stops what is being moved, if it still is, and puts everything back; says what could not be. What is done is not done again.
    pub async fn restore(&self) -> Vec<String> {
        let motion = self.lock().motion;
        let mut left = Vec::new();
        if let Some(motion) = motion {
            left.extend(self.come_to_rest(motion).await);
        }
        left.extend(self.restore_parameters().await);
        left
    }

    /// [`Self::restore`], where what could not be put back is a failure.
    ///
    /// # Errors
    /// `not_put_back` with what was not, and why.
    pub(crate) async fn restored(&self) -> Result<(), Failure> {
        let left = self.restore().await;
        not_put_back(self.id(), &left).map_or(Ok(()), |failure| Err(with_left(failure, &left)))
    }

    /// The drive stands without power, and nothing is sent for its motion any more; why that was not seen.
    async fn come_to_rest(&self, motion: Moving) -> Vec<String> {
        let (network, id) = (self.node().network(), self.node().id());
        if motion.in_cycles {
            network.sync(None);
        }
        let stood = bring_to_rest(&self.drive).await;
        let released = match motion.was_guarded {
            true => network.put_back([id].into_iter().collect()).await,
            // One that was not seen to stand is left to its own watch: it is among those in motion.
            false => network.release_guards([id].into_iter().collect()).await,
        };
        if stood.is_ok() {
            self.lock().motion = None;
        }
        let stood = stood.err().map(|failure| failure.to_string());
        stood.into_iter().chain(released.err().map(|error| error.to_string())).collect()
    }

    /// What was written and commanded, without the motion.
    pub(super) async fn restore_parameters(&self) -> Vec<String> {
        let (started, sync, is_moved) = {
            let changed = self.lock();
            (changed.started, changed.sync, changed.motion.is_some())
        };
        let mut left = Vec::new();
        // Before SYNC ends and the TPDOs are changed: that they stop shows what the command did.
        if started && is_moved && self.node().network().moved().contains(self.node().id()) {
            // What it does about the loss of its PDOs is not known. A motion of others may go on: the node was not operational before.
            left.push("NMT state: it is moving, and was left operational".to_owned());
        } else if started {
            left.extend(self.leave_operational().await.err());
        }
        if sync {
            self.node().network().sync(None);
            self.lock().sync = false;
        }
        let (written, undeleted) = self.put_back_written().await;
        left.extend(written.into_iter().chain(undeleted.iter().map(Failure::to_string)));
        left
    }

    /// What was seen of the node's way back to pre-operational; `None` where it was not commanded to go there.
    pub fn left_operational(&self) -> Option<SeenBy> {
        self.lock().left_operational
    }

    /// Commands the node to be pre-operational, as it was, and looks whether it is.
    async fn leave_operational(&self) -> Result<(), String> {
        let sending = self.lock().sending.clone();
        let seen = leave_operational(&self.drive, sending.as_ref()).await;
        let mut changed = self.lock();
        changed.started = seen.is_err();
        changed.left_operational = seen.as_ref().ok().copied();
        seen.map(drop)
    }
}

/// That not everything of a node was put back; `None` if nothing is left. How to do it later is for its caller to say.
pub fn not_put_back(node: NodeId, left: &[String]) -> Option<Failure> {
    let failure = || Failure::new(format!("node {node}: not everything was put back"));
    (!left.is_empty()).then(|| failure().of_kind("not_put_back").at_node(node))
}

/// A failure, with what could not be put back after it.
pub fn with_left(failure: Failure, left: &[String]) -> Failure {
    left.iter().fold(failure, |failure, left| failure.because(format!("not put back: {left}")))
}

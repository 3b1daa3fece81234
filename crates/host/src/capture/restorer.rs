//! The way back of a capture: the drive's TPDOs, its NMT state and SYNC as they were, whatever ends it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use canopen::{Mux, NmtCommand};
use master::parameters::roll_back;
use master::{Drive, Node};

use crate::network::params::journal::Kept;

/// Puts back what a capture has changed. A clone outlives a capture that is given up, for the caller that ends it; without one,
/// the journal stays on the disk, for `params rollback`.
#[derive(Clone, Debug)]
pub struct Restorer {
    node: Node,
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
    /// SYNC is sent for the capture alone.
    pub(super) sync: bool,
}

impl Restorer {
    /// Of a drive of which nothing has been changed yet.
    pub fn of(drive: &Drive) -> Self {
        Self { node: drive.node().clone(), changed: Arc::default() }
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
        if sync {
            self.node.network().sync(None);
            self.lock().sync = false;
        }
        if started {
            self.node.nmt(NmtCommand::EnterPreOperational);
            self.lock().started = false;
        }
        if undo.is_empty() {
            return Vec::new();
        }
        let undone = roll_back(&self.node, &undo, |_| None).await;
        let mut left: Vec<String> =
            undone.not_put_back.iter().map(|left| format!("{}: {}", left.object, left.why)).collect();
        if left.is_empty() {
            let journal = {
                let mut changed = self.lock();
                changed.undo.clear();
                changed.journal.take()
            };
            left.extend(journal.and_then(|journal| journal.remove().err()).map(|failure| failure.to_string()));
        }
        left
    }
}

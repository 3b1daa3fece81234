//! The way back: what each object had before a case wrote it, and the NMT state in which the node was found.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use canopen::{Mux, NmtCommand, NmtState};
use master::Node;
use master::parameters::{in_order, roll_back};

use crate::subject::Subject;

/// How long an NMT command takes to get to the node and to act.
pub(crate) const SETTLING: Duration = Duration::from_millis(60);

/// Looks at a node that starts, each as long as an answer is waited for.
const BOOT_LOOKS: usize = 10;

/// Puts back what a case has touched. A clone outlives a run that is given up, for the caller that ends it.
#[derive(Clone, Debug)]
pub struct Restorer {
    node: Node,
    subject: Subject,
    journal: Arc<Mutex<Journal>>,
}

#[derive(Debug, Default)]
struct Journal {
    /// What each write found, oldest first.
    undo: Vec<(Mux, Vec<u8>)>,
    /// What all parameters were before the node was first reset.
    parameters: Option<BTreeMap<Mux, Vec<u8>>>,
    was_reset: bool,
    found: Option<NmtState>,
    commanded: bool,
}

impl Restorer {
    pub(super) fn new(node: Node, subject: Subject) -> Self {
        Self { node, subject, journal: Arc::default() }
    }

    /// Notes what an object has before it is written.
    pub(super) fn touch(&self, mux: Mux, before: Vec<u8>) {
        self.lock().undo.push((mux, before));
    }

    /// The write was refused.
    pub(super) fn untouch(&self, mux: Mux) {
        let mut journal = self.lock();
        if journal.undo.last().is_some_and(|(last, _)| *last == mux) {
            journal.undo.pop();
        }
    }

    /// The state in which the node was found.
    pub(crate) fn set_found(&self, state: NmtState) {
        self.lock().found = Some(state);
    }

    pub(crate) fn note_commanded(&self) {
        self.lock().commanded = true;
    }

    /// Reads what a reset may change, once in a run.
    pub(super) async fn prepare_reset(&self) {
        if self.lock().parameters.is_none() {
            let mut parameters = self.read_parameters().await;
            let mut journal = self.lock();
            // The case has changed some already: the oldest value is the one that was found.
            for (mux, before) in journal.undo.iter().rev() {
                if let Some(value) = parameters.get_mut(mux) {
                    value.clone_from(before);
                }
            }
            journal.parameters = Some(parameters);
        }
        let mut journal = self.lock();
        (journal.was_reset, journal.commanded) = (true, true);
        // A reset forgets what was written and not stored: the parameters as a whole lead back.
        let parameters = journal.parameters.clone().unwrap_or_default();
        journal.undo.retain(|(mux, _)| !parameters.contains_key(mux));
    }

    /// Puts everything back; what could not be.
    pub async fn restore(&self) -> Vec<String> {
        // Forgotten only when all is done: this too may be given up, and is then begun anew.
        let (parameters, was_reset, commanded) = {
            let journal = self.lock();
            (journal.parameters.clone(), journal.was_reset, journal.commanded)
        };
        if was_reset {
            self.wait_for_answer().await;
        }
        if commanded {
            // SDO is not answered in the stopped state.
            self.command(NmtCommand::EnterPreOperational).await;
        }
        let mut left = self.undo().await;
        if let Some(wanted) = parameters.filter(|_| was_reset) {
            let current = self.read_parameters().await;
            for step in in_order(Some(self.subject.description), &current, &wanted, false) {
                if let Err(error) = self.node.download(step.object, &step.value).await
                    && !self.is_unused(step.object).await
                {
                    left.push(format!("{}: {error}", step.object));
                }
            }
        }
        if commanded {
            let back = match self.lock().found {
                Some(NmtState::Operational) => NmtCommand::Start,
                Some(NmtState::Stopped) => NmtCommand::Stop,
                _ => NmtCommand::EnterPreOperational,
            };
            self.command(back).await;
        }
        let mut journal = self.lock();
        (journal.was_reset, journal.commanded) = (false, false);
        left
    }

    /// All parameters of a node that has just started: those that its memory has.
    pub(crate) async fn stored(&self) -> BTreeMap<Mux, Vec<u8>> {
        self.read_parameters().await
    }

    /// Writes these where they differ, to be saved.
    ///
    /// # Errors
    /// What is not taken, in words.
    pub(crate) async fn store(&self, wanted: &BTreeMap<Mux, Vec<u8>>) -> Result<(), String> {
        let current = self.read_parameters().await;
        for step in in_order(Some(self.subject.description), &current, wanted, false) {
            if let Err(error) = self.node.download(step.object, &step.value).await {
                return Err(format!("{} does not take again what was stored: {error}", step.object));
            }
        }
        Ok(())
    }

    /// A node that was reset may still be starting.
    async fn wait_for_answer(&self) {
        for _ in 0..BOOT_LOOKS {
            if self.node.upload(Mux::new(0x1000, 0)).await.is_ok() {
                return;
            }
        }
    }

    /// Puts back what was written; what could not be.
    pub(super) async fn undo(&self) -> Vec<String> {
        let undo: Vec<_> = self.lock().undo.iter().rev().cloned().collect();
        if undo.is_empty() {
            return Vec::new();
        }
        let undone = roll_back(&self.node, &undo, |_| None).await;
        self.lock().undo.clear();
        let mut left = Vec::new();
        for object in undone.not_put_back {
            if !self.is_unused(object.object).await {
                left.push(format!("{}: {}", object.object, object.why));
            }
        }
        left
    }

    /// An entry of a mapping beyond those that count: devices that check entries do not take back a 0.
    async fn is_unused(&self, mux: Mux) -> bool {
        let is_entry = matches!(mux.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF) && mux.sub_index > 0;
        is_entry && self.node.read::<u8>(Mux::new(mux.index, 0)).await.is_ok_and(|count| count < mux.sub_index)
    }

    async fn command(&self, command: NmtCommand) {
        self.node.nmt(command);
        self.node.network().sleep(SETTLING).await;
    }

    async fn read_parameters(&self) -> BTreeMap<Mux, Vec<u8>> {
        let mut found = BTreeMap::new();
        for row in self.subject.rows().filter(|row| self.subject.is_setting(row)) {
            if let Ok(value) = self.node.upload(row.mux()).await {
                found.insert(row.mux(), value.as_bytes().to_vec());
            }
        }
        found
    }

    fn lock(&self) -> MutexGuard<'_, Journal> {
        // Nothing is half done between two notes.
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

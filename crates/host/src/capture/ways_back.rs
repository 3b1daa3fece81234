//! What is to be put back of the captures, test motions and tunings that go on in a program, whatever ends it.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use master::Drive;

use super::Restorer;

/// The ways back of what is going on in a network, for what ends it. A clone is the same list.
#[derive(Clone, Debug, Default)]
pub struct WaysBack(Arc<Mutex<Vec<Restorer>>>);

/// That of one job, which its network has too until the job has ended: it may be closed meanwhile.
#[derive(Clone, Debug)]
pub struct WayBack {
    own: Arc<OnceLock<Restorer>>,
    of_network: WaysBack,
}

impl WaysBack {
    fn lock(&self) -> MutexGuard<'_, Vec<Restorer>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Nothing is to be put back.
    pub fn is_empty(&self) -> bool {
        self.lock().is_empty()
    }

    /// Puts everything back; what could not be, in words.
    pub async fn restore(&self) -> Vec<String> {
        // They are in the list until they are done: this may be given up on the way, and is begun anew then.
        let restorers = self.lock().clone();
        let mut left = Vec::new();
        // The newest first: it may have been begun on what an older one changed.
        for restorer in restorers.into_iter().rev() {
            let node = restorer.id();
            left.extend(restorer.restore().await.iter().map(|left| format!("node {node}: not put back: {left}")));
        }
        self.lock().retain(|restorer| !restorer.is_done());
        left
    }
}

impl WayBack {
    /// Of a job in this network, which has changed nothing yet.
    pub fn in_network(of_network: &WaysBack) -> Self {
        Self { own: Arc::default(), of_network: of_network.clone() }
    }

    /// This drive is going to be changed. A job changes one.
    pub fn of(&self, drive: &Drive) -> &Restorer {
        self.own.get_or_init(|| {
            let restorer = Restorer::of(drive);
            self.of_network.lock().push(restorer.clone());
            restorer
        })
    }

    /// The job was given up: stops what it moves, and puts back what it has changed. What could not be put back stays with the network.
    pub async fn restore(&self) {
        let Some(own) = self.own.get() else { return };
        own.restore().await;
        self.remove_if_done();
    }

    /// The job was ended. What it could not put back stays with the network, which tries once more when it is closed.
    pub(crate) fn remove_if_done(&self) {
        if self.own.get().is_some_and(Restorer::is_done) {
            self.remove();
        }
    }

    /// The job has ended by itself: it has tried to put everything back, and what is left is in what it reports.
    pub fn remove(&self) {
        let Some(own) = self.own.get() else { return };
        self.of_network.lock().retain(|other| !other.is_same(own));
    }
}

//! What is to be put back of the captures that go on in a network.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use canopen::NodeId;
use host::capture::Restorer;
use master::Network;

/// The ways back of what is going on in a network, for what ends it.
#[derive(Clone, Default)]
pub(crate) struct WaysBack(Arc<Mutex<Vec<Restorer>>>, Arc<Mutex<Option<(Network, NodeId)>>>);

impl WaysBack {
    fn lock(&self) -> MutexGuard<'_, Vec<Restorer>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// This node is going to be moved: what is given up stops it first.
    pub(crate) fn stop_first(&self, network: Network, node: NodeId) {
        *self.1.lock().unwrap_or_else(PoisonError::into_inner) = Some((network, node));
    }

    /// Something is going to be changed.
    pub(crate) fn add(&self, restorer: Restorer) {
        self.lock().push(restorer);
    }

    /// What it led back from is as it was.
    pub(crate) fn remove(&self, restorer: &Restorer) {
        self.lock().retain(|other| !other.is_same(restorer));
    }

    /// Puts everything back; what could not be, in words.
    pub(crate) async fn restore(&self) -> Vec<String> {
        let moved = self.1.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some((network, node)) = moved.filter(|(network, node)| network.moved().contains(*node)) {
            network.stop_moved([node].into_iter().collect()).await;
        }
        let restorers = std::mem::take(&mut *self.lock());
        let mut left = Vec::new();
        for restorer in restorers {
            let node = restorer.node();
            left.extend(restorer.restore().await.iter().map(|left| format!("node {node}: not put back: {left}")));
        }
        left
    }
}

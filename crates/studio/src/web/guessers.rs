//! What a wrong password costs: the address that it came from waits. Nobody else does.

use std::collections::BTreeSet;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long an address waits for the answer to a wrong password; what else comes from there meanwhile is not looked at.
const PENALTY: Duration = Duration::from_secs(1);

/// Addresses that may wait: more than a network of a machine's own has.
const MOST: usize = 1024;

/// Addresses that wait.
#[derive(Debug, Default)]
pub(super) struct Guessers(Mutex<BTreeSet<IpAddr>>);

impl Guessers {
    /// Nothing from there is looked at now.
    pub(super) fn has(&self, from: IpAddr) -> bool {
        let guessers = self.lock();
        guessers.contains(&from) || guessers.len() >= MOST
    }

    /// Waits for what a wrong password costs.
    pub(super) async fn pay(self: Arc<Self>, from: IpAddr) {
        self.lock().insert(from);
        // Who hangs up waits all the same.
        let paid = tokio::spawn(async move {
            tokio::time::sleep(PENALTY).await;
            self.lock().remove(&from);
        });
        let _ = paid.await;
    }

    fn lock(&self) -> MutexGuard<'_, BTreeSet<IpAddr>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

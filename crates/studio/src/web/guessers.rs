//! The price of a wrong password: its address has to wait, and no other.

use std::collections::BTreeSet;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long an address waits for the answer to a wrong password; other passwords from there are refused unchecked meanwhile.
const PENALTY: Duration = Duration::from_secs(1);

/// Addresses that may wait: more than the private network of a machine has.
const MOST: usize = 1024;

/// Addresses that wait.
#[derive(Debug, Default)]
pub(super) struct Guessers(Mutex<BTreeSet<IpAddr>>);

impl Guessers {
    /// Passwords from there are not checked now.
    pub(super) fn has(&self, from: IpAddr) -> bool {
        let guessers = self.lock();
        guessers.contains(&from) || guessers.len() >= MOST
    }

    /// Waits the time that a wrong password costs.
    pub(super) async fn pay(self: Arc<Self>, from: IpAddr) {
        self.lock().insert(from);
        // Closing the connection does not shorten the wait.
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

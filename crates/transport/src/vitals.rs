//! What a server sees of its clients without asking them, and which of them makes room for a further one: servers take a limited
//! number of clients, and one that matters takes the place of one that does not.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use can::Instant;

/// Of one client; shared between the task that serves it and the owner of the places.
#[derive(Debug)]
pub struct Vitals {
    engaged: AtomicBool,
    /// When it last said something, in ns of the server's clock.
    spoke_at: AtomicU64,
}

impl Vitals {
    /// Of a client that connected at `now`.
    pub const fn new(now: Instant) -> Self {
        Self { engaged: AtomicBool::new(false), spoke_at: AtomicU64::new(now.as_nanos()) }
    }

    /// Of one that is engaged and never makes room for another.
    pub const fn of_a_bus() -> Self {
        Self { engaged: AtomicBool::new(true), spoke_at: AtomicU64::new(u64::MAX) }
    }

    /// It said something at `now`.
    pub fn spoke(&self, now: Instant) {
        self.spoke_at.store(now.as_nanos(), Ordering::Relaxed);
    }

    /// It has something to lose, or no longer: it listens to a bus, it has moved a drive.
    pub fn set_engaged(&self, engaged: bool) {
        self.engaged.store(engaged, Ordering::Relaxed);
    }

    /// It has something to lose.
    pub fn is_engaged(&self) -> bool {
        self.engaged.load(Ordering::Relaxed)
    }

    /// Which of these makes room: of those that are not engaged, or else of all, the one that has been silent for the longest.
    pub fn least<'a>(all: impl IntoIterator<Item = &'a Self>) -> Option<usize> {
        let rank = |vitals: &Self| (vitals.is_engaged(), vitals.spoke_at.load(Ordering::Relaxed));
        all.into_iter().map(rank).enumerate().min_by_key(|(_, rank)| *rank).map(|(place, _)| place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_not_engaged_makes_room_first_and_then_who_was_silent_longest() {
        let clients = [3, 1, 2].map(|second| Vitals::new(Instant::from_secs(second)));
        assert_eq!(Vitals::least(&clients), Some(1));
        clients[1].set_engaged(true);
        assert_eq!(Vitals::least(&clients), Some(2));
        clients[2].spoke(Instant::from_secs(4));
        assert_eq!(Vitals::least(&clients), Some(0));
        clients.iter().for_each(|client| client.set_engaged(true));
        assert_eq!(Vitals::least(&clients), Some(1));
        assert_eq!(Vitals::least([&Vitals::of_a_bus(), &clients[2]]), Some(1));
        assert_eq!(Vitals::least([]), None);
    }
}

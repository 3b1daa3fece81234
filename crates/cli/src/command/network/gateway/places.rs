//! The places of the gateway: a further client is always accepted, and if need be another makes room for it.

use std::net::SocketAddr;
use std::sync::Arc;

use can::Instant;
use tokio::sync::oneshot;
use transport::Vitals;

/// Clients at once.
pub(super) const MAX_CLIENTS: usize = 32;

/// Who is connected.
#[derive(Debug, Default)]
pub(super) struct Places(Vec<Client>);

#[derive(Debug)]
struct Client {
    peer: SocketAddr,
    vitals: Arc<Vitals>,
    /// Dropped, it ends the client's task, which stops what the client has moved.
    stay: oneshot::Sender<()>,
}

/// A client's own end of its place.
#[derive(Debug)]
pub(super) struct ClientPlace {
    pub(super) vitals: Arc<Vitals>,
    /// Ends when another needs the place.
    pub(super) stay: oneshot::Receiver<()>,
}

impl Places {
    /// A place for a client that comes at `now`, and the client that had to make room for it.
    pub(super) fn take(&mut self, peer: SocketAddr, now: Instant) -> (ClientPlace, Option<SocketAddr>) {
        self.0.retain(|client| !client.stay.is_closed());
        let least = Vitals::least(self.0.iter().map(|client| &*client.vitals));
        let displaced = least.filter(|_| self.0.len() >= MAX_CLIENTS).map(|place| self.0.remove(place).peer);
        let vitals = Arc::new(Vitals::new(now));
        let (stay, stays) = oneshot::channel();
        self.0.push(Client { peer, vitals: Arc::clone(&vitals), stay });
        (ClientPlace { vitals, stay: stays }, displaced)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(port: usize) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], u16::try_from(port).unwrap()))
    }

    #[test]
    fn the_client_that_has_moved_nothing_and_was_silent_longest_makes_room() {
        let mut places = Places::default();
        let mut here: Vec<ClientPlace> = (0..MAX_CLIENTS)
            .map(|number| {
                let (place, displaced) = places.take(peer(number), Instant::from_secs(number as u64));
                assert_eq!(displaced, None, "client {number}");
                place
            })
            .collect();
        // The first has moved a drive, the second has spoken since: the third is the one.
        here[0].vitals.set_engaged(true);
        here[1].vitals.spoke(Instant::from_secs(100));
        let (last, displaced) = places.take(peer(99), Instant::from_secs(101));
        assert_eq!(displaced, Some(peer(2)));
        assert!(here[2].stay.try_recv() == Err(oneshot::error::TryRecvError::Closed));
        assert!(here[0].stay.try_recv() == Err(oneshot::error::TryRecvError::Empty));
        // Whose connection has ended leaves a place free.
        drop(last);
        assert_eq!(places.take(peer(100), Instant::from_secs(102)).1, None);
    }
}

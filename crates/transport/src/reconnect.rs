//! A bus whose connection is made again when it is lost: a server that is restarted, an adapter that is unplugged and back.
//!
//! The bus says [`Note::ConnectionLost`] once, tries again and again, and says [`Note::ConnectionBack`]. In between frames that are
//! sent are lost, as those of a controller without a cable: stations keep their deadlines, and what waits for an answer ends with
//! its own timeout. Opening for the first time fails at once, because then the user is there to mend it.

use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use can::{Frame, Instant};

use crate::{AsyncBus, BusError, Note, Received, WallClock};

/// Between two attempts. A USB adapter needs about a second to be there again, a server about as long to start.
const PAUSE: Duration = Duration::from_millis(200);

/// A bus that can be opened more than once.
pub(crate) trait Reopen: AsyncBus + Sized + Send + 'static {
    /// All that it takes to open it.
    type Place: Clone + fmt::Debug + Send + Sync + 'static;

    /// Opens it, and brings it to where frames come and go.
    fn open(place: Self::Place, clock: WallClock) -> impl Future<Output = Result<Self, BusError>> + Send;
}

/// See the [module](self).
pub(crate) struct Reconnecting<B: Reopen> {
    place: B::Place,
    clock: WallClock,
    connection: Connection<B>,
}

enum Connection<B> {
    Up(B),
    /// Lost for this reason, which has not been reported yet.
    Lost(String),
    Opening(Pin<Box<dyn Future<Output = B> + Send>>),
}

impl<B: Reopen> Reconnecting<B> {
    /// Opens `place` for the first time.
    pub(crate) async fn open(place: B::Place, clock: &WallClock) -> Result<Self, BusError> {
        let bus = B::open(place.clone(), clock.clone()).await?;
        Ok(Self { place, clock: clock.clone(), connection: Connection::Up(bus) })
    }

    /// The bus, if it is there now.
    pub(crate) fn into_inner(self) -> Option<B> {
        match self.connection {
            Connection::Up(bus) => Some(bus),
            Connection::Lost(_) | Connection::Opening(_) => None,
        }
    }

    fn reopen(&self) -> Pin<Box<dyn Future<Output = B> + Send>> {
        let (place, clock) = (self.place.clone(), self.clock.clone());
        Box::pin(async move {
            loop {
                clock.sleep(PAUSE).await;
                if let Ok(bus) = B::open(place.clone(), clock.clone()).await {
                    return bus;
                }
            }
        })
    }

    /// Passes errors on that a new connection does not mend.
    fn lose(&mut self, error: BusError) -> Result<(), BusError> {
        if !error.is_loss_of_connection() {
            return Err(error);
        }
        let cause = std::error::Error::source(&error).map(|cause| format!(": {cause}")).unwrap_or_default();
        self.connection = Connection::Lost(format!("{error}{cause}"));
        Ok(())
    }
}

impl<B: Reopen> AsyncBus for Reconnecting<B> {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let Connection::Up(bus) = &mut self.connection else { return Ok(()) };
        match bus.send(frame).await {
            Ok(()) => Ok(()),
            Err(error) => self.lose(error),
        }
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            match &mut self.connection {
                Connection::Up(bus) => match bus.recv().await {
                    Ok(received) => return Ok(received),
                    Err(error) => self.lose(error)?,
                },
                Connection::Lost(reason) => {
                    let reason = std::mem::take(reason);
                    self.connection = Connection::Opening(self.reopen());
                    return Ok((self.clock.now(), Note::ConnectionLost { reason }.into()));
                }
                Connection::Opening(opening) => {
                    let bus = opening.await;
                    self.connection = Connection::Up(bus);
                    return Ok((self.clock.now(), Note::ConnectionBack.into()));
                }
            }
        }
    }
}

impl<B: Reopen> fmt::Debug for Reconnecting<B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reconnecting").field("place", &self.place).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::io;
    use std::sync::{Arc, Mutex};

    use super::*;

    /// What the next connections do; each `None` is one that does not come about.
    type Fate = Arc<Mutex<VecDeque<Option<Script>>>>;

    /// What one connection receives before it ends with the error of this kind, and what was sent on it.
    #[derive(Debug, Default)]
    struct Script {
        frames: VecDeque<Frame>,
        end: Option<BusError>,
        sent: Arc<Mutex<Vec<Frame>>>,
    }

    struct Scripted {
        script: Script,
        clock: WallClock,
    }

    impl Reopen for Scripted {
        type Place = Fate;

        async fn open(place: Fate, clock: WallClock) -> Result<Self, BusError> {
            let script = place.lock().unwrap().pop_front().flatten();
            let refused = BusError::Connect { address: "peer".into(), source: io::ErrorKind::ConnectionRefused.into() };
            script.map(|script| Self { script, clock }).ok_or(refused)
        }
    }

    impl AsyncBus for Scripted {
        async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
            self.script.sent.lock().unwrap().push(*frame);
            Ok(())
        }

        async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
            match (self.script.frames.pop_front(), self.script.end.take()) {
                (Some(frame), end) => {
                    self.script.end = end;
                    Ok((self.clock.now(), frame.into()))
                }
                (None, Some(end)) => Err(end),
                (None, None) => std::future::pending().await,
            }
        }
    }

    fn frame(text: &str) -> Frame {
        text.parse().unwrap()
    }

    fn closed() -> Option<BusError> {
        Some(BusError::Closed { address: "peer".into() })
    }

    #[tokio::test]
    async fn a_lost_connection_is_reported_once_made_again_and_reported() {
        let sent = Arc::new(Mutex::new(Vec::new()));
        let first = Script { frames: [frame("181#01")].into(), end: closed(), ..Script::default() };
        let second = Script { frames: [frame("181#02")].into(), sent: Arc::clone(&sent), ..Script::default() };
        let fate: Fate = Arc::new(Mutex::new([Some(first), None, None, Some(second)].into()));
        let clock = WallClock::start();
        let mut bus = Reconnecting::<Scripted>::open(fate, &clock).await.unwrap();
        assert_eq!(bus.recv().await.unwrap().1, frame("181#01").into());
        let (_, Received::Note(lost)) = bus.recv().await.unwrap() else { panic!("a frame without a sender") };
        assert_eq!(lost.to_string(), "the connection to the bus is lost: peer closed the connection");
        bus.send(&frame("601#AA")).await.unwrap(); // is lost, and does not block
        assert_eq!(bus.recv().await.unwrap().1, Note::ConnectionBack.into());
        bus.send(&frame("601#BB")).await.unwrap();
        assert_eq!(bus.recv().await.unwrap().1, frame("181#02").into());
        assert_eq!(*sent.lock().unwrap(), [frame("601#BB")]);
    }

    #[tokio::test]
    async fn an_attempt_goes_on_where_its_waiter_was_dropped() {
        let first = Script { end: closed(), ..Script::default() };
        let fate: Fate = Arc::new(Mutex::new([Some(first), Some(Script::default())].into()));
        let clock = WallClock::start();
        let mut bus = Reconnecting::<Scripted>::open(fate, &clock).await.unwrap();
        assert!(matches!(bus.recv().await.unwrap().1, Received::Note(Note::ConnectionLost { .. })));
        // Much shorter than the pause: an attempt that began anew each time would never end.
        let mut received = None;
        while received.is_none() {
            tokio::select! {
                result = bus.recv() => received = Some(result.unwrap().1),
                () = clock.sleep(Duration::from_millis(5)) => {}
            }
        }
        assert_eq!(received, Some(Note::ConnectionBack.into()));
    }

    #[tokio::test]
    async fn what_a_new_connection_does_not_mend_ends_the_bus() {
        let refused = BusError::Refused { address: "peer".into(), request: "a frame".into(), said: "no".into() };
        let fate: Fate = Arc::new(Mutex::new([Some(Script { end: Some(refused), ..Script::default() })].into()));
        let clock = WallClock::start();
        let mut bus = Reconnecting::<Scripted>::open(fate, &clock).await.unwrap();
        assert!(matches!(bus.recv().await, Err(BusError::Refused { .. })));
        let absent: Fate = Arc::default();
        assert!(matches!(Reconnecting::<Scripted>::open(absent, &clock).await, Err(BusError::Connect { .. })));
    }
}

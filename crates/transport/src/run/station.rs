//! Drives one [`Station`] on one bus.

use std::future::{Future, poll_fn};
use std::pin::pin;
use std::sync::Arc;
use std::task::{Poll, Wake, Waker};
use std::time::Duration;

use can::{Frame, Instant, Station};
use tokio::sync::Notify;

use crate::link::within;
use crate::{AsyncBus, BusError, Note, Received, WallClock};

/// How long a connection may take for what the station still had to send when the run ended.
const PARTING_PATIENCE: Duration = Duration::from_secs(1);

/// Runs `station` on `bus` until `until` completes (with its output) or the bus is lost. What the station has to send by
/// then still goes out.
///
/// The calls keep to the contract of [`Station`]. What `until` does to the station through a handle - a master's command
/// that queues an SDO request - is noticed at once, because `until` runs inside this loop; a caller that does so from another
/// task calls `wakeup.notify_one()` behind it. After each such wake-up the station gets a `handle_timeout`, so that its
/// idea of now is fresh.
///
/// `tell` hears the notes of the bus. A controller that is bus-off is the station's own ([`Station::handle_bus_off`]).
///
/// `handle_transmitted` is called when the connection has taken a frame: a socket does not report when the wire did.
pub async fn run_station<B, S, U>(
    bus: &mut B,
    station: &mut S,
    clock: &WallClock,
    wakeup: &Notify,
    until: U,
    mut tell: impl FnMut(Instant, &Note),
) -> Result<U::Output, BusError>
where
    B: AsyncBus,
    S: Station,
    U: Future,
{
    let mut until = pin!(until);
    let mut offered = None;
    station.handle_timeout(clock.now());
    loop {
        {
            let mut sending = pin!(send_all(bus, station, clock, offered.take()));
            tokio::select! {
                biased;
                output = &mut until => return part(clock, sending, output).await,
                sent = &mut sending => sent?,
            }
        }
        let deadline = station.poll_timeout();
        let event = tokio::select! {
            biased;
            output = &mut until => return part(clock, send_all(bus, station, clock, None), output).await,
            event = changed_behind_our_back(station, deadline) => event,
            // A deadline goes before a frame: a babbling bus must not keep a station from its timeouts.
            () = clock.sleep_until_due(deadline) => StationEvent::Woken,
            received = bus.recv() => received?.into(),
            () = wakeup.notified() => StationEvent::Woken,
        };
        match event {
            StationEvent::Received(at, frame) => {
                let now = clock.now();
                station.handle_stamped(&frame, at.min(now), now);
            }
            StationEvent::Noted(at, note) => {
                if let Some(takes_part) = note.takes_part() {
                    station.handle_bus_off(!takes_part, clock.now());
                }
                tell(at, &note);
            }
            StationEvent::Offered(frame) => offered = Some(frame),
            StationEvent::Woken => station.handle_timeout(clock.now()),
        }
    }
}

/// A waker that has [`run_station`] look at its station again, for a station whose handles call one when they ask for something
/// from another task or thread.
pub fn waker_of(wakeup: Arc<Notify>) -> Waker {
    struct Wakes(Arc<Notify>);

    impl Wake for Wakes {
        fn wake(self: Arc<Self>) {
            self.0.notify_one();
        }
    }

    Waker::from(Arc::new(Wakes(wakeup)))
}

enum StationEvent {
    Received(Instant, Frame),
    Noted(Instant, Note),
    /// The station has something to send that it had not when it was last drained.
    Offered(Frame),
    Woken,
}

impl From<(Instant, Received)> for StationEvent {
    fn from((at, received): (Instant, Received)) -> Self {
        match received {
            Received::Frame(frame) => Self::Received(at, frame),
            Received::Note(note) => Self::Noted(at, note),
        }
    }
}

/// Sends `first` and everything that `station` offers.
async fn send_all(
    bus: &mut impl AsyncBus,
    station: &mut impl Station,
    clock: &WallClock,
    mut first: Option<Frame>,
) -> Result<(), BusError> {
    while let Some(frame) = first.take().or_else(|| station.poll_transmit()) {
        bus.send(&frame).await?;
        station.handle_transmitted(&frame, clock.now());
    }
    Ok(())
}

/// Lets the last frames out before the run ends with `output`.
async fn part<T>(
    clock: &WallClock,
    sending: impl Future<Output = Result<(), BusError>>,
    output: T,
) -> Result<T, BusError> {
    within(clock, PARTING_PATIENCE, sending).await.unwrap_or(Ok(())).map(|()| output)
}

/// Completes if `until`, polled just before, made the station offer a frame or change its deadline.
async fn changed_behind_our_back(station: &mut impl Station, deadline: Option<Instant>) -> StationEvent {
    poll_fn(|_| match station.poll_transmit() {
        Some(frame) => Poll::Ready(StationEvent::Offered(frame)),
        None if station.poll_timeout() != deadline => Poll::Ready(StationEvent::Woken),
        None => Poll::Pending,
    })
    .await
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Has two frames that came while its program was held up, and one with a time to come.
    struct Late(Vec<(Instant, Received)>);

    impl AsyncBus for Late {
        async fn send(&mut self, _: &Frame) -> Result<(), BusError> {
            Ok(())
        }

        async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
            match self.0.pop() {
                Some(received) => Ok(received),
                None => std::future::pending().await,
            }
        }
    }

    /// Keeps when frames came, and when it got them.
    struct Stamps(Vec<(Instant, Instant)>);

    impl Station for Stamps {
        fn handle_frame(&mut self, _: &Frame, _: Instant) {
            panic!("it has a time stamp");
        }

        fn handle_stamped(&mut self, _: &Frame, at: Instant, now: Instant) {
            self.0.push((at, now));
        }

        fn handle_timeout(&mut self, _: Instant) {}

        fn poll_transmit(&mut self) -> Option<Frame> {
            None
        }

        fn poll_timeout(&self) -> Option<Instant> {
            None
        }
    }

    #[tokio::test]
    async fn a_frame_comes_with_the_time_stamp_of_its_bus_and_never_later_than_now() {
        let clock = WallClock::start();
        let frame: Frame = "181#01".parse().expect("a frame");
        let [one, two] = [1, 2].map(Instant::from_nanos);
        let mut bus = Late([Instant::FAR_FUTURE, two, one].map(|at| (at, frame.into())).to_vec());
        let (mut stamps, wakeup) = (Stamps(Vec::new()), Notify::new());
        // What has come goes before this: it is not ready when it is first asked.
        let until = std::pin::pin!(async {
            for _ in 0..10 {
                tokio::task::yield_now().await;
            }
        });
        run_station(&mut bus, &mut stamps, &clock, &wakeup, until, |_, _| {}).await.expect("the bus is there");
        let [(first, _), (second, _), (third, now)] = stamps.0[..] else { panic!("{:?}", stamps.0) };
        assert_eq!((first, second, third), (one, two, now));
        assert!(now >= two && now < Instant::FAR_FUTURE);
    }
}

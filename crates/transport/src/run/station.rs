//! Drives one [`Station`] on one bus.

use std::future::{Future, poll_fn};
use std::task::Poll;

use can::{Frame, Instant, Station};
use tokio::sync::Notify;

use crate::{AsyncBus, BusError, WallClock};

/// Runs `station` on `bus` until `until` completes (with its output) or the bus is lost.
///
/// The calls keep to the contract of [`Station`]. What `until` does to the station through a handle - a master's command
/// that queues an SDO request - is noticed at once, because `until` runs inside this loop; whoever does so from another
/// task calls `wakeup.notify_one()` behind it. After each such wake-up the station gets a `handle_timeout`, so that its
/// idea of now is fresh.
///
/// `handle_transmitted` is called when the connection has taken a frame: a socket does not tell when the wire did.
pub async fn run_station<B, S, U>(
    bus: &mut B,
    station: &mut S,
    clock: &WallClock,
    wakeup: &Notify,
    until: U,
) -> Result<U::Output, BusError>
where
    B: AsyncBus,
    S: Station,
    U: Future,
{
    let mut until = std::pin::pin!(until);
    station.handle_timeout(clock.now());
    loop {
        while let Some(frame) = station.poll_transmit() {
            tokio::select! {
                biased;
                output = &mut until => return Ok(output),
                sent = bus.send(&frame) => sent?,
            }
            station.handle_transmitted(&frame, clock.now());
        }
        let deadline = station.poll_timeout();
        let event = tokio::select! {
            biased;
            output = &mut until => return Ok(output),
            event = changed_behind_our_back(station, deadline) => event,
            received = bus.recv() => Event::Received(received?.1),
            () = wakeup.notified() => Event::Woken,
            () = clock.sleep_until_due(deadline) => Event::Woken,
        };
        match event {
            Event::Received(frame) => station.handle_frame(&frame, clock.now()),
            Event::Offered(frame) => {
                tokio::select! {
                    biased;
                    output = &mut until => return Ok(output),
                    sent = bus.send(&frame) => sent?,
                }
                station.handle_transmitted(&frame, clock.now());
            }
            Event::Woken => station.handle_timeout(clock.now()),
        }
    }
}

enum Event {
    Received(Frame),
    /// The station has something to send that it had not when it was last drained.
    Offered(Frame),
    Woken,
}

/// Completes if `until`, polled just before, made the station offer a frame or change its deadline.
async fn changed_behind_our_back(station: &mut impl Station, deadline: Option<Instant>) -> Event {
    poll_fn(|_| match station.poll_transmit() {
        Some(frame) => Poll::Ready(Event::Offered(frame)),
        None if station.poll_timeout() != deadline => Poll::Ready(Event::Woken),
        None => Poll::Pending,
    })
    .await
}

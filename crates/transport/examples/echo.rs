//! Serves a bus with one station on it: it answers every data frame with the same data under the next identifier, and
//! sends a heartbeat. For trying other programs against the servers; without arguments it takes a free socketcand port:
//!
//! ```text
//! cargo run -p ferrodrive-transport --example echo -- socketcand://127.0.0.1:29536 slcan://127.0.0.1:3000
//! python -c 'import can; bus = can.Bus(interface="socketcand", host="127.0.0.1", port=29536, channel="can0"); print(bus.recv())'
//! ```
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "an example talks to its user")]

use std::collections::VecDeque;
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use transport::{Hub, HubOptions, ServeSpec, WallClock, run_station};

const HEARTBEAT_PERIOD: Duration = Duration::from_millis(5);
const HEARTBEAT: Frame = Frame::new(CanId::standard(0x701), &[0x05]);

#[derive(Default)]
struct Echo {
    answers: VecDeque<Frame>,
    heartbeat: Instant,
}

impl Station for Echo {
    fn handle_frame(&mut self, frame: &Frame, _now: Instant) {
        if let Some(id) = frame.standard_data_id() {
            self.answers.push_back(Frame::new(CanId::standard(id + 1), frame.data()));
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.heartbeat {
            self.heartbeat = now + HEARTBEAT_PERIOD;
            self.answers.push_back(HEARTBEAT);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.answers.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.heartbeat)
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut places: Vec<ServeSpec> = std::env::args().skip(1).map(|place| place.parse()).collect::<Result<_, _>>()?;
    if places.is_empty() {
        places.push("socketcand://127.0.0.1:0".parse()?);
    }
    let clock = WallClock::start();
    let options = HubOptions { zero: clock.unix_zero(), ..HubOptions::default() };
    let mut hub = Hub::bind(&places, options, &clock).await?;
    for listener in hub.listeners() {
        println!("ready {listener}");
    }
    let wakeup = tokio::sync::Notify::new();
    run_station(&mut hub, &mut Echo::default(), &clock, &wakeup, tokio::signal::ctrl_c(), |_, note| {
        eprintln!("{note}")
    })
    .await??;
    Ok(())
}

//! Two devices as programs of a microcontroller: a node with 30 objects, and the whole ZLAC8030L.
//!
//! Each is the loop of its main program: a frame from the CAN controller goes in, time passes, frames go out. `cargo xtask
//! test --only no_std` builds both for a Cortex-M4F, links them and prints how much flash and RAM they take.
//!
//! ```
//! use bare_metal::{Board, node};
//! use can::{CanId, Frame, Instant};
//!
//! /// A board whose CAN controller receives one frame and keeps what is sent.
//! #[derive(Default)]
//! struct Bench { now_ms: u64, received: Option<Frame>, sent: Vec<Frame> }
//!
//! impl Board for Bench {
//!     fn now(&mut self) -> Instant { self.now_ms += 1; Instant::from_millis(self.now_ms) }
//!     fn receive(&mut self) -> Option<Frame> { self.received.take() }
//!     fn send(&mut self, frame: &Frame) { self.sent.push(*frame) }
//! }
//!
//! let mut board = Bench { received: "605#4000100000000000".parse().ok(), ..Bench::default() };
//! let mut sensor = node::sensor();
//! node::start(&mut sensor, &mut board);
//! node::turn(&mut sensor, &mut board);
//! assert_eq!(board.sent, ["705#00".parse()?, "585#4300100091010400".parse()?]); // boot-up; a device of CiA 401
//! # Ok::<(), can::ParseFrameError>(())
//! ```
#![no_std]

#[cfg(target_os = "none")]
mod entry;
pub mod node;
pub mod servo;

use can::{Frame, Instant, Station};

/// What a board has of its own: a timer and a CAN controller.
pub trait Board {
    /// Time since the program's start.
    fn now(&mut self) -> Instant;

    /// The oldest frame that has arrived.
    fn receive(&mut self) -> Option<Frame>;

    /// Puts a frame into the CAN controller's queue.
    fn send(&mut self, frame: &Frame);
}

/// Hands what has arrived to a station, and what it wants to send to the controller.
fn exchange(station: &mut impl Station, board: &mut impl Board, now: Instant) {
    while let Some(frame) = board.receive() {
        station.handle_frame(&frame, now);
    }
    station.handle_timeout(now);
    while let Some(frame) = station.poll_transmit() {
        board.send(&frame);
        station.handle_transmitted(&frame, now);
    }
}

//! A bus for tests: hand-written toy nodes and a runner that polls a future only when it was woken.

#![allow(dead_code, reason = "each test file uses its part")]

pub(crate) mod toy;
pub(crate) mod toy_drive;

use std::future::Future;
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};
use std::task::{Context, Poll, Wake, Waker};

use can::{CanId, Frame, Instant, Station};
use canopen::{Mux, NodeId};
use cia402::ModeOfOperation;
use devices::servo::{self, CIA402};
use devices::{AxisDescription, Description, Units};
use master::Network;
use toy::Toy;

/// How long each frame takes, in nanoseconds: 128 bits at 500 kbit/s.
const FRAME_NS: u64 = 256_000;

/// The standard's servo as a frequency inverter: it turns in velocity mode (vl, 6042h) alone.
pub(crate) static INVERTER: LazyLock<&'static Description> = LazyLock::new(|| {
    let (target, actual, ramps) = servo::VELOCITY_MODE;
    let standard = CIA402.axes[0];
    let units = Units {
        target_velocity: Some(target),
        actual_velocity: Some(actual),
        ramps: Some(ramps),
        profile_velocity: None,
        target_current: None,
        ..standard.units
    };
    let axis = AxisDescription { modes: &[ModeOfOperation::VELOCITY], homing: None, units, ..standard };
    let name = "an inverter (`velocity` in vl)";
    Box::leak(Box::new(Description { name, axes: Box::leak(Box::new([axis])), ..CIA402 }))
});

pub(crate) fn node(raw: u8) -> NodeId {
    NodeId::new(raw).unwrap()
}

pub(crate) const fn mux(index: u16, sub_index: u8) -> Mux {
    Mux::new(index, sub_index)
}

/// One master and toy nodes, one frame at a time.
pub(crate) struct Bus {
    pub(crate) now: Instant,
    pub(crate) network: Network,
    pub(crate) toys: Vec<Toy>,
    pub(crate) log: Vec<(Instant, Frame)>,
    /// Unrequested frames, sent at their time.
    pub(crate) noise: Vec<(Instant, Frame)>,
}

impl Bus {
    pub(crate) fn new(toys: Vec<Toy>) -> Self {
        let start = Instant::from_secs(5);
        Self { now: start, network: Network::new(), toys, log: Vec::new(), noise: Vec::new() }
    }

    /// Runs the bus until the future is done. Panics when neither it nor the bus can go on.
    pub(crate) fn block_on<F: Future>(&mut self, future: F) -> F::Output {
        let flag = Arc::new(Flag(AtomicBool::new(true)));
        let waker = Waker::from(flag.clone());
        let mut context = Context::from_waker(&waker);
        let mut future = pin!(future);
        loop {
            if flag.0.swap(false, Ordering::Relaxed)
                && let Poll::Ready(output) = future.as_mut().poll(&mut context)
            {
                self.settle();
                return output;
            }
            if !self.step() && !flag.0.load(Ordering::Relaxed) {
                panic!("nothing more can happen at {}; last frames: {:?}", self.now, self.last_frames());
            }
        }
    }

    /// Everything that is due now, without letting time pass to a deadline.
    pub(crate) fn settle(&mut self) {
        self.network.handle_timeout(self.now);
        while self.send_one() {}
    }

    pub(crate) fn frames(&self) -> Vec<String> {
        self.log.iter().map(|(_, frame)| frame.to_string()).collect()
    }

    fn last_frames(&self) -> Vec<String> {
        let frames = self.frames();
        frames[frames.len().saturating_sub(10)..].to_vec()
    }

    fn step(&mut self) -> bool {
        if self.send_one() {
            return true;
        }
        let toys = self.toys.iter().filter_map(Toy::poll_timeout);
        let noise = self.noise.iter().map(|(at, _)| *at);
        let Some(due) = toys.chain(self.network.poll_timeout()).chain(noise).min() else { return false };
        self.now = self.now.max(due);
        self.network.handle_timeout(self.now);
        self.toys.iter_mut().for_each(|toy| toy.handle_timeout(self.now));
        true
    }

    /// The frame with the lowest identifier goes over the wire.
    fn send_one(&mut self) -> bool {
        let now = self.now;
        if let Some(position) = self.noise.iter().position(|(at, _)| *at <= now) {
            let (_, frame) = self.noise.remove(position);
            self.deliver(frame, None);
            return true;
        }
        if let Some(frame) = self.network.poll_transmit() {
            self.deliver(frame, Some(usize::MAX));
            return true;
        }
        for position in 0..self.toys.len() {
            if let Some(frame) = self.toys[position].poll_transmit() {
                self.deliver(frame, Some(position));
                return true;
            }
        }
        false
    }

    fn deliver(&mut self, frame: Frame, sender: Option<usize>) {
        self.now = self.now.plus_nanos(FRAME_NS);
        self.log.push((self.now, frame));
        if sender != Some(usize::MAX) {
            self.network.handle_frame(&frame, self.now);
        } else {
            self.network.handle_transmitted(&frame, self.now);
        }
        let others = self.toys.iter_mut().enumerate().filter(|(position, _)| sender != Some(*position));
        others.for_each(|(_, toy)| toy.handle_frame(&frame, self.now));
    }
}

struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A device that is stopped (CiA 301, 7.3.2.2.4: it answers no SDO) and sends the heartbeats of a node-ID that another one has, each
/// second.
#[derive(Clone)]
pub(crate) struct StoppedTwin {
    pub(crate) id: u16,
    pub(crate) due: Instant,
    pub(crate) frame: Option<Frame>,
}

impl StoppedTwin {
    pub(crate) fn of(id: u16, from: Instant) -> Self {
        Self { id, due: from, frame: None }
    }
}

impl Station for StoppedTwin {
    fn handle_frame(&mut self, _: &Frame, _: Instant) {}

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.due {
            self.due += std::time::Duration::from_secs(1);
            self.frame = Some(Frame::new(CanId::standard(0x700 + self.id), &[0x04]));
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.frame.take()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.due)
    }
}

/// `Some` with what `other` gives, or `None` if `limit` ends first. The loser is dropped.
pub(crate) async fn first<T>(limit: impl Future<Output = ()>, other: impl Future<Output = T>) -> Option<T> {
    let mut limit = pin!(limit);
    let mut other = pin!(other);
    std::future::poll_fn(|context| {
        if let Poll::Ready(output) = other.as_mut().poll(context) {
            return Poll::Ready(Some(output));
        }
        limit.as_mut().poll(context).map(|()| None)
    })
    .await
}

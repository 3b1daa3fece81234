//! Futures against a world: several in flight, real wakers, stalls.

use std::collections::VecDeque;
use std::future::poll_fn;
use std::pin::pin;
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};
use std::time::Duration;

use crate::common::{Chatter, TestDrive};
use can::{Bitrate, CanId, Frame, Instant, Station};
use sim::{BlockOnError, World, block_on, block_on_for};

/// A little master: asks nodes, remembers who answered when, wakes who waits.
#[derive(Default)]
struct Core {
    now: Instant,
    out: VecDeque<Frame>,
    answered: Vec<(u8, Instant)>,
    alarms: Vec<Instant>,
    wakers: Vec<Waker>,
    polls: usize,
}

#[derive(Clone, Default)]
struct Handle(Arc<Mutex<Core>>);

impl Handle {
    /// Asks `node` and waits for its answer.
    async fn ask(&self, node: u8) -> Instant {
        self.0.lock().unwrap().out.push_back(Frame::full(CanId::standard(0x600 + u16::from(node)), [0x40; 8]));
        poll_fn(|context| {
            let mut core = self.0.lock().unwrap();
            core.polls += 1;
            if let Some((_, at)) = core.answered.iter().find(|(it, _)| *it == node) {
                return Poll::Ready(*at);
            }
            core.wakers.push(context.waker().clone());
            Poll::Pending
        })
        .await
    }

    async fn sleep(&self, duration: Duration) {
        let end = self.0.lock().unwrap().now + duration;
        self.0.lock().unwrap().alarms.push(end);
        poll_fn(|context| {
            let mut core = self.0.lock().unwrap();
            if core.now >= end {
                return Poll::Ready(());
            }
            core.wakers.push(context.waker().clone());
            Poll::Pending
        })
        .await
    }
}

impl Station for Handle {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let mut core = self.0.lock().unwrap();
        core.now = now;
        if let Some(id @ 0x581..=0x5FF) = frame.standard_data_id() {
            core.answered.push(((id - 0x580) as u8, now));
            core.wakers.drain(..).for_each(Waker::wake);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        let mut core = self.0.lock().unwrap();
        core.now = now;
        if core.alarms.iter().any(|alarm| *alarm <= now) {
            core.alarms.retain(|alarm| *alarm > now);
            core.wakers.drain(..).for_each(Waker::wake);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.0.lock().unwrap().out.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.0.lock().unwrap().alarms.iter().min().copied()
    }
}

fn world_with(drives: &[(u8, u64)]) -> (World, Handle) {
    let mut world = World::new(Bitrate::K500, 1);
    for (node, answer_after_us) in drives {
        let mut drive = TestDrive::new(*node);
        drive.answer_after = Duration::from_micros(*answer_after_us);
        world.add_drive(*node, Box::new(drive)).unwrap();
    }
    let handle = Handle::default();
    world.add_station(handle.clone());
    world.run_until(Instant::from_secs(1));
    (world, handle)
}

#[test]
fn one_future_gets_its_answer_at_the_bus_s_time() {
    let (mut world, master) = world_with(&[(4, 500)]);
    let at = block_on(&mut world, master.ask(4)).unwrap();
    assert_eq!(world.now(), at);
    let frames = crate::common::frames(&world);
    let (request, answer) = (&frames[frames.len() - 2], &frames[frames.len() - 1]);
    assert_eq!(request.0, 1_000_000_000, "the request starts at once");
    assert_eq!(answer.0, request.1 + 500_000, "and the answer after the drive's time");
    assert_eq!(answer.1, at.as_nanos());
}

#[test]
fn two_futures_are_in_flight_together() {
    let (mut world, master) = world_with(&[(1, 2_000), (2, 5_000)]);
    let mut slow = pin!(master.ask(2));
    let mut fast = pin!(master.ask(1));
    let mut done = (None, None);
    let both = poll_fn(|context| {
        if done.0.is_none()
            && let Poll::Ready(at) = slow.as_mut().poll(context)
        {
            done.0 = Some(at);
        }
        if done.1.is_none()
            && let Poll::Ready(at) = fast.as_mut().poll(context)
        {
            done.1 = Some(at);
        }
        done.0.zip(done.1).map_or(Poll::Pending, Poll::Ready)
    });
    let (slow_at, fast_at) = block_on(&mut world, both).unwrap();
    assert!(fast_at < slow_at);
    let elapsed = slow_at - Instant::from_secs(1);
    assert!(elapsed < Duration::from_micros(6_000), "side by side, not one after the other: {elapsed:?}");
}

#[test]
fn a_future_is_polled_only_when_it_was_woken() {
    let (mut world, master) = world_with(&[(4, 500)]);
    let period = Duration::from_micros(700);
    world.add_station(Chatter::new(crate::common::frame("181#"), Instant::from_millis(1_001), period));
    world.with_drive(4, |drive, now| drive.set_power(false, now)).unwrap();
    let result = block_on_for(&mut world, Duration::from_secs(1), master.ask(4));
    assert_eq!(result, Err(BlockOnError::OutOfTime { at: Instant::from_secs(2) }));
    assert_eq!(world.now(), Instant::from_secs(2));
    assert_eq!(master.0.lock().unwrap().polls, 1);
}

#[test]
fn sleeping_is_a_deadline_of_the_core() {
    let (mut world, master) = world_with(&[]);
    block_on(&mut world, master.sleep(Duration::from_secs(3_600))).unwrap();
    assert_eq!(world.now(), Instant::from_secs(3_601));
}

#[test]
fn a_future_that_nothing_can_wake_stalls_instead_of_hanging() {
    let (mut world, _) = world_with(&[(4, 500)]);
    let result = block_on(&mut world, std::future::pending::<()>());
    assert_eq!(result, Err(BlockOnError::Stalled { at: Instant::from_secs(1) }));
    let text = result.unwrap_err().to_string();
    assert_eq!(text, "stalled at 1.000000000 s: the future waits, but nothing is left to happen in the world");
}

#[test]
fn a_ready_future_takes_no_time() {
    let (mut world, _) = world_with(&[]);
    assert_eq!(block_on(&mut world, async { 7 }), Ok(7));
    assert_eq!(world.now(), Instant::from_secs(1));
}

#[test]
fn a_future_that_wakes_itself_is_polled_again_without_time_passing() {
    let (mut world, _) = world_with(&[]);
    let mut left = 1_000;
    let counting = poll_fn(|context| {
        left -= 1;
        context.waker().wake_by_ref();
        if left == 0 { Poll::Ready(()) } else { Poll::Pending }
    });
    assert_eq!(block_on(&mut world, counting), Ok(()));
    assert_eq!(world.now(), Instant::from_secs(1));
}

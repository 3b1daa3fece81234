//! Drives a virtual world behind a [`Hub`], at the pace of the wall clock or one of its own.

use std::ops::ControlFlow;
use std::time::Duration;

use can::{Frame, Instant};
use tokio::sync::mpsc;

use crate::clock::waiter::Waiter;
use crate::{ClientId, ErrorFrame, Hub, HubEvent, LeaveReason, WallClock};

/// How far a world is moved past its next deadline in one go. A world that is late (the machine was busy, the process was
/// stopped) catches up in steps of this length, between which clients and commands are served; one with nothing due is
/// moved to now at once.
const LONGEST_STEP: Duration = Duration::from_millis(20);

/// A world of stations on a simulated wire whose time the caller moves. Its time is that of the [`WallClock`], unless it
/// has a pace of its own.
pub trait RealTimeWorld {
    /// How far the world has come.
    fn now(&self) -> Instant;

    /// How far the world is to have come when the clock shows `clock`; asked once in each turn of the loop. At or before
    /// [`now`](Self::now): it stands.
    fn target(&mut self, clock: Instant) -> Instant {
        clock
    }

    /// What the clock shows when the world is to have come to `at`; `None` for never.
    fn clock_at(&self, at: Instant) -> Option<Instant> {
        Some(at)
    }

    /// What the clock shows when [`advance_to`](Self::advance_to) is to be called in any case, for what is waited for outside of the
    /// world; `None` for nothing.
    fn wakes_at(&self) -> Option<Instant> {
        None
    }

    /// When something is next due in it; `None` for never, at or before [`now`](Self::now) for at once.
    fn next_deadline(&self) -> Option<Instant>;

    /// Moves the world to `instant`, which is never earlier than `now`, serving everything due on the way at its own time. A world
    /// that has to wait for a program outside may stop before.
    fn advance_to(&mut self, instant: Instant);

    /// A client offers `frame` at the world's now: it takes part in arbitration from here on. At most 64 frames of one
    /// client are under way at a time; a client's frames keep their order.
    fn inject(&mut self, client: ClientId, frame: &Frame);

    /// The next thing that became of a frame, in the order of time. Everything injected comes out here once.
    fn take_heard(&mut self) -> Option<Heard>;

    /// A client has come.
    fn joined(&mut self, client: ClientId) {
        let _ = client;
    }

    /// A client is gone. Nothing more is injected for it; what was before still counts.
    fn left(&mut self, client: ClientId, reason: LeaveReason) {
        let _ = (client, reason);
    }

    /// How far the world is behind its target, in its own time, reported at every turn of the loop and before every command: next to nothing
    /// while the machine keeps up.
    fn set_lag(&mut self, lag: Duration) {
        let _ = lag;
    }
}

/// What became of a frame in a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// The wire carried it: its last bit was sent at `at`.
    Carried {
        /// The frame.
        frame: Frame,
        /// The end of its last bit.
        at: Instant,
        /// Whose; `None` for the world's own stations.
        from: Option<ClientId>,
    },
    /// A frame was destroyed on the wire, and an error frame followed: all stations see that.
    Error {
        /// What a controller reports of it.
        error: ErrorFrame,
        /// The time of the error frame.
        at: Instant,
    },
    /// The world gave up an injected frame.
    Lost {
        /// The client that injected it.
        from: ClientId,
    },
}

/// Runs `world` in real time until `command` breaks the loop, and returns what it broke with.
///
/// `command` is called for everything that comes out of `commands`, with the world brought up to now; a closed channel
/// leaves the world running. The loop sleeps until the next deadline, frame or command.
pub async fn run_world<W, C, T>(
    world: &mut W,
    hub: &mut Hub,
    clock: &WallClock,
    commands: &mut mpsc::Receiver<C>,
    mut command: impl FnMut(&mut W, C) -> ControlFlow<T>,
) -> T
where
    W: RealTimeWorld,
{
    let mut commands_open = true;
    let mut waiter = Waiter::new(clock);
    loop {
        let is_late = catch_up(world, hub, clock);
        while let Some(event) = hub.try_next_event() {
            take_in(world, event);
        }
        let deadline = match world.next_deadline() {
            _ if is_late => Some(Instant::ZERO),
            Some(at) => world.clock_at(at),
            None => None,
        };
        let deadline = deadline.into_iter().chain(world.wakes_at()).min();
        tokio::select! {
            biased;
            received = commands.recv(), if commands_open => {
                catch_up(world, hub, clock);
                match received.map(|received| command(world, received)) {
                    Some(ControlFlow::Break(result)) => {
                        tell(world, hub);
                        return result;
                    }
                    Some(ControlFlow::Continue(())) => {}
                    None => commands_open = false,
                }
            }
            event = hub.next_event() => {
                catch_up(world, hub, clock);
                take_in(world, event);
            }
            () = until_due(deadline, clock, &mut waiter) => {}
        }
    }
}

/// Waits for the deadline, and lets the tasks of the clients run in any case.
async fn until_due(deadline: Option<Instant>, clock: &WallClock, waiter: &mut Waiter) {
    match deadline {
        Some(deadline) if deadline <= clock.now() => tokio::task::yield_now().await,
        _ => waiter.until(deadline).await,
    }
}

/// Moves the world towards now and reports what was heard; true if now is not reached.
fn catch_up(world: &mut impl RealTimeWorld, hub: &Hub, clock: &WallClock) -> bool {
    let began = clock.now();
    let now = world.target(began).max(world.now());
    let target = match world.next_deadline() {
        Some(due) => now.min(due.max(world.now()) + LONGEST_STEP),
        None => now,
    };
    world.advance_to(target);
    // The clock goes on while the world computes, so that a world which takes longer than it gains shows that here.
    world.set_lag((now - target) + (clock.now() - began));
    tell(world, hub);
    target < now
}

fn tell(world: &mut impl RealTimeWorld, hub: &Hub) {
    while let Some(heard) = world.take_heard() {
        match heard {
            Heard::Carried { frame, at, from } => hub.broadcast(&frame, at, from),
            Heard::Error { error, at } => hub.broadcast_error(&error, at),
            Heard::Lost { from } => hub.discard(from),
        }
    }
}

fn take_in(world: &mut impl RealTimeWorld, event: HubEvent) {
    match event {
        HubEvent::Frame { client, frame } => world.inject(client, &frame),
        HubEvent::Left { client, reason } => world.left(client, reason),
        HubEvent::Joined { client, .. } => world.joined(client),
    }
}

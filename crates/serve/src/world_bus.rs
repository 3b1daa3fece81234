//! The embedded world as a bus that passes with the clock, for a command that serves people: they live in its time.
//!
//! The master is a station of this world, and time moves from one event of it to the next, never beyond what the clock shows. So a
//! machine that is busy makes this world late, and a master on it misses nothing: no cycle, no time-out. A world that falls behind
//! does not catch up for long: the time between is left out.

use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use can::{Instant, Station};
use futures_util::FutureExt;
use host::{Wire, WorldAsks, WorldDoor};
use sim::pace::Pace;
use sim::{StationId, World};
use tokio::sync::Notify;
use transport::{WallClock, waker_of};

/// How finely the world follows the clock while something happens in it, and while nothing does.
const STEP: Duration = Duration::from_millis(1);
const LONGEST: Duration = Duration::from_millis(20);

/// How far it may fall behind and still catch up: far less than after which a page that says nothing is taken for gone. What a page
/// said while the machine stood still is heard within this time of the world.
const MOST_BEHIND: Duration = Duration::from_millis(50);

/// A world that catches up lets the connections of pages have their turn after so much of its time, or so many polls of the program.
const SLICE: Duration = Duration::from_millis(5);
const POLLS: u32 = 8 * AT_ONCE;

/// How often a program that has more to do is polled at one instant.
const AT_ONCE: u32 = 4;

/// In which what the master still had to send goes out, at the end.
const PARTING: Duration = Duration::from_millis(10);

/// See the [module](self).
pub(crate) struct WorldBus {
    world: World,
    clock: WallClock,
    pace: Pace,
    asks: WorldAsks,
    wire: Wire,
}

impl WorldBus {
    /// A bus of this world, whose time begins now, and where the world can be asked.
    pub(crate) fn new(mut world: World, clock: &WallClock, wire: Wire) -> (Self, WorldDoor) {
        let pace = Pace::real_time(world.now()).rebased(elapsed(clock), world.now());
        let (door, asks) = host::world_door(Some(world.live_values()));
        (Self { world, clock: clock.clone(), pace, asks, wire }, door)
    }

    /// Runs `station`, the master with what listens beside it, in this world until `until` completes. `wakeup` is notified when
    /// another task has changed the station.
    pub(crate) async fn run<S, U>(mut self, station: S, wakeup: &Notify, until: U) -> U::Output
    where
        S: Station + Clone + Send + 'static,
        U: Future,
    {
        let master = self.world.add_station(station);
        let woken = Arc::new(Notify::new());
        let waker = waker_of(Arc::clone(&woken));
        let mut until = pin!(until);
        let (mut polls, mut gave_way) = (0, self.world.now());
        loop {
            if polls >= POLLS || self.world.now() - gave_way >= SLICE {
                self.attend(master);
                tokio::task::yield_now().await;
                (polls, gave_way) = (0, self.world.now());
            }
            polls += 1;
            let polled = until.as_mut().poll(&mut Context::from_waker(&waker));
            // What it has changed itself is seen here.
            let _ = is_notified(wakeup);
            self.world.refresh();
            if let Poll::Ready(output) = polled {
                self.world.run_for(PARTING);
                return output;
            }
            // It has more to do at once. One that computes for long leaves time to pass between.
            let mut is_due = is_notified(&woken);
            if is_due && polls % AT_ONCE != 0 {
                continue;
            }
            // It is polled again at the very instant at which something happens for it.
            while self.world.now() - gave_way < SLICE {
                let is_now = self.step_towards_now();
                if is_notified(&woken) {
                    break;
                }
                if !is_now {
                    continue;
                }
                self.attend(master);
                (polls, gave_way) = (0, self.world.now());
                if is_due {
                    tokio::task::yield_now().await;
                    break;
                }
                let pause = self.until_next_event();
                is_due = tokio::select! {
                    biased;
                    () = woken.notified() => true,
                    () = wakeup.notified() => true,
                    Some(asked) = self.asks.next() => {
                        asked.answer(&mut self.world);
                        false
                    }
                    () = self.clock.sleep(pause) => false,
                };
            }
        }
    }

    /// Moves the world by its next event, or to now where nothing happens before; true if it is there.
    fn step_towards_now(&mut self) -> bool {
        let elapsed = elapsed(&self.clock);
        if self.pace.behind(elapsed, self.world.now()) > MOST_BEHIND {
            self.pace = self.pace.rebased(elapsed, self.world.now() + MOST_BEHIND);
        }
        let target = self.pace.target(elapsed);
        if self.world.next_event().is_some_and(|at| at <= target) {
            self.world.step();
            return false;
        }
        if target > self.world.now() {
            self.world.run_until(target);
        }
        true
    }

    /// How long nothing happens in the world, by the clock.
    fn until_next_event(&self) -> Duration {
        let at = self.world.next_event().and_then(|at| self.pace.elapsed_at(at));
        at.map_or(LONGEST, |at| at.saturating_sub(elapsed(&self.clock))).clamp(STEP, LONGEST)
    }

    /// Answers what is asked of the world, and shows how its wire is.
    fn attend(&mut self, master: StationId) {
        self.asks.answer(&mut self.world);
        let counters = self.world.counters(master);
        self.wire.update(|health| {
            health.state = Some(counters.state().word());
            (health.transmit_errors, health.receive_errors) = (Some(counters.tec()), Some(counters.rec()));
            health.error_frames = self.world.statistics().errors;
        });
    }
}

/// Whether it was notified since the last look.
fn is_notified(by: &Notify) -> bool {
    by.notified().now_or_never().is_some()
}

fn elapsed(clock: &WallClock) -> Duration {
    clock.now() - Instant::ZERO
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;
    use std::sync::Mutex;

    use can::{Bitrate, BusFrame, Frame, Listen, Tap};
    use master::Network;
    use sim::machine::zlac8030l;

    use super::*;

    /// Frames, and when they came.
    #[derive(Clone, Debug, Default)]
    struct Heard(Arc<Mutex<Vec<(Instant, Frame)>>>);

    impl Listen for Heard {
        fn hear(&mut self, passed: BusFrame) {
            self.0.lock().expect("heard").push((passed.at, passed.frame));
        }
    }

    #[tokio::test]
    async fn a_program_that_is_held_up_misses_nothing_and_the_world_is_never_ahead_of_the_clock() {
        const RUN: Duration = Duration::from_millis(200);
        const HELD_UP: Duration = Duration::from_millis(80);
        let mut world = World::new(Bitrate::K500, 1);
        for node in 4..=6 {
            world.add_drive(node, Box::new(zlac8030l(node, 1))).expect("free");
        }
        let (mut twin, begun) = (world.clone(), world.now());
        let heard = Heard::default();
        twin.add_station(Tap::new(Network::new(), heard.clone()));
        twin.run_for(RUN);
        // Their boot-ups, one behind the other.
        let carried = std::mem::take(&mut *heard.0.lock().expect("heard"));
        assert_eq!(carried.len(), 3);
        let (clock, network, wakeup) = (WallClock::start(), Network::new(), Arc::new(Notify::new()));
        let (bus, _door) = WorldBus::new(world, &clock, Wire::default());
        network.on_activity(waker_of(Arc::clone(&wakeup)));
        let until = async {
            for milliseconds in 1..=200 {
                network.sleep(Duration::from_millis(1)).await;
                assert_eq!(network.now(), begun + Duration::from_millis(milliseconds));
                assert!(network.now() - begun <= clock.now() - Instant::ZERO);
                if milliseconds % 60 == 0 {
                    // A machine that stands still.
                    std::thread::sleep(HELD_UP);
                }
            }
        };
        bus.run(Tap::new(network.clone(), heard.clone()), &wakeup, until).await;
        assert_eq!(*heard.0.lock().expect("heard"), carried);
        // It has left out most of what it was late.
        assert!(clock.now() - Instant::ZERO >= RUN + 3 * (HELD_UP - MOST_BEHIND - STEP));
    }
    /// To the executor, and at once back.
    async fn give_way() {
        let mut gave_way = false;
        poll_fn(|context| {
            context.waker().wake_by_ref();
            if std::mem::replace(&mut gave_way, true) { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }

    #[tokio::test]
    async fn a_program_that_computes_for_long_lets_the_world_and_other_tasks_go_on() {
        let (clock, network, wakeup) = (WallClock::start(), Network::new(), Notify::new());
        let (bus, _door) = WorldBus::new(World::new(Bitrate::K500, 1), &clock, Wire::default());
        let turns = Arc::new(Mutex::new(0));
        let other = tokio::spawn({
            let turns = Arc::clone(&turns);
            async move {
                loop {
                    *turns.lock().expect("counted") += 1;
                    tokio::task::yield_now().await;
                }
            }
        });
        let until = async {
            let mut before = (network.now(), 0);
            for _ in 0..10 {
                for _ in 0..POLLS {
                    // It computes.
                    std::thread::sleep(Duration::from_micros(100));
                    give_way().await;
                }
                let now = (network.now(), *turns.lock().expect("counted"));
                assert!(now.0 > before.0 && now.1 > before.1, "{before:?}, then {now:?}");
                before = now;
            }
        };
        bus.run(network.clone(), &wakeup, until).await;
        other.abort();
    }
}

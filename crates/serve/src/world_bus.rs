//! The embedded world as a bus that passes with the clock, for a command that serves people: they live in its time.
//!
//! The world is moved whenever its bus is used, and at least once a millisecond. One that falls far behind (the machine slept)
//! does not catch up: the time between is left out.

use std::time::Duration;

use can::{Frame, Instant};
use host::{Wire, WorldAsks, WorldDoor};
use sim::pace::Pace;
use sim::recorder::LiveValues;
use sim::{StationId, World, WorldError};
use transport::{AsyncBus, BusError, Received, WallClock};

/// How finely the world follows the clock: the joints' answers come within some milliseconds.
const STEP: Duration = Duration::from_millis(1);

/// How far it may fall behind and still catch up.
const MOST_BEHIND: Duration = Duration::from_millis(250);

/// See the [module](self).
pub(crate) struct WorldBus {
    world: World,
    probe: StationId,
    clock: WallClock,
    pace: Pace,
    asks: WorldAsks,
    wire: Wire,
    values: LiveValues,
}

impl WorldBus {
    /// A bus of this world, whose time begins now, and where the world can be asked.
    pub(crate) fn new(mut world: World, clock: &WallClock, wire: Wire) -> (Self, WorldDoor) {
        let probe = world.add_probe();
        let begun = elapsed(clock);
        let pace = Pace::real_time(world.now()).rebased(begun, world.now());
        let values = world.live_values();
        values.set_host_time(Instant::ZERO + begun, world.now());
        let (door, asks) = host::world_door(Some(values.clone()));
        (Self { world, probe, clock: clock.clone(), pace, asks, wire, values }, door)
    }

    /// Moves the world to now.
    fn catch_up(&mut self) {
        let elapsed = elapsed(&self.clock);
        if self.pace.behind(elapsed, self.world.now()) > MOST_BEHIND {
            self.pace = self.pace.rebased(elapsed, self.world.now());
            self.values.set_host_time(Instant::ZERO + elapsed, self.world.now());
        }
        let target = self.pace.target(elapsed);
        if target > self.world.now() {
            self.world.run_until(target);
        }
        self.asks.answer(&mut self.world);
        let counters = self.world.counters(self.probe);
        self.wire.update(|health| {
            health.state = Some(counters.state().word());
            (health.transmit_errors, health.receive_errors) = (Some(counters.tec()), Some(counters.rec()));
            health.error_frames = self.world.statistics().errors;
        });
    }
}

impl AsyncBus for WorldBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        loop {
            self.catch_up();
            match self.world.send(self.probe, *frame) {
                // As many frames wait as a controller has room for: this one waits in the program.
                Err(WorldError::ProbeFull) => self.clock.sleep(STEP).await,
                // Nothing else can be wrong with a probe of this very world.
                _ => return Ok(()),
            }
        }
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        loop {
            self.catch_up();
            if let Some((at, frame)) = self.world.poll_received(self.probe) {
                let at = self.pace.elapsed_at(at).map_or_else(|| self.clock.now(), |elapsed| Instant::ZERO + elapsed);
                return Ok((at, frame.into()));
            }
            self.clock.sleep(STEP).await;
        }
    }
}

fn elapsed(clock: &WallClock) -> Duration {
    clock.now() - Instant::ZERO
}

#[cfg(test)]
mod tests {
    use can::Bitrate;
    use sim::machine::zlac8030l;

    use super::*;

    #[tokio::test]
    async fn frames_have_the_times_at_which_the_world_has_carried_them_however_late_they_are_taken() {
        let mut world = World::new(Bitrate::K500, 1);
        for node in 4..=6 {
            world.add_drive(node, Box::new(zlac8030l(node, 1))).expect("free");
        }
        let (mut twin, begun) = (world.clone(), world.now());
        let probe = twin.add_probe();
        twin.run_for(Duration::from_secs(1));
        let carried: Vec<(Instant, Frame)> = std::iter::from_fn(|| twin.poll_received(probe)).collect();
        // Their boot-ups, one behind the other.
        assert_eq!(carried.len(), 3);
        loop {
            let clock = WallClock::start();
            let (mut bus, _door) = WorldBus::new(world.clone(), &clock, Wire::default());
            let zero = bus.pace.elapsed_at(begun);
            let mut heard = Vec::new();
            for _ in &carried {
                heard.push(bus.recv_frame().await.expect("a world is always there"));
            }
            // A machine that stood still for so long that the time was left out shows nothing here.
            if bus.pace.elapsed_at(begun) == zero {
                let zero = Instant::ZERO + zero.expect("it goes on");
                let shown: Vec<_> = heard.iter().map(|(at, frame)| (begun + (*at - zero), *frame)).collect();
                assert_eq!(shown, carried);
                break;
            }
        }
    }
}

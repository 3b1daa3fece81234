//! A master on a bus whose time is the clock's: the bus in this thread, in one of its own in real time, or a world of this very
//! program. What the command line and the Python package do alike on a live bus is here; jobs, signals and words are theirs.
//!
//! A program that ends its work stops what it has moved ([`host::stopping::stop`]). One whose bus is lost cannot: [`LostBus`]
//! says what may be moving still.

use std::sync::Arc;

use can::{Instant, Station};
use host::stopping::Account;
use host::{Wire, WorldDoor};
use master::Network;
use sim::World;
use tokio::sync::Notify;
use transport::{AnyBus, BusError, BusSpec, BusThread, BusThreadError, Note, WallClock, run_station, waker_of};

use crate::world_bus::WorldBus;

/// A bus that is open, and the clock of its times.
pub struct LiveBus {
    bus: OpenBus,
    clock: WallClock,
}

/// Where the bus is.
#[allow(clippy::large_enum_variant, reason = "there is one, for as long as it is used")]
enum OpenBus {
    /// In the thread that asks.
    Here(AnyBus),
    /// In a thread of its own, in real time.
    Thread(BusThread),
    /// In the thread that asks, on a world of its own.
    World(WorldBus),
}

/// The bus was lost, and with it the way to the drives.
#[derive(Debug)]
pub struct LostBus {
    /// What the connection reported.
    pub error: BusError,
    /// The drives that had been set in motion: none of them was seen to stand.
    pub moving: Vec<Account>,
}

impl LiveBus {
    /// Opens a bus; `in_real_time` in a thread that nothing else of this program delays.
    ///
    /// # Errors
    /// Why it does not open, or does not run in real time.
    pub async fn open(spec: &BusSpec, in_real_time: bool) -> Result<Self, BusThreadError> {
        if in_real_time {
            let (thread, clock) = BusThread::open(spec.clone()).await?;
            return Ok(Self { bus: OpenBus::Thread(thread), clock });
        }
        let clock = WallClock::start();
        let bus = spec.open(&clock).await.map_err(BusThreadError::Bus)?;
        Ok(Self { bus: OpenBus::Here(bus), clock })
    }

    /// The bus of a world whose time begins now, and where that world can be asked.
    pub fn of_world(world: World, clock: WallClock, wire: Wire) -> (Self, WorldDoor) {
        let (bus, door) = WorldBus::new(world, &clock, wire);
        (Self { bus: OpenBus::World(bus), clock }, door)
    }

    /// The clock of the bus.
    pub const fn clock(&self) -> &WallClock {
        &self.clock
    }

    /// Runs `station`, which is `network` with what listens beside it, until `until` completes. `report` hears what the bus says
    /// beside frames. Where the bus is lost, `who` ("this command") lets go of the drives.
    ///
    /// # Errors
    /// The bus is lost.
    pub async fn run<U: Future>(
        self,
        (network, who): (&Network, &str),
        mut station: impl Station + Clone + Send + 'static,
        until: U,
        report: impl FnMut(Instant, &Note),
    ) -> Result<U::Output, LostBus> {
        let Self { bus, clock } = self;
        let wakeup = Arc::new(Notify::new());
        // What asks from another thread or task: a job, or all of it where the bus has a thread of its own.
        network.on_activity(waker_of(Arc::clone(&wakeup)));
        let ended = match bus {
            OpenBus::Here(mut bus) => run_station(&mut bus, &mut station, &clock, &wakeup, until, report).await,
            OpenBus::World(bus) => Ok(bus.run(station, &wakeup, until).await),
            OpenBus::Thread(thread) => thread.run(station, wakeup, until, report).await,
        };
        ended.map_err(|error| LostBus { error, moving: Account::of_lost_bus(network, who) })
    }
}

//! Drives, stations and the bus between them, moved from event to event in virtual time.

mod access;
mod ahead;
mod alone;
mod bodies;
mod body;
mod crew;
mod digest;
mod due;
mod external;
mod ledger;
mod log;
mod member;
mod mounted;
mod probe;
mod step;
mod stores;
mod watch;
mod watching;

use core::time::Duration;

use can::{Bitrate, Frame, Instant, Station};

pub use alone::LoneShaft;
pub use digest::Digest;
pub use external::{ExchangeError, ExternalShaft, Given};
pub use log::FrameLog;
pub use member::AnyStation;
pub use stores::StoredImage;

use crate::fault::{Corruption, NodeFaults};
use crate::machine::TimingMode;
use crate::recorder::{LivePlace, Recorder};
use crate::stimulus::Place;
use crate::wire::{Bus, ControllerOptions};
use crate::{Prng, VirtualDrive, seeds};
use body::CoupledBody;
use crew::{Crew, JobResult};
use due::DueTimes;
use ledger::Ledger;
use member::{Member, Vacant};
use watch::WorldWatch;

/// A bus with everything on it.
///
/// A clone is a snapshot: it goes on with identical results. (A station that shares state with others,
/// such as a handle to a master, shares it with its clone too.)
#[derive(Clone)]
pub struct World {
    now: Instant,
    seed: u64,
    timing: TimingMode,
    /// Some drive of it has noise or jitter.
    has_chance: bool,
    bus: Bus,
    members: Vec<Member>,
    due: DueTimes,
    log: FrameLog,
    digest: Digest,
    recorder: Option<Recorder>,
    live: LivePlace,
    /// By station, while stores are guarded.
    ledgers: Vec<Option<Ledger>>,
    watch: Option<Box<WorldWatch>>,
    /// What several drives move together.
    bodies: Vec<CoupledBody>,
    /// What sits on the shafts of others: the station, and the place of the shaft.
    mounted: Vec<(usize, Place)>,
    crew: Crew,
    /// Stations that the crew has done its last job with, and what they want.
    done_ahead: Vec<(usize, JobResult)>,
}

/// Names one station of one world: what `add_*` returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StationId(usize);

impl StationId {
    /// The number of its controller in [`WireEvent`](crate::wire::WireEvent).
    pub fn index(self) -> usize {
        self.0
    }
}

/// Why a world did not do what was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// A second drive under one number.
    #[error("there is already a drive {0}")]
    DuplicateDrive(u8),
    /// No drive was added under this number.
    #[error("there is no drive {0}")]
    NoSuchDrive(u8),
    /// The station is not a probe.
    #[error("station {} is not a probe", .0.0)]
    NotAProbe(StationId),
    /// More frames wait at this probe than it can hold.
    #[error("too many frames wait to be sent")]
    ProbeFull,
}

impl World {
    /// An empty bus at time zero. `seed` decides everything random.
    pub fn new(bitrate: Bitrate, seed: u64) -> Self {
        let mut seeds = Prng::new(seed);
        Self {
            now: Instant::ZERO,
            seed,
            timing: TimingMode::Ideal,
            has_chance: false,
            bus: Bus::new(bitrate, seeds.next_u64()),
            members: Vec::new(),
            due: DueTimes::default(),
            log: FrameLog::default(),
            digest: Digest::default(),
            recorder: None,
            live: LivePlace::default(),
            ledgers: Vec::new(),
            watch: None,
            bodies: Vec::new(),
            mounted: Vec::new(),
            crew: Crew::ALONE,
            done_ahead: Vec::new(),
        }
    }

    /// Whether drives that are added from now on take the time that such devices take to boot, to answer and to store. In a
    /// new world they take none. The world's seed decides their jitter.
    pub fn set_timing(&mut self, timing: TimingMode) {
        self.timing = timing;
    }

    /// Adds a drive under a number (the one users know it by, whatever its node-ID becomes) and powers it.
    pub fn add_drive(&mut self, number: u8, mut drive: Box<dyn VirtualDrive>) -> Result<StationId, WorldError> {
        if self.drive_id(number).is_some() {
            return Err(WorldError::DuplicateDrive(number));
        }
        if self.timing == TimingMode::Device {
            drive.set_timing(self.timing, seeds::timing_seed(self.seed, number), self.now);
            self.has_chance = true;
        }
        let id = self.add(Member::Drive { number, drive }, ControllerOptions::MICROCONTROLLER);
        self.set_power(number, true)?;
        Ok(id)
    }

    /// Whether its seed may have decided anything so far. If not, a world of any other seed has done the same.
    pub fn is_random(&self) -> bool {
        self.has_chance || self.bus.has_drawn()
    }

    /// Adds a station at the bus's bit rate, with a microcontroller's CAN controller.
    pub fn add_station<S: Station + Clone + Send + 'static>(&mut self, station: S) -> StationId {
        self.add_station_with(station, ControllerOptions::MICROCONTROLLER, self.bus.bitrate())
    }

    /// Adds a station with a controller of its own kind and bit rate.
    pub fn add_station_with<S: Station + Clone + Send + 'static>(
        &mut self,
        station: S,
        options: ControllerOptions,
        bitrate: Bitrate,
    ) -> StationId {
        let id = self.add(Member::Station(Box::new(station)), options);
        self.bus.restart(id.0, Some(bitrate), self.now);
        self.serve(id.0);
        id
    }

    /// Adds a CAN adapter that is written and read from outside: [`send`](Self::send), [`poll_received`](Self::poll_received).
    pub fn add_probe(&mut self) -> StationId {
        let id = self.add(Member::Probe(Box::default()), ControllerOptions::ADAPTER);
        self.bus.restart(id.0, Some(self.bus.bitrate()), self.now);
        id
    }

    /// Takes a station off the bus for good. Its identifier is not given to another.
    pub fn remove(&mut self, id: StationId) {
        self.members[id.0] = Member::Gone(Vacant);
        self.bus.restart(id.0, None, self.now);
        self.due.set(id.0, Instant::FAR_FUTURE);
    }

    /// The present in virtual time, counted from the start of the world.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// Moves on until nothing is left to do at or before `end`; then it is `end`.
    pub fn run_until(&mut self, end: Instant) {
        while self.next_event().is_some_and(|at| at <= end) {
            self.step();
        }
        self.move_to(end);
    }

    /// Moves on by `duration`.
    pub fn run_for(&mut self, duration: Duration) {
        self.run_until(self.now + duration);
    }

    /// Queues a frame at a probe.
    pub fn send(&mut self, probe: StationId, frame: Frame) -> Result<(), WorldError> {
        let Member::Probe(it) = &mut self.members[probe.0] else { return Err(WorldError::NotAProbe(probe)) };
        it.send(frame).map_err(|_| WorldError::ProbeFull)?;
        self.collect(probe.0);
        Ok(())
    }

    /// The next frame a probe heard, with the time of its last bit. Frames it sent itself are not among them.
    pub fn poll_received(&mut self, probe: StationId) -> Option<(Instant, Frame)> {
        match &mut self.members[probe.0] {
            Member::Probe(probe) => probe.poll_received(),
            _ => None,
        }
    }

    /// How many frames of a probe have got through: also one that another station has sent with it at the same time, the same to the last
    /// bit, of which the wire has one frame and the log one sender.
    pub fn frames_sent(&self, probe: StationId) -> u64 {
        if let Member::Probe(probe) = &self.members[probe.0] { probe.sent() } else { 0 }
    }

    /// True if a probe has heard a frame that has not been taken yet.
    pub fn has_received(&self, probe: StationId) -> bool {
        matches!(&self.members[probe.0], Member::Probe(probe) if probe.has_received())
    }

    /// Cuts a station's cable. It goes on alone.
    pub fn cut(&mut self, id: StationId) {
        self.bus.cut(id.0, self.now);
        self.keep_events();
    }

    /// Joins a cut cable.
    pub fn join(&mut self, id: StationId) {
        self.bus.join(id.0, self.now);
        self.keep_events();
    }

    /// Sets what is wrong with a station's access to the bus.
    pub fn set_node_faults(&mut self, id: StationId, faults: NodeFaults) {
        self.bus.set_faults(id.0, faults, self.now);
        self.collect(id.0);
    }

    /// Sets how the wire is disturbed from the next frame on.
    pub fn set_corruption(&mut self, corruption: Corruption) {
        self.bus.set_corruption(corruption);
    }

    /// A copy to come back to.
    pub fn snapshot(&self) -> Self {
        self.clone()
    }
}

//! A virtual machine with a host and one page, in one thread: its caller has the clock, and moves it.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use can::{Instant, Tap};
use console::line::Reader;
use host::capture::WaysBack;
use host::{Setting, Wire, WorldAsks, world_door};
use machine::file::Machine;
use master::Network;
use sim::World;
use sim::command::{self, Service, perform};
use sim::{StoredImage, VirtualDrive};
use words::document::BadFile;
use words::models::with_files;

use crate::hosted::{Hosted, PassedFrames};
use crate::requests::{Request, Response};

/// Longest wait for each answer of a node: virtual drives answer within some milliseconds.
const TIMEOUT: Duration = Duration::from_millis(200);

/// The first search for drives takes less.
const SEARCH: Duration = Duration::from_secs(3);

/// The drives boot before the host looks for them.
const BOOT: Duration = Duration::from_secs(1);

/// How often it is looked whether they are found.
const STEP: Duration = Duration::from_millis(50);

/// Why a call was refused: a word that programs may rely on, and words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failed {
    /// The word.
    pub kind: &'static str,
    /// What is wrong, what was expected, what to do.
    pub message: String,
}

impl Failed {
    pub(crate) fn new(kind: &'static str, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }
}

impl From<BadFile> for Failed {
    fn from(bad: BadFile) -> Self {
        Self::new("bad_file", bad.to_string())
    }
}

/// What a drive has stored in a world before, as [`HostedWorld::take_stores`] gave it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored {
    /// The number of the drive.
    pub number: u8,
    /// Its model: another one cannot use it.
    pub model: String,
    /// The content of its non-volatile memory.
    pub image: Vec<u8>,
}

/// It owns the world, the master on it, its host, and the conversation with the page.
pub struct HostedWorld {
    world: World,
    asks: WorldAsks,
    hosted: Hosted,
}

impl core::fmt::Debug for HostedWorld {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("HostedWorld").field("now", &self.now()).finish_non_exhaustive()
    }
}

impl HostedWorld {
    /// The machine of a machine file with a host that has found its drives, some two seconds after the power came on. `unix_zero` is the Unix
    /// time of the world's zero, for logs.
    ///
    /// # Errors
    /// What is wrong with the file, with the lines.
    pub fn open(machine: &str, unix_zero: Duration) -> Result<Self, Failed> {
        Self::open_with(machine, unix_zero, &[], false).map(|(world, _)| world)
    }

    /// The same with what its drives have stored before; and why that of a drive cannot be used, which begins as it left the factory then.
    /// With `is_kept` a drive acknowledges a store when [`confirm_store`](Self::confirm_store) has reported that its content is kept.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn open_with(
        machine: &str,
        unix_zero: Duration,
        stored: &[Stored],
        is_kept: bool,
    ) -> Result<(Self, Vec<String>), Failed> {
        let machine = Machine::parse_in(machine, Path::new(""))?;
        let mut unusable = Vec::new();
        let mut world = machine.build_with(&mut |number, drive| {
            if let Err(why) = put_back(stored, number, drive) {
                unusable.push(why);
            }
        })?;
        if is_kept {
            world.guard_stores();
        }
        let network = Network::new();
        network.set_models(with_files(machine.models().map(|(_, model)| model)));
        let passed = PassedFrames::default();
        world.add_station(Tap::new(network.clone(), passed.clone()));
        world.run_for(BOOT);
        let (door, asks) = world_door(Some(world.live_values()));
        let setting = Setting {
            bus: "sim".into(),
            bitrate: Some(world.bitrate()),
            timeout: TIMEOUT,
            models: machine.models().collect(),
            gears: machine.models().map(|(node, _)| (node, machine.gear(node))).collect(),
            groups: machine.groups.clone(),
            interface: "can0".into(),
            unix_zero,
            journals: None,
            world: Some(door),
            ways_back: WaysBack::default(),
            console: Some(Arc::new(Reader)),
            wire: Wire::default(),
            // All drives are virtual.
            allow_motion: true,
        };
        let mut hosted = Self { world, asks, hosted: Hosted::new(network, setting, passed) };
        hosted.join();
        let end = hosted.now() + SEARCH;
        while hosted.is_searching() && hosted.now() < end {
            hosted.run_until(hosted.now() + STEP);
        }
        Ok((hosted, unusable))
    }

    /// Whether the host has still to find its drives.
    fn is_searching(&self) -> bool {
        let state = self.hosted.handle().states().borrow().snapshot();
        state.scanning || state.nodes.is_empty()
    }

    /// Begins the conversation with the page anew: what it moved in the one before is stopped, as with any end of a connection.
    pub fn join(&mut self) {
        self.hosted.join();
        self.settle();
    }

    /// The world's time.
    pub fn now(&self) -> Instant {
        self.world.now()
    }

    /// Hands on a message of the page, as it would send it over the studio's socket. Its answer is among what is sent.
    pub fn say(&mut self, message: &str) {
        self.hosted.say(message);
        self.settle();
    }

    /// What the page is to be sent since the last call: JSON objects, the first one the welcome.
    pub fn take_sent(&mut self) -> Vec<String> {
        self.hosted.take_sent()
    }

    /// Moves the world on.
    pub fn run_until(&mut self, end: Instant) {
        loop {
            self.settle();
            match self.world.next_event() {
                Some(at) if at <= end => self.world.step(),
                _ => break,
            };
        }
        self.world.run_until(end);
    }

    /// What a request of the page is answered.
    pub fn request(&self, request: &Request, body: &[u8]) -> Response {
        self.hosted.request(request, body)
    }

    /// Does what a line says, and answers with a line of JSON: `4 supply 30`, `4 get`.
    ///
    /// # Errors
    /// What is wrong with the line. Time passes by [`run_until`](Self::run_until) alone.
    pub fn command(&mut self, line: &str) -> Result<String, Failed> {
        let failed = |error: command::CommandError| Failed::new(error.kind(), error.to_string());
        let command: command::Command = line.parse().map_err(failed)?;
        if let command::Command::Run(_) = command {
            return Err(Failed::new("usage", "time passes by calls of run here, not by a line"));
        }
        let answer = perform(&mut self.world, &command, Service::default()).map_err(failed)?;
        self.world.refresh();
        Ok(answer)
    }

    /// What drives have stored since the last call, each once.
    pub fn take_stores(&mut self) -> Vec<StoredImage> {
        std::iter::from_fn(|| self.world.poll_store()).collect()
    }

    /// A content that [`take_stores`](Self::take_stores) gave is kept: the drive acknowledges its store.
    pub fn confirm_store(&mut self, number: u8, generation: u64) {
        self.world.confirm_store(number, generation);
    }

    /// A hash of all that has happened: equal for equal runs, in every engine and natively.
    pub fn digest(&mut self) -> u64 {
        self.world.digest().value()
    }

    /// Has host and page do what they can do now.
    fn settle(&mut self) {
        while self.hosted.poll() {
            self.asks.answer(&mut self.world);
            self.world.refresh();
        }
    }
}

fn put_back(stored: &[Stored], number: u8, drive: &mut dyn VirtualDrive) -> Result<(), String> {
    let Some(Stored { model, image, .. }) = stored.iter().find(|stored| stored.number == number) else { return Ok(()) };
    let unusable =
        |why: &str| format!("what drive {number} has stored cannot be used, and it begins as from the factory: {why}");
    if model != drive.model() {
        return Err(unusable(&format!("it is that of a {model}, and the drive is a {}", drive.model())));
    }
    drive.load_nvm(image).map_err(|refused| unusable(&refused.to_string()))
}

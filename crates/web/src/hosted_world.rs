//! A virtual machine with a host and one page, in one thread: its caller has the clock, and moves it.

use std::collections::VecDeque;
use std::path::Path;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::{BusFrame, Instant, Listen, Tap};
use futures_util::stream::poll_fn;
use host::page::{Said, Word, serve};
use host::{Host, HostHandle, Setting, Wire, WorldAsks, world_door};
use machine::file::Machine;
use master::Network;
use sim::World;
use sim::command::{self, Service, perform};
use sim::task::Task;
use tokio::sync::mpsc;
use words::document::BadFile;
use words::models::with_files;

use crate::requests::{Request, Response, respond};

/// Longest wait for each answer of a node: virtual drives answer within some milliseconds.
const TIMEOUT: Duration = Duration::from_millis(200);

/// The first search for drives takes less.
const SEARCH: Duration = Duration::from_secs(3);

/// The drives boot before the host looks for them.
const BOOT: Duration = Duration::from_secs(1);

/// How often it is looked whether they are found.
const STEP: Duration = Duration::from_millis(50);

/// The page is the one of this module: no other can send a message.
const WORD: &str = "page";

/// Messages of the page that wait: each is taken when it comes.
const WAITING: usize = 64;

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

type Work = Task<Pin<Box<dyn Future<Output = ()>>>>;

/// It owns the world, the master on it, its host, and the conversation with the page.
pub struct HostedWorld {
    world: World,
    asks: WorldAsks,
    handle: HostHandle,
    hosting: Work,
    /// The conversation with the page.
    conversation: Work,
    said: mpsc::Sender<Said>,
    sending: mpsc::Receiver<String>,
    sent: Vec<String>,
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
        let machine = Machine::parse_in(machine, Path::new(""))?;
        let mut world = machine.build()?;
        let network = Network::new();
        network.set_models(with_files(machine.models().map(|(_, model)| model)));
        let passed = Passed::default();
        world.add_station(Tap::new(network.clone(), passed.clone()));
        world.run_for(BOOT);
        let (door, asks) = world_door();
        let setting = Setting {
            bus: "sim".into(),
            bitrate: Some(world.bitrate()),
            timeout: TIMEOUT,
            models: machine.models().collect(),
            gears: machine.models().map(|(node, _)| (node, machine.gear(node))).collect(),
            interface: "can0".into(),
            unix_zero,
            journals: None,
            world: Some(door),
            wire: Wire::default(),
            // All drives are virtual.
            allow_motion: true,
        };
        let (host, handle) = Host::new(network, setting);
        let hosting = Task::new(boxed(host.run(move || passed.lock().pop_front())));
        let (conversation, said, sending) = converse(&handle);
        let mut hosted = Self { world, asks, handle, hosting, conversation, said, sending, sent: Vec::new() };
        hosted.settle();
        let end = hosted.now() + SEARCH;
        while hosted.is_searching() && hosted.now() < end {
            hosted.run_until(hosted.now() + STEP);
        }
        Ok(hosted)
    }

    /// Whether the host has still to find its drives.
    fn is_searching(&self) -> bool {
        let state = self.handle.states().borrow().snapshot();
        state.scanning || state.nodes.is_empty()
    }

    /// Begins the conversation with the page anew: what it moved in the one before is stopped, as with any end of a connection.
    pub fn join(&mut self) {
        self.sent.clear();
        (self.conversation, self.said, self.sending) = converse(&self.handle);
        self.settle();
    }

    /// The world's time.
    pub fn now(&self) -> Instant {
        self.world.now()
    }

    /// Hands on a message of the page, as it would send it over the studio's socket. Its answer is among what is sent.
    pub fn say(&mut self, message: &str) {
        // There is room: the conversation takes each at once.
        let _ = self.said.try_send(Said::Text(message.to_owned()));
        self.settle();
    }

    /// What the page is to be sent since the last call: JSON objects, the first one the welcome.
    pub fn take_sent(&mut self) -> Vec<String> {
        std::mem::take(&mut self.sent)
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
        respond(&self.handle, request, body)
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

    /// A hash of all that has happened: equal for equal runs, in every engine and natively.
    pub fn digest(&mut self) -> u64 {
        self.world.digest().value()
    }

    /// Has host and page do what they can do now.
    fn settle(&mut self) {
        loop {
            let mut polled = false;
            for task in [&mut self.hosting, &mut self.conversation] {
                polled |= task.poll_if_woken().is_some();
            }
            if !polled {
                return;
            }
            while let Ok(message) = self.sending.try_recv() {
                self.sent.push(message);
            }
            self.asks.answer(&mut self.world);
            self.world.refresh();
        }
    }
}

/// Opens a session, and serves it: the conversation, where its messages go, and where those to the page come from.
fn converse(handle: &HostHandle) -> (Work, mpsc::Sender<Said>, mpsc::Receiver<String>) {
    let (said, mut saying) = mpsc::channel(WAITING);
    let (to_page, sending) = mpsc::channel(1);
    let page = handle.clone();
    let conversation = async move {
        let Some(session) = page.join().await else { return };
        let word = Word { text: WORD.into(), is_same: |a, b| a == b };
        serve(&page, session, word, poll_fn(move |context| saying.poll_recv(context)), to_page).await;
    };
    (Task::new(boxed(conversation)), said, sending)
}

fn boxed(future: impl Future<Output = ()> + 'static) -> Pin<Box<dyn Future<Output = ()>>> {
    Box::pin(future)
}

/// The frames that have passed the master since the host has taken them.
#[derive(Clone, Default)]
struct Passed(Arc<Mutex<VecDeque<BusFrame>>>);

impl Passed {
    fn lock(&self) -> MutexGuard<'_, VecDeque<BusFrame>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listen for Passed {
    fn hear(&mut self, passed: BusFrame) {
        self.lock().push_back(passed);
    }
}

//! A scenario under way in a world that the caller moves: what it does, looks at and waits for, without a clock of its
//! own. [`Runner`](super::Runner) moves the world in virtual time.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::pin::Pin;
use std::rc::Rc;
use std::task::Waker;

use can::Instant;
use master::Network;
use sim::task::Task;
use sim::wire::WireEvent;
use sim::{StationId, World};

use super::command::Command;
use super::condition::{Condition, View};
use super::file::Scenario;
use super::host::{HostBoard, HostTask, run};
use super::occurrence::Occurrence;
use super::outcome::{Outcome, Row, RowKind, Verdict};
use super::script::Script;
use machine::file::SEED;
use words::document::BadFile;
use words::models::with_files;

/// Frames that the outcome of a failed run lists.
const FRAMES_SHOWN: usize = 24;

/// A scenario that goes along with a world which the caller moves.
///
/// The caller moves the world no further than [`Execution::next_time`] and calls [`Execution::look`] there, hands on
/// what happens with [`Execution::hear`], and calls [`Execution::go_on`] after each of these.
pub struct Execution {
    scenario: Scenario,
    seed: u64,
    host: StationId,
    /// The hosts at work; `None` for one that is through.
    tasks: Vec<Option<Task<HostFuture>>>,
    shared: Rc<RefCell<HostBoard>>,
    script: Script,
    next_sample: Instant,
    frames: VecDeque<(Instant, can::Frame)>,
    finished: bool,
}

/// A host as it goes through its lines.
type HostFuture = Pin<Box<dyn Future<Output = ()>>>;

impl Execution {
    /// The world of a scenario at time zero, with the power just come on, and its execution. Without a seed it is that of the scenario,
    /// of its machine, or 1.
    ///
    /// The scenario's hosts are one master on the bus. A scenario without any has a master too, which says nothing; or, if it
    /// [`is_served`](Self::is_served_by), the CAN adapter of a host outside.
    ///
    /// # Errors
    /// What a drive of the machine does not take.
    pub fn begin(scenario: &Scenario, seed: Option<u64>) -> Result<(World, Self), BadFile> {
        let seed = seed.or(scenario.seed).or(scenario.machine.seed).unwrap_or(SEED);
        let mut machine = scenario.whole_machine();
        machine.seed = Some(seed);
        let mut world = machine.build()?;
        let network = Network::new();
        network.set_models(with_files(scenario.machine.models().map(|(_, model)| model)));
        let host = world.add_station(network.clone());
        let shared = Rc::new(RefCell::new(HostBoard::default()));
        let machine = Rc::new(scenario.machine.clone());
        let sheets = Rc::new(scenario.sheets.clone());
        let paths = Rc::new(scenario.paths.clone());
        let tasks = scenario.hosts.iter().enumerate().map(|(number, it)| {
            let (machine, sheets, shared) = (Rc::clone(&machine), Rc::clone(&sheets), Rc::clone(&shared));
            let (paths, network) = (Rc::clone(&paths), network.clone());
            let task = HostTask { number, name: it.name.clone(), network, machine, sheets, paths, shared };
            let future: HostFuture = Box::pin(run(task, it.start, it.lines.clone()));
            Some(Task::new(future))
        });
        let tasks = tasks.collect();
        world.refresh();
        if scenario.needs_events() {
            world.watch(true);
        }
        let execution = Self {
            scenario: scenario.clone(),
            seed,
            host,
            tasks,
            shared,
            script: Script::new(scenario),
            next_sample: Instant::ZERO,
            frames: VecDeque::with_capacity(FRAMES_SHOWN),
            finished: false,
        };
        Ok((world, execution))
    }

    /// A host outside of the world, at this adapter, plays with it. In a scenario without hosts of its own it takes their place: it is
    /// the one whose cable is cut, and that dies.
    pub fn is_served_by(&mut self, adapter: StationId, world: &mut World) {
        if !self.scenario.has_hosts() {
            world.remove(self.host);
            self.host = adapter;
        }
    }

    /// When it ends at the latest.
    pub fn limit(&self) -> Instant {
        Instant::ZERO + self.scenario.end.unwrap_or(self.scenario.limit)
    }

    /// Whether it is at its end: nothing is left to be done or decided, or its time is up.
    pub fn is_over(&self) -> bool {
        self.finished
    }

    /// Has the hosts do what they can do now; false at the end of the run.
    pub fn go_on(&mut self, world: &mut World) -> bool {
        if !self.finished {
            self.poll_hosts(world);
            self.finished = world.now() >= self.limit() || self.is_through();
        }
        !self.finished
    }

    /// When values are to be looked at next; never before `now`, and `None` after the end.
    pub fn next_time(&self, now: Instant) -> Option<Instant> {
        if self.finished {
            return None;
        }
        let planned = self.script.next_time(&self.scenario);
        let samples = self.script.samples(&self.scenario) || self.hosts_wait_for_values();
        let sample = samples.then_some(self.next_sample.max(now));
        planned.into_iter().chain(sample).chain([self.limit()]).min()
    }

    /// Looks at values, as is due at [`next_time`](Self::next_time).
    pub fn look(&mut self, world: &mut World) {
        self.look_at(world, None);
        let now = world.now();
        if self.next_sample <= now {
            let period = self.scenario.sample.as_nanos() as u64;
            self.next_sample = Instant::from_nanos((now.as_nanos() / period + 1) * period);
        }
    }

    /// Takes in what has just happened.
    pub fn hear(&mut self, world: &mut World, occurrence: Occurrence<'_>) {
        if self.finished {
            return;
        }
        if let Occurrence::Wire(WireEvent::Frame { end, frame, .. }) = occurrence {
            if self.frames.len() == FRAMES_SHOWN {
                self.frames.pop_front();
            }
            self.frames.push_back((*end, *frame));
        }
        self.look_at(world, Some(occurrence));
    }

    /// Ends the run where it stands, and gives the outcome.
    pub fn conclude(mut self, world: &mut World) -> Outcome {
        self.script.conclude(&self.scenario, world);
        self.conclude_hosts();
        let mut rows = std::mem::take(&mut self.script.rows);
        rows.append(&mut self.shared.borrow_mut().rows);
        rows.sort_by_key(|row| (row.at.unwrap_or(Instant::FAR_FUTURE), row.place));
        let mut outcome = Outcome {
            title: self.scenario.title.clone(),
            seed: self.seed,
            parameters: self.scenario.parameters.clone().into_iter().collect(),
            end: world.now(),
            rows,
            figures: self.script.figures(&self.scenario),
            digest: world.digest().value(),
            is_random: world.is_random(),
            last_frames: Vec::new(),
        };
        if !outcome.passed() {
            let shown =
                |(at, frame): &(Instant, can::Frame)| format!("({:.6}) can0 {frame}", at.as_nanos() as f64 / 1e9);
            outcome.last_frames = self.frames.iter().map(shown).collect();
        }
        outcome
    }

    /// What hosts have left undone. Of a host that has died nothing more is asked.
    fn conclude_hosts(&mut self) {
        if self.script.host_died {
            return;
        }
        let mut shared = self.shared.borrow_mut();
        for host in &self.scenario.hosts {
            let lines = host.lines.iter().filter(|line| {
                !shared
                    .rows
                    .iter()
                    .any(|row| row.kind == RowKind::Host && row.place == line.place.line && row.asked == line.asked)
            });
            let left: Vec<_> = lines.cloned().collect();
            for (n, line) in left.into_iter().enumerate() {
                let (verdict, seen) = match n {
                    0 => (Verdict::Failed, "not done by the end of the run"),
                    _ => (Verdict::Skipped, "not reached"),
                };
                let name = line.name.unwrap_or_else(|| host.name.clone());
                let (asked, place) = (line.asked, line.place.line);
                shared.rows.push(Row { kind: RowKind::Host, name, asked, at: None, seen: seen.into(), verdict, place });
            }
        }
    }

    fn is_through(&self) -> bool {
        let hosts = self.script.host_died || self.tasks.iter().all(Option::is_none);
        self.scenario.end.is_none() && hosts && self.script.is_through(&self.scenario)
    }

    /// Polls the hosts that were woken, until none is.
    fn poll_hosts(&mut self, world: &mut World) {
        if self.script.host_died {
            self.tasks.clear();
            return;
        }
        let mut polled = true;
        while std::mem::take(&mut polled) {
            for host in &mut self.tasks {
                let Some(outcome) = host.as_mut().and_then(Task::poll_if_woken) else { continue };
                if outcome.is_ready() {
                    *host = None;
                }
                polled = true;
            }
            if polled {
                world.refresh();
            }
        }
        let done = std::mem::take(&mut self.shared.borrow_mut().done);
        if !done.is_empty() {
            let now = world.now();
            done.iter().for_each(|name| self.script.note_done(name, now));
            self.look_at(world, None);
        }
    }

    fn look_at(&mut self, world: &mut World, occurrence: Option<Occurrence<'_>>) {
        self.script.look(&self.scenario, world, self.host, occurrence);
        self.look_for_hosts(world, occurrence);
    }

    /// The condition of a line of a host that waits for one.
    fn condition_of(scenario: &Scenario, (host, line): (usize, usize)) -> Option<&Condition> {
        match &scenario.hosts.get(host)?.lines.get(line)?.command {
            Command::WaitFor(condition, _) => Some(condition),
            _ => None,
        }
    }

    fn hosts_wait_for_values(&self) -> bool {
        let shared = self.shared.borrow();
        let mut waiting = shared.waits.iter().filter(|waiting| !waiting.so);
        waiting.any(|waiting| Self::condition_of(&self.scenario, waiting.line).is_some_and(|it| !it.is_event()))
    }

    /// Tells hosts that what they wait for is so.
    fn look_for_hosts(&mut self, world: &mut World, occurrence: Option<Occurrence<'_>>) {
        let mut shared = self.shared.borrow_mut();
        for waiting in shared.waits.iter_mut().filter(|waiting| !waiting.so) {
            let Some(condition) = Self::condition_of(&self.scenario, waiting.line) else { continue };
            let done = |name: &str| self.script.is_done(name);
            if condition.is_event() == occurrence.is_some()
                && condition.holds(&mut View { world, occurrence, done: &done })
            {
                waiting.so = true;
                waiting.waker.take().into_iter().for_each(Waker::wake);
            }
        }
    }
}

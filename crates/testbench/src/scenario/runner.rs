//! Goes through a scenario in virtual time: from event to event of its world, and to each time that the scenario names.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

use can::Instant;
use master::Network;
use sim::wire::WireEvent;
use sim::{StationId, World};

use super::condition::View;
use super::deed::Deed;
use super::file::Scenario;
use super::host::{Desk, Post, run};
use super::outcome::{Outcome, Row, RowKind, Verdict};
use super::script::Script;
use crate::document::BadFile;
use crate::machine_file::{Machine, SEED};
use crate::models::with_told;

/// Frames that the outcome of a failed run tells.
const FRAMES_TOLD: usize = 24;

/// A run of a scenario: stepped by whoever wants to look in between, or [run](Self::run) to its end.
pub struct Runner {
    scenario: Scenario,
    seed: u64,
    world: World,
    host: StationId,
    tasks: Vec<Task>,
    desk: Rc<RefCell<Desk>>,
    script: Script,
    next_sample: Instant,
    frames: VecDeque<(Instant, can::Frame)>,
    /// All frames since the last call of [`Runner::take_carried`], for a record.
    carried: Option<Vec<(Instant, can::Frame)>>,
    finished: bool,
}

/// One host at work.
struct Task {
    future: Option<Pin<Box<dyn Future<Output = ()>>>>,
    woken: Arc<Woken>,
}

/// Remembers that somebody called the waker.
struct Woken(AtomicBool);

impl Wake for Woken {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Release);
    }
}

impl Runner {
    /// A run at time zero, with the power just come on. Without a seed it is that of the scenario, of its machine, or 1.
    ///
    /// # Errors
    /// What a drive of the machine does not take.
    pub fn new(scenario: &Scenario, seed: Option<u64>) -> Result<Self, BadFile> {
        let seed = seed.or(scenario.seed).or(scenario.machine.seed).unwrap_or(SEED);
        let mut world = Machine { seed: Some(seed), ..scenario.machine.clone() }.build()?;
        let network = Network::new();
        network.set_models(with_told(scenario.machine.models().map(|(_, model)| model)));
        let host = world.add_station(network.clone());
        let desk = Rc::new(RefCell::new(Desk::default()));
        let tasks = scenario.hosts.iter().enumerate().map(|(number, it)| {
            let models = scenario.machine.models().collect();
            let post = Post { number, name: it.name.clone(), network: network.clone(), models, desk: Rc::clone(&desk) };
            let future = run(post, it.start, it.lines.clone());
            Task { future: Some(Box::pin(future)), woken: Arc::new(Woken(AtomicBool::new(true))) }
        });
        let tasks = tasks.collect();
        world.refresh();
        let script = Script::new(scenario);
        let scenario = scenario.clone();
        let frames = VecDeque::with_capacity(FRAMES_TOLD);
        Ok(Self {
            scenario,
            seed,
            world,
            host,
            tasks,
            desk,
            script,
            next_sample: Instant::ZERO,
            frames,
            carried: None,
            finished: false,
        })
    }

    /// The present of the run.
    pub fn now(&self) -> Instant {
        self.world.now()
    }

    /// When it ends at the latest.
    pub fn limit(&self) -> Instant {
        Instant::ZERO + self.scenario.end.unwrap_or(self.scenario.limit)
    }

    /// The world as it stands.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The world, to put a recorder into it or to change what no scenario says.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// From now on all frames are kept for [`take_carried`](Self::take_carried).
    pub fn keep_carried(&mut self) {
        self.carried.get_or_insert_default();
    }

    /// The frames that the bus has carried since the last call, each with the time of its last bit.
    pub fn take_carried(&mut self) -> Vec<(Instant, can::Frame)> {
        self.carried.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Goes to the end.
    pub fn run(mut self) -> Outcome {
        while self.step() {}
        self.conclude()
    }

    /// Goes on to the next event; false at the end of the run.
    pub fn step(&mut self) -> bool {
        if self.finished {
            return false;
        }
        self.poll_hosts();
        let now = self.world.now();
        if now >= self.limit() || self.is_through() {
            self.finished = true;
            return false;
        }
        let planned = self.script.next_time(&self.scenario);
        let samples = self.script.samples(&self.scenario) || self.hosts_wait_for_values();
        let sample = samples.then_some(self.next_sample.max(now));
        let own = planned.into_iter().chain(sample).chain([self.limit()]).min().unwrap_or_else(|| self.limit());
        match self.world.next_event() {
            Some(at) if at <= own => {
                self.world.step();
                self.look_at_events();
            }
            _ => {
                self.world.run_until(own);
                self.look(None);
                if self.next_sample <= own {
                    let period = self.scenario.sample.as_nanos() as u64;
                    self.next_sample = Instant::from_nanos((own.as_nanos() / period + 1) * period);
                }
            }
        }
        true
    }

    /// Ends the run where it stands, and tells what came of it.
    pub fn conclude(mut self) -> Outcome {
        self.script.conclude(&self.scenario, &mut self.world);
        self.conclude_hosts();
        let mut rows = std::mem::take(&mut self.script.rows);
        rows.append(&mut self.desk.borrow_mut().rows);
        rows.sort_by_key(|row| (row.at.unwrap_or(Instant::FAR_FUTURE), row.place));
        let mut outcome = Outcome {
            title: self.scenario.title.clone(),
            seed: self.seed,
            parameters: self.scenario.parameters.clone().into_iter().collect(),
            end: self.world.now(),
            rows,
            figures: self.script.figures(&self.scenario),
            digest: self.world.digest().value(),
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
        let mut desk = self.desk.borrow_mut();
        for host in &self.scenario.hosts {
            let lines = host.lines.iter().filter(|line| {
                !desk
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
                desk.rows.push(Row { kind: RowKind::Host, name, asked, at: None, seen: seen.into(), verdict, place });
            }
        }
    }

    fn is_through(&self) -> bool {
        let hosts = self.script.host_died || self.tasks.iter().all(|task| task.future.is_none());
        self.scenario.end.is_none() && hosts && self.script.is_through(&self.scenario)
    }

    /// Polls the hosts that were woken, until none is.
    fn poll_hosts(&mut self) {
        if self.script.host_died {
            self.tasks.clear();
            return;
        }
        let mut polled = true;
        while std::mem::take(&mut polled) {
            for task in &mut self.tasks {
                let Some(future) = &mut task.future else { continue };
                if task.woken.0.swap(false, Ordering::AcqRel) {
                    let waker = Waker::from(Arc::clone(&task.woken));
                    if let Poll::Ready(()) = future.as_mut().poll(&mut Context::from_waker(&waker)) {
                        task.future = None;
                    }
                    polled = true;
                }
            }
            if polled {
                self.world.refresh();
            }
        }
        let done = std::mem::take(&mut self.desk.borrow_mut().done);
        if !done.is_empty() {
            let now = self.world.now();
            done.iter().for_each(|name| self.script.note_done(name, now));
            self.look(None);
        }
    }

    /// Hands on what has happened on the wire.
    fn look_at_events(&mut self) {
        while let Some(event) = self.world.log_mut().pull() {
            if let WireEvent::Frame { end, frame, .. } = event {
                if self.frames.len() == FRAMES_TOLD {
                    self.frames.pop_front();
                }
                self.frames.push_back((end, frame));
                if let Some(carried) = &mut self.carried {
                    carried.push((end, frame));
                }
            }
            self.look(Some(&event));
        }
    }

    fn look(&mut self, event: Option<&WireEvent>) {
        self.script.look(&self.scenario, &mut self.world, self.host, event);
        self.look_for_hosts(event);
    }

    /// The condition of a line of a host that waits for one.
    fn condition_of(scenario: &Scenario, (host, line): (usize, usize)) -> Option<&super::condition::Condition> {
        match &scenario.hosts.get(host)?.lines.get(line)?.deed {
            Deed::WaitFor(condition, _) => Some(condition),
            _ => None,
        }
    }

    fn hosts_wait_for_values(&self) -> bool {
        let desk = self.desk.borrow();
        let mut waiting = desk.waits.iter().filter(|waiting| !waiting.so);
        waiting.any(|waiting| Self::condition_of(&self.scenario, waiting.line).is_some_and(|it| !it.is_event()))
    }

    /// Tells hosts that what they wait for is so.
    fn look_for_hosts(&mut self, event: Option<&WireEvent>) {
        let mut desk = self.desk.borrow_mut();
        for waiting in desk.waits.iter_mut().filter(|waiting| !waiting.so) {
            let Some(condition) = Self::condition_of(&self.scenario, waiting.line) else { continue };
            let done = |name: &str| self.script.is_done(name);
            if condition.is_event() == event.is_some()
                && condition.holds(&mut View { world: &mut self.world, event, done: &done })
            {
                waiting.so = true;
                waiting.waker.take().into_iter().for_each(Waker::wake);
            }
        }
    }
}

//! A world that Python holds: drives, adapters and time, behind a lock, and what waits for it.

mod happened;
mod jobs;
mod record;
mod report;
mod stimulus;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use host::events;
use machine::file::{self, Machine};
use master::decode::Decoder;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyDict, PyTuple};
use sim::command;
use sim::machine::{TimingMode, order};
use sim::stimulus::{FORMS, Place};
use sim::wire::{Statistics, WireEvent};
use sim::{Fidelity, StationId, VirtualDrive};
use words::drive::{DriveSpec, drive_spec};

use crate::failure::{bad_value, named, refused, wrong_use};
use crate::frames::{Plain, frame, plain};
use crate::process;
use crate::sheets::{model_of, node_id};
use happened::Happened;
pub(crate) use jobs::{Job, Jobs};
use record::Recordings;

/// How far a world is moved in one go before Python's signal handlers get their turn (Ctrl-C). Where it is cut changes
/// nothing in the run.
const SLICE: Duration = Duration::from_millis(200);

/// Samples that are kept of each signal for a picture: it is not wider.
const MOST_KEPT: u128 = 100_000;

/// What a stimulus may say, one form a line, as `help` of `ferrodrive sim` lists them.
#[pyfunction]
pub(crate) fn stimulus_forms() -> Vec<&'static str> {
    FORMS.to_vec()
}

/// The words of a world command that says the same as the arguments of a stimulus, without its node.
#[pyfunction]
#[pyo3(signature = (name, *values))]
pub(crate) fn stimulus_words(name: &str, values: &Bound<'_, PyTuple>) -> PyResult<String> {
    let of_node = || stimulus::of_node(name, values).map(|done| done.to_string());
    let of_body = || stimulus::of_body(name, values).map(|done| done.to_string());
    let of_wire = |_| stimulus::of_wire(name, values).map(|done| done.to_string());
    of_node().or_else(|_| of_body()).or_else(of_wire)
}

pub(crate) fn place_of(text: &str) -> PyResult<Place> {
    text.parse().map_err(|()| bad_value(format!("{text:?} is not a node; expected 1 to 127")))
}

fn timing_mode(timing: &str) -> PyResult<TimingMode> {
    timing.parse().map_err(|_| bad_value(format!("{timing:?} is not a timing; expected device or ideal")))
}

fn fidelity_of(fidelity: &str) -> PyResult<Fidelity> {
    fidelity.parse().map_err(|_| bad_value(format!("{fidelity:?} is not a fidelity; expected full or mechanical")))
}

/// A bus with everything on it, in virtual time; `ferrodrive.World` is what users have.
#[pyclass(frozen, subclass, weakref, module = "ferrodrive._native")]
pub(crate) struct World {
    shared: Arc<Shared>,
}

/// What a world's handles share.
pub(crate) struct Shared {
    /// Of the process that has made it.
    process: u32,
    state: Mutex<WorldState>,
}

/// The world and what waits for it.
pub(crate) struct WorldState {
    pub(crate) world: sim::World,
    pub(crate) jobs: Jobs,
    /// In the order in which Python numbers them.
    probes: Vec<StationId>,
    recordings: Recordings,
    happened: Happened,
    /// What its machine file says, for a master that joins it.
    machine: Option<Arc<Machine>>,
    /// Of drives that are added and do not say it.
    fidelity: Fidelity,
}

/// Why [`World::advance`] came back.
enum Came {
    /// To the end of the time it was given.
    ToTheEnd,
    /// Something was heard at the probe of this number.
    Heard(usize),
    /// The job of this number has ended.
    Done(u64),
    /// Nothing will ever happen any more.
    Stalled,
    /// As far as it goes in one go.
    SomeWay,
}

impl Shared {
    /// The state, for this process alone.
    pub(crate) fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, WorldState>> {
        self.check_process()?;
        Ok(self.state.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner))
    }

    pub(crate) fn check_process(&self) -> PyResult<()> {
        if process::generation() == self.process {
            return Ok(());
        }
        Err(wrong_use(
            "this world belongs to the process that made it, and this one was forked from that; make a world of its own in each process",
        ))
    }

    /// The lock of the state, for a caller that has looked at the process.
    pub(crate) fn state(&self) -> &Mutex<WorldState> {
        &self.state
    }

    /// Works with the state while other Python threads run.
    pub(crate) fn detached<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut WorldState) -> T + Send,
    ) -> PyResult<T> {
        self.check_process()?;
        Ok(py.detach(|| work(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))))
    }
}

impl WorldState {
    fn new(world: sim::World) -> Self {
        let (recordings, happened) = (Recordings::default(), Happened::default());
        Self {
            world,
            jobs: Jobs::default(),
            probes: Vec::new(),
            recordings,
            happened,
            machine: None,
            fidelity: Fidelity::Full,
        }
    }

    /// What its machine file says, if it is of one.
    pub(crate) fn machine(&self) -> Option<Arc<Machine>> {
        self.machine.clone()
    }

    fn probe(&self, number: usize) -> PyResult<StationId> {
        self.probes
            .get(number)
            .copied()
            .ok_or_else(|| bad_value(format!("expected an adapter of this world, got {number}")))
    }

    /// Moves to the first event that a caller waits for, at most to `until`.
    fn advance(&mut self, until: Option<Instant>, probes: &[StationId]) -> Came {
        let came = self.advance_unrecorded(until, probes);
        self.keep_record();
        came
    }

    fn run_for(&mut self, duration: Duration) {
        self.world.run_for(duration);
        self.keep_record();
    }

    pub(crate) fn keep_record(&mut self) {
        self.recordings.keep_up(&mut self.world, &mut self.happened);
    }

    fn advance_unrecorded(&mut self, until: Option<Instant>, probes: &[StationId]) -> Came {
        let slice_end = self.world.now() + SLICE;
        let end = until.unwrap_or(Instant::FAR_FUTURE);
        loop {
            if let Some(heard) = probes.iter().position(|probe| self.world.has_received(*probe)) {
                return Came::Heard(heard);
            }
            if let Some(done) = self.jobs.poll(&mut self.world) {
                return Came::Done(done);
            }
            match self.world.next_event() {
                Some(at) if at <= end => {
                    if at > slice_end {
                        self.world.run_until(slice_end);
                        return Came::SomeWay;
                    }
                    self.world.step();
                }
                None if until.is_none() => return Came::Stalled,
                _ if end > slice_end => {
                    self.world.run_until(slice_end);
                    return Came::SomeWay;
                }
                _ => {
                    self.world.run_until(end);
                    return Came::ToTheEnd;
                }
            }
        }
    }
}

impl World {
    /// What its handles share.
    pub(crate) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    fn holding(world: sim::World) -> Self {
        let state = Mutex::new(WorldState::new(world));
        Self { shared: Arc::new(Shared { process: process::generation(), state }) }
    }

    /// Puts a drive onto the bus that is built as described, of the world's fidelity unless it has its own.
    fn order(&self, py: Python<'_>, number: u8, mut spec: DriveSpec) -> PyResult<()> {
        let (bitrate, fidelity) = {
            let state = self.shared.lock(py)?;
            (state.world.bitrate(), state.fidelity)
        };
        spec.fidelity = spec.fidelity.or(Some(fidelity));
        self.put(py, number, order(spec.model, &spec.order(bitrate)).map_err(refused)?)
    }

    fn put(&self, py: Python<'_>, number: u8, drive: Box<dyn VirtualDrive>) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        state.world.add_drive(number, drive).map_err(refused)?;
        state.recordings.follow(&mut state.world, &mut state.happened);
        Ok(())
    }
}

#[pymethods]
impl World {
    #[new]
    fn new(bitrate: &str, seed: u64) -> PyResult<Self> {
        let known: Bitrate = bitrate.parse().map_err(|error| bad_value(format!("{bitrate:?}: {error}")))?;
        Ok(Self::holding(sim::World::new(known, seed)))
    }

    /// Bit rate of the bus in bit/s.
    #[getter]
    fn bitrate(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.shared.lock(py)?.world.bitrate().bits_per_second())
    }

    /// The present in ns since the world began.
    #[getter]
    fn now_ns(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.shared.lock(py)?.world.now().as_nanos())
    }

    /// Numbers of the drives, in the order in which they were added.
    #[getter]
    fn nodes(&self, py: Python<'_>) -> PyResult<Vec<u16>> {
        // Bytes would become `bytes`.
        Ok(self.shared.lock(py)?.world.drive_numbers().map(u16::from).collect())
    }

    /// Puts a drive of a model (or of a file that describes one) onto the bus, with what is special about it, and powers it.
    fn add_drive(&self, py: Python<'_>, model: &str, node: u8, options: Vec<(String, String)>) -> PyResult<()> {
        let mut spec = DriveSpec::new(model_of(model)?, node_id(node)?);
        for (key, value) in options {
            spec.set(&key, &value).map_err(bad_value)?;
        }
        self.order(py, node, spec)
    }

    /// The same of a drive in words, `zlac8030l@4,motor=fast`; its number.
    fn add_described(&self, py: Python<'_>, words: &str) -> PyResult<u8> {
        let spec = drive_spec(words).map_err(bad_value)?;
        let number = spec.node.raw();
        self.order(py, number, spec)?;
        Ok(number)
    }

    /// How long boot, answers and stores take of drives that are added from here on: `ideal`, or `device`.
    fn set_timing(&self, py: Python<'_>, timing: &str) -> PyResult<()> {
        self.shared.lock(py)?.world.set_timing(timing_mode(timing)?);
        Ok(())
    }

    /// How many threads compute its drives; the same to the last bit on any number.
    fn set_threads(&self, py: Python<'_>, threads: usize) -> PyResult<()> {
        self.shared.lock(py)?.world.set_threads(threads);
        Ok(())
    }

    /// How much is computed of drives that are added from here on and do not say it: `full`, or `mechanical`.
    fn set_fidelity(&self, py: Python<'_>, fidelity: &str) -> PyResult<()> {
        self.shared.lock(py)?.fidelity = fidelity_of(fidelity)?;
        Ok(())
    }

    /// Becomes the world that a machine file describes; data sheets that it names are looked for beside it.
    fn become_machine(
        &self,
        py: Python<'_>,
        path: PathBuf,
        seed: Option<u64>,
        timing: Option<&str>,
        fidelity: Option<&str>,
    ) -> PyResult<()> {
        let mut machine = file::read(&path).map_err(|reason| bad_value(named(&path, reason)))?;
        machine.seed = seed.or(machine.seed);
        let said = timing.map(timing_mode).transpose()?;
        machine.fidelity = fidelity.map(fidelity_of).transpose()?.or(machine.fidelity);
        // What is green here is to be green on the desk.
        machine.timing = said.or(machine.timing).or(Some(TimingMode::Device));
        let world = machine.build().map_err(|bad| bad_value(bad.named(path.display().to_string())))?;
        *self.shared.lock(py)? = WorldState { machine: Some(Arc::new(machine)), ..WorldState::new(world) };
        Ok(())
    }

    /// Moves on by `ns`.
    fn run_ns(&self, py: Python<'_>, ns: u64) -> PyResult<()> {
        // Slice after slice from here, so that the times of two threads add up.
        let mut left = Duration::from_nanos(ns);
        while !left.is_zero() {
            let slice = left.min(SLICE);
            self.shared.detached(py, |state| state.run_for(slice))?;
            left -= slice;
            py.check_signals()?;
        }
        Ok(())
    }

    /// Moves on to the first thing that is waited for: a frame at one of `probes`, the end of a job, at most to `until_ns`.
    ///
    /// Returns `("heard", place in probes)`, `("done", job)`, `("stalled", 0)`, or `None` at `until_ns`.
    fn advance(
        &self,
        py: Python<'_>,
        until_ns: Option<u64>,
        probes: Vec<usize>,
    ) -> PyResult<Option<(&'static str, u64)>> {
        let until = until_ns.map(Instant::from_nanos);
        let stations = {
            let state = self.shared.lock(py)?;
            probes.into_iter().map(|probe| state.probe(probe)).collect::<PyResult<Vec<_>>>()?
        };
        loop {
            match self.shared.detached(py, |state| state.advance(until, &stations))? {
                Came::ToTheEnd => return Ok(None),
                Came::Heard(probe) => return Ok(Some(("heard", probe as u64))),
                Came::Done(job) => return Ok(Some(("done", job))),
                Came::Stalled => return Ok(Some(("stalled", 0))),
                Came::SomeWay => py.check_signals()?,
            }
        }
    }

    /// Notes what happens in the world from now on, or stops that.
    fn watch(&self, py: Python<'_>, on: bool) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        state.happened.watch(&mut state.world, on);
        Ok(())
    }

    /// What happened since the last call, one line of JSON each.
    fn take_events(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let state = &mut *self.shared.lock(py)?;
        Ok(state.happened.take(&mut state.world).iter().map(|event| events::json(event).to_string()).collect())
    }

    /// Has the last events kept for a report, also where a program asks for them.
    fn keep_events(&self, py: Python<'_>) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        state.happened.keep(&mut state.world);
        Ok(())
    }

    /// The last of them, oldest first, one line of JSON each.
    fn last_events(&self, py: Python<'_>, most: usize) -> PyResult<Vec<String>> {
        let state = &mut *self.shared.lock(py)?;
        Ok(state.happened.last(&mut state.world, most).map(|event| events::json(event).to_string()).collect())
    }

    /// Records every signal of every drive to a file `.mcap` or `.csv`, a sample every `period_ns`.
    fn begin_record(&self, py: Python<'_>, path: PathBuf, period_ns: u64) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        if state.recordings.has_file() {
            return Err(wrong_use("this world is being recorded already; end_record() first"));
        }
        let period = Duration::from_nanos(period_ns);
        let begun = state.recordings.begin_file(&mut state.world, &mut state.happened, &path, period);
        begun.map_err(|error| PyOSError::new_err(format!("{}: {error}", path.display())))
    }

    /// Ends the record, if there is one.
    fn end_record(&self, py: Python<'_>) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        state.recordings.end_file(&mut state.world, &mut state.happened).map_err(PyErr::from)
    }

    /// Keeps the last `keep_ns` of what moves from now on, with a sample every `period_ns`.
    fn begin_trail(&self, py: Python<'_>, keep_ns: u64, period_ns: u64) -> PyResult<()> {
        let state = &mut *self.shared.lock(py)?;
        let (keep, period) = (Duration::from_nanos(keep_ns), Duration::from_nanos(period_ns.max(1)));
        if keep.as_nanos() / period.as_nanos() > MOST_KEPT {
            return Err(bad_value(format!(
                "more than {MOST_KEPT} samples of each signal; keep less, or sample less often"
            )));
        }
        state.recordings.keep_trail(&mut state.world, &mut state.happened, keep, period);
        Ok(())
    }

    /// What was kept, as SVG.
    fn trail_picture(&self, py: Python<'_>, title: &str) -> PyResult<String> {
        let state = &mut *self.shared.lock(py)?;
        state.recordings.picture(&mut state.world, &mut state.happened, title).map_err(wrong_use)
    }

    /// Joins an adapter to the bus; returns its number.
    fn add_probe(&self, py: Python<'_>) -> PyResult<usize> {
        let mut state = self.shared.lock(py)?;
        let id = state.world.add_probe();
        state.probes.push(id);
        Ok(state.probes.len() - 1)
    }

    /// Takes an adapter off the bus for good.
    fn remove_probe(&self, py: Python<'_>, probe: usize) -> PyResult<()> {
        let mut state = self.shared.lock(py)?;
        let id = state.probe(probe)?;
        state.world.remove(id);
        Ok(())
    }

    /// Queues a frame at an adapter.
    fn send(&self, py: Python<'_>, probe: usize, message: Plain) -> PyResult<()> {
        let frame = frame(message)?;
        let mut state = self.shared.lock(py)?;
        let id = state.probe(probe)?;
        state.world.send(id, frame).map_err(wrong_use)
    }

    /// The next frame that an adapter heard, with the time of its last bit in ns.
    fn poll(&self, py: Python<'_>, probe: usize) -> PyResult<Option<(u64, Plain)>> {
        let mut state = self.shared.lock(py)?;
        let id = state.probe(probe)?;
        Ok(state.world.poll_received(id).map(|(at, frame)| (at.as_nanos(), plain(&frame))))
    }

    /// True if an adapter has heard a frame that was not taken yet.
    fn has_heard(&self, py: Python<'_>, probe: usize) -> PyResult<bool> {
        let state = self.shared.lock(py)?;
        let id = state.probe(probe)?;
        Ok(state.world.has_received(id))
    }

    /// Does what a line of world commands says; returns the answer, a line of JSON, or `None` for a comment.
    fn command(&self, py: Python<'_>, line: &str) -> PyResult<Option<String>> {
        let mut state = self.shared.lock(py)?;
        Ok(command::answer(&mut state.world, line).map(|answer| answer.json))
    }

    /// Does something to the node at a place (`4`, or `5.2` for an axis).
    #[pyo3(signature = (place, name, *values))]
    fn stimulate(&self, py: Python<'_>, place: &str, name: &str, values: &Bound<'_, PyTuple>) -> PyResult<()> {
        let (place, stimulus) = (place_of(place)?, stimulus::of_node(name, values)?);
        command::apply(&mut self.shared.lock(py)?.world, place, &stimulus).map_err(refused)
    }

    /// Does something to a machine that several drives move.
    #[pyo3(signature = (body, name, *values))]
    fn stimulate_body(&self, py: Python<'_>, body: &str, name: &str, values: &Bound<'_, PyTuple>) -> PyResult<()> {
        let stimulus = stimulus::of_body(name, values)?;
        command::apply_to_body(&mut self.shared.lock(py)?.world, body, &stimulus).map_err(refused)
    }

    /// Disturbs the wire.
    #[pyo3(signature = (name, *values))]
    fn disturb(&self, py: Python<'_>, name: &str, values: &Bound<'_, PyTuple>) -> PyResult<()> {
        let fault = stimulus::of_wire(name, values)?;
        self.shared.lock(py)?.world.disturb(fault);
        Ok(())
    }

    /// What can be measured at a place (`4`, or `5.2` for an axis) now.
    fn report<'py>(&self, py: Python<'py>, place: &str) -> PyResult<Bound<'py, PyDict>> {
        let place = place_of(place)?;
        let mut state = self.shared.lock(py)?;
        report::at(py, &mut state.world, place)
    }

    /// Model of the drive under a number.
    fn model_of(&self, py: Python<'_>, number: u8) -> PyResult<&'static str> {
        self.shared.lock(py)?.world.with_drive(number, |drive, _| drive.model()).map_err(refused)
    }

    /// Number of axes of the drive under a number.
    fn axes_of(&self, py: Python<'_>, number: u8) -> PyResult<u8> {
        self.shared.lock(py)?.world.with_drive(number, |drive, _| drive.axes()).map_err(refused)
    }

    /// Names of the digital inputs of the drive under a number.
    fn inputs_of(&self, py: Python<'_>, number: u8) -> PyResult<Vec<&'static str>> {
        self.shared.lock(py)?.world.with_drive(number, |drive, _| drive.inputs().to_vec()).map_err(refused)
    }

    /// Hash over all frames with their times and over the present shaft angles.
    fn digest(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.shared.lock(py)?.world.digest().value())
    }

    /// Share of the time that the wire was busy, from 0 to 1, and the frames it carried, since the world began.
    fn statistics(&self, py: Python<'_>) -> PyResult<(f64, u64)> {
        let statistics = self.shared.lock(py)?.world.statistics();
        Ok((statistics.load_since(&Statistics::default()), statistics.frames))
    }

    /// The last frames on the wire, oldest first, one candump line each.
    fn frames(&self, py: Python<'_>, last: usize) -> PyResult<Vec<String>> {
        let state = self.shared.lock(py)?;
        let carried = state.world.log().iter().rev().filter_map(|event| match event {
            WireEvent::Frame { end, frame, .. } => Some(format!("({:.6}) can0 {frame}", end.as_secs_f64())),
            _ => None,
        });
        let mut lines: Vec<_> = carried.take(last).collect();
        lines.reverse();
        Ok(lines)
    }

    /// The last frames on the wire, oldest first, each with its time in s and what it says.
    fn decoded_frames(&self, py: Python<'_>, last: usize) -> PyResult<Vec<String>> {
        let mut state = self.shared.lock(py)?;
        let mut decoder = Decoder::new();
        let numbers: Vec<u8> = state.world.drive_numbers().collect();
        for number in numbers {
            let model = state.world.with_drive(number, |drive, _| drive.description()).map_err(refused)?;
            if let (Some(node), Some(model)) = (NodeId::new(number), model) {
                decoder.set_model(node, model);
            }
        }
        match state.world.log().lost_pdo_setup() {
            Some(setup) => setup.iter().for_each(|frame| decoder.pass(frame)),
            None => decoder.forget_pdos(),
        }
        let mut lines = VecDeque::new();
        for event in state.world.log().iter() {
            let WireEvent::Frame { end, frame, .. } = event else { continue };
            if lines.len() == last {
                lines.pop_front();
            }
            // Each has to be decoded: it may say what those behind it mean.
            lines.push_back((end.as_secs_f64(), frame, decoder.decode(frame)));
        }
        Ok(lines.into_iter().map(|(at_s, frame, said)| format!("{at_s:.6}  {frame:<22}  {said}")).collect())
    }

    /// Becomes a copy of `other`, which is a copy of this world or has none of its adapters.
    fn become_copy_of(&self, py: Python<'_>, other: &Bound<'_, World>) -> PyResult<()> {
        if Arc::ptr_eq(&self.shared, &other.get().shared) {
            return Ok(());
        }
        let (world, probes, machine, fidelity) = {
            let state = other.get().shared.lock(py)?;
            state.jobs.check_copyable()?;
            let mut copy = state.world.snapshot();
            // What is kept of a world is not part of it.
            copy.stop_recording();
            (copy, state.probes.clone(), state.machine(), state.fidelity)
        };
        let state = &mut *self.shared.lock(py)?;
        state.jobs.check_copyable()?;
        if state.recordings.has_file() {
            return Err(wrong_use(
                "this world is being recorded, and the times of a record do not go back; end_record() first",
            ));
        }
        if probes.len() < state.probes.len() {
            return Err(wrong_use(
                "an adapter was joined to the bus since the snapshot was taken; take the snapshot behind can.Bus(..), \
                 or restore it before",
            ));
        }
        (state.world, state.probes, state.machine, state.fidelity) = (world, probes, machine, fidelity);
        state.recordings.follow(&mut state.world, &mut state.happened);
        Ok(())
    }
}

//! What is asked of a network as a whole: who is there, its boot-up, its description, its load, and why a drive does not move. The
//! results are those of the command line (`host::network`).

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use can::{Bitrate, BusFrame};
use canopen::NodeId;
use cia402::ModeOfOperation;
use host::network::boot::{BootOptions, Planned};
use host::network::check::CheckReport;
use host::network::explain::ExplainReport;
use host::network::heard::Counted;
use host::network::params::journal::default_path;
use host::network::plan::{CYCLE, PlanReport, SHORTEST_CYCLE, traffic};
use host::network::scan::{ScanReport, ScannedNode, no_node};
use machine::file::Machine;
use master::Network as Core;
use master::decode::Decoder;
use master::drive::Drive;
use master::explain::Overheard;
use master::plan::{ErrorRate, HostQueue, NodeTraffic, Settings};
use pyo3::prelude::*;
use sim::recorder::LiveValues;
use words::failure::Failure;
use words::mode::mode;
use words::models::Description;

use super::job::Trouble;
use super::runner::Runner;
use super::value::Value;
use super::{Job, Network, duration};
use crate::failure::{bad_value, how_to_say, raised};
use crate::sheets::{model_of, node_id};

/// Longest wait for an answer, as the default of the command line.
pub(super) const TIMEOUT: Duration = Duration::from_millis(500);

impl Network {
    /// The models that need not be found out.
    pub(super) fn known(&self) -> BTreeMap<NodeId, &'static Description> {
        self.machine.iter().flat_map(|machine| machine.models()).collect()
    }

    /// What a boot-up goes by: this file, or the machine file, or who is there.
    pub(super) fn planned(&self, py: Python<'_>, file: Option<PathBuf>) -> PyResult<Planned> {
        match (&self.machine, file) {
            (_, Some(path)) => Planned::read(Some(&path)).map_err(|failure| raised(py, &failure)),
            (Some(machine), None) => Ok(Planned::Machine(PathBuf::new(), Box::new(Machine::clone(machine)))),
            (None, None) => Ok(Planned::Bus),
        }
    }

    fn is_virtual(&self) -> bool {
        matches!(&*self.runner, Runner::World(_))
    }

    /// True values from the simulation of virtual drives; `None` on a real bus.
    pub(super) fn true_values(&self, py: Python<'_>) -> PyResult<Option<LiveValues>> {
        match &*self.runner {
            Runner::World(shared) => Ok(Some(shared.lock(py)?.world.live_values())),
            Runner::Live(_) => Ok(None),
        }
    }

    /// The bit rate, where it is known without being said.
    pub(super) fn bitrate(&self, py: Python<'_>) -> PyResult<Option<Bitrate>> {
        match &*self.runner {
            Runner::World(shared) => Ok(Some(shared.lock(py)?.world.bitrate())),
            Runner::Live(_) => Ok(self.machine.as_ref().and_then(|machine| machine.bitrate)),
        }
    }
}

/// The drive at a node: of this model, or as the machine file has it, or as its identity and objects have it.
pub(super) async fn drive_at(
    core: &Core,
    machine: Option<&Machine>,
    id: NodeId,
    model: Option<&'static Description>,
) -> Result<Drive, Failure> {
    let node = core.node(id);
    let described = machine.filter(|machine| machine.models().any(|(other, _)| other == id));
    match (model, described) {
        (Some(model), _) => {
            Ok(Drive::new(node, model).behind(machine.map_or(master::Gear::DIRECT, |file| file.gear(id))))
        }
        (None, Some(machine)) => {
            let drive = machine.drive(node);
            drive.check_identity().await?;
            Ok(drive)
        }
        (None, None) => {
            let knowledge = master::identify::knowledge(&node).await?;
            Ok(Drive::known_as(node, knowledge))
        }
    }
}

/// All nodes on the bus.
#[pyfunction]
pub(crate) fn scan(py: Python<'_>, network: &Bound<'_, Network>) -> PyResult<Job> {
    let network = network.get();
    let (core, known, listener) = (network.core.clone(), network.known(), network.traffic.listen(false));
    network.begin_said(py, async move {
        let found = core.scan(TIMEOUT, |_| ()).await;
        let (mut counted, mut decoder) = (Counted::default(), Decoder::knowing(core.models()));
        known.iter().for_each(|(node, model)| decoder.set_model(*node, model));
        while let Some(BusFrame { frame, .. }) = listener.take() {
            counted.note(&mut decoder, &frame);
        }
        let heard = counted.reported(|node| found.iter().any(|found| found.node == node));
        if found.is_empty() {
            return Err(no_node(&heard).into());
        }
        let nodes = found.iter().map(|found| ScannedNode::new(known.get(&found.node).copied(), found, how_to_say));
        Ok(Value::report(&ScanReport { nodes: nodes.collect(), heard }))
    })
}

/// Boots the nodes of a file, or who is there.
#[pyfunction]
pub(crate) fn boot(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    file: Option<PathBuf>,
    nodes: Vec<u8>,
    reset: bool,
    start: bool,
) -> PyResult<Job> {
    let network = network.get();
    let (planned, only) = (network.planned(py, file)?, node_ids(nodes)?);
    let (core, known) = (network.core.clone(), network.known());
    network.begin_said(py, async move {
        let mut plan = planned.plan(&core, &known, TIMEOUT, &only, |_| ()).await?;
        let options = BootOptions { nodes: only, reset, no_start: !start };
        let report = options.boot(&core, &mut plan).await;
        let value = Value::report(&report);
        report.failure().map_or(Ok(()), |failure| Err(Trouble::Reported(failure, Box::new(Value::report(&report)))))?;
        Ok(value)
    })
}

/// Node-IDs of a list.
pub(super) fn node_ids(nodes: Vec<u8>) -> PyResult<Vec<NodeId>> {
    nodes.into_iter().map(node_id).collect()
}

/// What goes wrong with a described bus; no bus is needed.
#[pyfunction]
pub(crate) fn check_file(py: Python<'_>, file: PathBuf, strict: bool) -> PyResult<Py<PyAny>> {
    let report = py.detach(|| {
        let mut checked = host::network::check::read(&file)?;
        let predicted = checked.predict();
        Ok::<_, Failure>(CheckReport::new(&file, checked, predicted, None, strict))
    });
    Value::report(&report.map_err(|failure| raised(py, &failure))?).into_python(py)
}

/// The same, held against the drives of this bus.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, network: &Bound<'_, Network>, file: PathBuf, strict: bool) -> PyResult<Job> {
    let network = network.get();
    let core = network.core.clone();
    let read = py.detach(|| {
        let mut checked = host::network::check::read(&file)?;
        let predicted = checked.predict();
        Ok::<_, Failure>((checked, predicted))
    });
    let (mut checked, predicted) = read.map_err(|failure| raised(py, &failure))?;
    network.begin_said(py, async move {
        let live = checked.ask(&core, |node| core.node(node)).await;
        Ok(Value::report(&CheckReport::new(&file, checked, predicted, Some(live), strict)))
    })
}

/// How a bus is planned, in plain values. Times in s; 0 for none.
#[derive(FromPyObject)]
pub(crate) struct PlanOrder {
    #[pyo3(item)]
    cycle: Option<f64>,
    #[pyo3(item)]
    mode: Option<String>,
    #[pyo3(item)]
    modes: BTreeMap<u8, String>,
    #[pyo3(item)]
    bitrate: Option<String>,
    #[pyo3(item)]
    jitter: f64,
    #[pyo3(item)]
    sdo: f64,
    #[pyo3(item)]
    emcy: f64,
    #[pyo3(item)]
    heartbeat: f64,
    #[pyo3(item)]
    errors: f64,
    #[pyo3(item)]
    by_priority: bool,
}

impl PlanOrder {
    fn settings(&self, cycle: Duration) -> PyResult<Settings> {
        let some = |seconds| Ok::<_, PyErr>(Some(duration(seconds)?).filter(|time| !time.is_zero()));
        Ok(Settings {
            jitter: duration(self.jitter)?,
            queue: if self.by_priority { HostQueue::Priority } else { HostQueue::Fifo },
            sdo: some(self.sdo)?,
            emcy: some(self.emcy)?,
            host_heartbeat: some(self.heartbeat)?.map(|time| (NodeId::MAX, time)),
            errors: some(self.errors)?.map(ErrorRate),
            ..Settings::new(cycle)
        })
    }

    fn modes(&self) -> PyResult<(Option<ModeOfOperation>, BTreeMap<NodeId, ModeOfOperation>)> {
        let own = self.modes.iter().map(|(node, name)| Ok((node_id(*node)?, mode(name).map_err(bad_value)?)));
        let all = self.mode.as_deref().map(mode).transpose().map_err(bad_value)?;
        Ok((all, own.collect::<PyResult<_>>()?))
    }
}

/// Whether everything fits the bus, and how late each frame may come.
#[pyfunction]
pub(crate) fn plan(py: Python<'_>, network: &Bound<'_, Network>, order: PlanOrder) -> PyResult<Job> {
    let network = network.get();
    let parse = |text: &str| text.parse::<Bitrate>().map_err(|error| bad_value(format!("{text:?}: {error}")));
    let said = order.bitrate.as_deref().map(parse).transpose()?;
    let bitrate = said.map_or_else(|| network.bitrate(py), |said| Ok(Some(said)))?;
    let bitrate =
        bitrate.ok_or_else(|| bad_value("the bit rate of this bus is not known: state it, as in bitrate=500_000"))?;
    let (all, own) = order.modes()?;
    let machine = network.machine.clone();
    let moved =
        machine.as_ref().filter(|_| all.is_none() && own.is_empty()).and_then(|machine| machine.fullest_cycle());
    let cycle = order.cycle.map(duration).transpose()?.or(moved.as_ref().map(|moved| moved.period)).unwrap_or(CYCLE);
    if cycle < SHORTEST_CYCLE {
        return Err(bad_value(format!("a cycle of {} s is too short; expected 0.00025 or more", cycle.as_secs_f64())));
    }
    let settings = order.settings(cycle)?;
    // Real drives have been set up, or not.
    let file = machine.clone().filter(|_| network.is_virtual());
    let core = network.core.clone();
    network.begin_said(py, async move {
        let mut found: Vec<NodeId> = core.scan(TIMEOUT, |_| ()).await.iter().map(|found| found.node).collect();
        found.sort_unstable();
        if let Some(missing) = own.keys().find(|node| !found.contains(node)) {
            return Err(Failure::usage(format!("modes has node {missing}, which is not on the bus"))
                .at_node(*missing)
                .into());
        }
        let mut nodes: Vec<NodeTraffic> = Vec::new();
        for id in found {
            let drive = drive_at(&core, machine.as_deref(), id, None).await?;
            let asked = own.get(&id).copied().or(all);
            nodes.push(traffic(&drive, file.as_deref(), asked, moved.as_ref()).await?);
        }
        if nodes.is_empty() {
            return Err(no_node(&[]).into());
        }
        Ok(Value::report(&PlanReport::new(&nodes, &settings, bitrate, moved)))
    })
}

/// Why a drive does not move, and why its PDOs are silent.
#[pyfunction]
pub(crate) fn explain(
    py: Python<'_>,
    network: &Bound<'_, Network>,
    node: u8,
    model: Option<&str>,
    watch_s: f64,
) -> PyResult<Job> {
    let network = network.get();
    let (id, watch, model) = (node_id(node)?, duration(watch_s)?, model.map(model_of).transpose()?);
    let (core, machine, listener) = (network.core.clone(), network.machine.clone(), network.traffic.listen(true));
    network.begin_said(py, async move {
        let mut heard = Overheard::from(core.now());
        core.sleep(watch).await;
        while let Some(BusFrame { at, frame, own }) = listener.take() {
            if own { heard.note_own(&frame, at) } else { heard.note(&frame, at) }
        }
        heard.until(core.now());
        let drive = match drive_at(&core, machine.as_deref(), id, model).await {
            // Silence is what has to be explained; the frames are still evidence.
            Err(failure) if failure.kind == "no_answer" => Drive::of_unknown_model(core.node(id)),
            drive => drive?,
        };
        Ok(Value::report(&ExplainReport::from(drive.explain(&heard).await)))
    })
}

/// What a job needs of a network to ask one of its drives.
pub(super) struct AskedDrive {
    pub(super) core: Core,
    pub(super) machine: Option<Arc<Machine>>,
    pub(super) node: NodeId,
    pub(super) model: Option<&'static Description>,
    is_virtual: bool,
}

impl AskedDrive {
    pub(super) fn of(network: &Network, node: u8, model: Option<&str>) -> PyResult<Self> {
        Ok(Self {
            core: network.core.clone(),
            machine: network.machine.clone(),
            node: node_id(node)?,
            model: model.map(model_of).transpose()?,
            is_virtual: network.is_virtual(),
        })
    }

    /// Where the way back is kept: here, or at the place of its node. A virtual bus ends with the program, and nothing is left to go back to.
    pub(super) fn journal(&self, asked: Option<PathBuf>) -> Option<PathBuf> {
        (!self.is_virtual).then(|| asked.unwrap_or_else(|| default_path(self.node)))
    }

    /// The drive that is meant.
    pub(super) async fn drive(&self) -> Result<Drive, Failure> {
        drive_at(&self.core, self.machine.as_deref(), self.node, self.model).await
    }
}

//! The master for Python: what a drive is asked becomes a job, which a world or the thread of a real bus works through.
//!
//! Blocking calls and coroutines are two ways to wait for a job; both are in Python (`ferrodrive/master.py`).

pub(crate) mod axes;
pub(crate) mod capture;
pub(crate) mod capture_file;
mod chosen;
mod from_file;
mod job;
mod order;
pub(crate) mod params;
pub(crate) mod report;
mod runner;
mod slot;
pub(crate) mod supervise;
pub(crate) mod tap;
pub(crate) mod test_motion;
pub(crate) mod tune;
mod value;
pub(crate) mod whole;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use can::Tap;
use canopen::object::DEVICE_TYPE;
use canopen::{Mux, NmtCommand, NodeId};
use host::capture::{WayBack, WaysBack};
use host::network::read_machine;
use machine::file::Machine;
use master::drive::Drive;
use master::identify::Knowledge;
use master::{Error, Gear, Network as Core, Node};
use pyo3::prelude::*;
use transport::BusSpec;
use words::models::{Description, with_files};

use chosen::Chosen;
pub(crate) use job::Job;
use job::Trouble;
use order::{Order, duration};
use runner::Runner;
use tap::Traffic;
use value::Value;

use crate::failure::{bad_value, raised, wrong_use};
use crate::live::{Live, stop_what_moves};
use crate::sheets::{model_of, node_id};
use crate::world::World;

/// How long is listened for a node before it is asked: drives boot within that.
const QUIET: Duration = Duration::from_secs(2);

/// A CANopen network as its master sees it; `ferrodrive.Network` is what users have.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Network {
    core: Core,
    traffic: Traffic,
    runner: Arc<Runner>,
    /// What is to be put back when it is closed.
    ways_back: WaysBack,
    closed: AtomicBool,
    /// What a machine file says of its drives.
    machine: Option<Arc<Machine>>,
    /// What nodes have shown of their models, of those that were asked for it.
    identified: Arc<Mutex<BTreeMap<NodeId, Knowledge>>>,
}

#[pymethods]
impl Network {
    /// A master as one more station of a world; with the machine file that describes what is there, where the world was not made of one.
    #[staticmethod]
    fn in_world(
        py: Python<'_>,
        world: &Bound<'_, World>,
        machine: Option<PathBuf>,
        sdo_servers: BTreeMap<i64, i64>,
        sync_counter: Option<i64>,
    ) -> PyResult<Self> {
        let chosen = Chosen::new(sdo_servers, sync_counter)?;
        let machine = read_machine_of(py, machine)?;
        let (core, traffic, shared) = (Core::new(), Traffic::default(), Arc::clone(world.get().shared()));
        let mut state = shared.lock(py)?;
        state.world.add_station(Tap::new(core.clone(), traffic.clone()));
        state.jobs.note_master();
        let machine = machine.or_else(|| state.machine());
        drop(state);
        chosen.apply(&core, machine.as_deref());
        Ok(Self::new((core, traffic), Runner::World(shared), WaysBack::default(), machine))
    }

    /// A master on a real bus: `socketcand://HOST:PORT/can0`, `slcan:///dev/ttyACM0?bitrate=500k`; with the machine file that says what
    /// is there.
    #[staticmethod]
    fn on_bus(
        py: Python<'_>,
        bus: &str,
        machine: Option<PathBuf>,
        sdo_servers: BTreeMap<i64, i64>,
        sync_counter: Option<i64>,
    ) -> PyResult<Self> {
        let chosen = Chosen::new(sdo_servers, sync_counter)?;
        let spec: BusSpec = bus.parse().map_err(bad_value)?;
        let machine = read_machine_of(py, machine)?;
        let (core, traffic) = (Core::new(), Traffic::default());
        let ways_back = WaysBack::default();
        let live = py.detach(|| Live::open(spec, core.clone(), traffic.clone(), ways_back.clone()));
        let live = live.map_err(|reason| wrong_use(format!("bus {bus}: {reason}")))?;
        chosen.apply(&core, machine.as_deref());
        Ok(Self::new((core, traffic), Runner::Live(Mutex::new(Some(live))), ways_back, machine))
    }

    /// Stops what this program has set in motion, and leaves the real bus; what was not seen to stand, in words.
    fn close(&self, py: Python<'_>) -> Vec<String> {
        self.closed.store(true, Ordering::Relaxed);
        let Runner::Live(live) = &*self.runner else { return Vec::new() };
        let open = live.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| open.map(|mut live| live.close()).unwrap_or_default())
    }

    /// The same in a world, whose owner has to move it: everything else that was asked of this network is given up, and the
    /// network is silent when this has ended.
    fn close_in_world(&self, py: Python<'_>) -> PyResult<Job> {
        let (core, ways_back) = (self.core.clone(), self.ways_back.clone());
        if let Runner::World(shared) = &*self.runner {
            shared.lock(py)?.jobs.cancel_all_of(self.owner());
        }
        let job = self.begin(py, async move {
            let mut moving = stop_what_moves(&core).await;
            moving.extend(ways_back.restore().await);
            core.fall_silent();
            Ok(Value::List(moving.into_iter().map(Value::Text).collect()))
        });
        self.closed.store(true, Ordering::Relaxed);
        job
    }

    /// What a real bus has said beside frames since the last call, a line each.
    fn take_notes(&self) -> Vec<String> {
        self.runner.with_live(Live::take_notes).unwrap_or_default()
    }

    /// Lets time pass, in seconds.
    fn sleep(&self, py: Python<'_>, seconds: f64) -> PyResult<Job> {
        let core = self.core.clone();
        let duration = duration(seconds)?;
        self.begin(py, async move {
            core.sleep(duration).await;
            Ok(Value::None)
        })
    }

    /// Sends an NMT command, to all nodes or to one.
    fn nmt(&self, command: &str, node: Option<u8>) -> PyResult<()> {
        self.check_open()?;
        let command = nmt_command(command)?;
        match node {
            Some(raw) => self.node(raw)?.nmt(command),
            None => self.core.nmt_all(command),
        }
        Ok(())
    }

    /// Produces SYNC with this period in seconds, or stops.
    fn sync(&self, period_s: Option<f64>) -> PyResult<()> {
        self.check_open()?;
        self.core.sync(period_s.map(duration).transpose()?);
        Ok(())
    }

    /// Nodes that were heard of.
    fn seen(&self) -> Vec<u16> {
        NodeId::all().filter(|id| self.core.facts(*id).seen_at.is_some()).map(|id| id.raw().into()).collect()
    }

    /// Waits until a node has booted or was heard of. One that booted long ago, and has no heartbeat, says nothing by itself: it is asked.
    fn wait_for(&self, py: Python<'_>, node: u8, within_s: f64) -> PyResult<Job> {
        let (node, patience, network) = (self.node(node)?, duration(within_s)?, self.core.clone());
        let now = move || network.with_core(|core| core.now());
        let until = now() + patience;
        self.begin(py, async move {
            loop {
                let quiet = (until - now()).min(QUIET);
                if node.wait(|view| view.facts.seen_at, quiet).await.is_ok() {
                    return Ok(Value::Bool(true));
                }
                let left = (until - now()).min(QUIET);
                if left.is_zero() {
                    return Ok(Value::Bool(false));
                }
                // It is heard of by any answer.
                node.clone().with_timeout(left).upload(DEVICE_TYPE).await.ok();
            }
        })
    }

    /// SDO upload.
    fn upload(&self, py: Python<'_>, node: u8, index: u16, sub_index: u8) -> PyResult<Job> {
        let node = self.node(node)?;
        self.begin(
            py,
            async move { Ok(Value::Bytes(node.upload(Mux::new(index, sub_index)).await?.as_bytes().to_vec())) },
        )
    }

    /// SDO download.
    fn download(&self, py: Python<'_>, node: u8, index: u16, sub_index: u8, data: Vec<u8>) -> PyResult<Job> {
        let node = self.node(node)?;
        self.begin(py, async move { node.download(Mux::new(index, sub_index), &data).await.map(|()| Value::None) })
    }

    /// Which model a node is as the machine file says; `None` where it says nothing.
    fn model_by_file(&self, node: u8) -> PyResult<Option<&'static str>> {
        Ok(self.described(node_id(node)?).map(|model| model.name))
    }

    /// Which model a node is by its identity and objects: its name, and whether others fit as well; `None` if nothing speaks for one.
    fn identify(&self, py: Python<'_>, node: u8) -> PyResult<Job> {
        let (node, identified) = (self.node(node)?, Arc::clone(&self.identified));
        self.begin(py, async move {
            let knowledge = master::identify::knowledge(&node).await?;
            let guessed = knowledge.guess().is_some();
            let known = knowledge.description().map(|model| Value::Text(model.name.to_owned()));
            identified.lock().unwrap_or_else(PoisonError::into_inner).insert(node.id(), knowledge);
            Ok(known.map_or(Value::None, |name| Value::List(vec![name, Value::Bool(guessed)])))
        })
    }

    /// Does what an order says with a drive of a model.
    fn drive(&self, py: Python<'_>, node: u8, model: &str, order: Order) -> PyResult<Job> {
        let drive = if order.guessed {
            let unknown = || {
                wrong_use(format!(
                    "node {node} has not shown to be a {model}: call network.drive({node}) again, or name its model"
                ))
            };
            Drive::known_as(self.node(node)?, self.guess(node, model).ok_or_else(unknown)?)
        } else {
            Drive::new(self.node(node)?, self.model(node, model)?)
        };
        let drive = drive.behind(self.gear(node, order.gear_ratio)?);
        match order.do_.as_str() {
            "check_identity" => self.begin(py, async move { drive.check_identity().await.map(|()| Value::None) }),
            "state" => self.begin(py, async move { drive.state().await.map(|state| value::state(&state)) }),
            _ => {
                let command = order.command()?;
                self.begin(py, async move { drive.perform(&command).await.map(|report| value::report(&report)) })
            }
        }
    }
}

impl Drop for Network {
    /// A network that is dropped without being closed stops what it moved all the same.
    fn drop(&mut self) {
        if self.closed.load(Ordering::Relaxed) {
            return;
        }
        self.core.quick_stop_moved();
        if let Runner::World(shared) = &*self.runner {
            Python::attach(|py| {
                // A world that is being dropped is not moved by itself.
                if let Ok(mut state) = shared.lock(py) {
                    state.world.refresh();
                }
            });
        }
    }
}

fn read_machine_of(py: Python<'_>, path: Option<PathBuf>) -> PyResult<Option<Arc<Machine>>> {
    let read = path.map(|path| read_machine(&path)).transpose();
    Ok(read.map_err(|failure| raised(py, &failure))?.map(Arc::new))
}

impl Network {
    fn new(
        (core, traffic): (Core, Traffic),
        runner: Runner,
        ways_back: WaysBack,
        machine: Option<Arc<Machine>>,
    ) -> Self {
        let described = machine.iter().flat_map(|machine| machine.models()).map(|(_, model)| model);
        core.set_models(with_files(described));
        Self {
            core,
            traffic,
            runner: Arc::new(runner),
            ways_back,
            closed: AtomicBool::new(false),
            machine,
            identified: Arc::default(),
        }
    }

    /// Distinguishes its jobs from those of other networks in the same world.
    fn owner(&self) -> usize {
        Arc::as_ptr(&self.runner) as usize
    }

    /// The model of a node as the machine file says.
    fn described(&self, node: NodeId) -> Option<&'static Description> {
        let mut models = self.machine.iter().flat_map(|machine| machine.models());
        models.find(|(id, _)| *id == node).map(|(_, model)| model)
    }

    /// A model by its name; of a node that the machine file has, with the choices that it has there.
    fn model(&self, node: u8, name: &str) -> PyResult<&'static Description> {
        let described = self.described(node_id(node)?).filter(|model| model.name == name);
        described.map_or_else(|| model_of(name), Ok)
    }

    /// What a node has shown, where this model is the guess by it.
    fn guess(&self, node: u8, name: &str) -> Option<Knowledge> {
        let identified = self.identified.lock().unwrap_or_else(PoisonError::into_inner);
        let knowledge = identified.get(&NodeId::new(node)?)?;
        (knowledge.description()?.name == name).then(|| knowledge.clone())
    }

    /// An error once it was closed.
    fn check_open(&self) -> PyResult<()> {
        if self.closed.load(Ordering::Relaxed) { Err(closed()) } else { Ok(()) }
    }

    /// What stands behind the shaft of a node: this ratio, or else what the machine file says.
    fn gear(&self, node: u8, ratio: Option<f64>) -> PyResult<Gear> {
        let Some(ratio) = ratio else {
            let node = node_id(node)?;
            return Ok(self.machine.as_ref().map_or(Gear::DIRECT, |machine| machine.gear(node)));
        };
        Gear::new(ratio).map_err(|error| bad_value(error.to_string()))
    }

    fn node(&self, raw: u8) -> PyResult<Node> {
        Ok(self.core.node(node_id(raw)?))
    }

    /// Begins a job where jobs are worked through.
    fn begin(
        &self,
        py: Python<'_>,
        work: impl Future<Output = Result<Value, Error>> + Send + 'static,
    ) -> PyResult<Job> {
        self.begin_said(py, async move { work.await.map_err(Trouble::from) })
    }

    /// As [`begin`](Self::begin), of work that may say more than a drive does.
    fn begin_said(
        &self,
        py: Python<'_>,
        work: impl Future<Output = Result<Value, Trouble>> + Send + 'static,
    ) -> PyResult<Job> {
        self.begin_job(py, work, None)
    }

    /// As [`begin_said`](Self::begin_said), of work that has a way back: when it is given up it ends with that.
    fn begin_leading_back<F: Future<Output = Result<Value, Trouble>> + Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(WayBack) -> F,
    ) -> PyResult<Job> {
        let way_back = WayBack::in_network(&self.ways_back);
        self.begin_job(py, work(way_back.clone()), Some(way_back))
    }

    fn begin_job(
        &self,
        py: Python<'_>,
        work: impl Future<Output = Result<Value, Trouble>> + Send + 'static,
        way_back: Option<WayBack>,
    ) -> PyResult<Job> {
        self.check_open()?;
        let (job, future) = Job::new(work, way_back, &self.runner);
        match &*self.runner {
            Runner::World(shared) => job.set_number(shared.lock(py)?.jobs.begin(self.owner(), future)),
            Runner::Live(live) => {
                let live = live.lock().unwrap_or_else(PoisonError::into_inner);
                let open = live.as_ref().ok_or_else(closed)?;
                open.begin(future).map_err(wrong_use)?;
            }
        }
        Ok(job)
    }
}

fn closed() -> PyErr {
    wrong_use("the network is closed; open another one: Network(bus)")
}

fn nmt_command(word: &str) -> PyResult<NmtCommand> {
    NmtCommand::of_word(word).ok_or_else(|| {
        bad_value(format!(
            "{word:?} is not an NMT command; expected {}",
            NmtCommand::ALL.map(NmtCommand::word).join(", ")
        ))
    })
}

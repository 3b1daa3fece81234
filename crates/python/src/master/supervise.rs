//! A network that is watched, for Python: one job boots it, another one watches it for as long as it is open, further ones take what
//! happened and start what came back.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use can::BusFrame;
use canopen::NodeId;
use host::network::boot::BootReport;
use host::network::supervise::WatchedEvent;
use master::Network as Core;
use master::core::NodeSet;
use master::supervise::Supervisor as MasterSupervisor;
use pyo3::prelude::*;

use super::job::Trouble;
use super::tap::Listener;
use super::value::Value;
use super::whole::{TIMEOUT, node_ids};
use super::{Job, Network, duration};
use crate::sheets::node_id;

/// How often a job that waits for the watch looks: as often as the watch does.
const LOOK: Duration = Duration::from_millis(20);

/// Events that wait for a program; a further one replaces the oldest.
const MOST_WAITING: usize = 10_000;

/// A watch over a network; `ferrodrive.Supervisor` is what users have.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Supervisor {
    network: Py<Network>,
    core: Core,
    watch: Arc<SupervisionWatch>,
}

#[derive(Default)]
struct SupervisionWatch {
    state: Mutex<SupervisionState>,
    closed: AtomicBool,
}

#[derive(Default)]
struct SupervisionState {
    /// Between its boot-up and its keeping.
    opened: Option<(MasterSupervisor, Listener)>,
    events: VecDeque<WatchedEvent>,
    /// Nodes that are to be started, and what came of those that were.
    resume: VecDeque<NodeId>,
    resumed: VecDeque<(NodeId, Result<(), master::Error>)>,
    /// The watch has ended, and no drive waits for its heartbeat.
    released: Option<Result<(), master::Error>>,
}

impl SupervisionWatch {
    fn lock(&self) -> MutexGuard<'_, SupervisionState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn keep(self: Arc<Self>, core: Core) -> Result<Value, Trouble> {
        let opened = self.lock().opened.take();
        let Some((mut supervisor, others)) = opened else {
            self.lock().released = Some(Ok(()));
            return Ok(Value::None);
        };
        while !self.closed.load(Ordering::Relaxed) {
            while let Some(BusFrame { at, frame, .. }) = others.take() {
                supervisor.hear(at, &frame);
            }
            let asked = self.lock().resume.pop_front();
            if let Some(node) = asked {
                let came = supervisor.resume(node).await;
                self.lock().resumed.push_back((node, came));
            }
            // To its end, whatever else happens: it may be stopping a motor.
            if let Some((at, event)) = supervisor.next().await {
                let mut state = self.lock();
                if state.events.len() == MOST_WAITING {
                    state.events.pop_front();
                }
                state.events.push_back(WatchedEvent::new(at, &event));
            }
        }
        let released = core.release_guards(NodeSet::ALL).await;
        self.lock().released = Some(released);
        Ok(Value::None)
    }
}

/// One that is dropped watches no longer, and no drive waits for its heartbeat.
impl Drop for Supervisor {
    fn drop(&mut self) {
        self.watch.closed.store(true, Ordering::Relaxed);
    }
}

#[pymethods]
impl Supervisor {
    #[new]
    fn new(network: Py<Network>) -> Self {
        let core = network.get().core.clone();
        Self { network, core, watch: Arc::default() }
    }

    /// Boots the nodes of a file, or who is there; the report.
    fn open(&self, py: Python<'_>, file: Option<PathBuf>, nodes: Vec<u8>, own_node: u8) -> PyResult<Job> {
        let network = self.network.get();
        let (planned, only, own) = (network.planned(py, file)?, node_ids(nodes)?, node_id(own_node)?);
        let (core, known, watch) = (network.core.clone(), network.known(), Arc::clone(&self.watch));
        let others = network.traffic.listen(false);
        network.begin_said(py, async move {
            let mut plan = planned.plan(&core, &known, TIMEOUT, &only, |_| ()).await?;
            plan.own = own;
            let report = core.boot(&plan).await;
            let unconfigured = core.unconfigured(&plan, &report).await;
            let booted = BootReport::new(&plan, &report, &unconfigured);
            if let Some(failure) = booted.failure().filter(|_| !unconfigured.is_empty()) {
                // What is watched had better be what was planned.
                core.release_guards(NodeSet::ALL).await?;
                return Err(Trouble::Reported(failure, Box::new(Value::report(&booted))));
            }
            while core.poll_event().is_some() {}
            watch.lock().opened = Some((MasterSupervisor::new(core.clone(), plan), others));
            Ok(Value::report(&booted))
        })
    }

    /// Watches for as long as it is open; no call waits for this.
    fn keep(&self, py: Python<'_>) -> PyResult<Job> {
        self.network.get().begin_said(py, Arc::clone(&self.watch).keep(self.core.clone()))
    }

    /// The next thing that happened, waited for at most so long in s; `None` if nothing did.
    fn next(&self, py: Python<'_>, within_s: f64) -> PyResult<Job> {
        let (watch, core, within) = (Arc::clone(&self.watch), self.core.clone(), duration(within_s)?);
        self.network.get().begin_said(py, async move {
            let end = core.now() + within;
            loop {
                let event = watch.lock().events.pop_front();
                if let Some(event) = event {
                    return Ok(Value::report(&event));
                }
                let left = end - core.now();
                if left.is_zero() {
                    return Ok(Value::None);
                }
                core.sleep(left.min(LOOK)).await;
            }
        })
    }

    /// Lets a node that came back take part again.
    fn resume(&self, py: Python<'_>, node: u8) -> PyResult<Job> {
        let (watch, core, node) = (Arc::clone(&self.watch), self.core.clone(), node_id(node)?);
        self.network.get().begin_said(py, async move {
            watch.lock().resume.push_back(node);
            loop {
                let came = {
                    let mut state = watch.lock();
                    let at = state.resumed.iter().position(|(other, _)| *other == node);
                    at.and_then(|at| state.resumed.remove(at))
                };
                match came {
                    Some((_, came)) => return Ok(came.map(|()| Value::None)?),
                    None if watch.closed.load(Ordering::Relaxed) => {
                        return Err(Trouble::Said("the watch was closed meanwhile".into()));
                    }
                    None => core.sleep(LOOK).await,
                }
            }
        })
    }

    /// Ends the watch; no drive waits for the heartbeat of this program then.
    fn close(&self, py: Python<'_>) -> PyResult<Job> {
        let (watch, core) = (Arc::clone(&self.watch), self.core.clone());
        let was_closed = watch.closed.swap(true, Ordering::Relaxed);
        self.network.get().begin_said(py, async move {
            if was_closed {
                return Ok(Value::None);
            }
            loop {
                let released = watch.lock().released.take();
                if let Some(released) = released {
                    return Ok(released.map(|()| Value::None)?);
                }
                core.sleep(LOOK).await;
            }
        })
    }
}

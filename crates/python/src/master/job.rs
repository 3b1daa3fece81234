//! A piece of the master's work as Python holds it.

use std::future::poll_fn;
use std::pin::pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Poll, Waker};
use std::time::Duration;

use host::capture::WayBack;
use master::Error;
use pyo3::prelude::*;
use words::failure::Failure;

use super::runner::Runner;
use super::value::Value;
use crate::failure::{how_to_say, master_error, wrong_use};
use crate::live::Live;
use crate::world;

/// How long a waiting thread is deaf to signals (Ctrl-C).
const NAP: Duration = Duration::from_millis(100);

/// A job: begun, and to be waited for.
#[pyclass(frozen, module = "ferrodrive._native")]
pub(crate) struct Job {
    number: AtomicU64,
    runner: Arc<Runner>,
    outcome: Arc<Outcome>,
}

/// Why a job did not do what it should.
pub(super) enum Trouble {
    /// What a drive, or the way to it, says.
    Drive(Error),
    /// What a group or a base says.
    Said(String),
    /// What an operation on the network as a whole says.
    Failed(Failure),
    /// The same, with what was done as far as it went.
    Reported(Failure, Box<Value>),
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

impl From<Error> for Trouble {
    fn from(error: Error) -> Self {
        Self::Drive(error)
    }
}

impl Trouble {
    /// As Python raises it, with what is wrong with the bus.
    pub(super) fn raised(self, py: Python<'_>, bus: Option<&str>) -> PyErr {
        match self {
            Self::Drive(error) => {
                let (mut text, advice) = (error.to_string(), how_to_name(&error));
                if let Some(advice) = &advice {
                    text = format!("{text}. {advice}");
                }
                let failure = advice.into_iter().fold(Failure::from(error), Failure::next);
                master_error(py, &text, &failure, bus)
            }
            Self::Said(text) => master_error(py, &text, &Failure::new(text.as_str()), bus),
            Self::Failed(failure) => master_error(py, &failure.to_string(), &failure, bus),
            Self::Reported(failure, report) => {
                let error = master_error(py, &failure.to_string(), &failure, bus);
                let set = report.into_python(py).and_then(|report| error.value(py).setattr("report", report));
                set.map_or_else(|failed| failed, |()| error)
            }
        }
    }
}

/// How a program names the model of a node, where that is what is missing.
fn how_to_name(error: &Error) -> Option<String> {
    let (node, fitting) = match error {
        Error::GuessedModel { node, guess, .. } => (*node, guess.fitting().map(|model| model.name).collect()),
        Error::UnknownModel { node, .. } => (*node, vec!["MODEL"]),
        _ => return None,
    };
    Some(format!("name its model: {}", how_to_say(node, &fitting)))
}

#[derive(Default)]
struct Outcome {
    state: Mutex<JobState>,
    ended: Condvar,
}

#[derive(Default)]
struct JobState {
    result: Option<Result<Value, Trouble>>,
    /// There is a result, or there was one until it was taken.
    reported: bool,
    /// The result is not wanted any more, or will never come.
    given_up: bool,
    /// Given up, it goes on until what it has changed is put back.
    leads_back: bool,
    /// Has the work be polled again.
    waker: Option<Waker>,
    /// Called when it has ended.
    callback: Option<Py<PyAny>>,
}

impl JobState {
    const fn has_ended(&self) -> bool {
        self.reported || self.given_up && !self.leads_back
    }
}

impl Outcome {
    fn lock(&self) -> MutexGuard<'_, JobState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reports the end of a job however it ends: with a result, or dropped with the thread that ran it.
struct Reporter(Arc<Outcome>);

impl Reporter {
    /// True once it is given up; until then `waker` is called when it is.
    fn is_given_up(&self, waker: &Waker) -> bool {
        let mut state = self.0.lock();
        state.waker = (!state.given_up).then(|| waker.clone());
        state.given_up
    }

    fn report(&self, result: Option<Result<Value, Trouble>>) {
        let callback = {
            let mut state = self.0.lock();
            state.given_up = state.given_up || result.is_none();
            state.reported = true;
            state.result = result;
            state.callback.take()
        };
        self.0.ended.notify_all();
        if let Some(callback) = callback {
            Python::attach(|py| {
                if let Err(error) = callback.call0(py) {
                    error.write_unraisable(py, None);
                }
            });
        }
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        let has_ended = self.0.lock().has_ended();
        if !has_ended {
            self.report(None);
        }
    }
}

impl Job {
    /// A job, and the future that does it.
    /// One that is given up goes the way back that it has, if any, before it ends.
    pub(super) fn new(
        work: impl Future<Output = Result<Value, Trouble>> + Send + 'static,
        way_back: Option<WayBack>,
        runner: &Arc<Runner>,
    ) -> (Self, world::Job) {
        let outcome = Arc::new(Outcome::default());
        outcome.lock().leads_back = way_back.is_some();
        let reporter = Reporter(Arc::clone(&outcome));
        let future = async move {
            let result = {
                let mut work = pin!(work);
                // Dropping the work takes back what it asked the network for.
                let result = poll_fn(|context| match reporter.is_given_up(context.waker()) {
                    true => Poll::Ready(None),
                    false => work.as_mut().poll(context).map(Some),
                });
                result.await
            };
            match (&result, way_back) {
                // What could not be put back stays in the journal of a real bus; no caller waits for an answer any more.
                (None, Some(way_back)) => way_back.restore().await,
                (Some(_), Some(way_back)) => way_back.remove(),
                (_, None) => {}
            }
            reporter.report(result);
        };
        (Self { number: AtomicU64::new(0), runner: Arc::clone(runner), outcome }, Box::pin(future))
    }

    pub(super) fn set_number(&self, number: u64) {
        self.number.store(number, Ordering::Relaxed);
    }
}

#[pymethods]
impl Job {
    /// Its number in its world; 0 on a real bus.
    #[getter]
    fn number(&self) -> u64 {
        self.number.load(Ordering::Relaxed)
    }

    /// True when it has ended, one way or the other.
    #[getter]
    fn ended(&self) -> bool {
        self.outcome.lock().has_ended()
    }

    /// True for one that puts back what it has changed when it is given up, and ends after that.
    #[getter]
    fn leads_back(&self) -> bool {
        self.outcome.lock().leads_back
    }

    /// Waits for its end on a real bus.
    fn wait(&self, py: Python<'_>) -> PyResult<()> {
        while !self.ended() {
            py.detach(|| {
                let state = self.outcome.lock();
                if !state.has_ended() {
                    drop(self.outcome.ended.wait_timeout(state, NAP));
                }
            });
            py.check_signals()?;
        }
        Ok(())
    }

    /// Has `callback` called from the thread of the bus when it has ended; at once if it has.
    fn on_end(&self, py: Python<'_>, callback: Py<PyAny>) -> PyResult<()> {
        {
            let mut state = self.outcome.lock();
            if !state.has_ended() {
                state.callback = Some(callback);
                return Ok(());
            }
        }
        callback.call0(py).map(|_| ())
    }

    /// Gives it up. What it asked for is taken back; what a drive has received already stays.
    fn cancel(&self, py: Python<'_>) -> PyResult<()> {
        let (waker, leads_back) = {
            let mut state = self.outcome.lock();
            state.given_up = true;
            (state.waker.take(), state.leads_back)
        };
        match &*self.runner {
            Runner::World(shared) if !leads_back => shared.lock(py)?.jobs.cancel(self.number()),
            _ => waker.into_iter().for_each(Waker::wake),
        }
        Ok(())
    }

    /// What came of it; raises what went wrong.
    fn result(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let lost = || self.runner.with_live(Live::lost).flatten();
        match self.outcome.lock().result.take() {
            Some(Ok(value)) => value.into_python(py),
            Some(Err(trouble)) => Err(trouble.raised(py, lost().as_deref())),
            None => {
                Err(wrong_use(lost().unwrap_or_else(|| "it was given up, or the network was closed meanwhile".into())))
            }
        }
    }
}

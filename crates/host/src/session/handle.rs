//! The channels between the web part and the host: a bounded one for requests, and one for states that keeps the newest.
//!
//! No client, however slow or greedy, makes anything here grow: a request that finds no room is refused, a state that was
//! not fetched is replaced, and news that were not fetched are counted. A stop has its own channel, which is never full.

use std::convert::Infallible;
use std::sync::{Arc, OnceLock};

use tokio::sync::{broadcast, mpsc, oneshot, watch};

use crate::answer::Answer;
use crate::command::Command;
use crate::session::authority::SessionId;
use crate::snapshot::{News, Snapshot};
use crate::timeline::Timeline;
use crate::trace::Trace;

/// Requests of all sessions queued for the host, which takes them far faster than they come.
const REQUESTS: usize = 256;

/// News queued for a session; a slower one misses the oldest.
const NEWS: usize = 256;

/// A handle to the host; cheap to clone, one for each task of the web part.
#[derive(Clone, Debug)]
pub struct HostHandle {
    requests: mpsc::Sender<Request>,
    stops: Arc<watch::Sender<u64>>,
    states: watch::Receiver<StateUpdate>,
    news: broadcast::Sender<News>,
    trace: Arc<Trace>,
    timeline: Arc<Timeline>,
}

/// The host's ends of the channels; for a test of a front end without a host.
pub struct Inbox {
    /// What sessions ask.
    pub requests: mpsc::Receiver<Request>,
    /// Counts the presses of stop.
    pub stops: watch::Receiver<u64>,
    /// The state of everything.
    pub states: watch::Sender<StateUpdate>,
    /// News.
    pub news: broadcast::Sender<News>,
    /// The frames of the bus.
    pub trace: Arc<Trace>,
    /// The timeline of the drives.
    pub timeline: Arc<Timeline>,
}

/// The state of everything; as JSON for those who ask for it, made once.
#[derive(Clone, Debug, Default)]
pub struct StateUpdate {
    snapshot: Arc<Snapshot>,
    json: Arc<OnceLock<Arc<str>>>,
}

impl From<Snapshot> for StateUpdate {
    fn from(snapshot: Snapshot) -> Self {
        Self { snapshot: Arc::new(snapshot), json: Arc::default() }
    }
}

impl StateUpdate {
    /// The state as it was when the update was made; cheap to clone.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        Arc::clone(&self.snapshot)
    }

    /// The state as JSON: `/api/state`.
    pub fn json(&self) -> Arc<str> {
        // Only names, numbers and lists: serialising cannot fail.
        let made = || serde_json::to_string(&*self.snapshot).unwrap_or_default().into();
        Arc::clone(self.json.get_or_init(made))
    }
}

/// A request to the host.
#[derive(Debug)]
pub enum Request {
    /// Opens a session.
    Join {
        /// Dropped with the session, however it ends.
        liveness: oneshot::Receiver<Infallible>,
        /// Its number; dropped if there are too many.
        welcome: oneshot::Sender<SessionId>,
    },
    /// A command of a session.
    Do {
        /// Which session.
        session: SessionId,
        /// Number of the message, above all before.
        seq: u64,
        /// What it asks.
        command: Command,
        /// Where the answer is sent.
        answer: oneshot::Sender<Answer>,
    },
}

/// Both ends, with the trace and the timeline that they share.
pub fn channel(trace: Trace) -> (HostHandle, Inbox) {
    let (trace, timeline) = (Arc::new(trace), Arc::<Timeline>::default());
    let (requests, requested) = mpsc::channel(REQUESTS);
    let (stops, stopped) = watch::channel(0);
    let (shown, states) = watch::channel(StateUpdate::default());
    let (news, _) = broadcast::channel(NEWS);
    let handle = HostHandle {
        requests,
        stops: Arc::new(stops),
        states,
        news: news.clone(),
        trace: Arc::clone(&trace),
        timeline: Arc::clone(&timeline),
    };
    (handle, Inbox { requests: requested, stops: stopped, states: shown, news, trace, timeline })
}

/// A session with the host. The host stops what it moved when this is dropped.
#[derive(Debug)]
pub struct Session {
    id: SessionId,
    handle: HostHandle,
    _lifeline: oneshot::Sender<Infallible>,
}

impl HostHandle {
    /// Opens a session; `None` if there are too many, or the host has ended.
    pub async fn join(&self) -> Option<Session> {
        let (held, liveness) = oneshot::channel();
        let (welcome, welcomed) = oneshot::channel();
        self.requests.send(Request::Join { liveness, welcome }).await.ok()?;
        let id = welcomed.await.ok()?;
        Some(Session { id, handle: self.clone(), _lifeline: held })
    }

    /// Requests a quick stop of every drive. Never waits and never fails while there is a host; false without one.
    pub fn stop_all(&self) -> bool {
        self.stops.send_modify(|count| *count = count.wrapping_add(1));
        self.stops.receiver_count() > 0
    }

    /// The states from now on.
    pub fn states(&self) -> watch::Receiver<StateUpdate> {
        self.states.clone()
    }

    /// The frames of the bus so far.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// The timeline of the drives.
    pub fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// The news from now on.
    pub fn news(&self) -> broadcast::Receiver<News> {
        self.news.subscribe()
    }
}

impl Session {
    /// Its number.
    pub const fn id(&self) -> SessionId {
        self.id
    }

    /// Sends a command; returns the receiver of its answer, or the refusal if there is no room.
    pub fn ask(&self, seq: u64, command: Command) -> Result<oneshot::Receiver<Answer>, Answer> {
        if command == Command::STOP_ALL {
            self.handle.stop_all();
        }
        let (answer, answered) = oneshot::channel();
        let request = Request::Do { session: self.id, seq, command, answer };
        match self.handle.requests.try_send(request) {
            Ok(()) => Ok(answered),
            Err(mpsc::error::TrySendError::Full(_)) => {
                Err(Answer::failed(Some(seq), "busy", "too many requests are waiting: try again"))
            }
            Err(mpsc::error::TrySendError::Closed(_)) => Err(Answer::failed(Some(seq), "over", "the studio is ending")),
        }
    }
}

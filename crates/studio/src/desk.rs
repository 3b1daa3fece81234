//! Where the web part and the host meet: wishes in by a bounded channel, pictures out by one that keeps the newest.
//!
//! Nothing here grows with a client that is slow or greedy: a wish that finds no room is refused, a picture that nobody
//! fetched is replaced, and news that were not fetched are counted. A stop has a way of its own, which is never full.

use std::convert::Infallible;
use std::sync::Arc;

use tokio::sync::{broadcast, mpsc, oneshot, watch};

use crate::authority::SessionId;
use crate::message::{Answer, Deed};
use crate::timeline::Timeline;
use crate::trace::Trace;

/// Wishes that may wait for the host, of all sessions together: it takes them far faster than they come.
const WISHES: usize = 256;

/// News that may wait for a session; a slower one misses the oldest.
const NEWS: usize = 256;

/// A handle on the host: a cheap clone for each task of the web part.
#[derive(Clone, Debug)]
pub struct Desk {
    wishes: mpsc::Sender<Wish>,
    stops: Arc<watch::Sender<u64>>,
    pictures: watch::Receiver<Picture>,
    news: broadcast::Sender<Arc<str>>,
    trace: Arc<Trace>,
    timeline: Arc<Timeline>,
}

/// What the host has in its hands.
pub(crate) struct Counter {
    pub(crate) wishes: mpsc::Receiver<Wish>,
    pub(crate) stops: watch::Receiver<u64>,
    pub(crate) pictures: watch::Sender<Picture>,
    pub(crate) news: broadcast::Sender<Arc<str>>,
    pub(crate) trace: Arc<Trace>,
    pub(crate) timeline: Arc<Timeline>,
}

/// The state of everything, as JSON.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// Counts the pictures.
    pub(crate) number: u64,
    pub(crate) json: Arc<str>,
}

/// What a session wants.
#[derive(Debug)]
pub(crate) enum Wish {
    /// To be one.
    Join {
        /// Is dropped with the session, however it ends.
        lifeline: oneshot::Receiver<Infallible>,
        /// Its number; dropped if there are too many.
        welcome: oneshot::Sender<SessionId>,
    },
    /// Something done.
    Do { session: SessionId, seq: u64, deed: Deed, answer: oneshot::Sender<Answer> },
}

/// Both ends, with the trace and the timeline between them.
pub(crate) fn desk(trace: Trace) -> (Desk, Counter) {
    let (trace, timeline) = (Arc::new(trace), Arc::<Timeline>::default());
    let (wishes, wished) = mpsc::channel(WISHES);
    let (stops, stopped) = watch::channel(0);
    let (shown, pictures) = watch::channel(Picture { number: 0, json: "{}".into() });
    let (news, _) = broadcast::channel(NEWS);
    let desk = Desk {
        wishes,
        stops: Arc::new(stops),
        pictures,
        news: news.clone(),
        trace: Arc::clone(&trace),
        timeline: Arc::clone(&timeline),
    };
    (desk, Counter { wishes: wished, stops: stopped, pictures: shown, news, trace, timeline })
}

/// A session at the desk. The host stops what it moved when this is dropped.
#[derive(Debug)]
pub(crate) struct Session {
    id: SessionId,
    desk: Desk,
    _lifeline: oneshot::Sender<Infallible>,
}

impl Desk {
    /// A further session; `None` if there are too many, or no host any more.
    pub(crate) async fn join(&self) -> Option<Session> {
        let (held, lifeline) = oneshot::channel();
        let (welcome, welcomed) = oneshot::channel();
        self.wishes.send(Wish::Join { lifeline, welcome }).await.ok()?;
        let id = welcomed.await.ok()?;
        Some(Session { id, desk: self.clone(), _lifeline: held })
    }

    /// Has every drive quick-stopped. Never waits and never fails while there is a host; false without one.
    pub(crate) fn stop_all(&self) -> bool {
        self.stops.send_modify(|count| *count = count.wrapping_add(1));
        self.stops.receiver_count() > 0
    }

    /// The pictures from now on.
    pub(crate) fn pictures(&self) -> watch::Receiver<Picture> {
        self.pictures.clone()
    }

    /// The frames that have passed.
    pub(crate) fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What has happened.
    pub(crate) fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    /// The news from now on.
    pub(crate) fn news(&self) -> broadcast::Receiver<Arc<str>> {
        self.news.subscribe()
    }
}

impl Session {
    /// Its number.
    pub(crate) const fn id(&self) -> SessionId {
        self.id
    }

    /// Asks for something; where the answer will come, or the answer if there is no room.
    pub(crate) fn ask(&self, seq: u64, deed: Deed) -> Result<oneshot::Receiver<Answer>, Answer> {
        if deed == (Deed::StopAll {}) {
            self.desk.stop_all();
        }
        let (answer, answered) = oneshot::channel();
        let wish = Wish::Do { session: self.id, seq, deed, answer };
        match self.desk.wishes.try_send(wish) {
            Ok(()) => Ok(answered),
            Err(mpsc::error::TrySendError::Full(_)) => {
                Err(Answer::failed(Some(seq), "busy", "too many requests are waiting: try again"))
            }
            Err(mpsc::error::TrySendError::Closed(_)) => Err(Answer::failed(Some(seq), "over", "the studio is ending")),
        }
    }
}

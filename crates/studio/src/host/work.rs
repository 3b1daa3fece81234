//! What is under way, and how the futures of it are held.

use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use futures_util::future::{AbortHandle, LocalBoxFuture, abortable};
use futures_util::stream::FuturesUnordered;
use master::Error;
use master::explain::{Explained, Overheard};
use master::identify::Found;
use tokio::sync::oneshot;

use super::transactions::{Refusal, Written};
use crate::message::Answer;
use crate::snapshot::DriveView;

/// Everything under way.
pub(super) type Work = FuturesUnordered<LocalBoxFuture<'static, Done>>;

/// Who waits for an answer to which message.
pub(super) type Asked = (u64, oneshot::Sender<Answer>);

/// Something has come to its end.
pub(super) enum Done {
    /// A drive was looked at.
    Read(NodeId, Result<Box<DriveView>, Error>),
    /// All node-IDs were asked.
    Scanned(Vec<Found>, Option<Asked>),
    /// A deed on a drive has ended; `None` if it was cut short.
    Deed(NodeId, u64, Option<Result<Vec<String>, Error>>),
    /// What was moved has been told to stop.
    Told(Vec<(NodeId, Result<(), Error>)>),
    /// The PDO mappings of a node were read.
    Learned(NodeId),
    /// Objects were looked at.
    Looked(Asked, Result<serde_json::Value, Refusal>),
    /// Parameters were written, or not.
    Written(Asked, Box<Written>),
    /// A drive was looked at closely.
    Explained(u64, oneshot::Sender<Answer>, Box<Explained>),
}

/// A deed on a drive that is under way. There is one for each node: a further one replaces it.
pub(super) struct Running {
    pub(super) generation: u64,
    /// For people: "moving".
    pub(super) what: &'static str,
    /// It moves the drive, and ends with whoever commanded it.
    pub(super) moves: bool,
    abort: AbortHandle,
    answer: Option<Asked>,
}

/// Frames of others that are gathered before a drive is explained.
pub(super) struct Listening {
    pub(super) node: NodeId,
    pub(super) until: Instant,
    pub(super) heard: Overheard,
    pub(super) seq: u64,
    pub(super) answer: oneshot::Sender<Answer>,
}

/// How long others are listened to before: one and a half of the heartbeat period that most drives come with.
pub(super) const LISTENING_TIME: Duration = Duration::from_millis(1500);

impl Running {
    /// A deed, and the future to poll for it.
    pub(super) fn new(
        node: NodeId,
        generation: u64,
        what: &'static str,
        moves: bool,
        answer: Option<Asked>,
        deed: impl Future<Output = Result<Vec<String>, Error>> + 'static,
    ) -> (Self, LocalBoxFuture<'static, Done>) {
        let (deed, abort) = abortable(deed);
        let future = Box::pin(async move { Done::Deed(node, generation, deed.await.ok()) });
        (Self { generation, what, moves, abort, answer }, future)
    }

    /// Ends it before its time: it asks nothing further of the drive from here on.
    pub(super) fn cut_short(self, kind: &'static str, why: &str) {
        self.abort.abort();
        self.tell(|seq| Answer::failed(Some(seq), kind, why));
    }

    /// Answers whoever asked for it.
    pub(super) fn tell(self, answer: impl FnOnce(u64) -> Answer) {
        if let Some((seq, waiting)) = self.answer {
            say(waiting, answer(seq));
        }
    }
}

/// Gives an answer to whoever waits for it; the page may have gone.
pub(super) fn say(answer: oneshot::Sender<Answer>, text: Answer) {
    let _ = answer.send(text);
}

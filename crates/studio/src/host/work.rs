//! What is under way, and how the futures of it are held.

use std::time::Duration;

use can::Instant;
use canopen::NodeId;
use futures_util::future::{AbortHandle, LocalBoxFuture, abortable};
use futures_util::stream::FuturesUnordered;
use master::Error;
use master::drive::HostLoss;
use master::explain::{Explained, Overheard};
use master::identify::Found;
use master::plan::NodeTraffic;
use tokio::sync::oneshot;

use super::group_run::GroupOutcome;
use super::pdo_load::PlannedPdos;
use super::transactions::{Refusal, Written};
use crate::message::Answer;
use crate::snapshot::DriveView;
use crate::world::{Changed, NoAnswer};

/// Everything under way.
pub(super) type Work = FuturesUnordered<LocalBoxFuture<'static, Done>>;

/// Who waits for an answer to which message.
pub(super) type Asked = (u64, oneshot::Sender<Answer>);

/// What a drive is on while it is being quick-stopped.
pub(super) const STOPPING: &str = "stopping";

/// Something has come to its end.
pub(super) enum Done {
    /// A drive was looked at.
    Read(NodeId, Result<Box<Look>, Error>),
    /// All node-IDs were asked.
    Scanned(Vec<Found>, Option<Asked>),
    /// A command on a drive has ended; `None` if it was cut short.
    Command(NodeId, u64, Option<Outcome>),
    /// A motion of several drives has ended; `None` if it was cut short.
    Group(u64, Option<GroupOutcome>),
    /// The PDO mappings of a node were read; `None` if it did not answer.
    Learned(NodeId, Option<Box<NodeTraffic>>),
    /// They were read for a page.
    PdosRead(Asked, NodeId, Box<Result<NodeTraffic, Refusal>>),
    /// A change of PDOs was planned.
    PdosPlanned(Asked, Box<Result<PlannedPdos, Refusal>>),
    /// Objects were looked at.
    Looked(Asked, Result<serde_json::Value, Refusal>),
    /// Parameters were written, or not.
    Written(Asked, Box<Written>),
    /// The world was looked at.
    LookedAround(Asked, Result<serde_json::Value, NoAnswer>),
    /// Something was done to the world, or not.
    WorldChanged(Asked, Result<Result<Changed, (&'static str, String)>, NoAnswer>),
    /// A drive was looked at closely.
    Explained(u64, oneshot::Sender<Answer>, Box<Explained>),
}

/// What a motion tells when it is done, or why it was not done.
pub(super) type Outcome = Result<Vec<String>, Refusal>;

/// What was seen of a drive.
pub(super) struct Look {
    pub(super) view: DriveView,
    /// What it would do if this program died, where that was asked for and is known.
    pub(super) loss: Option<HostLoss>,
}

/// A command on a drive that is under way. There is one for each node: a further one replaces it.
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
    /// A command, and the future to poll for it.
    pub(super) fn new(
        node: NodeId,
        generation: u64,
        what: &'static str,
        moves: bool,
        answer: Option<Asked>,
        command: impl Future<Output = Outcome> + 'static,
    ) -> (Self, LocalBoxFuture<'static, Done>) {
        let (command, abort) = abortable(command);
        let future = Box::pin(async move { Done::Command(node, generation, command.await.ok()) });
        (Self { generation, what, moves, abort, answer }, future)
    }

    /// A motion of several drives: one for each, and the future of all. The first answers.
    pub(super) fn of_group(
        nodes: &[NodeId],
        generation: u64,
        what: &'static str,
        answer: Asked,
        motion: impl Future<Output = GroupOutcome> + 'static,
    ) -> (Vec<Self>, LocalBoxFuture<'static, Done>) {
        let (motion, abort) = abortable(motion);
        let future = Box::pin(async move { Done::Group(generation, motion.await.ok()) });
        let mut answer = Some(answer);
        let one = |_| Self { generation, what, moves: true, abort: abort.clone(), answer: answer.take() };
        (nodes.iter().map(one).collect(), future)
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

/// What there is to know of something that shows itself: nothing, where it was done.
pub(super) fn quietly(done: Result<(), Error>) -> Outcome {
    done.map(|()| Vec::new()).map_err(|error| refusal_of(&error))
}

/// What the master says, as it is answered.
pub(super) fn refusal_of(error: &Error) -> Refusal {
    (error.kind(), error.to_string())
}

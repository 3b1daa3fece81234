//! Work under way, and the futures that do it.

use std::rc::Weak;
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

use crate::answer::Answer;
use crate::around::Changed;
use crate::capture::CaptureOutcome;
use crate::console::Said;
use crate::motion::group_run::GroupOutcome;
use crate::parameters::transactions::{Refusal, Written};
use crate::pdo::load::PlannedPdos;
use crate::session::authority::SessionId;
use crate::snapshot::DriveView;
use crate::tune::TuneOutcome;
use crate::world::door::NoAnswer;

/// Everything under way.
pub(crate) type Work = FuturesUnordered<LocalBoxFuture<'static, Done>>;

/// A message number, and the sender of its answer.
pub(crate) type Asked = (u64, oneshot::Sender<Answer>);

/// Shown while a drive is being quick-stopped.
pub(crate) const STOPPING: &str = "stopping";

/// A line of a console that is under way beside the commands of drives.
pub(crate) struct OpenLine {
    pub(crate) of: LineOf,
    pub(crate) abort: AbortHandle,
    /// Dropped with the line.
    pub(crate) alive: Weak<()>,
}

/// With what a line ends before it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LineOf {
    /// It stops this drive by itself, beside the host's own stop: with a newer command to that.
    Stop(NodeId),
    /// It looks, for this session: when that leaves.
    Session(SessionId),
}

/// Work that has ended.
pub(crate) enum Done {
    /// A drive was read.
    Read(NodeId, Result<Box<Look>, Error>),
    /// A scan has ended.
    Scanned(Vec<Found>, Option<Asked>),
    /// A command on a drive has ended; `None` if it was cut short.
    Command(NodeId, u64, Option<Outcome>),
    /// A motion of several drives has ended; `None` if it was cut short.
    Group(u64, Option<GroupOutcome>),
    /// The PDO mappings of a node were read; `None` if it did not answer.
    Learned(NodeId, Option<Box<NodeTraffic>>),
    /// PDOs were read for a page.
    PdosRead(Asked, NodeId, Box<Result<NodeTraffic, Refusal>>),
    /// A change of PDOs was planned.
    PdosPlanned(Asked, Box<Result<PlannedPdos, Refusal>>),
    /// Objects were read.
    Looked(Asked, Result<serde_json::Value, Refusal>),
    /// Parameters were written, or not.
    Written(Asked, Box<Written>),
    /// A capture has ended.
    Captured(Asked, Box<CaptureOutcome>),
    /// A measurement for gains, or a trial of them, has ended.
    Tuned(Asked, Box<TuneOutcome>),
    /// The world was read.
    LookedAround(Asked, Result<serde_json::Value, NoAnswer>),
    /// The world was changed, or not.
    WorldChanged(Asked, Result<Result<Changed, (&'static str, String)>, NoAnswer>),
    /// A line of a console has ended.
    Line(Asked, Said),
    /// Something that others wait for has ended.
    Nothing,
    /// A drive was examined for an explanation.
    Explained(u64, oneshot::Sender<Answer>, Box<Explained>),
}

/// The remarks of a motion that was done, or why it was not done.
pub(crate) type Outcome = Result<Vec<String>, Refusal>;

/// The values read from a drive.
pub(crate) struct Look {
    pub(crate) view: DriveView,
    /// What it would do if this program died, if read and known.
    pub(crate) loss: Option<HostLoss>,
}

/// A command under way on a drive. There is one for each node: a further one replaces it.
pub(crate) struct Running {
    pub(crate) generation: u64,
    /// For people: "moving".
    pub(crate) what: &'static str,
    /// It moves the drive, and ends with the session that commanded it.
    pub(crate) moves: bool,
    abort: AbortHandle,
    answer: Option<Asked>,
}

/// Frames of other programs that are gathered before a drive is explained.
pub(crate) struct Listening {
    pub(crate) node: NodeId,
    pub(crate) until: Instant,
    pub(crate) heard: Overheard,
    pub(crate) seq: u64,
    pub(crate) answer: oneshot::Sender<Answer>,
}

/// How long other programs are listened to before: 1.5 times the usual default heartbeat period.
pub(crate) const LISTENING_TIME: Duration = Duration::from_millis(1500);

impl Running {
    /// A command, and the future to poll for it.
    pub(crate) fn new(
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
    pub(crate) fn of_group(
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

    /// A test motion: its own future answers, at the end of the way back.
    pub(crate) const fn of_test_motion(generation: u64, what: &'static str, abort: AbortHandle) -> Self {
        Self { generation, what, moves: true, abort, answer: None }
    }

    /// Cancels it: it sends nothing further to the drive.
    pub(crate) fn cut_short(self, kind: &'static str, why: &str) {
        self.abort.abort();
        self.reply(|seq| Answer::failed(Some(seq), kind, why));
    }

    /// Answers its requests.
    pub(crate) fn reply(self, answer: impl FnOnce(u64) -> Answer) {
        if let Some((seq, waiting)) = self.answer {
            send(waiting, answer(seq));
        }
    }
}

/// Sends an answer to the task that waits for it; the page may have disconnected.
pub(crate) fn send(answer: oneshot::Sender<Answer>, text: Answer) {
    let _ = answer.send(text);
}

/// The outcome of a command whose effect is visible: no remarks.
pub(crate) fn quietly(done: Result<(), Error>) -> Outcome {
    done.map(|()| Vec::new()).map_err(|error| refusal_of(&error))
}

/// An error of the master, as a refusal.
pub(crate) fn refusal_of(error: &Error) -> Refusal {
    (error.kind(), error.to_string())
}

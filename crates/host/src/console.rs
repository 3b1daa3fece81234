//! What a front end gives the host for the lines of its console: who understands them ([`Reader`]), and what they are carried out with.

use std::collections::BTreeMap;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use canopen::NodeId;
use devices::Description;
use master::{Gear, Network};
use serde_json::json;
use words::failure::{Failure, FailureBody};
use words::plain;

use crate::answer::Answer;
use crate::command::Command;
use crate::trace::Trace;

/// Understands the lines of a console.
pub trait Reader: core::fmt::Debug + Send + Sync {
    /// What a line asks for.
    ///
    /// # Errors
    /// What is said at once: help, or what is wrong with the line.
    fn read(&self, line: &str) -> Result<Order, Said>;
}

/// A line that is being carried out.
pub type Work = Pin<Box<dyn Future<Output = Said>>>;

/// What a line asks for.
pub struct Order {
    /// What it does to drives: a command to one, or [`Command::STOP_ALL`]; `None` if it only looks.
    pub asked: Option<Command>,
    /// Does it, and words what came of it.
    pub work: Box<dyn FnOnce(Hands) -> Work>,
}

impl core::fmt::Debug for Order {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Order").field("asked", &self.asked).finish_non_exhaustive()
    }
}

/// What a line is carried out with.
#[derive(Clone, Debug)]
pub struct Hands {
    /// The bus as the master sees it.
    pub network: Network,
    /// The bus, as it was given.
    pub bus: String,
    /// The session is in control: it may do more to the bus than stop its drives.
    pub in_control: bool,
    /// Longest wait for each answer of a node.
    pub timeout: Duration,
    /// The models that are known for sure.
    pub models: BTreeMap<NodeId, &'static Description>,
    /// The gears behind the shafts.
    pub gears: BTreeMap<NodeId, Gear>,
    /// The frames of the bus.
    pub trace: Arc<Trace>,
}

/// What a line has to say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// As the command line prints it.
    pub text: String,
    /// The status that the command line ends with: 0 if it was done, 2 for a line that makes no sense.
    pub status: u8,
    /// The kind of a failure, and in one line what failed and why.
    pub trouble: Option<(&'static str, String)>,
}

impl Said {
    /// It was done.
    pub const fn done(text: String) -> Self {
        Self { text, status: 0, trouble: None }
    }

    /// It was not, for a reason that was found before anything was done.
    pub fn failed(failure: &Failure) -> Self {
        let FailureBody { kind, message, .. } = failure.into();
        let status = if failure.is_usage { 2 } else { 1 };
        Self { text: format!("error: {}", plain(&failure.to_string())), status, trouble: Some((kind, message)) }
    }

    /// The line makes no sense: `text` says why.
    pub fn senseless(text: String) -> Self {
        let message = text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        Self { text, status: 2, trouble: Some(("usage", message)) }
    }

    pub(crate) fn refused(kind: &'static str, message: &str) -> Self {
        Self { text: format!("error: {message}"), status: 1, trouble: Some((kind, message.to_owned())) }
    }

    /// What a session is answered.
    pub(crate) fn answer(&self, seq: u64) -> Answer {
        Answer::known(
            seq,
            json!({ "text": self.text, "status": self.status, "kind": self.trouble.as_ref().map(|(kind, _)| kind) }),
        )
    }
}

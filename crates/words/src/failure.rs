//! Why something was not done, in parts that a person reads in order and a program looks into: what, where, why, what to do next.
//!
//! The command line prints it and its `--json`, the Python package raises it.

use std::error::Error;
use std::fmt;

use canopen::{AbortCode, Mux, NodeId};
use cia402::ModeOfOperation;
use master::base::{BaseError, StopCause};
use master::group::GroupError;
use serde::Serialize;

/// A reason in up to three parts, and what it is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What kind it is, in a word that programs may rely on; `docs/json.md` lists them.
    pub kind: &'static str,
    /// What could not be done, with node and object.
    pub what: String,
    /// Why: what the drive or the system answered, what was expected; one line each.
    pub because: Vec<String>,
    /// What to do next, one line each.
    pub next: Vec<String>,
    /// The node, object and abort code that it is about.
    pub subject: Subject,
    /// The request itself makes no sense: nothing was tried.
    pub is_usage: bool,
}

/// What a failure is about, as far as it is about one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Subject {
    /// The node.
    pub node: Option<NodeId>,
    /// The object.
    pub object: Option<Mux>,
    /// The SDO abort code that the node answered with.
    pub abort: Option<AbortCode>,
}

impl Failure {
    /// It was tried and failed.
    pub fn new(what: impl Into<String>) -> Self {
        Self {
            kind: "failed",
            what: what.into(),
            because: Vec::new(),
            next: Vec::new(),
            subject: Subject::default(),
            is_usage: false,
        }
    }

    /// The request makes no sense.
    pub fn usage(what: impl Into<String>) -> Self {
        Self { kind: "usage", is_usage: true, ..Self::new(what) }
    }

    /// A file that the request names is missing, or is not what it is to be.
    pub fn bad_file(what: impl Into<String>) -> Self {
        Self { kind: "bad_file", ..Self::new(what) }
    }

    /// A file that was asked for cannot be written.
    pub fn of_writing(what: &str, path: &std::path::Path, error: &std::io::Error) -> Self {
        Self::new(format!("cannot write {what} {}", path.display())).of_kind("file").because(error).next(
            "make sure that its folder exists, can be written and has room; an existing file of another kind is not overwritten",
        )
    }

    /// What and what to do next, in one line.
    pub fn one_line(&self) -> String {
        let parts: Vec<_> = std::iter::once(&self.what).chain(&self.next).map(String::as_str).collect();
        parts.join(": ")
    }

    /// Names its kind.
    #[must_use]
    pub fn of_kind(self, kind: &'static str) -> Self {
        Self { kind, ..self }
    }

    /// Names the node that it is about.
    #[must_use]
    pub fn at_node(mut self, node: NodeId) -> Self {
        self.subject.node = Some(node);
        self
    }

    /// The same with the number of a row; 0 or more than 127 names none.
    #[must_use]
    pub fn about(mut self, node: u8) -> Self {
        self.subject.node = NodeId::new(node);
        self
    }

    /// Names the object that it is about.
    #[must_use]
    pub fn at_object(mut self, object: Mux) -> Self {
        self.subject.object = Some(object);
        self
    }

    /// Adds a reason.
    #[must_use]
    pub fn because(mut self, reason: impl fmt::Display) -> Self {
        self.because.push(reason.to_string());
        self
    }

    /// With what had failed before it as a reason.
    #[must_use]
    pub fn after(mut self, earlier: Self) -> Self {
        self.because.push(earlier.what);
        self.because.extend(earlier.because);
        self.next.extend(earlier.next);
        self
    }

    /// Adds advice; what is there already, as of another node with the same trouble, is not said twice.
    #[must_use]
    pub fn next(mut self, advice: impl fmt::Display) -> Self {
        let advice = advice.to_string();
        if !self.next.contains(&advice) {
            self.next.push(advice);
        }
        self
    }
}

/// What was done, and how it ended. Where both failed, the end comes first: a shaft that may still turn, or a value that was not put
/// back, matters more than why.
///
/// # Errors
/// What failed.
pub fn both<T>(done: Result<T, Failure>, ended: Result<(), Failure>) -> Result<T, Failure> {
    match (done, ended) {
        (Err(why), Err(end)) => Err(end.after(why)),
        (done, ended) => done.and_then(|done| ended.map(|()| done)),
    }
}

/// What has caused an error, the nearest first.
pub fn causes(error: &dyn Error) -> impl Iterator<Item = &dyn Error> {
    std::iter::successors(error.source(), |&cause| cause.source())
}

/// An error with what has caused it, in one line.
pub fn with_causes(error: &dyn Error) -> String {
    causes(error).fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// The same for programs: the `error` of a line of `--json`.
#[derive(Clone, Debug, Serialize)]
pub struct FailureBody {
    /// A word: `usage`, `no_answer`, `aborted`, `out_of_limits`, ...
    pub kind: &'static str,
    /// What and why.
    pub message: String,
    /// The node that it is about.
    pub node: Option<u8>,
    /// The object that it is about.
    pub object: Option<String>,
    /// The SDO abort code.
    pub abort: Option<u32>,
    /// What to do.
    pub next: Option<String>,
}

impl FailureBody {
    /// Of the parts of a failure: what, why, and what to do.
    pub fn new(kind: &'static str, (what, because, next): (&str, &[String], &[String]), subject: Subject) -> Self {
        let because = because.join("; ");
        Self {
            kind,
            message: if because.is_empty() { what.to_owned() } else { format!("{what}: {because}") },
            node: subject.node.map(NodeId::raw),
            object: subject.object.map(|object| object.to_string()),
            abort: subject.abort.map(|code| code.0),
            next: (!next.is_empty()).then(|| next.join("; ")),
        }
    }
}

impl From<&Failure> for FailureBody {
    fn from(failure: &Failure) -> Self {
        Self::new(failure.kind, (&failure.what, &failure.because, &failure.next), failure.subject)
    }
}

/// Several lines, each complete: `what`, then the reasons, then the advice.
impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        self.because.iter().try_for_each(|reason| write!(f, "\n  because: {reason}"))?;
        self.next.iter().try_for_each(|advice| write!(f, "\n  next:    {advice}"))
    }
}

impl From<master::Error> for Failure {
    /// The master's errors have what, why and what to do; how a model is named is the caller's to add.
    fn from(error: master::Error) -> Self {
        let subject = Subject { node: Some(error.node()), object: error.object(), abort: error.abort() };
        let failure = Self { kind: error.kind(), subject, ..parts(&error) };
        match remedy(&error) {
            Some(remedy) if failure.next.is_empty() => failure.next(remedy),
            _ => failure,
        }
    }
}

/// Where an error of several drives names no remedy of its own: what shows why one of them does not follow.
pub const SEE_DRIVES: &str = "ferrodrive state NODE shows where each stands, ferrodrive explain NODE what keeps it";

const MODES: &str = "name a mode that the model has: csp, ip, csv or pv; ferrodrive objects NODE 6060 shows them";

impl From<GroupError> for Failure {
    /// What a drive said is that drive's failure.
    fn from(error: GroupError) -> Self {
        let what = error.to_string();
        let group = || Self::new(what.as_str()).of_kind("group");
        match error {
            GroupError::Drive(error) => error.into(),
            GroupError::Period { .. } => Self::usage(what).next("give a period within that, e.g. 5ms"),
            GroupError::NoAxis => Self::usage(what).next("name the axes that are to move as one"),
            GroupError::Path { .. } | GroupError::BeyondDrive { .. } => {
                let failure = Self::new(what)
                    .of_kind("out_of_limits")
                    .next("give a position, velocity, acceleration or rounding within what the axes may do");
                match error {
                    GroupError::Path { node: Some(node), .. } | GroupError::BeyondDrive { node, .. } => failure.at_node(node),
                    _ => failure,
                }
            }
            GroupError::NoMode { node } => group().at_node(node).next(MODES),
            GroupError::NoPosition { node, .. } => group().at_node(node).next(
                "choose another mode (the best that the model has is taken without one), or map 6064h to a TPDO that comes each cycle",
            ),
            GroupError::NotEnabled { node, .. } => group().at_node(node).next(format!(
                "ferrodrive explain {node} says what keeps it; `ferrodrive plan` whether the bus carries such a cycle"
            )),
            // What the drive said in it, unless that is about the mode.
            GroupError::Cyclic(error) => match error.of_drive() {
                None | Some(master::Error::NoSuchMode { .. }) => group().next(MODES),
                Some(said) => {
                    let Self { kind, subject, next, .. } = Self::from(said.clone());
                    Self { kind, subject, next, ..group() }
                }
            },
            GroupError::NotAtRest(why) => group().at_node(why.node()).next(SEE_DRIVES),
            _ => group().next(SEE_DRIVES),
        }
    }
}

impl Failure {
    /// About the wheel that stopped a base, if one did.
    fn of_cause(self, cause: StopCause) -> Self {
        match cause {
            StopCause::Wheel { node, .. } | StopCause::Lag { node, .. } => self.at_node(node),
            StopCause::Watchdog { .. } => self,
        }
    }
}

impl From<BaseError> for Failure {
    /// What a drive said is that drive's failure.
    fn from(error: BaseError) -> Self {
        let what = error.to_string();
        let base = || Self::new(what.as_str()).of_kind("base");
        match error {
            BaseError::Drive(error) => error.into(),
            BaseError::BadLimit { .. } | BaseError::BadLength { .. } | BaseError::BadTwist { .. } => {
                Self::usage(what).next("give finite numbers, and lengths, limits and times above 0")
            }
            BaseError::BeyondDrive { .. } => {
                Self::new(what).of_kind("out_of_limits").next("lower the limits of the base")
            }
            BaseError::NotEnabled { .. } => base().next("ferrodrive explain NODE says what keeps each of them"),
            BaseError::NotAtRest(why) => base().at_node(why.node()).next(SEE_DRIVES),
            BaseError::Stopped(cause) => base().of_cause(cause).next(SEE_DRIVES),
            BaseError::NotStopped { cause, .. } => base().of_cause(*cause).next(SEE_DRIVES),
            _ => base().next(SEE_DRIVES),
        }
    }
}

/// What to do about an error of the master whose words do not have it apart; of a model that is not known the caller says how it is named.
fn remedy(error: &master::Error) -> Option<&'static str> {
    use master::Error;
    Some(match error {
        Error::OutOfLimits { .. } | Error::TooFine { .. } => {
            "ask for a value that the drive takes, or change the setting that limits it"
        }
        Error::BadAnswer { .. } => "try again; ferrodrive scan shows whether two devices have this node-ID",
        Error::WrongLength { .. } => "ferrodrive scan shows what the node is; name its model if it is another one",
        Error::QueueFull { .. } => "wait for the requests that are under way, then send the next one",
        Error::NoSuchAxis { axes: 0, .. } => {
            "name the node of a drive; `ferrodrive write` sets the outputs of other devices"
        }
        Error::NoSuchAxis { .. } => "name an axis that the model has; the first is number 1",
        Error::NoSuchQuantity { .. } => "ferrodrive objects NODE lists what the model has",
        Error::NoFeed { .. } => {
            "give an angle such as 90deg, or a machine file whose [[drive]] has units = { feed_constant = \"10mm\" }"
        }
        Error::NoParameterStore { .. } => {
            "write them after each start: ferrodrive params apply NODE FILE, or boot by a machine file"
        }
        Error::NotStored { .. } => {
            "look for what keeps its memory from answering: ferrodrive faults NODE; then save again"
        }
        Error::NoFactorySettings { .. } => "write each object instead: ferrodrive params apply NODE FILE",
        Error::NoSuchMode { mode: ModeOfOperation::HOMING, .. } => {
            "move it to its reference, and set the position to zero there: ferrodrive objects NODE position"
        }
        Error::NoSuchMode { .. } => "choose one of the modes that the model has",
        _ => return None,
    })
}

/// What the error says, and apart from it what it advises.
fn parts(error: &master::Error) -> Failure {
    if let master::Error::NotReached(explanation) = error {
        let facts: Vec<String> = explanation.facts.iter().map(ToString::to_string).collect();
        return Failure::new(format!("node {}: could not {}", explanation.node, explanation.intent))
            .because(&explanation.conclusion)
            .because(format!("seen: {}", facts.join("; ")))
            .next(&explanation.advice);
    }
    let text = error.to_string();
    match error.advice().and_then(|advice| Some((text.strip_suffix(&advice)?, advice.clone()))) {
        Some((what, advice)) => Failure::new(what.trim_end().trim_end_matches(['.', ':'])).next(advice),
        None => Failure::new(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_names_what_why_and_next() {
        let failure = Failure::new("cannot read 6064h:00 of node 9").because("no answer").next("ferrodrive scan");
        let text = "cannot read 6064h:00 of node 9\n  because: no answer\n  next:    ferrodrive scan";
        assert_eq!(failure.to_string(), text);
        assert!(Failure::usage("x").is_usage && !failure.is_usage);
    }

    #[test]
    fn advice_for_several_nodes_is_said_once() {
        let nodes = ["node 1: no answer", "node 2: no answer"];
        let failure = nodes.iter().fold(Failure::new("not booted"), |it, why| it.because(why).next("check the cable"));
        assert_eq!((failure.because.len(), failure.next), (2, vec!["check the cable".to_owned()]));
    }

    #[test]
    fn a_drive_that_is_silent_while_a_group_is_opened_is_not_asked_for_its_modes() {
        let node = NodeId::MIN;
        let silent = master::Error::QueueFull { node };
        let error = |error: master::Error| Failure::from(GroupError::Cyclic(error.into()));
        assert_eq!(
            (error(silent.clone()).kind, error(silent.clone()).next),
            ("queue_full", Failure::from(silent).next)
        );
        assert_eq!(error(master::Error::UnknownModel { node, intent: "move it" }).kind, "unknown_model");
    }

    #[test]
    fn an_error_is_reported_with_all_that_has_caused_it() {
        #[derive(Debug)]
        struct Lost(Option<Box<Lost>>, &'static str);
        impl fmt::Display for Lost {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.1)
            }
        }
        impl Error for Lost {
            fn source(&self) -> Option<&(dyn Error + 'static)> {
                self.0.as_deref().map(|cause| cause as _)
            }
        }
        let reset = Lost(None, "connection reset");
        let error = Lost(Some(Box::new(Lost(Some(Box::new(reset)), "cannot read"))), "the bus is lost");
        assert_eq!(with_causes(&error), "the bus is lost: cannot read: connection reset");
        assert_eq!(causes(&error).map(ToString::to_string).collect::<Vec<_>>(), ["cannot read", "connection reset"]);
    }
}

//! Why a command did not do what was asked: what failed, what the drive said, what to do next.

use std::fmt;

use canopen::{Mux, NodeId};
use clap::error::{ContextKind, ErrorKind};
use master::base::BaseError;
use master::group::GroupError;
use serde::Serialize;

use crate::plain::short;
use crate::signals::Signal;
use crate::status::Status;
pub(crate) use words::failure::FailureBody;
use words::failure::Subject;
use words::models::how_to_say;
use words::unresolved::Unresolved;

/// A reason for people, in up to three parts, and what programs look for in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    /// Decides the exit status.
    pub(crate) status: Status,
    /// What kind it is, in a word that programs may rely on.
    pub(crate) kind: &'static str,
    /// What could not be done, with node and object.
    pub(crate) what: String,
    /// Why: what the drive or the system said, one line each.
    pub(crate) because: Vec<String>,
    /// What to do next, one line each.
    pub(crate) next: Vec<String>,
    /// The node, object and abort code that it is about.
    pub(crate) subject: Subject,
    /// It has been reported already, as part of what the command printed.
    pub(crate) reported: bool,
    /// Lines of output were printed before it, which are not all that there would be.
    pub(crate) partial: bool,
}

impl Failure {
    /// The operation failed.
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self {
            status: Status::Failed,
            kind: "failed",
            what: what.into(),
            because: Vec::new(),
            next: Vec::new(),
            subject: Subject::default(),
            reported: false,
            partial: false,
        }
    }

    /// Standard output cannot be written.
    #[allow(clippy::needless_pass_by_value, reason = "for map_err")]
    pub(crate) fn not_printed(error: std::io::Error) -> Self {
        Self::of_stdout(error)
    }

    /// The command line makes no sense, as found out only now.
    pub(crate) fn usage(what: impl Into<String>) -> Self {
        Self { status: Status::Usage, kind: "usage", ..Self::new(what) }
    }

    /// A file that the command is to work by is missing, or is not what it is to be.
    pub(crate) fn bad_file(what: impl Into<String>) -> Self {
        Self { kind: "bad_file", ..Self::new(what) }
    }

    /// What the command has to say does not get out.
    pub(crate) fn of_stdout(error: std::io::Error) -> Self {
        Self::new("cannot write to standard output")
            .because(error)
            .next("check whether the disk is full, or the reading program has ended")
    }

    /// A file that was asked for cannot be written.
    pub(crate) fn of_writing(what: &str, path: &std::path::Path, error: &std::io::Error) -> Self {
        Self::new(format!("cannot write {what} {}", path.display())).of_kind("file").because(error).next(
            "make sure that its folder exists, can be written and has room; an existing file of another kind is not overwritten",
        )
    }

    /// What is asked for needs the model of a node, and that is not known.
    pub(crate) fn unknown_model(node: NodeId) -> Self {
        let failure =
            Self::new(format!("the model of node {node} is not known")).of_kind("unknown_model").at_node(node);
        failure.next(format!("name its model: {}", how_to_say(node, &["MODEL"])))
    }

    /// A signal asked the command to end.
    pub(crate) fn ended_by(signal: Signal) -> Self {
        Self { status: signal.status(), kind: "interrupted", ..Self::new(signal.text()) }
    }

    /// What the parser of the command line found, for programs; people get its own text.
    pub(crate) fn of_command_line(error: &clap::Error) -> Self {
        let text = short(&error.render().to_string());
        let (what, rest) = text.split_once("\n\n").unwrap_or((&text, ""));
        let what: Vec<&str> = what.lines().map(str::trim).collect();
        let failure = Self::usage(what.join(" ").trim_start_matches("error: "));
        let tips = rest.lines().map(str::trim).filter_map(|line| line.strip_prefix("tip: "));
        let failure = tips.fold(failure, |failure, tip| failure.next(tip));
        match error.kind() {
            ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
                Self::usage("no command given").next("ferrodrive --help lists the commands")
            }
            _ => match error.get(ContextKind::Usage) {
                Some(usage) => failure.next(usage.to_string().trim().replace("Usage:", "usage:")),
                None if failure.next.is_empty() => failure.next("ferrodrive --help, or --help after the command"),
                None => failure,
            },
        }
    }

    /// That a file named on the command line is missing or cannot be used, where that is what the parser met: the command line itself
    /// makes sense.
    pub(crate) fn of_named_file(error: &clap::Error) -> Option<Self> {
        let unresolved = std::error::Error::source(error)?.downcast_ref::<Unresolved>()?;
        let Unresolved::File(reason) = unresolved else { return None };
        Some(
            Self::bad_file(short(reason))
                .next("give the path of an EDS or DCF file; `ferrodrive eds lint FILE` says what is wrong with one"),
        )
    }

    /// Names its kind.
    pub(crate) fn of_kind(self, kind: &'static str) -> Self {
        Self { kind, ..self }
    }

    /// Says which node it is about.
    pub(crate) fn at_node(mut self, node: NodeId) -> Self {
        self.subject.node = Some(node);
        self
    }

    /// Says which object it is about.
    pub(crate) fn at_object(mut self, object: Mux) -> Self {
        self.subject.object = Some(object);
        self
    }

    /// Adds a reason.
    pub(crate) fn because(mut self, reason: impl fmt::Display) -> Self {
        self.because.push(reason.to_string());
        self
    }

    /// Adds advice.
    pub(crate) fn next(mut self, advice: impl fmt::Display) -> Self {
        self.next.push(advice.to_string());
        self
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

/// A failure as programs read it: `{"ok":false,"error":{..}}`.
#[derive(Serialize)]
pub(crate) struct FailureReport {
    ok: bool,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    partial: bool,
    error: FailureBody,
}

impl From<&Failure> for FailureReport {
    fn from(failure: &Failure) -> Self {
        Self { ok: false, partial: failure.partial, error: failure.into() }
    }
}

impl From<&Failure> for FailureBody {
    fn from(failure: &Failure) -> Self {
        Self::new(failure.kind, (&failure.what, &failure.because, &failure.next), failure.subject)
    }
}

impl From<words::failure::Failure> for Failure {
    fn from(failure: words::failure::Failure) -> Self {
        let words::failure::Failure { kind, what, because, next, subject, is_usage } = failure;
        let status = if is_usage { Status::Usage } else { Status::Failed };
        Self { status, kind, what, because, next, subject, reported: false, partial: false }
    }
}

impl From<GroupError> for Failure {
    fn from(error: GroupError) -> Self {
        match error {
            GroupError::Drive(error) => error.into(),
            error => words::failure::Failure::from(error).into(),
        }
    }
}

impl From<BaseError> for Failure {
    fn from(error: BaseError) -> Self {
        match error {
            BaseError::Drive(error) => error.into(),
            error => words::failure::Failure::from(error).into(),
        }
    }
}

impl From<master::Error> for Failure {
    /// With how a model is named on this command line.
    fn from(error: master::Error) -> Self {
        use master::Error;
        let advice = match &error {
            Error::GuessedModel { node, guess, .. } => {
                let fitting: Vec<_> = guess.fitting().map(|model| model.name).collect();
                Some(format!("name its model: {}", how_to_say(*node, &fitting)))
            }
            Error::WrongModel { node, .. } | Error::OtherModel { node, .. } => Some(format!(
                "omit --model {node}=.., see what `ferrodrive scan` shows for it, or correct the machine file"
            )),
            Error::UnknownModel { node, .. } => Some(format!("name its model: {}", how_to_say(*node, &["MODEL"]))),
            _ => None,
        };
        advice.into_iter().fold(words::failure::Failure::from(error).into(), Self::next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::AbortCode;

    #[test]
    fn a_failure_names_what_why_and_next() {
        let failure = Failure::new("cannot read 6064h:00 of node 9").because("no answer").next("ferrodrive scan");
        let text = "cannot read 6064h:00 of node 9\n  because: no answer\n  next:    ferrodrive scan";
        assert_eq!(failure.to_string(), text);
        assert_eq!(Failure::usage("x").status as u8, 2);
    }

    #[test]
    fn a_failure_for_programs_has_its_parts_in_fields() {
        let failure = Failure::new("node 4 refused").because("read-only").next("read it").next("once");
        let mut failure = failure.at_node(NodeId::new(4).unwrap()).at_object(Mux::new(0x6064, 0));
        failure.subject.abort = Some(AbortCode::READ_ONLY);
        let json = serde_json::to_value(FailureReport::from(&failure)).unwrap();
        let expected = serde_json::json!({ "ok": false, "error": {
            "kind": "failed", "message": "node 4 refused: read-only", "node": 4, "object": "6064h:00",
            "abort": 0x0601_0002, "next": "read it; once" } });
        assert_eq!(json, expected);
    }
}

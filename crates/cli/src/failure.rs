//! Why a command did not do what was asked: what failed, what the drive said, what to do next.

use std::fmt;
use std::ops::{Deref, DerefMut};

use canopen::{Mux, NodeId};
use clap::error::{ContextKind, ErrorKind};
use master::base::BaseError;
use master::group::GroupError;
use serde::Serialize;

use crate::plain::short;
use crate::signals::Signal;
use crate::status::Status;
pub(crate) use words::failure::FailureBody;
use words::models::name_its_model;
use words::unresolved::Unresolved;

/// A reason for people and for programs, and what it means for the command that fails with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    /// Decides the exit status.
    pub(crate) status: Status,
    /// It has been reported already, as part of what the command printed.
    pub(crate) reported: bool,
    /// Lines of output were printed before it, which are not all that there would be.
    pub(crate) partial: bool,
    /// What failed, why, and what to do next.
    pub(crate) reason: words::failure::Failure,
}

impl Deref for Failure {
    type Target = words::failure::Failure;

    fn deref(&self) -> &Self::Target {
        &self.reason
    }
}

impl DerefMut for Failure {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.reason
    }
}

impl Failure {
    /// The operation failed.
    pub(crate) fn new(what: impl Into<String>) -> Self {
        words::failure::Failure::new(what).into()
    }

    /// The command line makes no sense, as found out only now.
    pub(crate) fn usage(what: impl Into<String>) -> Self {
        words::failure::Failure::usage(what).into()
    }

    /// A file that the command is to work by is missing, or is not what it is to be.
    pub(crate) fn bad_file(what: impl Into<String>) -> Self {
        words::failure::Failure::bad_file(what).into()
    }

    /// What the command has to say does not get out.
    pub(crate) fn of_stdout(error: std::io::Error) -> Self {
        Self::new("cannot write to standard output")
            .because(error)
            .next("check whether the disk is full, or the reading program has ended")
    }

    /// A file that was asked for cannot be written.
    pub(crate) fn of_writing(what: &str, path: &std::path::Path, error: &std::io::Error) -> Self {
        words::failure::Failure::of_writing(what, path, error).into()
    }

    /// What is asked for needs the model of a node, and that is not known.
    pub(crate) fn unknown_model(node: NodeId) -> Self {
        let failure = Self::new(format!("the model of node {node} is not known")).of_kind("unknown_model");
        failure.at_node(node).next(name_its_model(node, &["MODEL"]))
    }

    /// A signal asked the command to end.
    pub(crate) fn ended_by(signal: Signal) -> Self {
        Self { status: signal.status(), ..Self::new(signal.text()).of_kind("interrupted") }
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
        Self { reason: self.reason.of_kind(kind), ..self }
    }

    /// Says which node it is about.
    pub(crate) fn at_node(self, node: NodeId) -> Self {
        Self { reason: self.reason.at_node(node), ..self }
    }

    /// Says which object it is about.
    pub(crate) fn at_object(self, object: Mux) -> Self {
        Self { reason: self.reason.at_object(object), ..self }
    }

    /// Adds a reason.
    pub(crate) fn because(self, reason: impl fmt::Display) -> Self {
        Self { reason: self.reason.because(reason), ..self }
    }

    /// Adds advice.
    pub(crate) fn next(self, advice: impl fmt::Display) -> Self {
        Self { reason: self.reason.next(advice), ..self }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.reason.fmt(f)
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
        (&failure.reason).into()
    }
}

impl From<words::failure::Failure> for Failure {
    fn from(reason: words::failure::Failure) -> Self {
        let status = if reason.is_usage { Status::Usage } else { Status::Failed };
        Self { status, reported: false, partial: false, reason }
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
                Some(name_its_model(*node, &fitting))
            }
            Error::WrongModel { node, .. } | Error::OtherModel { node, .. } => Some(format!(
                "omit --model {node}=.., see what `ferrodrive scan` shows for it, or correct the machine file"
            )),
            Error::UnknownModel { node, .. } => Some(name_its_model(*node, &["MODEL"])),
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
    fn what_makes_no_sense_has_its_own_status() {
        assert_eq!((Failure::usage("x").status, Failure::new("x").status), (Status::Usage, Status::Failed));
        assert_eq!(Failure::usage("x").next("y").of_kind("z").status as u8, 2);
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

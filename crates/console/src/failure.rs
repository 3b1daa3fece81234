//! Why a command did not do what was asked: what failed, what the drive said, what to do next.

use std::fmt;
use std::ops::{Deref, DerefMut};

use canopen::{Mux, NodeId};
use master::base::BaseError;
use master::group::GroupError;
use serde::Serialize;

use crate::status::Status;
pub use words::failure::FailureBody;
use words::models::name_its_model;

/// A reason for people and for programs, and what it means for the command that fails with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Decides the exit status.
    pub status: Status,
    /// It has been reported already, as part of what the command printed.
    pub reported: bool,
    /// Lines of output were printed before it, which are not all that there would be.
    pub partial: bool,
    /// What failed, why, and what to do next.
    pub reason: words::failure::Failure,
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
    pub fn new(what: impl Into<String>) -> Self {
        words::failure::Failure::new(what).into()
    }

    /// The command line makes no sense, as found out only now.
    pub fn usage(what: impl Into<String>) -> Self {
        words::failure::Failure::usage(what).into()
    }

    /// A file that the command is to work by is missing, or is not what it is to be.
    pub fn bad_file(what: impl Into<String>) -> Self {
        words::failure::Failure::bad_file(what).into()
    }

    /// What the command has to say does not get out.
    pub fn of_stdout(error: std::io::Error) -> Self {
        Self::new("cannot write to standard output")
            .because(error)
            .next("check whether the disk is full, or the reading program has ended")
    }

    /// A file that was asked for cannot be written.
    pub fn of_writing(what: &str, path: &std::path::Path, error: &std::io::Error) -> Self {
        words::failure::Failure::of_writing(what, path, error).into()
    }

    /// What is asked for needs the model of a node, and that is not known.
    pub fn unknown_model(node: NodeId) -> Self {
        let failure = Self::new(format!("the model of node {node} is not known")).of_kind("unknown_model");
        failure.at_node(node).next(name_its_model(node, &["MODEL"]))
    }

    /// Names its kind.
    pub fn of_kind(self, kind: &'static str) -> Self {
        Self { reason: self.reason.of_kind(kind), ..self }
    }

    /// Says which node it is about.
    pub fn at_node(self, node: NodeId) -> Self {
        Self { reason: self.reason.at_node(node), ..self }
    }

    /// Says which object it is about.
    pub fn at_object(self, object: Mux) -> Self {
        Self { reason: self.reason.at_object(object), ..self }
    }

    /// Adds a reason.
    pub fn because(self, reason: impl fmt::Display) -> Self {
        Self { reason: self.reason.because(reason), ..self }
    }

    /// Adds advice.
    pub fn next(self, advice: impl fmt::Display) -> Self {
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
pub struct FailureReport {
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
            // Where one can be enabled that is not known it has to be stopped, too.
            Error::UnknownModel { node, intent: "stop it" } => {
                Some(format!("ferrodrive quick-stop {node} or estop, which need no model"))
            }
            Error::UnknownModel { node, .. } => Some(name_its_model(*node, &["MODEL", "FILE.eds"])),
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

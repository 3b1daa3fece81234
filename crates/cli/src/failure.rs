//! Why a command did not do what was asked: what failed, what the drive said, what to do next.

use std::fmt;

use crate::context::how_to_say;
use crate::signals::Signal;

/// How a command ended; the process ends with the same number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// The operation failed.
    Failed = 1,
    /// The command line makes no sense.
    Usage = 2,
    /// The terminal was closed. Signals as shells number them: 128 + SIGHUP.
    HungUp = 129,
    /// Ctrl-C: 128 + SIGINT.
    Interrupted = 130,
    /// Ctrl-\: 128 + SIGQUIT.
    Quit = 131,
    /// Asked to end: 128 + SIGTERM.
    Terminated = 143,
}

impl Status {
    /// True if a signal ended the command.
    pub(crate) const fn is_signal(self) -> bool {
        self as u8 > 128
    }
}

/// A reason for people, in up to three parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    /// Decides the exit status.
    pub(crate) status: Status,
    /// What could not be done, with node and object.
    pub(crate) what: String,
    /// Why: what the drive or the system said, one line each.
    pub(crate) because: Vec<String>,
    /// What to do next, one line each.
    pub(crate) next: Vec<String>,
}

impl Failure {
    /// The operation failed.
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self { status: Status::Failed, what: what.into(), because: Vec::new(), next: Vec::new() }
    }

    /// The command line makes no sense, as found out only now.
    pub(crate) fn usage(what: impl Into<String>) -> Self {
        Self { status: Status::Usage, ..Self::new(what) }
    }

    /// A signal asked the command to end.
    pub(crate) fn ended_by(signal: Signal) -> Self {
        Self { status: signal.status(), ..Self::new(signal.text()) }
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

impl From<master::Error> for Failure {
    /// The master's errors say what, why and what to do in whole sentences, but for how a model is named on this command
    /// line. What is beyond a limit was mistyped.
    fn from(error: master::Error) -> Self {
        use master::Error;
        let failure = Self::new(error.to_string());
        match error {
            Error::OutOfLimits { .. } => Self { status: Status::Usage, ..failure },
            Error::GuessedModel { node, guess, .. } => {
                let fitting: Vec<_> = guess.fitting().map(|model| model.model).collect();
                failure.next(format!("say which it is: {}", how_to_say(node, &fitting)))
            }
            Error::WrongModel { node, .. } | Error::OtherModel { node, .. } => failure.next(format!(
                "leave --model {node}=.. away and see what `ferrodrive scan` says of it, or correct the machine file"
            )),
            Error::UnknownModel { node, .. } => {
                failure.next(format!("say which it is: {}", how_to_say(node, &["MODEL"])))
            }
            _ => failure,
        }
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
        assert_eq!(Failure::usage("x").status as u8, 2);
    }
}

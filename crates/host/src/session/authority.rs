//! Sessions, which of them has control, and how control changes hands.
//!
//! A session is one open page. Any number may look; at most one has control: it takes control while it is free, or
//! gets it handed over. Control cannot be taken away; a stop is open to all, and a session that ends releases control.

use std::collections::BTreeMap;

use serde::Serialize;

/// A session, numbered from 1 in the order of connection. Numbers are not reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub struct SessionId(pub u64);

/// Why a request of a session is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Another session has control.
    #[error("session {} has control: ask for it", .0.0)]
    ControlledBy(SessionId),
    /// No session has control.
    #[error("no session has control: take control first")]
    NotTaken,
    /// It has no control to hand over.
    #[error("this session does not have control")]
    NothingToGive,
    /// There is no such session.
    #[error("there is no session {}", .0.0)]
    NoSuchSession(SessionId),
    /// A message was repeated, or came out of order.
    #[error("sequence number {got} is not above {last}: repeated or out of order")]
    Replayed {
        /// The number of the message.
        got: u64,
        /// The highest one before.
        last: u64,
    },
}

impl Refusal {
    /// As a stable word for programs.
    pub const fn kind(self) -> &'static str {
        match self {
            Self::ControlledBy(_) | Self::NotTaken | Self::NothingToGive => "not_in_control",
            Self::NoSuchSession(_) => "no_such_session",
            Self::Replayed { .. } => "replayed",
        }
    }
}

/// The sessions, which of them has control, and who asked for it.
#[derive(Debug, Default)]
pub struct Authority {
    /// The highest sequence number of each session.
    sessions: BTreeMap<SessionId, u64>,
    newest: u64,
    controller: Option<SessionId>,
    /// The session that asked for control last.
    asking: Option<SessionId>,
}

impl Authority {
    /// Adds a session.
    pub fn join(&mut self) -> SessionId {
        self.newest += 1;
        let session = SessionId(self.newest);
        self.sessions.insert(session, 0);
        session
    }

    /// Removes a session; true if it had control.
    pub fn leave(&mut self, session: SessionId) -> bool {
        self.sessions.remove(&session);
        if self.asking == Some(session) {
            self.asking = None;
        }
        self.release(session)
    }

    /// Records the number of a message, which has to be above all before.
    pub fn accept(&mut self, session: SessionId, got: u64) -> Result<(), Refusal> {
        let last = self.sessions.get_mut(&session).ok_or(Refusal::NoSuchSession(session))?;
        if got <= *last {
            return Err(Refusal::Replayed { got, last: *last });
        }
        *last = got;
        Ok(())
    }

    /// Takes control if no session has it.
    pub fn take(&mut self, session: SessionId) -> Result<(), Refusal> {
        match self.controller {
            Some(other) if other != session => Err(Refusal::ControlledBy(other)),
            _ => {
                self.give(session);
                Ok(())
            }
        }
    }

    /// Asks for control; all sessions are shown who has it and who asked last.
    pub fn ask(&mut self, session: SessionId) -> Result<(), Refusal> {
        match self.controller {
            None => Err(Refusal::NotTaken),
            Some(controller) if controller == session => Ok(()),
            Some(_) => {
                self.asking = Some(session);
                Ok(())
            }
        }
    }

    /// Hands control to another session.
    pub fn hand_over(&mut self, from: SessionId, to: SessionId) -> Result<(), Refusal> {
        if self.controller != Some(from) {
            return Err(Refusal::NothingToGive);
        }
        if !self.sessions.contains_key(&to) {
            return Err(Refusal::NoSuchSession(to));
        }
        self.give(to);
        Ok(())
    }

    /// Releases control; true if the session had it.
    pub fn release(&mut self, session: SessionId) -> bool {
        let had = self.controller == Some(session);
        if had {
            self.controller = None;
        }
        had
    }

    /// Whether a session may move drives.
    pub fn may_move(&self, session: SessionId) -> Result<(), Refusal> {
        match self.controller {
            Some(controller) if controller == session => Ok(()),
            Some(other) => Err(Refusal::ControlledBy(other)),
            None => Err(Refusal::NotTaken),
        }
    }

    /// The session that has control.
    pub const fn controller(&self) -> Option<SessionId> {
        self.controller
    }

    /// The session that asked for control last.
    pub const fn asking(&self) -> Option<SessionId> {
        self.asking
    }

    /// The number of sessions.
    pub fn sessions(&self) -> usize {
        self.sessions.len()
    }

    fn give(&mut self, session: SessionId) {
        self.controller = Some(session);
        if self.asking == Some(session) {
            self.asking = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_has_control_until_it_hands_it_over_or_goes() {
        let mut authority = Authority::default();
        let [first, second] = [authority.join(), authority.join()];
        assert_eq!(authority.may_move(first), Err(Refusal::NotTaken));
        authority.take(first).expect("it is free");
        assert_eq!(authority.take(second), Err(Refusal::ControlledBy(first)));
        assert_eq!(authority.may_move(second), Err(Refusal::ControlledBy(first)));
        assert_eq!(authority.hand_over(second, second), Err(Refusal::NothingToGive));
        authority.ask(second).expect("another session has it");
        assert_eq!((authority.controller(), authority.asking()), (Some(first), Some(second)));
        assert_eq!(authority.hand_over(first, SessionId(9)), Err(Refusal::NoSuchSession(SessionId(9))));
        authority.hand_over(first, second).expect("both are connected");
        assert_eq!((authority.controller(), authority.asking()), (Some(second), None));
        assert!(!authority.leave(first) && authority.leave(second));
        assert_eq!((authority.controller(), authority.sessions()), (None, 0));
    }

    #[test]
    fn a_number_counts_once_and_only_upwards() {
        let mut authority = Authority::default();
        let session = authority.join();
        assert_eq!(authority.accept(session, 1), Ok(()));
        assert_eq!(authority.accept(session, 1), Err(Refusal::Replayed { got: 1, last: 1 }));
        assert_eq!(authority.accept(session, 7), Ok(()));
        assert_eq!(authority.accept(session, 3), Err(Refusal::Replayed { got: 3, last: 7 }));
        let other = authority.join();
        assert_eq!(authority.accept(other, 3), Ok(()), "each session counts for itself");
        authority.leave(other);
        assert_eq!(authority.accept(other, 4), Err(Refusal::NoSuchSession(other)));
    }
}

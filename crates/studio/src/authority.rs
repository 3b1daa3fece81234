//! Who looks, who moves, and how that goes over from one to the other.
//!
//! A session is one open page. Any number may look; at most one has control, and gets it by taking what nobody has or by
//! being handed it. Nobody can take it away: a stop is open to all, and a session that goes gives it up.

use std::collections::BTreeMap;

use serde::Serialize;

/// A session, numbered from 1 in the order of coming. Numbers are not used again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(transparent)]
pub(crate) struct SessionId(pub(crate) u64);

/// Why a session may not do what it asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refusal {
    /// Another one has control.
    #[error("session {} has control: ask it to hand control over", .0.0)]
    ControlledBy(SessionId),
    /// Nobody has.
    #[error("nobody has control: take it first")]
    NotTaken,
    /// It has none to hand over.
    #[error("this session has no control to hand over")]
    NothingToGive,
    /// There is no such session.
    #[error("there is no session {}", .0.0)]
    NoSuchSession(SessionId),
    /// A message came a second time, or out of order.
    #[error("sequence number {got} is not above {last}: it was sent before, or is a copy")]
    Replayed {
        /// The number that came.
        got: u64,
        /// The highest before.
        last: u64,
    },
}

impl Refusal {
    /// In a word that programs may rely on.
    pub(crate) const fn kind(self) -> &'static str {
        match self {
            Self::ControlledBy(_) | Self::NotTaken | Self::NothingToGive => "not_in_control",
            Self::NoSuchSession(_) => "no_such_session",
            Self::Replayed { .. } => "replayed",
        }
    }
}

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Authority {
    /// The highest sequence number of each session.
    sessions: BTreeMap<SessionId, u64>,
    newest: u64,
    controller: Option<SessionId>,
    /// Who would like to have control.
    asking: Option<SessionId>,
}

impl Authority {
    /// A further session.
    pub(crate) fn join(&mut self) -> SessionId {
        self.newest += 1;
        let session = SessionId(self.newest);
        self.sessions.insert(session, 0);
        session
    }

    /// A session has gone; true if it had control.
    pub(crate) fn leave(&mut self, session: SessionId) -> bool {
        self.sessions.remove(&session);
        if self.asking == Some(session) {
            self.asking = None;
        }
        self.release(session)
    }

    /// Takes note of a message's number, which has to be above all before.
    pub(crate) fn accept(&mut self, session: SessionId, got: u64) -> Result<(), Refusal> {
        let last = self.sessions.get_mut(&session).ok_or(Refusal::NoSuchSession(session))?;
        if got <= *last {
            return Err(Refusal::Replayed { got, last: *last });
        }
        *last = got;
        Ok(())
    }

    /// Takes control where nobody has it.
    pub(crate) fn take(&mut self, session: SessionId) -> Result<(), Refusal> {
        match self.controller {
            Some(other) if other != session => Err(Refusal::ControlledBy(other)),
            _ => {
                self.give(session);
                Ok(())
            }
        }
    }

    /// Asks the one who has control for it; who has it, and who asked last, is shown to all.
    pub(crate) fn ask(&mut self, session: SessionId) -> Result<(), Refusal> {
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
    pub(crate) fn hand_over(&mut self, from: SessionId, to: SessionId) -> Result<(), Refusal> {
        if self.controller != Some(from) {
            return Err(Refusal::NothingToGive);
        }
        if !self.sessions.contains_key(&to) {
            return Err(Refusal::NoSuchSession(to));
        }
        self.give(to);
        Ok(())
    }

    /// Gives control up; true if the session had it.
    pub(crate) fn release(&mut self, session: SessionId) -> bool {
        let had = self.controller == Some(session);
        if had {
            self.controller = None;
        }
        had
    }

    /// Whether a session may move drives.
    pub(crate) fn may_move(&self, session: SessionId) -> Result<(), Refusal> {
        match self.controller {
            Some(controller) if controller == session => Ok(()),
            Some(other) => Err(Refusal::ControlledBy(other)),
            None => Err(Refusal::NotTaken),
        }
    }

    /// Who has control.
    pub(crate) const fn controller(&self) -> Option<SessionId> {
        self.controller
    }

    /// Who would like to have it.
    pub(crate) const fn asking(&self) -> Option<SessionId> {
        self.asking
    }

    /// How many sessions there are.
    pub(crate) fn sessions(&self) -> usize {
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
        authority.take(first).expect("nobody has it");
        assert_eq!(authority.take(second), Err(Refusal::ControlledBy(first)));
        assert_eq!(authority.may_move(second), Err(Refusal::ControlledBy(first)));
        assert_eq!(authority.hand_over(second, second), Err(Refusal::NothingToGive));
        authority.ask(second).expect("somebody has it");
        assert_eq!((authority.controller(), authority.asking()), (Some(first), Some(second)));
        assert_eq!(authority.hand_over(first, SessionId(9)), Err(Refusal::NoSuchSession(SessionId(9))));
        authority.hand_over(first, second).expect("both are there");
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

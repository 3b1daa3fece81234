//! The status flags of an slcan adapter (`F`) as notes.
//!
//! Source: LAWICEL's CANUSB manual, command `F`. There is no flag for bus-off: an adapter that is off the bus is error-passive
//! before, and answers frames with BEL then.

use crate::note::{ControllerState, ErrorFrame, ErrorKind, ErrorKinds, Note};

const RECEIVE_QUEUE_FULL: u8 = 0x01;
const SEND_QUEUE_FULL: u8 = 0x02;
const ERROR_WARNING: u8 = 0x04;
const DATA_OVERRUN: u8 = 0x08;
const ERROR_PASSIVE: u8 = 0x20;
const ARBITRATION_LOST: u8 = 0x40;
pub(super) const BUS_ERROR: u8 = 0x80;

/// The state of the controller by its flags.
pub(super) const fn state(flags: u8) -> ControllerState {
    if flags & ERROR_PASSIVE != 0 {
        ControllerState::ErrorPassive
    } else if flags & ERROR_WARNING != 0 {
        ControllerState::ErrorWarning
    } else {
        ControllerState::ErrorActive
    }
}

/// What flags show beside the state: they stand for what has been since they were last asked for, and are cleared by that.
pub(super) fn happened(flags: u8) -> impl Iterator<Item = Note> {
    let has = move |bits: u8| flags & bits != 0;
    let lost = has(ARBITRATION_LOST).then_some(ErrorKind::LostArbitration);
    let error = ErrorFrame { kinds: lost.into_iter().collect::<ErrorKinds>(), ..ErrorFrame::default() };
    [
        has(RECEIVE_QUEUE_FULL | DATA_OVERRUN).then_some(Note::Overrun { lost: None }),
        has(SEND_QUEUE_FULL).then_some(Note::SendQueueFull),
        has(ARBITRATION_LOST | BUS_ERROR).then_some(Note::ErrorFrame(error)),
    ]
    .into_iter()
    .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits by the manual's table, counted from 0.
    #[test]
    fn flags_have_the_places_of_the_manual() {
        let said = |bit: u8| {
            let flags = 1 << bit;
            (state(flags), happened(flags).map(|note| note.kind()).collect::<Vec<_>>())
        };
        use ControllerState::{ErrorActive, ErrorPassive, ErrorWarning};
        assert_eq!(said(0), (ErrorActive, vec!["overrun"]));
        assert_eq!(said(1), (ErrorActive, vec!["send_queue_full"]));
        assert_eq!(said(2), (ErrorWarning, vec![]));
        assert_eq!(said(3), (ErrorActive, vec!["overrun"]));
        assert_eq!(said(4), (ErrorActive, vec![]));
        assert_eq!(said(5), (ErrorPassive, vec![]));
        assert_eq!(said(6), (ErrorActive, vec!["error_frame"]));
        assert_eq!(said(7), (ErrorActive, vec!["error_frame"]));
        assert_eq!(state(0x24), ErrorPassive);
    }
}

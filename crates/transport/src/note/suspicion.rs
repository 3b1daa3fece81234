//! What the errors of a bus mean together: a bit rate that is wrong, or no node that acknowledges.

use super::{ControllerState, ErrorFrame, ErrorKind, Note, Received};

/// Errors in a row without a frame between that make a bit rate suspicious. A disturbance seldom hits so many frames one
/// after the other, and a wrong bit rate hits each.
const GARBLED: u32 = 10;

/// Frames in a row without an acknowledgement before that is reported: a node may be about to boot.
const UNACKNOWLEDGED: u32 = 3;

/// Counts errors between frames. One for each bus.
#[derive(Clone, Debug, Default)]
pub(crate) struct Suspicions {
    garbled: u32,
    unacknowledged: u32,
}

impl Suspicions {
    /// What is to be suspected behind `received`; each time once, until a frame is heard.
    pub(crate) fn after(&mut self, received: &Received) -> Option<Note> {
        match received {
            Received::Frame(_) => {
                *self = Self::default();
                None
            }
            Received::Note(Note::ErrorFrame(error)) => self.after_error(*error),
            // A controller that does not report single errors reports that they add up. One that only listens gets no further
            // than error-passive by a wrong bit rate, and one that sends gets there by the lack of an acknowledgement.
            Received::Note(Note::State(ControllerState::ErrorPassive)) if self.garbled == 0 => {
                let is_new = self.unacknowledged < UNACKNOWLEDGED;
                self.unacknowledged = UNACKNOWLEDGED;
                is_new.then_some(Note::NoAcknowledge)
            }
            Received::Note(_) => None,
        }
    }

    fn after_error(&mut self, error: ErrorFrame) -> Option<Note> {
        let has = |kind| error.kinds.contains(kind);
        if has(ErrorKind::Acknowledge) {
            self.unacknowledged = self.unacknowledged.saturating_add(1);
            return (self.unacknowledged == UNACKNOWLEDGED).then_some(Note::NoAcknowledge);
        }
        if [ErrorKind::Bit, ErrorKind::Stuff, ErrorKind::Form, ErrorKind::Crc].into_iter().any(has) {
            self.garbled = self.garbled.saturating_add(1);
            return (self.garbled == GARBLED).then_some(Note::WrongBitRate);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(kind: ErrorKind) -> Received {
        Note::ErrorFrame(ErrorFrame { kinds: [kind].into_iter().collect(), ..ErrorFrame::default() }).into()
    }

    fn frame() -> Received {
        Received::Frame("704#05".parse().unwrap())
    }

    /// What is suspected behind each of `received`.
    fn suspected(received: &[Received]) -> Vec<(usize, Note)> {
        let mut suspicions = Suspicions::default();
        let all = received.iter().enumerate();
        all.filter_map(|(place, received)| Some((place + 1, suspicions.after(received)?))).collect()
    }

    #[test]
    fn many_errors_and_no_frame_are_a_wrong_bit_rate_and_reported_once() {
        let stuff = vec![error(ErrorKind::Stuff); 40];
        assert_eq!(suspected(&stuff), [(10, Note::WrongBitRate)]);
        // A disturbed bus with frames on it has the right one.
        let disturbed: Vec<Received> =
            (0..40).map(|n| if n % 9 == 8 { frame() } else { error(ErrorKind::Crc) }).collect();
        assert_eq!(suspected(&disturbed), []);
        // After a frame it may be said again.
        let again = [stuff.clone(), vec![frame()], stuff].concat();
        assert_eq!(suspected(&again), [(10, Note::WrongBitRate), (51, Note::WrongBitRate)]);
    }

    #[test]
    fn frames_that_are_not_acknowledged_are_not_taken_for_a_wrong_bit_rate() {
        let alone = vec![error(ErrorKind::Acknowledge); 40];
        assert_eq!(suspected(&alone), [(3, Note::NoAcknowledge)]);
        let passive = Received::Note(Note::State(ControllerState::ErrorPassive));
        assert_eq!(suspected(&[passive.clone(), passive.clone()]), [(1, Note::NoAcknowledge)]);
        assert_eq!(suspected(&[error(ErrorKind::Form), passive]), []);
        assert_eq!(suspected(&vec![error(ErrorKind::LostArbitration); 40]), []);
    }
}

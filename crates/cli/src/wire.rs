//! What a bus says beside frames, kept for display.

use host::Wire;
use transport::{ControllerState, Note};

/// Takes a note of the bus down.
pub(crate) fn put_down(wire: &Wire, note: &Note) {
    wire.update(|health| match note {
        Note::State(state) => health.state = Some(word(*state)),
        Note::Restarted => health.state = Some(word(ControllerState::ErrorActive)),
        Note::ErrorFrame(frame) => {
            health.error_frames += 1;
            if let Some(counters) = frame.counters {
                health.transmit_errors = Some(counters.transmit.into());
                health.receive_errors = Some(counters.receive.into());
            }
        }
        Note::Overrun { lost } => health.frames_lost += u64::from(lost.unwrap_or(1)),
        Note::DatagramsLost { count } => health.frames_lost += u64::from(*count),
        Note::SendQueueFull => health.frames_lost += 1,
        Note::ConnectionLost { .. } => health.state = Some("connection lost"),
        // The controller has not reported its state yet.
        Note::ConnectionBack => health.state = None,
        Note::WrongBitRate | Note::NoAcknowledge | Note::FdFrame { .. } | Note::TornRecord(_) => {}
    });
}

const fn word(state: ControllerState) -> &'static str {
    match state {
        ControllerState::ErrorActive => "error-active",
        ControllerState::ErrorWarning => "error-warning",
        ControllerState::ErrorPassive => "error-passive",
        ControllerState::BusOff => "bus-off",
    }
}

#[cfg(test)]
mod tests {
    use host::Health;
    use transport::{ErrorCounters, ErrorFrame};

    use super::*;

    #[test]
    fn what_a_controller_reports_is_kept_until_it_reports_something_else() {
        let wire = Wire::default();
        let counters = Some(ErrorCounters { transmit: 136, receive: 2 });
        let error = ErrorFrame { counters, ..ErrorFrame::default() };
        for note in [
            Note::State(ControllerState::ErrorPassive),
            Note::ErrorFrame(error),
            Note::ErrorFrame(ErrorFrame::default()),
            Note::Overrun { lost: Some(3) },
            Note::Overrun { lost: None },
            Note::DatagramsLost { count: 2 },
            Note::SendQueueFull,
            Note::WrongBitRate,
        ] {
            put_down(&wire, &note);
        }
        let expected = Health {
            state: Some("error-passive"),
            transmit_errors: Some(136),
            receive_errors: Some(2),
            error_frames: 2,
            frames_lost: 7,
        };
        wire.update(|health| assert_eq!(*health, expected));
        for (note, state) in [
            (Note::State(ControllerState::BusOff), Some("bus-off")),
            (Note::Restarted, Some("error-active")),
            (Note::ConnectionLost { reason: "gone".into() }, Some("connection lost")),
            (Note::ConnectionBack, None),
        ] {
            put_down(&wire, &note);
            wire.update(|health| assert_eq!(health.state, state));
        }
    }
}

//! What a live bus says beside frames: the state of the controller, errors on the wire, a connection that went away.
//!
//! A [`Note`] is never an error of [`crate::AsyncBus`]: the bus goes on, or comes back. The caller that runs a bus hands notes to
//! its listener ([`crate::run_station`]). Terms are those of ISO 11898-1.

mod bus_notes;
mod error_frame;
mod suspicion;

use std::fmt;

use can::{CanId, Frame};
use canlog::Finding;

pub use bus_notes::BusNotes;
pub use error_frame::{ErrorCounters, ErrorFrame, ErrorKind, ErrorKinds};
pub(crate) use suspicion::Suspicions;

/// What comes from a bus: mostly frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Received {
    /// A frame of another participant.
    Frame(Frame),
    /// Something about the bus itself.
    Note(Note),
}

impl Received {
    /// The frame, if it is one.
    pub fn frame(self) -> Option<Frame> {
        match self {
            Self::Frame(frame) => Some(frame),
            Self::Note(_) => None,
        }
    }
}

impl From<Frame> for Received {
    fn from(frame: Frame) -> Self {
        Self::Frame(frame)
    }
}

impl From<Note> for Received {
    fn from(note: Note) -> Self {
        Self::Note(note)
    }
}

/// Something that a live bus says beside frames. Prints as one line for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Note {
    /// The controller's fault confinement came to this state (ISO 11898-1, fault confinement).
    State(ControllerState),
    /// The controller was bus-off and takes part again.
    Restarted,
    /// An error frame was on the wire, or the controller's error counters changed.
    ErrorFrame(ErrorFrame),
    /// Many bit, stuff, form or CRC errors and no frame: behind them, once.
    WrongBitRate,
    /// Several frames of ours were not acknowledged and no frame was heard: behind them, once.
    NoAcknowledge,
    /// A CAN FD frame was on the bus. CANopen (CiA 301) has none, so that it is passed over.
    FdFrame {
        /// Its identifier.
        id: CanId,
        /// Bytes of data, 0 to 64.
        length: u8,
    },
    /// Frames of others were lost, because they were not read fast enough.
    Overrun {
        /// Their number, where it is known.
        lost: Option<u32>,
    },
    /// Datagrams of a peer did not arrive: UDP says nothing of those, but they are numbered.
    DatagramsLost {
        /// Their number.
        count: u8,
    },
    /// Frames of ours were lost: the queue of the controller or the adapter was full, or it refused them.
    SendQueueFull,
    /// The connection to the bus is lost, and is being made again. Until [`Note::ConnectionBack`] what is sent is lost.
    ConnectionLost {
        /// What happened, in words.
        reason: String,
    },
    /// The connection is there again.
    ConnectionBack,
    /// A part of a log that is not a frame, and was passed over.
    TornRecord(Finding),
}

impl Note {
    /// A word for programs, which stays as it is: `bus_off`, `error_frame`.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::State(ControllerState::ErrorActive) => "error_active",
            Self::State(ControllerState::ErrorWarning) => "error_warning",
            Self::State(ControllerState::ErrorPassive) => "error_passive",
            Self::State(ControllerState::BusOff) => "bus_off",
            Self::Restarted => "restarted",
            Self::ErrorFrame(_) => "error_frame",
            Self::WrongBitRate => "wrong_bit_rate",
            Self::NoAcknowledge => "no_acknowledge",
            Self::FdFrame { .. } => "fd_frame",
            Self::Overrun { .. } => "overrun",
            Self::DatagramsLost { .. } => "datagrams_lost",
            Self::SendQueueFull => "send_queue_full",
            Self::ConnectionLost { .. } => "connection_lost",
            Self::ConnectionBack => "connection_back",
            Self::TornRecord(_) => "torn_record",
        }
    }

    /// What a person at the bus does about it; `None` where nothing is to be done, or the note itself says what.
    pub const fn advice(&self) -> Option<&'static str> {
        match self {
            Self::WrongBitRate => {
                Some("is the bit rate right? `ip -details link show can0` shows that of an interface")
            }
            Self::NoAcknowledge => {
                Some("is another node on, is the bus terminated at both ends, do all nodes have the same bit rate?")
            }
            Self::State(ControllerState::BusOff) => Some(
                "check bit rate, termination and wiring; then `ip link set can0 type can restart`, or `restart-ms 100` for \
                 good",
            ),
            Self::FdFrame { .. } => Some("a controller of classical CAN would destroy it: keep FD nodes off this bus"),
            Self::Overrun { .. } => Some("this machine is too busy, or the program was stopped for a while"),
            Self::SendQueueFull => Some(
                "no node takes the frames (bus-off, no other node), or there are too many: `ip link set can0 txqueuelen 1000`",
            ),
            _ => None,
        }
    }

    /// Whether a station's controller takes part in the bus behind this note: for [`can::Station::handle_bus_off`].
    /// `None`: as before.
    pub const fn takes_part(&self) -> Option<bool> {
        match self {
            Self::State(ControllerState::BusOff) => Some(false),
            Self::State(_) | Self::Restarted => Some(true),
            _ => None,
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State(state) => write!(f, "the controller is {state}"),
            Self::Restarted => f.write_str("the controller was bus-off and takes part again"),
            Self::ErrorFrame(error) => write!(f, "error frame: {error}"),
            Self::WrongBitRate => f.write_str("many errors on the wire and no frame"),
            Self::NoAcknowledge => f.write_str("what is sent is not acknowledged, and no frame is heard"),
            Self::FdFrame { id, length } => {
                write!(f, "CAN FD frame {id} with {length} bytes passed over: CANopen has classical frames only")
            }
            Self::Overrun { lost: Some(1) } => f.write_str("1 received frame was lost: it was not read fast enough"),
            Self::Overrun { lost: Some(lost) } => {
                write!(f, "{lost} received frames were lost: they were not read fast enough")
            }
            Self::Overrun { lost: None } => f.write_str("received frames were lost: they were not read fast enough"),
            Self::DatagramsLost { count: 1 } => {
                f.write_str("1 datagram of the peer did not arrive, nor the frames in it")
            }
            Self::DatagramsLost { count } => {
                write!(f, "{count} datagrams of the peer did not arrive, nor the frames in them")
            }
            Self::SendQueueFull => f.write_str("a frame could not be sent and is lost: the send queue is full"),
            Self::ConnectionLost { reason } => write!(f, "the connection to the bus is lost: {reason}"),
            Self::ConnectionBack => f.write_str("the connection to the bus is back"),
            Self::TornRecord(torn) => write!(f, "{torn}"),
        }
    }
}

/// Fault confinement of a CAN controller (ISO 11898-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ControllerState {
    /// Both error counters are below the warning limit.
    ErrorActive,
    /// An error counter has reached 96.
    ErrorWarning,
    /// An error counter has passed 127: the controller's error flags are recessive.
    ErrorPassive,
    /// The transmit error counter has passed 255: the controller neither sends nor hears.
    BusOff,
}

impl fmt::Display for ControllerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ErrorActive => "error-active",
            Self::ErrorWarning => "at its error warning limit",
            Self::ErrorPassive => "error-passive",
            Self::BusOff => "bus-off",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_takes_part_unless_it_is_bus_off() {
        for (note, takes_part) in [
            (Note::State(ControllerState::BusOff), Some(false)),
            (Note::Restarted, Some(true)),
            // Some drivers do not report a restart, only of the state that comes after.
            (Note::State(ControllerState::ErrorActive), Some(true)),
            (Note::State(ControllerState::ErrorPassive), Some(true)),
            (Note::Overrun { lost: None }, None),
            (Note::ConnectionBack, None),
        ] {
            assert_eq!(note.takes_part(), takes_part, "{note}");
        }
    }
}

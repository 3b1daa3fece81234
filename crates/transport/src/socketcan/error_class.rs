//! Error messages of Linux CAN, as notes: the class in the identifier and the eight bytes behind it.
//!
//! Source: the kernel's `include/uapi/linux/can/error.h`. A driver fills in what its controller reports; one message may say
//! several things, and a server of socketcand passes on the class alone.

use canlog::RawErrorFrame;

use crate::note::{ControllerState, ErrorCounters, ErrorFrame, ErrorKind, ErrorKinds, Note};

/// Bits of the class, which stands in the identifier (`CAN_ERR_*`).
mod class {
    pub(super) const TX_TIMEOUT: u32 = 0x001;
    pub(super) const LOST_ARBITRATION: u32 = 0x002;
    pub(super) const CONTROLLER: u32 = 0x004;
    pub(super) const PROTOCOL: u32 = 0x008;
    pub(super) const TRANSCEIVER: u32 = 0x010;
    pub(super) const NO_ACKNOWLEDGE: u32 = 0x020;
    pub(super) const BUS_OFF: u32 = 0x040;
    pub(super) const BUS_ERROR: u32 = 0x080;
    pub(super) const RESTARTED: u32 = 0x100;
    pub(super) const COUNTERS: u32 = 0x200;
    /// Classes of an error frame on the wire, or of a lost arbitration.
    pub(super) const ON_THE_WIRE: u32 = LOST_ARBITRATION | PROTOCOL | TRANSCEIVER | NO_ACKNOWLEDGE | BUS_ERROR;
}

/// Bits of byte 1: the controller (`CAN_ERR_CRTL_*`).
mod controller {
    pub(super) const RX_OVERFLOW: u8 = 0x01;
    pub(super) const TX_OVERFLOW: u8 = 0x02;
    pub(super) const WARNING: u8 = 0x04 | 0x08;
    pub(super) const PASSIVE: u8 = 0x10 | 0x20;
    pub(super) const ACTIVE: u8 = 0x40;
}

/// Bits of byte 2: the protocol (`CAN_ERR_PROT_*`).
mod protocol {
    pub(super) const BIT: u8 = 0x01 | 0x08 | 0x10;
    pub(super) const FORM: u8 = 0x02;
    pub(super) const STUFF: u8 = 0x04;
    pub(super) const OVERLOAD: u8 = 0x20;
    pub(super) const TX: u8 = 0x80;
}

/// Values of byte 3: where in the frame (`CAN_ERR_PROT_LOC_*`). What controllers have no kind for is named by its place.
mod location {
    pub(super) const CRC_SEQUENCE: u8 = 0x08;
    pub(super) const CRC_DELIMITER: u8 = 0x18;
    pub(super) const ACK_SLOT: u8 = 0x19;
    pub(super) const ACK_DELIMITER: u8 = 0x1B;
}

impl Note {
    /// What an error frame of a log says: at least one note.
    pub fn of_error(error: RawErrorFrame) -> impl Iterator<Item = Self> {
        notes_of(error.class, error.data)
    }
}

/// What an error message says: `class` is its identifier without the flags, `data` the bytes behind it (zero where unknown).
/// At least one note.
pub(crate) fn notes_of(class: u32, data: [u8; 8]) -> impl Iterator<Item = Note> {
    let state = if class & class::CONTROLLER == 0 { 0 } else { data[1] };
    let has = |bits: u8| state & bits != 0;
    let overrun = has(controller::RX_OVERFLOW).then_some(Note::Overrun { lost: None });
    let overflow = has(controller::TX_OVERFLOW) || class & class::TX_TIMEOUT != 0;
    let overflow = overflow.then_some(Note::SendQueueFull);
    let restarted = (class & class::RESTARTED != 0).then_some(Note::Restarted);
    let state = if class & class::BUS_OFF != 0 {
        Some(ControllerState::BusOff)
    } else if has(controller::PASSIVE) {
        Some(ControllerState::ErrorPassive)
    } else if has(controller::WARNING) {
        Some(ControllerState::ErrorWarning)
    } else if has(controller::ACTIVE) {
        Some(ControllerState::ErrorActive)
    } else {
        None
    };
    let silent = overrun.is_none() && overflow.is_none() && restarted.is_none() && state.is_none();
    let on_the_wire = class & class::ON_THE_WIRE != 0 || silent;
    let error = on_the_wire.then(|| Note::ErrorFrame(error_frame(class, data)));
    [error, overrun, overflow, restarted, state.map(Note::State)].into_iter().flatten()
}

/// The class of an error frame, as [`notes_of`] reads it: on the wire a bus error in any case.
pub(crate) fn class_of(error: &ErrorFrame) -> u32 {
    let of_kind = |kind| match kind {
        ErrorKind::Acknowledge => class::NO_ACKNOWLEDGE | class::BUS_ERROR,
        ErrorKind::LostArbitration => class::LOST_ARBITRATION,
        ErrorKind::Transceiver => class::TRANSCEIVER,
        ErrorKind::Bit | ErrorKind::Stuff | ErrorKind::Form | ErrorKind::Crc | ErrorKind::Overload => {
            class::PROTOCOL | class::BUS_ERROR
        }
    };
    let class = error.kinds.iter().map(of_kind).fold(0, |all, one| all | one);
    if class == 0 { class::BUS_ERROR } else { class }
}

fn error_frame(class: u32, data: [u8; 8]) -> ErrorFrame {
    let of_class = |bit: u32| class & bit != 0;
    let (kind, place) = if of_class(class::PROTOCOL) { (data[2], data[3]) } else { (0, 0) };
    let has = |bits: u8| kind & bits != 0;
    let by_kind = has(protocol::BIT | protocol::FORM | protocol::STUFF | protocol::OVERLOAD);
    let at = |places: [u8; 2]| !by_kind && places.contains(&place);
    let acknowledge = of_class(class::NO_ACKNOWLEDGE) || at([location::ACK_SLOT, location::ACK_DELIMITER]);
    let kinds = [
        (ErrorKind::Acknowledge, acknowledge),
        (ErrorKind::Bit, has(protocol::BIT)),
        (ErrorKind::Stuff, has(protocol::STUFF)),
        (ErrorKind::Form, has(protocol::FORM)),
        (ErrorKind::Crc, at([location::CRC_SEQUENCE, location::CRC_DELIMITER])),
        (ErrorKind::LostArbitration, of_class(class::LOST_ARBITRATION)),
        (ErrorKind::Overload, has(protocol::OVERLOAD)),
        (ErrorKind::Transceiver, of_class(class::TRANSCEIVER)),
    ];
    let kinds: ErrorKinds = kinds.into_iter().filter(|(_, there)| *there).map(|(kind, _)| kind).collect();
    // Only who sends misses an acknowledgement. A driver that leaves the bit away may not know.
    let transmitting = (has(protocol::TX) || acknowledge).then_some(true);
    let counters = of_class(class::COUNTERS).then_some(ErrorCounters { transmit: data[6], receive: data[7] });
    ErrorFrame { kinds, transmitting, counters }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(kinds: &[ErrorKind], transmitting: bool, counters: Option<(u8, u8)>) -> Note {
        let counters = counters.map(|(transmit, receive)| ErrorCounters { transmit, receive });
        let transmitting = transmitting.then_some(true);
        Note::ErrorFrame(ErrorFrame { kinds: kinds.iter().copied().collect(), transmitting, counters })
    }

    /// Class, bytes, and what the kernel's header says that they mean.
    #[test]
    fn messages_of_drivers_are_read_as_the_header_says() {
        use ControllerState as State;
        use ErrorKind::{Acknowledge, Bit, Crc, Form, LostArbitration, Overload, Stuff, Transceiver};
        let state = Note::State;
        let rows: [(u32, [u8; 8], &[Note]); 17] = [
            (0x020, [0; 8], &[error(&[Acknowledge], true, None)]),
            // sja1000: bus error, "other" at the acknowledge slot while sending.
            (0x088, [0, 0, 0x80, 0x19, 0, 0, 0, 0], &[error(&[Acknowledge], true, None)]),
            (0x088, [0, 0, 0x80, 0x08, 0, 0, 0, 0], &[error(&[Crc], true, None)]),
            // A stuff error inside the checksum is not an error of the checksum.
            (0x088, [0, 0, 0x04, 0x08, 0, 0, 0, 0], &[error(&[Stuff], false, None)]),
            (0x288, [0, 0, 0x02, 0x00, 0, 0, 8, 96], &[error(&[Form], false, Some((8, 96)))]),
            (0x088, [0, 0, 0x90, 0, 0, 0, 0, 0], &[error(&[Bit], true, None)]),
            (0x008, [0, 0, 0x20, 0, 0, 0, 0, 0], &[error(&[Overload], false, None)]),
            (0x002, [5, 0, 0, 0, 0, 0, 0, 0], &[error(&[LostArbitration], false, None)]),
            (0x010, [0, 0, 0, 0, 0x04, 0, 0, 0], &[error(&[Transceiver], false, None)]),
            (0x004, [0, 0x08, 0, 0, 0, 0, 0, 0], &[state(State::ErrorWarning)]),
            (0x204, [0, 0x30, 0, 0, 0, 0, 128, 0], &[state(State::ErrorPassive)]),
            (0x004, [0, 0x40, 0, 0, 0, 0, 0, 0], &[state(State::ErrorActive)]),
            (0x040, [0; 8], &[state(State::BusOff)]),
            (0x104, [0, 0x40, 0, 0, 0, 0, 0, 0], &[Note::Restarted, state(State::ErrorActive)]),
            (0x004, [0, 0x01, 0, 0, 0, 0, 0, 0], &[Note::Overrun { lost: None }]),
            (0x001, [0; 8], &[Note::SendQueueFull]),
            // By socketcand, without its bytes: something was wrong, and that is all.
            (0x004, [0; 8], &[error(&[], false, None)]),
        ];
        for (class, data, expected) in rows {
            assert_eq!(notes_of(class, data).collect::<Vec<_>>(), expected, "{class:03X} {data:02X?}");
        }
    }

    #[test]
    fn every_message_says_something() {
        let mut random = crate::testing::Random::new(10);
        for _ in 0..10_000 {
            let (class, data) = (random.next() as u32 & 0x1FFF_FFFF, random.next().to_le_bytes());
            assert!(notes_of(class, data).next().is_some(), "{class:08X} {data:02X?}");
        }
    }
}

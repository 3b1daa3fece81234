//! python-can's `udp_multicast` datagrams as data: a MessagePack map for each frame, with the attributes of `can.Message` by their
//! names.
//!
//! Source: `pack_message` of `can/interfaces/udp_multicast/utils.py` in python-can 4.6. Pure: bytes in, an item out.

use can::{CanId, Frame, MAX_DATA_LENGTH};
use serde::{Deserialize, Serialize};

/// Longest data of a CAN FD frame.
const MAX_FD_LENGTH: usize = 64;

/// A `can.Message`. What a sender omits is as the constructor of `can.Message` has it.
#[derive(Debug, Deserialize, Serialize)]
struct PythonCanMessage<'a> {
    /// Unix time, in s.
    #[serde(default)]
    timestamp: f64,
    arbitration_id: u32,
    #[serde(default = "yes")]
    is_extended_id: bool,
    #[serde(default)]
    is_remote_frame: bool,
    #[serde(default)]
    is_error_frame: bool,
    /// Always nil here: the name that the sender has for its bus.
    #[serde(default, skip_deserializing)]
    channel: Option<()>,
    #[serde(default)]
    dlc: Option<u32>,
    #[serde(borrow, default, with = "serde_bytes")]
    data: &'a [u8],
    #[serde(default)]
    is_fd: bool,
    #[serde(default)]
    bitrate_switch: bool,
    #[serde(default)]
    error_state_indicator: bool,
}

const fn yes() -> bool {
    true
}

/// What a datagram carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// A frame of classical CAN.
    Frame(Frame),
    /// A CAN FD frame, whose data are not kept.
    FdFrame {
        /// Its identifier.
        id: CanId,
        /// Bytes of data, 0 to 64.
        length: u8,
    },
    /// An error message; what it says depends on the sender's adapter.
    Error,
}

/// Why bytes are not a message of python-can.
#[derive(Debug, thiserror::Error)]
pub enum MalformedDatagram {
    /// No MessagePack, or a map that lacks what a message has.
    #[error("no message of python-can: {0}")]
    Map(#[from] rmp_serde::decode::Error),
    /// A map whose values do not make a frame.
    #[error("identifier {id:X}h with {length} bytes is not a CAN frame")]
    Frame {
        /// `arbitration_id`.
        id: u32,
        /// Length of `data`, or `dlc` of a remote frame.
        length: usize,
    },
}

/// Appends the datagram of `frame`, stamped with `unix_s`.
pub fn emit(frame: &Frame, unix_s: f64, out: &mut Vec<u8>) {
    let message = PythonCanMessage {
        timestamp: unix_s,
        arbitration_id: frame.id().raw(),
        is_extended_id: frame.id().is_extended(),
        is_remote_frame: frame.is_remote(),
        is_error_frame: false,
        channel: None,
        dlc: Some(u32::from(frame.dlc())),
        data: frame.data(),
        is_fd: false,
        bitrate_switch: false,
        error_state_indicator: false,
    };
    // Fails only where the writer does, which a vector never does.
    let written = rmp_serde::encode::write_named(out, &message);
    assert!(written.is_ok(), "{written:?}");
}

/// Reads a datagram.
pub fn parse(bytes: &[u8]) -> Result<Item, MalformedDatagram> {
    let message: PythonCanMessage<'_> = rmp_serde::from_slice(bytes)?;
    if message.is_error_frame {
        return Ok(Item::Error);
    }
    let raw = message.arbitration_id;
    let length = match message.is_remote_frame {
        true => message.dlc.unwrap_or(0) as usize,
        false => message.data.len(),
    };
    let malformed = MalformedDatagram::Frame { id: raw, length };
    let id = match message.is_extended_id {
        true if raw <= CanId::MAX_EXTENDED => CanId::extended(raw),
        false if raw <= u32::from(CanId::MAX_STANDARD) => CanId::standard(raw as u16),
        _ => return Err(malformed),
    };
    let longest = if message.is_fd { MAX_FD_LENGTH } else { MAX_DATA_LENGTH };
    if length > longest {
        return Err(malformed);
    }
    Ok(match (message.is_fd, message.is_remote_frame) {
        (true, _) => Item::FdFrame { id, length: length as u8 },
        (false, true) => Item::Frame(Frame::remote(id, length as u8)),
        (false, false) => Item::Frame(Frame::new(id, message.data)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// `pack_message(can.Message(timestamp=1.5, arbitration_id=0x604, is_extended_id=False, data=[0x40, 0x41]))`, byte by byte
    /// as the MessagePack specification has maps, strings, doubles, integers, booleans, nil and binaries.
    fn of_python_can() -> Vec<u8> {
        let string = |text: &str| [&[0xA0 | text.len() as u8][..], text.as_bytes()].concat();
        [
            vec![0x8B],
            [string("timestamp"), vec![0xCB, 0x3F, 0xF8, 0, 0, 0, 0, 0, 0]].concat(),
            [string("arbitration_id"), vec![0xCD, 0x06, 0x04]].concat(),
            [string("is_extended_id"), vec![0xC2]].concat(),
            [string("is_remote_frame"), vec![0xC2]].concat(),
            [string("is_error_frame"), vec![0xC2]].concat(),
            [string("channel"), vec![0xC0]].concat(),
            [string("dlc"), vec![2]].concat(),
            [string("data"), vec![0xC4, 2, 0x40, 0x41]].concat(),
            [string("is_fd"), vec![0xC2]].concat(),
            [string("bitrate_switch"), vec![0xC2]].concat(),
            [string("error_state_indicator"), vec![0xC2]].concat(),
        ]
        .concat()
    }

    #[test]
    fn a_datagram_is_what_python_can_packs() {
        let frame: Frame = "604#4041".parse().unwrap();
        let mut out = Vec::new();
        emit(&frame, 1.5, &mut out);
        assert_eq!(out, of_python_can());
        assert_eq!(parse(&out).unwrap(), Item::Frame(frame));
    }

    #[test]
    fn a_senders_channel_whole_seconds_and_further_keys_are_no_obstacle() {
        let string = |text: &str| [&[0xA0 | text.len() as u8][..], text.as_bytes()].concat();
        let bytes = [
            vec![0x85],
            [string("timestamp"), vec![3]].concat(),
            [string("channel"), string("vcan0")].concat(),
            [string("is_rx"), vec![0xC3]].concat(),
            [string("arbitration_id"), vec![0x12]].concat(),
            [string("data"), vec![0xC4, 1, 7]].concat(),
        ]
        .concat();
        assert_eq!(parse(&bytes).unwrap(), Item::Frame("00000012#07".parse().unwrap()));
    }

    #[test]
    fn what_is_not_a_frame_of_ours_is_reported() {
        let packed = |change: fn(&mut PythonCanMessage<'_>)| {
            let data = [0; 65];
            let mut message = PythonCanMessage {
                timestamp: 0.0,
                arbitration_id: 0x181,
                is_extended_id: false,
                is_remote_frame: false,
                is_error_frame: false,
                channel: None,
                dlc: Some(9),
                data: &data[..9],
                is_fd: false,
                bitrate_switch: false,
                error_state_indicator: false,
            };
            change(&mut message);
            parse(&rmp_serde::to_vec_named(&message).unwrap())
        };
        let said = |result: Result<Item, MalformedDatagram>| result.unwrap_err().to_string();
        assert_eq!(said(packed(|_| {})), "identifier 181h with 9 bytes is not a CAN frame");
        assert_eq!(said(packed(|m| m.arbitration_id = 0x800)), "identifier 800h with 9 bytes is not a CAN frame");
        assert_eq!(said(packed(|m| m.is_remote_frame = true)), "identifier 181h with 9 bytes is not a CAN frame");
        let fd = packed(|m| m.is_fd = true).unwrap();
        assert_eq!(fd, Item::FdFrame { id: CanId::standard(0x181), length: 9 });
        assert_eq!(packed(|m| m.is_error_frame = true).unwrap(), Item::Error);
        assert!(said(parse(b"")).contains("no message of python-can"));
        assert!(said(parse(b"hello")).contains("no message of python-can"));
    }

    #[test]
    fn reading_gives_back_what_was_emitted_and_damage_never_panics() {
        let mut random = Random::new(0x5EED_0011);
        for _ in 0..2_000 {
            let frame = random.frame();
            let mut out = Vec::new();
            emit(&frame, random.below(1_000_000) as f64, &mut out);
            assert_eq!(parse(&out).unwrap(), Item::Frame(frame));
            let place = random.below(out.len());
            out[place] = random.next() as u8;
            let _ = parse(&out);
            assert!(parse(&out[..place]).is_err());
        }
    }
}

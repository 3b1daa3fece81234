//! What stands on the wire, over random frames: TIME, EMCY, boot-up and heartbeat, answers to guarding, COB-IDs and the identifiers of the
//! predefined connection set, NMT, MPDO, SDO block transfer. The layouts are those of CiA 301, written down once more. SDO, LSS and SYNC
//! have theirs beside their types.

use can::{CanId, Frame, Instant};
use canopen::connection_set::Service;
use canopen::emcy::Emcy;
use canopen::guarding::Guarding;
use canopen::heartbeat::Heartbeat;
use canopen::nmt::{MalformedNmt, NmtRequest};
use canopen::pdo::{AddressMode, Mpdo};
use canopen::sdo::block::wire::{Acknowledgement, End, Reply, Request, Segment};
use canopen::time_stamp::TimeOfDay;
use canopen::{CobId, Mux, NmtState, NodeId};

use super::any_device::device::Numbers;

const ROUNDS: usize = 20_000;

/// Frames of any identifier, kind and length, half of them data frames of the base format with an identifier that `favoured` has.
fn frames(seed: u64, favoured: fn(u16) -> u16) -> impl Iterator<Item = Frame> {
    let mut numbers = Numbers(seed);
    (0..ROUNDS).map(move |_| {
        let length = numbers.below(9);
        let (raw, data) = (numbers.next() as u32, numbers.bytes(length));
        match numbers.below(8) {
            0 => Frame::remote(CanId::standard(raw as u16 & 0x7FF), length as u8),
            1 => Frame::new(CanId::extended(raw & 0x1FFF_FFFF), &data),
            2 | 3 => Frame::new(CanId::standard(raw as u16 & 0x7FF), &data),
            _ => Frame::new(CanId::standard(favoured(raw as u16)), &data),
        }
    })
}

/// CiA 301, 7.1.6.5 and 7.2.6: 28 bits of milliseconds, 4 reserved, 16 of days.
#[test]
fn a_time_of_day_is_48_bits_from_the_lowest_on() {
    let mut read = 0;
    for frame in frames(1, |_| 0x100) {
        let Some(time) = TimeOfDay::parse(&frame) else {
            assert!(frame.data().len() < 6, "{frame}");
            continue;
        };
        let bits = frame.data()[..6].iter().rev().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
        assert_eq!((u64::from(time.millis), u64::from(time.days)), (bits & 0x0FFF_FFFF, bits >> 32), "{frame}");
        assert_eq!(time.emit(frame.id()), Frame::of_bits(frame.id(), bits & !0xF000_0000, 6), "{frame}");
        read += 1;
    }
    assert!(read > ROUNDS / 4, "{read}");
}

/// CiA 301, 7.2.7: code, error register, five bytes of the manufacturer's.
#[test]
fn an_emcy_is_eight_bytes_with_the_code_first() {
    let mut read = 0;
    for frame in frames(2, |raw| 0x081 + raw % 127) {
        let Some(emcy) = Emcy::parse(&frame) else {
            assert_ne!(frame.data().len(), 8, "{frame}");
            continue;
        };
        let data = frame.data();
        assert_eq!(emcy.code.0, u16::from(data[0]) + 256 * u16::from(data[1]), "{frame}");
        assert_eq!((emcy.error_register, &emcy.manufacturer[..]), (data[2], &data[3..]), "{frame}");
        assert_eq!(emcy.emit(frame.id()), frame);
        read += 1;
    }
    assert!(read > ROUNDS / 20, "{read}");
}

/// CiA 301, 7.2.8.3.2.2: 700h + node-ID, the state in the first byte; 00h, 04h, 05h and 7Fh are defined.
#[test]
fn a_heartbeat_is_of_its_identifiers_node_and_has_a_state_of_the_standard_or_none() {
    let mut read = 0;
    for frame in frames(3, |raw| 0x701 + raw % 127) {
        let of_node = frame.id().as_standard().filter(|raw| (0x701..=0x77F).contains(raw)).map(|raw| raw as u8 & 0x7F);
        let expected = of_node.zip(frame.data().first().copied());
        let parsed = Heartbeat::parse(&frame);
        assert_eq!(parsed.map(|it| (it.node.raw(), it.state)), expected, "{frame}");
        let Some(heartbeat) = parsed else { continue };
        assert_eq!(heartbeat.emit(), Frame::new(frame.id(), &frame.data()[..1]));
        let defined = [0x00, 0x04, 0x05, 0x7F].contains(&(heartbeat.state & 0x7F));
        assert_eq!(heartbeat.nmt_state().is_some(), defined, "{frame}");
        if let Some(state) = heartbeat.nmt_state() {
            assert_eq!(state.heartbeat_byte(), heartbeat.state & 0x7F, "{frame}");
        }
        read += 1;
    }
    assert!(read > ROUNDS / 4, "{read}");
}

/// CiA 301, 7.2.8.3.1: the state in bits 0 to 6, and bit 7 alternates, first 0.
#[test]
fn answers_to_guarding_have_the_state_and_a_bit_that_alternates() {
    let mut numbers = Numbers(4);
    let states = [NmtState::Stopped, NmtState::Operational, NmtState::PreOperational];
    for node in (1..=127).filter_map(NodeId::new) {
        let mut guarding = Guarding::new(numbers.next() as u16, numbers.next() as u8);
        for turn in 0..8_u8 {
            let state = states[numbers.below(states.len())];
            let answer = guarding.answer(node, state, Instant::ZERO);
            let byte = (turn % 2) << 7 | state.heartbeat_byte();
            assert_eq!(answer, Frame::new(CanId::standard(0x700 + u16::from(node.raw())), &[byte]));
            let heartbeat = Heartbeat::parse(&answer).expect("it has the form of a heartbeat");
            assert_eq!((heartbeat.node, heartbeat.nmt_state()), (node, Some(state)));
        }
    }
}

/// CiA 301, 7.5.2.35, table 67: bit 31 valid, bit 30 RTR, bit 29 frame format, the identifier below.
#[test]
fn a_cob_id_is_an_identifier_and_three_flags() {
    let mut numbers = Numbers(5);
    for _ in 0..ROUNDS {
        let raw = numbers.next() as u32;
        let cob_id = CobId(raw);
        let (bits, extended) = (if raw >> 29 & 1 == 1 { 29 } else { 11 }, raw >> 29 & 1 == 1);
        assert_eq!((cob_id.is_valid(), cob_id.allows_rtr()), (raw >> 31 == 0, raw >> 30 & 1 == 0), "{raw:08X}");
        assert_eq!((cob_id.is_extended(), cob_id.can_id().is_extended()), (extended, extended), "{raw:08X}");
        assert_eq!(cob_id.can_id().raw(), raw & ((1 << bits) - 1), "{raw:08X}");
    }
}

/// CiA 301, 7.3.3: each identifier has one service of one node at most.
#[test]
fn an_identifier_of_the_predefined_connection_set_names_its_service_and_that_its_identifier() {
    for raw in 0..0x800 {
        let id = CanId::standard(raw);
        if let Some(service) = Service::of(id) {
            assert_eq!(service.can_id(), Some(id), "{raw:03X}h: {service:?}");
        }
        assert_eq!(Service::of(CanId::extended(raw.into())), None, "{raw:03X}h of 29 bits");
    }
}

/// CiA 301, 7.2.8.3.1.1: identifier 0, a command specifier of five, a node-ID of 1 to 127 or 0 for all.
#[test]
fn a_request_of_the_nmt_master_is_a_command_and_a_node_id() {
    let mut read = 0;
    for frame in frames(6, |_| 0) {
        // Half of them have a command that is defined.
        let mut data = frame.data().to_vec();
        if let Some(first) = data.first_mut().filter(|first| **first < 0x80 || frame.is_remote()) {
            *first = [0x01, 0x02, 0x80, 0x81, 0x82][usize::from(*first) % 5];
        }
        let frame = if frame.is_remote() { frame } else { Frame::new(frame.id(), &data) };
        let expected = if frame.id() != CanId::standard(0) || frame.is_remote() {
            Err(MalformedNmt::OtherFrame)
        } else {
            match *data {
                [] | [_] => Err(MalformedNmt::TooShort { dlc: data.len() as u8 }),
                [0x01 | 0x02 | 0x80..=0x82, node @ 0x80..=0xFF, ..] => Err(MalformedNmt::NoSuchNode(node)),
                [0x01 | 0x02 | 0x80..=0x82, ..] => Ok(()),
                [code, ..] => Err(MalformedNmt::UnknownCommand(code)),
            }
        };
        let parsed = NmtRequest::parse(&frame);
        assert_eq!(parsed.map(|_| ()), expected, "{frame}");
        let Ok(request) = parsed else { continue };
        assert_eq!(request.emit(), Frame::new(frame.id(), &data[..2]), "{frame}");
        let meant = (1..=127).filter(|node| request.target.includes(NodeId::new(*node).unwrap())).collect::<Vec<u8>>();
        assert_eq!(meant, if data[1] == 0 { (1..=127).collect() } else { vec![data[1]] }, "{frame}");
        read += 1;
    }
    assert!(read > ROUNDS / 10, "{read}");
}

/// CiA 301, 7.2.2.5: bit 7 says whose object it is, bits 0 to 6 the node, then the multiplexor and four bytes.
#[test]
fn an_mpdo_is_a_node_a_multiplexor_and_four_bytes() {
    let mut read = 0;
    for frame in frames(7, |raw| 0x180 + raw % 0x400) {
        let Some(mpdo) = Mpdo::parse(&frame) else {
            assert_ne!(frame.data().len(), 8, "{frame}");
            continue;
        };
        let [address, low, high, sub_index, data @ ..] = <[u8; 8]>::try_from(frame.data()).unwrap();
        let mode = if address < 0x80 { AddressMode::Source } else { AddressMode::Destination };
        assert_eq!((mpdo.mode, mpdo.node), (mode, address % 0x80), "{frame}");
        assert_eq!(mpdo.object, Mux::new(u16::from(low) + 256 * u16::from(high), sub_index), "{frame}");
        assert_eq!(mpdo.data, data, "{frame}");
        assert_eq!(mpdo.emit(frame.id()), frame);
        read += 1;
    }
    assert!(read > ROUNDS / 20, "{read}");
}

/// Eight random bytes whose first is a request or a reply of block transfer: 5 and 6 in bits 5 to 7.
fn block_frames(seed: u64) -> impl Iterator<Item = [u8; 8]> {
    let mut numbers = Numbers(seed);
    (0..ROUNDS).map(move |_| {
        let mut raw = numbers.next().to_le_bytes();
        raw[0] = [5, 6][numbers.below(2)] << 5 | raw[0] & 0x1F;
        raw
    })
}

/// The bytes of a number, the lowest first.
fn number(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// CiA 301, 7.2.4.3.9 to 7.2.4.3.15, the client's: ccs 6 downloads and 5 uploads; bit 2 is cc, bit 1 of a download s.
#[test]
fn requests_of_a_block_transfer_have_the_fields_of_the_standard() {
    for raw in block_frames(8) {
        let mux = Mux::new(number(&raw[1..3]) as u16, raw[3]);
        let bit = |n: u8| raw[0] >> n & 1 == 1;
        let expected = match (raw[0] >> 5, raw[0] & 3) {
            (6, 0 | 2) => {
                Request::InitiateDownload { mux, checksum: bit(2), size: bit(1).then_some(number(&raw[4..])) }
            }
            (6, _) => Request::EndDownload(End { unused: raw[0] >> 2 & 7, checksum: number(&raw[1..3]) as u16 }),
            (5, 0) => Request::InitiateUpload { mux, checksum: bit(2), block_size: raw[4], switch_threshold: raw[5] },
            (5, 1) => Request::EndUpload,
            (5, 2) => Request::Acknowledge(Acknowledgement { sequence: raw[1], block_size: raw[2] }),
            _ => Request::StartUpload,
        };
        assert_eq!(Request::parse(&raw), Some(expected), "{raw:02X?}");
        assert_eq!(Request::parse(&expected.emit()), Some(expected), "{raw:02X?}");
    }
}

/// The server's: scs 5 downloads and 6 uploads; bit 2 is sc, bit 1 of an upload s.
#[test]
fn replies_of_a_block_transfer_have_the_fields_of_the_standard() {
    for raw in block_frames(9) {
        let mux = Mux::new(number(&raw[1..3]) as u16, raw[3]);
        let bit = |n: u8| raw[0] >> n & 1 == 1;
        let expected = match (raw[0] >> 5, raw[0] & 3) {
            (5, 0) => Some(Reply::InitiateDownload { mux, checksum: bit(2), block_size: raw[4] }),
            (5, 1) => Some(Reply::EndDownload),
            (5, 2) => Some(Reply::Acknowledge(Acknowledgement { sequence: raw[1], block_size: raw[2] })),
            // Not defined.
            (5, _) => None,
            (_, 0 | 2) => {
                let size = bit(1).then_some(number(&raw[4..]));
                Some(Reply::InitiateUpload { mux, checksum: bit(2), size })
            }
            _ => Some(Reply::EndUpload(End { unused: raw[0] >> 2 & 7, checksum: number(&raw[1..3]) as u16 })),
        };
        assert_eq!(Reply::parse(&raw), expected, "{raw:02X?}");
        if let Some(reply) = expected {
            assert_eq!(Reply::parse(&reply.emit()), Some(reply), "{raw:02X?}");
        }
    }
}

/// CiA 301, 7.2.4.3.10: bit 7 is c, bits 0 to 6 the number, then seven bytes.
#[test]
fn a_segment_of_a_block_is_a_number_a_flag_and_seven_bytes() {
    let mut numbers = Numbers(10);
    for _ in 0..ROUNDS {
        let raw = numbers.next().to_le_bytes();
        let segment = Segment::parse(&raw);
        assert_eq!((segment.last, segment.sequence), (raw[0] >= 0x80, raw[0] % 0x80), "{raw:02X?}");
        assert_eq!(segment.bytes, raw[1..], "{raw:02X?}");
        assert_eq!(segment.emit(), raw);
    }
}

//! Streams of other programs: socketcand, slcan, candump logs.
//!
//! A decoder gives the same messages however the stream is cut, and each message reads back as it was written.

use std::fmt::Debug;

use can::Instant;
use transport::socketcand;

pub(super) const CANDUMP_SAMPLES: &[&[u8]] = &[
    b"(1700000000.123456) can0 604#4041600000000000",
    b"(1700000000.123456) can0 604#4041600000000000 R",
    b"(1700000000.123456)  can0  604   [8]  40 41 60 00 00 00 00 00",
    b"can0  12345678   [2]  01 02",
];

pub(super) const SOCKETCAND_SAMPLES: &[&[u8]] = &[
    b"< open can0 >< rawmode >< send 604 8 2b 40 60 0 6 0 0 0 >",
    b"< hi >< ok >< frame 704 23.424242 00 >< frame 080 1.000000  >",
    b"< sendrtr 123 2 >< echo >< rtr 123 23.424242 2 >< error bus off >",
];

pub(super) const SLCAN_SAMPLES: &[&[u8]] = &[
    b"S6\rO\rt60482B40600006000000\rC\r",
    b"t70410012F\rz\rV1013\rN0001\rF00\r",
    b"T1234567820102\rr1232\r\x07Z1\rM00000000\r",
];

/// A log line: what was read can be written and reads the same.
pub(super) fn candump_line(data: &[u8]) {
    let Ok(line) = str::from_utf8(data) else { return };
    let Ok(Some(record)) = canlog::parse_line(line) else { return };
    let mut written = Vec::new();
    canlog::emit_line(&record, &mut written);
    let written = String::from_utf8(written).expect("a log is text");
    let again = canlog::parse_line(&written).expect("what was written can be read");
    // The data of a CAN FD frame is not kept: it is written as a comment.
    let kept = (!matches!(record.content, canlog::Content::FdFrame { .. })).then_some(record);
    let said = |record: &canlog::Record| (record.content, record.interface, record.direction);
    assert_eq!(again.as_ref().map(said), kept.as_ref().map(said), "{line:?} written as {written:?}");
}

/// socketcand in both directions.
pub(super) fn socketcand(data: &[u8]) {
    decoder_laws(data, socketcand_decoder::<socketcand::Request>, socketcand::Message::emit, |request| request);
    decoder_laws(data, socketcand_decoder::<socketcand::ServerReply>, socketcand::Message::emit, as_written);
}

/// slcan in both directions.
pub(super) fn slcan(data: &[u8]) {
    decoder_laws(data, slcan_decoder::<slcan::Command>, slcan::Line::emit, |command| command);
    decoder_laws(data, slcan_decoder::<slcan::Answer>, slcan::Line::emit, |answer| answer);
}

/// Time stamps are written in whole microseconds, words without control characters. Others may send more.
fn as_written(reply: socketcand::ServerReply) -> socketcand::ServerReply {
    match reply {
        socketcand::ServerReply::Frame { at, frame } => {
            socketcand::ServerReply::Frame { at: Instant::from_nanos(at.as_nanos() / 1_000 * 1_000), frame }
        }
        socketcand::ServerReply::Error(words) => {
            let printable: String = words.chars().filter(|char| !char.is_ascii_control()).collect();
            socketcand::ServerReply::Error(printable.trim().to_owned())
        }
        other => other,
    }
}

/// Decodes pieces of a stream: each valid message, and `None` for what is malformed.
fn socketcand_decoder<M: socketcand::Message>(pieces: &[&[u8]]) -> Vec<Option<M>> {
    let mut decoder = socketcand::Decoder::default();
    let mut messages = Vec::new();
    for mut piece in pieces.iter().copied() {
        messages.extend(std::iter::from_fn(|| decoder.next(&mut piece)).map(Result::ok));
    }
    messages
}

fn slcan_decoder<L: slcan::Line>(pieces: &[&[u8]]) -> Vec<Option<L>> {
    let mut decoder = slcan::Decoder::default();
    let mut lines = Vec::new();
    for mut piece in pieces.iter().copied() {
        lines.extend(std::iter::from_fn(|| decoder.next(&mut piece)).map(Result::ok));
    }
    lines
}

fn decoder_laws<M: Debug + PartialEq>(
    data: &[u8],
    decode: fn(&[&[u8]]) -> Vec<Option<M>>,
    emit: fn(&M, &mut Vec<u8>),
    canonical: fn(M) -> M,
) {
    let whole = decode(&[data]);
    assert!(whole.len() <= data.len() + 1, "{} results from {} bytes", whole.len(), data.len());
    let middle = data.len() / 2;
    assert_eq!(decode(&[&data[..middle], &data[middle..]]), whole, "cut at {middle}");
    let bytes: Vec<&[u8]> = data.chunks(1).collect();
    assert_eq!(decode(&bytes), whole, "cut into bytes");
    for message in whole.into_iter().flatten() {
        let mut written = Vec::new();
        emit(&message, &mut written);
        let again = decode(&[&written]);
        assert_eq!(again, [Some(canonical(message))], "written as {:?}", String::from_utf8_lossy(&written));
    }
}

//! SDO block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16) against frames that are written out, and against this crate's client.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::od::{DataType, Entry, Kind};
use canopen::sdo::Client;
use canopen::sdo::block::checksum;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{AbortCode, Mux, Node, NodeId, NodeProfile};

use crate::any_device::device::{Boxed, Numbers, answer, drain, node, node_of, rw, table, talk, upload, written};

const CAPACITY: u32 = 2000;
const TEXT: Mux = Mux::new(0x2009, 0);

/// 2009h: a string of up to 2000 bytes, which is "old text"; 2007h: UNSIGNED32 with the value 7.
fn device() -> Node<Boxed> {
    node(vec![
        rw(0x2007, 0, DataType::Unsigned32).default(7),
        rw(0x2009, 0, DataType::VisibleString).text("old text").capacity(CAPACITY),
    ])
}

/// What the text is.
#[track_caller]
fn text(node: &mut Node<Boxed>) -> Vec<u8> {
    upload(node, TEXT).unwrap()
}

fn frame(request: [u8; 8]) -> String {
    Frame::new(can::CanId::standard(0x604), &request).to_string()
}

/// A segment of a download.
fn segment(sequence: u8, last: bool, data: &[u8]) -> String {
    let mut raw = [0; 8];
    raw[0] = sequence | if last { 0x80 } else { 0 };
    raw[1..=data.len()].copy_from_slice(data);
    frame(raw)
}

/// The end of a download.
fn end(unused: u8, data: &[u8]) -> String {
    let [low, high] = checksum(0, data).to_le_bytes();
    frame([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0])
}

const DONE: &str = "584#A100000000000000";

#[test]
fn a_download_of_19_bytes_is_three_segments_and_their_checksum() {
    let mut node = device();
    let data = b"nineteen bytes of it";
    let data = &data[..19];
    for with_size in [true, false] {
        let begin = if with_size { "604#C609200013000000" } else { "604#C409200000000000" };
        talk(&mut node, &[(begin, "584#A40920007F000000")]);
        assert!(answer(&mut node, &segment(1, false, &data[..7])).is_empty());
        assert!(answer(&mut node, &segment(2, false, &data[7..14])).is_empty());
        talk(&mut node, &[(&segment(3, true, &data[14..]), "584#A2037F0000000000"), (&end(2, data), DONE)]);
        assert_eq!(text(&mut node), data);
    }
}

#[test]
fn an_upload_of_8_bytes_is_two_segments_and_their_checksum() {
    let mut node = device();
    let [low, high] = checksum(0, b"old text").to_le_bytes();
    talk(&mut node, &[("604#A40920007F000000", "584#C609200008000000")]);
    assert_eq!(answer(&mut node, "604#A300000000000000"), ["584#016F6C6420746578", "584#8274000000000000"]);
    let expected = Frame::new(can::CanId::standard(0x584), &[0xC1 | 6 << 2, low, high, 0, 0, 0, 0, 0]).to_string();
    talk(&mut node, &[("604#A2027F0000000000", &expected)]);
    assert!(answer(&mut node, "604#A100000000000000").is_empty());
    // Without a checksum where the client cannot form one.
    talk(&mut node, &[("604#A00920007F000000", "584#C209200008000000")]);
    answer(&mut node, "604#A300000000000000");
    talk(&mut node, &[("604#A2027F0000000000", "584#D900000000000000")]);
}

/// 7.2.4.3.12: up to the protocol switch threshold the server may answer as if the upload of 7.2.4.3.5 had been asked for.
#[test]
fn an_upload_of_no_more_bytes_than_the_threshold_is_an_ordinary_one() {
    let mut node = device();
    talk(
        &mut node,
        &[
            ("604#A40920007F080000", "584#4109200008000000"),
            ("604#6000000000000000", "584#006F6C6420746578"),
            ("604#7000000000000000", "584#1D74000000000000"),
            ("604#A40720007F040000", "584#4307200007000000"),
            ("604#A40920007F070000", "584#C609200008000000"),
        ],
    );
}

#[test]
fn what_was_lost_of_a_block_comes_again_and_the_client_chooses_the_size_of_the_next_one() {
    let mut node = device();
    let data = Numbers(3).bytes(200);
    let slot = node.table().find(TEXT).unwrap();
    node.dictionary_mut().set_bytes(slot, &data).unwrap();
    // 29 segments: the 4 of the first block, of which 2 arrive; 1; 127, of which all but the last; the last.
    let mut received = Vec::new();
    let mut take = |frames: Vec<String>, numbers: std::ops::RangeInclusive<u8>, kept: usize| {
        assert_eq!(frames.len(), numbers.clone().count());
        for (frame, number) in frames.iter().zip(numbers) {
            let frame: Frame = frame.parse().unwrap();
            assert_eq!(frame.data()[0] & 0x7F, number);
            if usize::from(number) <= kept {
                received.extend_from_slice(&frame.data()[1..]);
            }
        }
    };
    talk(&mut node, &[("604#A409200004000000", "584#C6092000C8000000")]);
    take(answer(&mut node, "604#A300000000000000"), 1..=4, 2);
    take(answer(&mut node, "604#A202010000000000"), 1..=1, 1);
    take(answer(&mut node, "604#A2017F0000000000"), 1..=26, 25);
    take(answer(&mut node, "604#A219010000000000"), 1..=1, 1);
    let [low, high] = checksum(0, &data).to_le_bytes();
    let expected = Frame::new(can::CanId::standard(0x584), &[0xC1 | 3 << 2, low, high, 0, 0, 0, 0, 0]).to_string();
    talk(&mut node, &[("604#A2017F0000000000", &expected)]);
    received.truncate(200);
    assert_eq!(received, data);
}

#[test]
fn a_gap_in_a_download_is_confirmed_up_to_it_and_filled_by_the_next_block() {
    let mut node = device();
    let data = Numbers(5).bytes(35);
    talk(&mut node, &[("604#C609200023000000", "584#A40920007F000000")]);
    // The second of five segments is lost.
    for number in [1, 3, 4] {
        let part = &data[7 * (usize::from(number) - 1)..][..7];
        assert!(answer(&mut node, &segment(number, false, part)).is_empty());
    }
    talk(&mut node, &[(&segment(5, true, &data[28..]), "584#A2017F0000000000")]);
    for number in [1, 2, 3] {
        assert!(answer(&mut node, &segment(number, false, &data[7 * usize::from(number)..][..7])).is_empty());
    }
    talk(&mut node, &[(&segment(4, true, &data[28..]), "584#A2047F0000000000"), (&end(0, &data), DONE)]);
    assert_eq!(text(&mut node), data);
}

/// The first frames of a download of 14 bytes.
const HALF: [(&str, &str); 1] = [("604#C60920000E000000", "584#A40920007F000000")];

/// 7.2.4.3.17: 0504 0002h, 0504 0003h, 0504 0004h, 0607 0012h, 0607 0010h, 0504 0001h.
#[test]
fn what_is_wrong_is_answered_with_the_code_that_the_standard_has_for_it_and_nothing_is_stored() {
    let refused = |code: &str| format!("584#80092000{code}");
    // Blocks of no segment and of 128.
    for block_size in ["00", "80", "FF"] {
        talk(&mut device(), &[(&format!("604#A4092000{block_size}000000"), &refused("02000405"))]);
    }
    let upload: &[(&str, &str)] = &[("604#A40920007F000000", "584#C609200008000000")];
    let mut node = device();
    talk(&mut node, upload);
    answer(&mut node, "604#A300000000000000");
    talk(&mut node, &[("604#A203000000000000", &refused("03000405"))]);
    talk(&mut node, upload);
    answer(&mut node, "604#A300000000000000");
    talk(&mut node, &[("604#A201000000000000", &refused("02000405"))]);
    // A confirmation before the start; a start of a download.
    talk(&mut node, upload);
    talk(&mut node, &[("604#A2017F0000000000", &refused("01000405"))]);
    talk(&mut node, &[("604#A300000000000000", "584#8000000001000405")]);

    let data = b"fourteen bytes";
    let complete = |node: &mut Node<Boxed>| {
        talk(node, &HALF);
        assert!(answer(node, &segment(1, false, &data[..7])).is_empty());
        talk(node, &[(&segment(2, true, &data[7..]), "584#A2027F0000000000")]);
    };
    let mut node = device();
    talk(&mut node, &HALF);
    talk(&mut node, &[("604#0061626364656667", &refused("03000405"))]);
    complete(&mut node);
    talk(&mut node, &[(&end(0, b"fourteen bytez"), &refused("04000405"))]);
    // Fewer bytes than declared, by the number of those that are unused in the last segment; more.
    complete(&mut node);
    talk(&mut node, &[(&end(1, &data[..13]), &refused("10000706"))]);
    talk(&mut node, &HALF);
    for number in [1, 2] {
        assert!(answer(&mut node, &segment(number, false, &data[..7])).is_empty());
    }
    talk(&mut node, &[(&segment(3, false, &data[..7]), &refused("12000706"))]);
    // More than the object has room for, declared and not.
    talk(&mut node, &[("604#C6092000D1070000", &refused("12000706"))]);
    assert_eq!(text(&mut node), b"old text");
    assert!(written(&mut node).is_empty());
}

#[test]
fn a_block_transfer_of_what_is_not_there_or_not_allowed_has_the_codes_of_any_other() {
    let rows = vec![
        rw(0x2007, 0, DataType::Unsigned32),
        Entry::new(0x2008, 0, DataType::Unsigned32, canopen::od::Access::ReadOnly, "row", ""),
        Entry::new(0x2009, 0, DataType::Unsigned32, canopen::od::Access::WriteOnly, "row", ""),
    ];
    talk(
        &mut node(rows),
        &[
            ("604#A40A20007F000000", "584#800A200000000206"),
            ("604#A40720017F000000", "584#8007200111000906"),
            ("604#A40920007F000000", "584#8009200001000106"),
            ("604#C60A200004000000", "584#800A200000000206"),
            ("604#C608200004000000", "584#8008200002000106"),
            ("604#C607200005000000", "584#8007200012000706"),
            ("604#C607200003000000", "584#8007200013000706"),
        ],
    );
}

#[test]
fn the_client_may_give_up_at_any_point_of_a_download_and_the_old_value_stays() {
    let data = b"fourteen bytes";
    let all =
        ["604#C60920000E000000".to_owned(), segment(1, false, &data[..7]), segment(2, true, &data[7..]), end(0, data)];
    for stop in 1..all.len() {
        // An abort, and another request in the place of the end.
        for stopper in ["604#8009200000000008", "604#4007200000000000"] {
            let mut node = device();
            for frame in &all[..stop] {
                answer(&mut node, frame);
            }
            let answers = answer(&mut node, stopper);
            answer(&mut node, "604#8009200000000008");
            assert_eq!(text(&mut node), b"old text", "{stopper} after {stop} frames");
            match (stop, stopper) {
                (_, "604#8009200000000008") => assert!(answers.is_empty()),
                // 40h is the number of a segment that is not the next one; then it is a request again.
                (1 | 2, _) => assert!(answers.is_empty()),
                _ => assert_eq!(answers, ["584#4307200007000000"]),
            }
        }
    }
}

/// A segment 23h looks as a download of four bytes does, to the object that its data names.
#[test]
fn segments_that_were_under_way_when_the_server_gave_up_are_not_taken_for_requests() {
    let mut node = device();
    talk(&mut node, &[("604#C609200010000000", "584#A40920007F000000")]);
    for number in [1, 2] {
        assert!(answer(&mut node, &segment(number, false, b"segment")).is_empty());
    }
    assert_eq!(answer(&mut node, &segment(3, false, b"segment")), ["584#8009200012000706"]);
    for number in 4..=0x30 {
        // 2007h:00 = 1, were it a request.
        assert!(answer(&mut node, &segment(number, false, &[0x07, 0x20, 0, 1, 0, 0, 0])).is_empty(), "{number:02X}h");
    }
    talk(&mut node, &[("604#4007200000000000", "584#4307200007000000")]);
    // Nor are they where the client was silent for too long in between.
    talk(&mut node, &[("604#C609200010000000", "584#A40920007F000000")]);
    assert!(answer(&mut node, &segment(1, false, b"segment")).is_empty());
    node.handle_timeout(Instant::from_millis(500));
    drain(&mut node);
    node.handle_timeout(Instant::from_millis(1000));
    assert_eq!(drain(&mut node).iter().map(ToString::to_string).collect::<Vec<_>>(), ["584#8009200000000405"]);
    assert!(answer(&mut node, &segment(2, false, b"segment")).is_empty());
    talk(&mut node, &[("604#4007200000000000", "584#4307200007000000")]);
}

/// The frame that ends a block may be lost: half of the time that the client has is waited for it.
#[test]
fn a_block_whose_end_does_not_come_is_confirmed_as_far_as_it_came_and_then_given_up() {
    let mut node = device();
    let timeout = NodeProfile::SDO_TIMEOUT_NS;
    talk(&mut node, &HALF);
    assert!(answer(&mut node, &segment(1, false, b"fourtee")).is_empty());
    let mut sent_at = |ns: u64| {
        node.handle_timeout(Instant::ZERO.plus_nanos(ns));
        drain(&mut node).iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert!(sent_at(timeout / 2 - 1).is_empty());
    assert_eq!(sent_at(timeout / 2), ["584#A2017F0000000000"]);
    assert!(sent_at(timeout - 1).is_empty());
    assert_eq!(sent_at(timeout), ["584#8009200000000405"]);
    assert_eq!(text(&mut node), b"old text");
}

#[test]
fn an_upload_whose_client_is_silent_is_given_up_after_its_time_and_that_of_the_block_on_a_slow_bus() {
    let mut node = device();
    talk(&mut node, &[("604#A40920007F000000", "584#C609200008000000")]);
    assert_eq!(answer(&mut node, "604#A300000000000000").len(), 2);
    // Two frames of 130 bits at 10 kbit/s take 26 ms.
    node.handle_timeout(Instant::from_micros(1_025_999));
    assert!(drain(&mut node).is_empty());
    node.handle_timeout(Instant::from_micros(1_026_000));
    assert_eq!(drain(&mut node).iter().map(ToString::to_string).collect::<Vec<_>>(), ["584#8009200000000405"]);
}

#[test]
fn an_abort_in_the_midst_of_an_upload_ends_its_segments() {
    let mut node = device();
    let slot = node.table().find(TEXT).unwrap();
    node.dictionary_mut().set_bytes(slot, &[7; 200]).unwrap();
    talk(&mut node, &[("604#A40920007F000000", "584#C6092000C8000000")]);
    node.handle_frame(&"604#A300000000000000".parse().unwrap(), Instant::ZERO);
    assert!(node.poll_transmit().is_some() && node.poll_transmit().is_some());
    node.handle_frame(&"604#8009200000000008".parse().unwrap(), Instant::ZERO);
    assert_eq!(node.poll_transmit(), None);
    talk(&mut node, &[("604#4007200000000000", "584#4307200007000000")]);
}

/// The client of this crate with the server of this crate; both take what the other offers.
fn run(mut client: Client, node: &mut Node<Boxed>, buffer: &mut [u8]) -> Result<Outcome, Failure> {
    for _ in 0..10_000 {
        while let Some(request) = client.poll_transmit(buffer) {
            node.handle_frame(&request, Instant::ZERO);
        }
        while let Some(reply) = node.poll_transmit() {
            if let Some(result) = client.handle_frame(&reply, buffer, Instant::ZERO) {
                if let Some(last) = client.poll_transmit(buffer) {
                    node.handle_frame(&last, Instant::ZERO);
                }
                return result;
            }
        }
    }
    panic!("no end");
}

fn client() -> Client {
    Client::new(NodeId::new(4).unwrap(), Duration::from_millis(50))
}

#[test]
fn values_of_every_type_and_length_travel_both_ways_in_blocks() {
    let rows = DataType::ALL.iter().map(|of| rw(0x2000 + of.code(), 0, *of).capacity(CAPACITY)).collect();
    let (mut node, mut numbers) = (node(rows), Numbers(1));
    for round in 0..20 {
        for data_type in DataType::ALL {
            let lengths = [0, 1, 7, 14, 889, 890, 1778, 2000];
            let size = match data_type.kind() {
                Kind::Bytes if round < lengths.len() => lengths[round],
                Kind::Bytes => numbers.below(CAPACITY as usize + 1),
                _ => data_type.size(),
            };
            let mut data = numbers.bytes(size);
            match data_type {
                DataType::Boolean => data[0] &= 1,
                DataType::UnicodeString => data.truncate(size & !1),
                _ => {}
            }
            let mux = Mux::new(0x2000 + data_type.code(), 0);
            let mut writer = client();
            writer.download_blocks(mux, &data, Instant::ZERO);
            let sent = run(writer, &mut node, &mut data.clone());
            assert_eq!(sent, Ok(Outcome::Downloaded { mux }), "{data_type:?} {size}");
            assert_eq!(upload(&mut node, mux).as_deref(), Ok(&data[..]), "{data_type:?}");
            let (mut reader, mut buffer) = (client(), vec![0; CAPACITY as usize]);
            reader.upload_blocks(mux, 0, Instant::ZERO);
            let read = run(reader, &mut node, &mut buffer);
            assert_eq!(read, Ok(Outcome::Uploaded { mux, length: data.len() }), "{data_type:?}");
            assert_eq!(buffer[..data.len()], data);
        }
    }
}

/// A server that takes blocks of any size, as an own device may say.
#[test]
fn a_download_keeps_to_the_block_size_of_its_server() {
    for block_size in [1, 2, 5, 126, 127] {
        let rows = vec![rw(0x2009, 0, DataType::Domain).capacity(CAPACITY)];
        let mut node = node_of(NodeProfile { sdo_block_size: block_size, ..NodeProfile::cia_301(table(rows)) });
        for size in [0, 6, 7, 8, 500] {
            let data = Numbers(9).bytes(size);
            let mut writer = client();
            writer.download_blocks(TEXT, &data, Instant::ZERO);
            assert_eq!(run(writer, &mut node, &mut data.clone()), Ok(Outcome::Downloaded { mux: TEXT }));
            assert_eq!(text(&mut node), data, "{size} bytes in blocks of {block_size}");
        }
    }
}

#[test]
fn a_client_sees_what_is_wrong_with_a_server_and_reports_it_with_the_code_of_the_standard() {
    let data = [1; 14];
    let downloading = |frames: &[&str]| {
        let (mut client, mut buffer, mut result) = (client(), data, None);
        client.download_blocks(TEXT, &data, Instant::ZERO);
        for frame in frames {
            while client.poll_transmit(&buffer).is_some() {}
            result = client.handle_frame(&frame.parse().unwrap(), &mut buffer, Instant::ZERO);
        }
        (result, client.poll_transmit(&buffer).map(|frame| frame.to_string()))
    };
    let reported = |code: &str| Some(format!("604#80092000{code}"));
    let size = downloading(&["584#A409200000000000"]);
    assert_eq!(size, (Some(Err(Failure::BlockSize { mux: TEXT, segments: 0 })), reported("02000405")));
    let number = downloading(&["584#A40920007F000000", "584#A2037F0000000000"]);
    assert_eq!(number, (Some(Err(Failure::SequenceNumber { mux: TEXT, sequence: 3 })), reported("03000405")));
    let reply = downloading(&["584#A40920007F000000", "584#A100000000000000"]);
    assert_eq!(reply, (Some(Err(Failure::UnexpectedReply { mux: TEXT, command: 0xA1 })), reported("01000405")));
    let stalls: Vec<&str> =
        std::iter::once("584#A40920007F000000").chain([["584#A2007F0000000000"; 16]].concat()).collect();
    let stalled = downloading(&stalls);
    assert_eq!(stalled, (Some(Err(Failure::Stalled { mux: TEXT, confirmed: 0 })), reported("00000008")));
    // CiA 301, 7.2.4.3.10: a confirmation of 0 has the block sent again; one that goes on begins their count anew.
    let often = ["584#A2007F0000000000"; 15];
    let goes_on = ["584#A2017F0000000000"];
    let slow = [&["584#A40920007F000000"][..], &often, &goes_on, &often, &goes_on].concat();
    let [low, high] = checksum(0, &data).to_le_bytes();
    assert_eq!(downloading(&slow), (None, Some(format!("604#C1{low:02X}{high:02X}0000000000"))));

    let uploading = |frames: &[&str]| {
        let (mut client, mut buffer, mut result) = (client(), [0; 32], None);
        client.upload_blocks(TEXT, 0, Instant::ZERO);
        for frame in frames {
            while client.poll_transmit(&buffer).is_some() {}
            result = client.handle_frame(&frame.parse().unwrap(), &mut buffer, Instant::ZERO);
        }
        (result, client.poll_transmit(&buffer).map(|frame| frame.to_string()))
    };
    const BEGIN: &str = "584#C609200008000000";
    let sum = uploading(&[BEGIN, "584#016F6C6420746578", "584#8274000000000000", "584#D900000000000000"]);
    assert_eq!(sum, (Some(Err(Failure::Checksum { mux: TEXT })), reported("04000405")));
    let short =
        uploading(&["584#C209200008000000", "584#016F6C6420746578", "584#8274000000000000", "584#DD00000000000000"]);
    let mismatch = Failure::LengthMismatch { mux: TEXT, declared: 8, received: 7 };
    assert_eq!(short, (Some(Err(mismatch)), reported("10000706")));
    let long = uploading(&[BEGIN, "584#016F6C6420746578", "584#026F6C6420746578"]);
    let mismatch = Failure::LengthMismatch { mux: TEXT, declared: 8, received: 14 };
    assert_eq!(long, (Some(Err(mismatch)), reported("10000706")));
    let large = uploading(&["584#C609200021000000"]);
    assert_eq!(large, (Some(Err(Failure::BufferTooSmall { mux: TEXT, needed: 33 })), reported("05000405")));
    let aborted = uploading(&[BEGIN, "584#016F6C6420746578", "584#8009200000000008"]);
    assert_eq!(aborted, (Some(Err(Failure::Aborted { mux: TEXT, code: AbortCode::GENERAL })), None));
}

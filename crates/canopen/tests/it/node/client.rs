//! The SDO client: against this crate's server, and against servers that misbehave.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{AbortCode, Mux, NodeId};

use crate::node::bench::Bench;
use crate::node::device::STANDARD;

const NAME: Mux = Mux::new(0x1008, 0);
const TARGET: Mux = Mux::new(0x607A, 0);

fn client() -> Client {
    Client::new(NodeId::new(4).unwrap(), Duration::from_millis(50))
}

/// Lets client and node talk until the transfer ends.
fn run(client: &mut Client, bench: &mut Bench, buffer: &mut [u8]) -> Result<Outcome, Failure> {
    for _ in 0..100 {
        let request = client.poll_transmit(buffer).expect("the client says nothing");
        bench.node.handle_frame(&request, bench.now);
        while let Some(reply) = bench.node.poll_transmit() {
            if let Some(result) = client.handle_frame(&reply, buffer, bench.now) {
                return result;
            }
        }
    }
    panic!("no end");
}

/// A transfer whose replies are given.
fn replies(mut client: Client, buffer: &mut [u8], frames: &[&str]) -> (Option<Result<Outcome, Failure>>, Client) {
    let mut result = None;
    for frame in frames {
        let _ = client.poll_transmit(&[]);
        result = client.handle_frame(&frame.parse().unwrap(), buffer, Instant::ZERO);
    }
    (result, client)
}

fn uploading(mux: Mux) -> Client {
    let mut client = client();
    client.upload(mux, Instant::ZERO);
    client
}

#[test]
fn values_travel_both_ways() {
    let (mut client, mut bench) = (client(), Bench::new(&STANDARD));
    for segmented in [false, true] {
        let mut data = 0x1234_5678_i32.to_le_bytes();
        if segmented {
            client.download_segmented(TARGET, &data, bench.now);
        } else {
            client.download(TARGET, &data, bench.now);
        }
        assert_eq!(run(&mut client, &mut bench, &mut data), Ok(Outcome::Downloaded { mux: TARGET }));
        assert_eq!(bench.value(0x607A), 0x1234_5678);
        assert_eq!(client.poll_timeout(), None);
        bench.set(0x607A, 0);
    }
    let mut buffer = [0; 64];
    client.upload(NAME, bench.now);
    let outcome = run(&mut client, &mut bench, &mut buffer);
    assert_eq!(outcome, Ok(Outcome::Uploaded { mux: NAME, length: 20 }));
    assert_eq!(&buffer[..20], b"a drive of the tests");
    for (index, text) in [(0x1009, "1.0"), (0x100A, "")] {
        let mux = Mux::new(index, 0);
        client.upload(mux, bench.now);
        let outcome = run(&mut client, &mut bench, &mut buffer);
        assert_eq!(outcome, Ok(Outcome::Uploaded { mux, length: text.len() }));
        assert_eq!(&buffer[..text.len()], text.as_bytes());
    }
}

#[test]
fn a_segmented_download_is_sent_in_sevens() {
    let mut client = client();
    let mut data = *b"0123456789abcdef";
    client.download(NAME, &data, Instant::ZERO);
    let mut sent = vec![client.poll_transmit(&[]).unwrap()];
    for reply in ["584#6008100000000000", "584#2000000000000000", "584#3000000000000000"] {
        assert_eq!(client.handle_frame(&reply.parse().unwrap(), &mut data, Instant::ZERO), None);
        sent.push(client.poll_transmit(&[]).unwrap());
    }
    let expected = ["604#2108100010000000", "604#0030313233343536", "604#1037383961626364", "604#0B65660000000000"]
        .map(|text| text.parse::<Frame>().unwrap());
    assert_eq!(sent, expected);
    let last = client.handle_frame(&"584#2000000000000000".parse().unwrap(), &mut data, Instant::ZERO);
    assert_eq!(last, Some(Ok(Outcome::Downloaded { mux: NAME })));
}

#[test]
fn a_refusal_is_reported_with_its_code() {
    let (mut client, mut bench) = (client(), Bench::new(&STANDARD));
    let mux = Mux::new(0x1003, 0);
    client.upload(mux, bench.now);
    let refusal = run(&mut client, &mut bench, &mut [0; 4]);
    assert_eq!(refusal, Err(Failure::Aborted { mux, code: AbortCode::NO_SUCH_OBJECT }));
    assert_eq!(client.poll_transmit(&[]), None);
    assert_eq!(
        refusal.unwrap_err().to_string(),
        "1003h:00: the device aborted with 0602 0000h (object does not exist in the object dictionary)"
    );
}

/// CiA 301, 7.2.4.3: one client for each channel. Where there are two all the same, each sees the other's replies.
#[test]
fn a_reply_for_another_entry_is_passed_over_and_reported_when_none_comes() {
    let expected = Mux::new(0x6041, 0);
    let foreign = ["584#4B40600000000000", "584#6040600000000000", "584#8040600000000206"];
    for frame in foreign {
        let (result, mut client) = replies(uploading(expected), &mut [0; 8], &[frame]);
        assert!(result.is_none() && client.is_busy(), "{frame}");
        // Its own comes after all.
        let own = client.handle_frame(&"584#4B41600037020000".parse().unwrap(), &mut [0; 8], Instant::from_millis(1));
        assert_eq!(own, Some(Ok(Outcome::Uploaded { mux: expected, length: 2 })), "{frame}");
        // Or does not.
        let (_, mut client) = replies(uploading(expected), &mut [0; 8], &[frame]);
        let failure = client.handle_timeout(Instant::from_millis(50));
        assert_eq!(failure, Some(Failure::WrongMux { expected, received: Mux::new(0x6040, 0) }), "{frame}");
        assert!(!client.is_busy());
        assert_eq!(client.poll_transmit(&[]), Some("604#8041600000000405".parse().unwrap()));
        // What is asked next has nothing to do with it.
        client.upload(expected, Instant::from_millis(60));
        assert_eq!(client.handle_timeout(Instant::from_millis(110)), Some(Failure::TimedOut { mux: expected }));
    }
}

#[test]
fn silence_times_out_and_the_server_is_informed() {
    let mut client = uploading(NAME);
    assert_eq!(client.poll_timeout(), Some(Instant::from_millis(50)));
    assert_eq!(client.handle_timeout(Instant::from_millis(49)), None);
    assert_eq!(client.handle_timeout(Instant::from_millis(50)), Some(Failure::TimedOut { mux: NAME }));
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100000000405".parse().unwrap()));
    assert_eq!(client.handle_timeout(Instant::from_millis(500)), None);
    // Its late reply belongs to no transfer.
    let late = client.handle_frame(&"584#4108100014000000".parse().unwrap(), &mut [0; 4], Instant::from_millis(501));
    assert_eq!(late, None);
}

#[test]
fn every_reply_starts_the_timeout_anew() {
    let mut client = uploading(NAME);
    let reply = "584#4108100014000000".parse().unwrap();
    client.handle_frame(&reply, &mut [0; 32], Instant::from_millis(40));
    assert_eq!(client.poll_timeout(), Some(Instant::from_millis(90)));
}

#[test]
fn a_repeated_segment_is_noticed() {
    let frames = ["584#4108100014000000", "584#0061206472697665", "584#0061206472697665"];
    let (result, mut client) = replies(uploading(NAME), &mut [0; 32], &frames);
    assert_eq!(result, Some(Err(Failure::ToggleBit { mux: NAME })));
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100000000305".parse().unwrap()));
}

#[test]
fn a_value_longer_than_the_buffer_is_refused_declared_or_not() {
    let declared = ["584#4108100014000000"];
    let (result, _) = replies(uploading(NAME), &mut [0; 19], &declared);
    assert_eq!(result, Some(Err(Failure::BufferTooSmall { mux: NAME, needed: 20 })));
    let undeclared = ["584#4008100000000000", "584#0061206472697665"];
    let (result, mut client) = replies(uploading(NAME), &mut [0; 4], &undeclared);
    assert_eq!(result, Some(Err(Failure::BufferTooSmall { mux: NAME, needed: 7 })));
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100005000405".parse().unwrap()));
}

#[test]
fn another_length_than_declared_is_an_error() {
    let frames = ["584#4108100014000000", "584#0161206472697665"];
    let (result, _) = replies(uploading(NAME), &mut [0; 32], &frames);
    assert_eq!(result, Some(Err(Failure::LengthMismatch { mux: NAME, declared: 20, received: 7 })));
}

#[test]
fn more_than_declared_is_refused_at_the_first_byte_too_many() {
    // Declared: 3 bytes; the first segment has 7, and more are to follow.
    let frames = ["584#4108100003000000", "584#0061206472697665"];
    let (result, mut client) = replies(uploading(NAME), &mut [0; 1024], &frames);
    assert_eq!(result, Some(Err(Failure::LengthMismatch { mux: NAME, declared: 3, received: 7 })));
    // CiA 301, 7.2.4.3.17: 0607 0010h, the length of the service parameter does not match.
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100010000706".parse().unwrap()));
}

#[test]
fn a_segment_without_data_that_announces_more_ends_the_upload() {
    for first in ["584#4008100000000000", "584#4108100014000000"] {
        let frames = [first, "584#0061206472697665", "584#1E00000000000000"];
        let (result, mut client) = replies(uploading(NAME), &mut [0; 1024], &frames);
        assert_eq!(result, Some(Err(Failure::EmptySegment { mux: NAME, received: 7 })));
        assert_eq!(client.poll_transmit(&[]), Some("604#8008100000000008".parse().unwrap()));
    }
    // The last segment may be empty: how else would a server end that did not know the length?
    let frames = ["584#4008100000000000", "584#0061206472697665", "584#1F00000000000000"];
    let (result, _) = replies(uploading(NAME), &mut [0; 1024], &frames);
    assert_eq!(result, Some(Ok(Outcome::Uploaded { mux: NAME, length: 7 })));
}

/// When an upload ends whose server sends a byte in each segment, each 49 ms after it was asked, and never the last.
fn dribbled(first: &str) -> (Instant, Failure, Client) {
    let (mut client, mut now) = (uploading(NAME), Instant::ZERO);
    let mut buffer = [0; 4096];
    assert_eq!(client.handle_frame(&first.parse().unwrap(), &mut buffer, now), None);
    for segment in 0.. {
        let toggle = if segment % 2 == 0 { "0C" } else { "1C" };
        now += Duration::from_millis(49);
        let due = client.poll_timeout().unwrap();
        if due <= now {
            return (due, client.handle_timeout(due).unwrap(), client);
        }
        let reply = format!("584#{toggle}61000000000000").parse().unwrap();
        assert_eq!(client.handle_frame(&reply, &mut buffer, now), None);
    }
    unreachable!()
}

#[test]
fn an_upload_whose_segments_are_all_in_time_ends_nevertheless() {
    // 50 ms for each reply. 700 bytes are 100 full segments, and one more is allowed for: 5.05 s.
    let (at, failure, mut client) = dribbled("584#41081000BC020000");
    let limit = Duration::from_millis(5050);
    assert_eq!(failure, Failure::Endless { mux: NAME, received: 103, limit });
    assert_eq!(at, Instant::ZERO + limit);
    // 0504 0000h: SDO protocol timed out.
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100000000405".parse().unwrap()));
    // Of a length that was not declared: 256 and one.
    let (_, failure, _) = dribbled("584#4008100000000000");
    assert_eq!(failure, Failure::Endless { mux: NAME, received: 262, limit: Duration::from_millis(257 * 50) });
    // A time that has no end for each reply has none for all of them.
    let mut client = Client::new(NodeId::new(4).unwrap(), Duration::MAX);
    client.upload(NAME, Instant::ZERO);
    assert_eq!(client.handle_frame(&"584#4008100000000000".parse().unwrap(), &mut [0; 8], Instant::ZERO), None);
    assert_eq!(client.poll_timeout(), Some(Instant::FAR_FUTURE));
}

#[test]
fn a_reply_of_another_kind_is_an_error() {
    let (result, _) = replies(uploading(NAME), &mut [0; 32], &["584#6008100000000000"]);
    assert_eq!(result, Some(Err(Failure::UnexpectedReply { mux: NAME, command: 0x60 })));
    let (result, _) = replies(uploading(NAME), &mut [0; 32], &["584#C008100000000000"]);
    assert_eq!(result, Some(Err(Failure::UnexpectedReply { mux: NAME, command: 0xC0 })));
}

#[test]
fn frames_of_others_are_left_alone() {
    let frames = ["585#4B40600000000000", "604#4B40600000000000", "584#R8", "00000584#4B40600000000000"];
    let (result, client) = replies(uploading(NAME), &mut [0; 8], &frames);
    assert_eq!(result, None);
    assert!(client.is_busy());
}

#[test]
fn the_user_may_give_up() {
    let mut client = uploading(NAME);
    client.abort(AbortCode::GENERAL);
    assert!(!client.is_busy());
    assert_eq!(client.poll_transmit(&[]), Some("604#8008100000000008".parse().unwrap()));
    client.abort(AbortCode::GENERAL);
    assert_eq!(client.poll_transmit(&[]), None);
}

#[test]
fn every_reply_is_survived_at_every_stage() {
    let stages: [&[&str]; 3] = [&[], &["584#4108100014000000"], &["584#4108100014000000", "584#0061206472697665"]];
    for stage in stages {
        for command in 0..=u8::MAX {
            for length in 0..=8 {
                let (_, mut client) = replies(uploading(NAME), &mut [0; 32], stage);
                let bytes = [command, 0x08, 0x10, 0x00, 0xFF, 0xFF, 0xFF, 0xFF];
                let frame = Frame::new(canopen::connection_set::sdo_reply(NodeId::new(4).unwrap()), &bytes[..length]);
                let _ = client.handle_frame(&frame, &mut [0; 32], Instant::ZERO);
            }
        }
    }
}

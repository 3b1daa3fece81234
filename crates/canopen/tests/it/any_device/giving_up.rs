//! A block transfer that one side gives up, after each frame of it (CiA 301, 7.2.4.3.17): the other side stops, the old value stays,
//! and the next transfer is as any other.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::od::DataType;
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{AbortCode, Mux, Node, NodeId, NodeProfile};

use crate::any_device::device::{Boxed, Numbers, answer, download, node_of, rw, table, talk, upload};

const VALUE: Mux = Mux::new(0x2009, 0);
const ABORT: &str = "604#8009200000000008";
/// Three blocks of five segments.
const BYTES: usize = 100;

/// 2009h: a hundred bytes of a domain, in blocks of five segments; 2007h: UNSIGNED32 with the value 7.
fn device() -> (Node<Boxed>, Vec<u8>) {
    let rows =
        vec![rw(0x2007, 0, DataType::Unsigned32).default(7), rw(0x2009, 0, DataType::Domain).capacity(BYTES as u32)];
    let mut node = node_of(NodeProfile { sdo_block_size: 5, ..NodeProfile::cia_301(table(rows)) });
    let old = Numbers(3).bytes(BYTES);
    download(&mut node, VALUE, &old, true).unwrap();
    (node, old)
}

/// Both ends, and the frames between them, one at a time.
struct Exchange {
    client: Client,
    node: Node<Boxed>,
    buffer: Vec<u8>,
    result: Option<Result<Outcome, Failure>>,
}

impl Exchange {
    fn begun(begin: impl Fn(&mut Client, &[u8])) -> (Self, Vec<u8>) {
        let (node, old) = device();
        let mut client = Client::new(NodeId::new(4).unwrap(), Duration::from_millis(50));
        let buffer = Numbers(4).bytes(BYTES);
        begin(&mut client, &buffer);
        (Self { client, node, buffer, result: None }, old)
    }

    /// The next frame, taken by the other side; `None` where neither has one left.
    fn step(&mut self) -> Option<Frame> {
        if let Some(request) = self.client.poll_transmit(&self.buffer) {
            self.node.handle_frame(&request, Instant::ZERO);
            return Some(request);
        }
        let reply = self.node.poll_transmit()?;
        self.node.handle_transmitted(&reply, Instant::ZERO);
        self.result = self.result.take().or(self.client.handle_frame(&reply, &mut self.buffer, Instant::ZERO));
        Some(reply)
    }
}

/// Gives up after each number of frames, and says after how many the transfer was over.
fn client_gives_up_after_each_frame(begin: fn(&mut Client, &[u8])) -> usize {
    for frames in 0.. {
        let (mut exchange, old) = Exchange::begun(begin);
        // The end of a download, with five bytes of the last segment unused, makes its value that of the object; nothing before does.
        let mut has_ended = false;
        for _ in 0..frames {
            let frame = exchange.step().expect("a frame of the transfer");
            has_ended |= frame.to_string().starts_with("604#D5");
        }
        if !exchange.client.is_busy() {
            assert!(matches!(exchange.result, Some(Ok(_))), "{:?}", exchange.result);
            return frames;
        }
        exchange.client.abort(AbortCode::GENERAL);
        assert!(!exchange.client.is_busy());
        let sent: Vec<_> = std::iter::from_fn(|| exchange.step()).map(|frame| frame.to_string()).collect();
        // Replies that were under way mean nothing to the client any more. What it has still sent is the abort alone.
        let of_client: Vec<_> = sent.iter().filter(|frame| frame.starts_with("604")).collect();
        assert_eq!(of_client, [ABORT], "after {frames} frames");
        assert_eq!(exchange.result, None, "after {frames} frames");
        let expected = if has_ended { Numbers(4).bytes(BYTES) } else { old };
        assert_eq!(upload(&mut exchange.node, VALUE).unwrap(), expected, "after {frames} frames");
        // The same client goes on with another object.
        exchange.client.upload(Mux::new(0x2007, 0), Instant::ZERO);
        while exchange.result.is_none() {
            exchange.step().expect("the server answers");
        }
        assert_eq!(exchange.result, Some(Ok(Outcome::Uploaded { mux: Mux::new(0x2007, 0), length: 4 })));
        assert_eq!(exchange.buffer[..4], [7, 0, 0, 0]);
    }
    unreachable!("a transfer has an end")
}

#[test]
fn the_client_may_give_up_a_download_in_blocks_after_each_frame() {
    let frames = client_gives_up_after_each_frame(|client, data| client.download_blocks(VALUE, data, Instant::ZERO));
    // Two to begin, 15 segments, three confirmations, two to end.
    assert_eq!(frames, 2 + 15 + 3 + 2);
}

#[test]
fn the_client_may_give_up_an_upload_in_blocks_after_each_frame() {
    let frames = client_gives_up_after_each_frame(|client, _| client.upload_blocks(VALUE, 0, Instant::ZERO));
    // Two to begin and one to start, 15 segments in one block of 127, its confirmation, the server's end. What the client
    // sends behind that ends the transfer at the server; the value has been checked.
    assert_eq!(frames, 3 + 15 + 1 + 1);
}

#[test]
fn an_upload_ends_at_the_server_at_each_point_where_the_client_may_end_it() {
    // All that a client sends in an upload of 100 bytes in blocks of ten segments; and how many segments come for it.
    let all = [
        ("604#A40920000A000000", 1),
        ("604#A300000000000000", 10),
        ("604#A20A0A0000000000", 5),
        ("604#A2050A0000000000", 1),
        ("604#A100000000000000", 0),
    ];
    for stop in 1..=all.len() {
        // An abort; an abort without the multiplexor, as some clients send it; another request in the place of what comes next.
        for stopper in [ABORT, "604#8000000000000008", "604#4007200000000000"] {
            let (mut node, old) = device();
            for (request, answers) in &all[..stop] {
                assert_eq!(answer(&mut node, request).len(), *answers, "{request}");
            }
            let answers = answer(&mut node, stopper);
            let expected = if stopper.starts_with("604#40") { &["584#4307200007000000"][..] } else { &[] };
            assert_eq!(answers, expected, "{stopper} after {stop} requests");
            talk(&mut node, &[("604#4007200000000000", "584#4307200007000000")]);
            assert_eq!(upload(&mut node, VALUE).unwrap(), old);
        }
    }
}

#[test]
fn segments_that_wait_to_be_sent_are_dropped_by_an_abort() {
    for taken in 0..5 {
        let (mut node, _) = device();
        talk(&mut node, &[("604#A40920000A000000", "584#C609200064000000")]);
        node.handle_frame(&"604#A300000000000000".parse().unwrap(), Instant::ZERO);
        for _ in 0..taken {
            assert!(node.poll_transmit().is_some());
        }
        node.handle_frame(&ABORT.parse().unwrap(), Instant::ZERO);
        assert_eq!(node.poll_transmit(), None, "after {taken} segments");
    }
}

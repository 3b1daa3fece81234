//! Block transfer over a wire that loses, delays and repeats frames: it ends with the right bytes or with an abort, never with
//! other bytes and success.

use std::collections::VecDeque;
use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::od::DataType;
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{Mux, Node, NodeId};

use crate::any_device::device::{Boxed, Numbers, drain, node, rw};

const OBJECT: Mux = Mux::new(0x2009, 0);
const CAPACITY: u32 = 4000;

/// A frame of 130 bits at 1 Mbit/s.
pub(super) const FRAME_NS: u64 = 130_000;

/// In thousandths: frames that are lost, and frames that come twice; and the longest delay on the way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wire {
    pub(super) lost: usize,
    pub(super) repeated: usize,
    pub(super) delay_ns: u64,
}

/// One direction of a wire. CAN keeps the order of the frames of one identifier.
#[derive(Default)]
pub(super) struct Line {
    under_way: VecDeque<(Instant, Frame)>,
}

impl Line {
    pub(super) fn send(&mut self, frame: Frame, wire: Wire, numbers: &mut Numbers, now: Instant) {
        let delay_ns = if wire.delay_ns == 0 { 0 } else { numbers.next() % wire.delay_ns };
        let before = self.under_way.back().map_or(Instant::ZERO, |(at, _)| *at);
        let at = now.plus_nanos(FRAME_NS + delay_ns).max(before);
        let copies = match numbers.below(1000) {
            lot if lot < wire.lost => 0,
            lot if lot < wire.lost + wire.repeated => 2,
            _ => 1,
        };
        self.under_way.extend(std::iter::repeat_n((at, frame), copies));
    }

    pub(super) fn next(&self) -> Option<Instant> {
        self.under_way.front().map(|(at, _)| *at)
    }

    pub(super) fn take(&mut self, now: Instant) -> Option<Frame> {
        self.under_way
            .front()
            .is_some_and(|(at, _)| *at <= now)
            .then(|| self.under_way.pop_front())
            .flatten()
            .map(|(_, frame)| frame)
    }
}

/// Lets both talk until the transfer ends for the client. `now` goes on.
fn run(
    client: &mut Client,
    node: &mut Node<Boxed>,
    buffer: &mut [u8],
    (wire, numbers): (Wire, &mut Numbers),
    now: &mut Instant,
) -> Result<Outcome, Failure> {
    let (mut requests, mut replies) = (Line::default(), Line::default());
    loop {
        // One frame at a time, the server's first: it has the smaller identifier.
        if let Some(frame) = node.poll_transmit() {
            replies.send(frame, wire, numbers, *now);
        } else if let Some(frame) = client.poll_transmit(buffer) {
            requests.send(frame, wire, numbers, *now);
        }
        let free = now.plus_nanos(FRAME_NS);
        let due = [requests.next(), replies.next(), client.poll_timeout(), node.poll_timeout(), Some(free)];
        *now = due.into_iter().flatten().min().unwrap().max(*now);
        while let Some(frame) = requests.take(*now) {
            node.handle_frame(&frame, *now);
        }
        while let Some(frame) = replies.take(*now) {
            if let Some(result) = client.handle_frame(&frame, buffer, *now) {
                return result;
            }
        }
        node.handle_timeout(*now);
        while node.poll_event().is_some() {}
        if let Some(failure) = client.handle_timeout(*now) {
            return Err(failure);
        }
    }
}

/// How many of the transfers came through. The object has the old or the new value after each download.
fn came_through(wire: Wire, transfers: usize) -> usize {
    let mut node = node(vec![rw(OBJECT.index, 0, DataType::Domain).capacity(CAPACITY)]);
    let slot = node.table().find(OBJECT).unwrap();
    let (mut numbers, mut now, mut done) = (Numbers(0x5EED), Instant::ZERO, 0);
    let mut client = Client::new(NodeId::new(4).unwrap(), Duration::from_millis(400));
    for transfer in 0..transfers {
        let size = numbers.below(CAPACITY as usize + 1);
        let data = numbers.bytes(size);
        let before = node.dictionary().view().long_bytes(slot).to_vec();
        if transfer % 2 == 0 {
            client.download_blocks(OBJECT, &data, now);
            let result = run(&mut client, &mut node, &mut data.clone(), (wire, &mut numbers), &mut now);
            let stored = node.dictionary().view().long_bytes(slot);
            assert!(
                stored == data || (result.is_err() && stored == before),
                "{wire:?}, transfer {transfer}: {result:?}"
            );
            done += usize::from(result.is_ok());
        } else {
            node.dictionary_mut().set_bytes(slot, &data).unwrap();
            let mut buffer = vec![0xEE; CAPACITY as usize];
            client.upload_blocks(OBJECT, 0, now);
            if let Ok(outcome) = run(&mut client, &mut node, &mut buffer, (wire, &mut numbers), &mut now) {
                assert_eq!(outcome, Outcome::Uploaded { mux: OBJECT, length: size }, "{wire:?}, transfer {transfer}");
                assert_eq!(buffer[..size], data, "{wire:?}, transfer {transfer}");
                done += 1;
            }
        }
        // What is left of it goes out on a good wire, and is over after its time.
        now += Duration::from_secs(4);
        while let Some(frame) = client.poll_transmit(&[]) {
            node.handle_frame(&frame, now);
        }
        for _ in 0..2 {
            node.handle_timeout(now);
            now += Duration::from_secs(2);
        }
        drain(&mut node);
    }
    done
}

#[test]
fn over_a_good_wire_every_transfer_comes_through_whatever_the_delay() {
    for delay_ns in [0, 1_000_000, 20_000_000] {
        assert_eq!(came_through(Wire { lost: 0, repeated: 0, delay_ns }, 40), 40);
    }
}

#[test]
fn lost_segments_come_again() {
    // One frame in a hundred is lost, and 4000 bytes are 572 segments: in segmented transfer next to none would come through.
    let done = came_through(Wire { lost: 10, repeated: 0, delay_ns: 0 }, 400);
    assert!(done > 320, "{done} of 400");
}

#[test]
fn repeated_frames_do_not_matter() {
    let done = came_through(Wire { lost: 0, repeated: 30, delay_ns: 0 }, 400);
    assert!(done > 360, "{done} of 400");
}

#[test]
fn whatever_happens_to_frames_there_are_the_right_bytes_or_an_abort() {
    for lost in [0, 5, 50, 300] {
        for repeated in [0, 10, 200] {
            for delay_ns in [0, 2_000_000, 100_000_000] {
                came_through(Wire { lost, repeated, delay_ns }, 60);
            }
        }
    }
}

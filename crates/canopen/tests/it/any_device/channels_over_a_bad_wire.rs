//! Clients of several servers of one node at a time, over one wire that loses, delays and repeats frames: each transfer ends as if
//! the others were not there.

use std::time::Duration;

use can::{CanId, Instant, Station};
use canopen::od::{DataType, Entry};
use canopen::sdo::Client;
use canopen::sdo::client::Outcome;
use canopen::{Mux, Node};

use crate::any_device::blocks_over_a_bad_wire::{FRAME_NS, Line, Wire};
use crate::any_device::channels::server;
use crate::any_device::device::{Boxed, Numbers, node, rw};

const CLIENTS: usize = 3;
/// Read by all, written by none.
const CONSTANT: Mux = Mux::new(0x2100, 0);
const CAPACITY: usize = 600;

/// A client, the object that it alone writes, and its transfer.
struct Asker {
    client: Client,
    own: Mux,
    /// What its object has, as far as it knows: more than one after a download of which it does not know the end.
    known: Vec<Vec<u8>>,
    buffer: Vec<u8>,
    mux: Option<Mux>,
    writes: bool,
    requests: Line,
    replies: Line,
    done: usize,
    ended: usize,
    /// After a failure it lets the server's time pass.
    pause: Instant,
}

impl Asker {
    fn new(number: usize) -> Self {
        let ids = [(0x604, 0x584), (0x680, 0x690), (0x681, 0x691)][number];
        let client = Client::on(CanId::standard(ids.0), CanId::standard(ids.1), Duration::from_millis(400));
        Self {
            client,
            own: Mux::new(0x2000 + number as u16, 0),
            known: vec![Vec::new()],
            buffer: Vec::new(),
            mux: None,
            writes: false,
            requests: Line::default(),
            replies: Line::default(),
            done: 0,
            ended: 0,
            pause: Instant::ZERO,
        }
    }

    fn begin(&mut self, numbers: &mut Numbers, now: Instant) {
        let kind = numbers.below(5);
        self.writes = kind < 2;
        let mux = if kind == 4 { CONSTANT } else { self.own };
        self.mux = Some(mux);
        let length = numbers.below(CAPACITY + 1);
        self.buffer = if self.writes { numbers.bytes(length) } else { vec![0xEE; CAPACITY] };
        if self.writes {
            self.known.push(self.buffer.clone());
        }
        match kind {
            0 => self.client.download_blocks(mux, &self.buffer, now),
            1 => self.client.download_segmented(mux, &self.buffer, now),
            2 => self.client.upload_blocks(mux, 0, now),
            _ => self.client.upload(mux, now),
        }
    }

    fn end(&mut self, outcome: Option<Outcome>, now: Instant) {
        let mux = self.mux.take().expect("a transfer under way");
        self.ended += 1;
        match outcome {
            Some(Outcome::Uploaded { length, .. }) => {
                let value = &self.buffer[..length];
                if mux == CONSTANT {
                    assert_eq!(value, constant());
                } else {
                    assert!(
                        self.known.iter().any(|known| known == value),
                        "{mux}: {length} bytes that were not written"
                    );
                }
                self.done += 1;
            }
            Some(Outcome::Downloaded { .. }) => {
                self.known.drain(..self.known.len() - 1);
                self.done += 1;
            }
            None => self.pause = now + Duration::from_secs(3),
        }
    }
}

fn constant() -> Vec<u8> {
    (0..CAPACITY).map(|at| (at * 7) as u8).collect()
}

fn device() -> Node<Boxed> {
    let mut rows: Vec<Entry> = [server(0x1201, 0), server(0x1202, 1)].concat();
    let own = (0..CLIENTS as u16).map(|number| rw(0x2000 + number, 0, DataType::Domain).capacity(CAPACITY as u32));
    rows.extend(
        own.chain([rw(CONSTANT.index, 0, DataType::Domain).bytes(constant().leak()).capacity(CAPACITY as u32)]),
    );
    node(rows)
}

/// How many transfers of each client came through, of how many.
fn came_through(wire: Wire, transfers: usize) -> Vec<(usize, usize)> {
    let (mut node, mut numbers, mut now) = (device(), Numbers(0x5EED), Instant::ZERO);
    let mut askers: Vec<Asker> = (0..CLIENTS).map(Asker::new).collect();
    while askers.iter().any(|asker| asker.ended < transfers) {
        for asker in &mut askers {
            if asker.mux.is_none() && asker.pause <= now && asker.ended < transfers {
                asker.begin(&mut numbers, now);
            }
        }
        // One frame at a time. Clients take turns: by identifier alone, three that never rest would leave the last one nothing.
        askers.rotate_left(1);
        if let Some(frame) = node.poll_transmit() {
            let of = |asker: &&mut Asker| [0x584, 0x690, 0x691][asker.own.index as usize - 0x2000] == frame.id().raw();
            askers.iter_mut().find(of).expect("a client's reply").replies.send(frame, wire, &mut numbers, now);
        } else if let Some((asker, frame)) = askers.iter_mut().find_map(|asker| {
            let frame = asker.client.poll_transmit(&asker.buffer)?;
            Some((asker, frame))
        }) {
            asker.requests.send(frame, wire, &mut numbers, now);
        }
        let free = now.plus_nanos(FRAME_NS);
        let lines = askers.iter().flat_map(|asker| [asker.requests.next(), asker.replies.next()]);
        let clients = askers.iter().map(|asker| asker.client.poll_timeout());
        let due = lines.chain(clients).chain([node.poll_timeout(), Some(free)]);
        now = due.flatten().min().unwrap().max(now);
        for asker in &mut askers {
            while let Some(frame) = asker.requests.take(now) {
                node.handle_frame(&frame, now);
            }
            while let Some(frame) = asker.replies.take(now) {
                if let Some(result) = asker.client.handle_frame(&frame, &mut asker.buffer, now) {
                    asker.end(result.ok(), now);
                }
            }
            if asker.client.handle_timeout(now).is_some() {
                asker.end(None, now);
            }
        }
        node.handle_timeout(now);
        while node.poll_event().is_some() {}
    }
    askers.iter().map(|asker| (asker.done, asker.ended)).collect()
}

#[test]
fn over_a_good_wire_every_transfer_of_every_client_comes_through() {
    for delay_ns in [0, 5_000_000] {
        assert_eq!(came_through(Wire { lost: 0, repeated: 0, delay_ns }, 60), [(60, 60); CLIENTS]);
    }
}

#[test]
fn over_a_bad_wire_each_client_reads_what_it_wrote_or_fails() {
    for lost in [0, 5, 50] {
        for repeated in [0, 10, 100] {
            let ends = came_through(Wire { lost, repeated, delay_ns: 2_000_000 }, 40);
            assert!(ends.iter().all(|(done, ended)| (lost + repeated > 20 || *done > 20) && *ended >= 40), "{ends:?}");
        }
    }
}

//! A device of rows that are put together at run time, its values in boxes, and an SDO client for it.

use std::time::Duration;

use can::{Frame, Instant, Station};
use canopen::od::{Access, DataType, Entry, FREE_PLACES, RowFacts, Storage, Table};
use canopen::sdo::Client;
use canopen::sdo::client::{Failure, Outcome};
use canopen::{Mux, Node, NodeEvent, NodeId, NodeProfile};

#[derive(Clone)]
pub(crate) struct Boxed;

impl Storage for Boxed {
    type Cells = Box<[u32]>;
    type Bytes = Box<[u8]>;
    type Pdos<P: Copy> = Box<[P]>;
    type Words = Box<[u64]>;
    type Events<E: Copy> = Box<[E]>;
    type Channels<C: Clone> = Box<[C]>;

    fn cells(count: usize) -> Self::Cells {
        vec![0; count].into()
    }
    fn bytes(count: usize) -> Self::Bytes {
        vec![0; count].into()
    }
    fn pdos<P: Copy>(count: usize, empty: P) -> Self::Pdos<P> {
        vec![empty; count].into()
    }
    fn words(count: usize) -> Self::Words {
        vec![0; count.div_ceil(64)].into()
    }
    fn events<E: Copy>(count: usize, empty: E) -> Self::Events<E> {
        vec![empty; count].into()
    }
    fn channels<C: Clone>(count: usize, empty: C) -> Self::Channels<C> {
        vec![empty; count].into()
    }
}

pub(crate) fn rw(index: u16, sub_index: u8, data_type: DataType) -> Entry {
    Entry::new(index, sub_index, data_type, Access::ReadWrite, "row", "")
}

pub(crate) fn table(mut rows: Vec<Entry>) -> &'static Table {
    rows.sort_by_key(|row| row.mux().key());
    let rows: &'static [Entry] = rows.leak();
    let (facts, places) = (vec![RowFacts::NONE; rows.len()].leak(), vec![FREE_PLACES; rows.len()].leak());
    Box::leak(Box::new(Table::at_run_time(rows, facts, places).expect("rows that ascend")))
}

/// Node 4 of these rows in pre-operational, as CiA 301 has it; nothing waits.
pub(crate) fn node(rows: Vec<Entry>) -> Node<Boxed> {
    node_of(NodeProfile::cia_301(table(rows)))
}

pub(crate) fn node_of(profile: NodeProfile) -> Node<Boxed> {
    let mut node = Node::new(Box::leak(Box::new(profile)), NodeId::new(4).unwrap());
    node.boot(Instant::ZERO);
    drain(&mut node);
    node
}

/// Frames that it sends, and its events are forgotten.
pub(crate) fn drain(node: &mut Node<Boxed>) -> Vec<Frame> {
    while node.poll_event().is_some() {}
    std::iter::from_fn(|| {
        let frame = node.poll_transmit()?;
        node.handle_transmitted(&frame, Instant::ZERO);
        Some(frame)
    })
    .collect()
}

/// A frame to the node, and what it answers.
pub(crate) fn answer(node: &mut Node<Boxed>, frame: &str) -> Vec<String> {
    node.handle_frame(&frame.parse().unwrap(), Instant::ZERO);
    drain(node).iter().map(ToString::to_string).collect()
}

/// Frames, each with the one answer that it has.
#[track_caller]
pub(crate) fn talk(node: &mut Node<Boxed>, script: &[(&str, &str)]) {
    for (request, expected) in script {
        assert_eq!(answer(node, request), [*expected], "after {request}");
    }
}

pub(crate) fn written(node: &mut Node<Boxed>) -> Vec<NodeEvent> {
    std::iter::from_fn(|| node.poll_event()).collect()
}

fn client() -> Client {
    Client::new(NodeId::new(4).unwrap(), Duration::from_millis(50))
}

fn run(mut client: Client, node: &mut Node<Boxed>, buffer: &mut [u8]) -> Result<Outcome, Failure> {
    loop {
        let request = client.poll_transmit(buffer).expect("the client goes on");
        node.handle_frame(&request, Instant::ZERO);
        let reply = node.poll_transmit().expect("the server answers");
        if let Some(result) = client.handle_frame(&reply, buffer, Instant::ZERO) {
            return result;
        }
    }
}

/// Writes by this crate's own client, in one frame where that is possible, or always in segments.
pub(crate) fn download(node: &mut Node<Boxed>, mux: Mux, data: &[u8], segmented: bool) -> Result<(), Failure> {
    let (mut client, mut data) = (client(), data.to_vec());
    if segmented {
        client.download_segmented(mux, &data, Instant::ZERO);
    } else {
        client.download(mux, &data, Instant::ZERO);
    }
    run(client, node, &mut data).map(|_| ())
}

pub(crate) fn upload(node: &mut Node<Boxed>, mux: Mux) -> Result<Vec<u8>, Failure> {
    let (mut client, mut buffer) = (client(), vec![0; 4096]);
    client.upload(mux, Instant::ZERO);
    match run(client, node, &mut buffer)? {
        Outcome::Uploaded { length, .. } => Ok(buffer[..length].to_vec()),
        other => panic!("{other:?} is not an upload"),
    }
}

/// Numbers that are the same each time (xorshift64, Marsaglia 2003).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() >> 8) as usize % end
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| (self.next() >> 32) as u8).collect()
    }
}

//! Wrong nodes that were drawn: what an SDO server does is changed by chance, from a seed, without a look at what the cases ask.

use std::cell::Cell;
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::Poll;
use std::time::Duration;

use can::{Bitrate, Tap};
use canopen::od::{Access, Entry};
use conform::{Capture, Outcome, Subject, Suite};
use devices::Description;
use master::Network;
use sim::{Prng, World, block_on_for};

use super::station::{Wrong, abort, confirm, index, is_abort};
use super::{Kind, without_drives};
use crate::bench::{LIMIT, drive, node};
use crate::complete::complete;

/// The seed, and how many nodes are drawn from it.
const SEED: u64 = 301;
const NODES: usize = 60;

/// What is changed, at one object of the dictionary.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    object: (u16, u8),
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    /// Reads are aborted with this code.
    ReadAborted(u32),
    /// Writes are aborted with this code.
    WriteAborted(u32),
    /// Writes are confirmed, and not made.
    WriteForgotten,
    /// Requests are not answered.
    Lost,
    /// A bit of the command and object in the answer is another.
    Turned(u8),
    /// A bit of the data in the answer to a read is another.
    Other(u8),
    /// What is aborted is aborted with this code.
    Code(u32),
}

/// Codes of CiA 301, 7.2.4.3.17.
const CODES: [u32; 12] = [
    0x0503_0000,
    0x0504_0001,
    0x0504_0005,
    0x0601_0000,
    0x0601_0001,
    0x0601_0002,
    0x0602_0000,
    0x0604_0041,
    0x0606_0000,
    0x0607_0010,
    0x0609_0011,
    0x0609_0030,
];

impl Change {
    /// Draws an object of the dictionary and what is done to it, until that is wrong by the standard whatever the object means.
    fn draw(prng: &mut Prng, rows: &[Entry]) -> Self {
        loop {
            let row = &rows[prng.below(rows.len() as u64) as usize];
            let code = CODES[prng.below(CODES.len() as u64) as usize];
            let bit = prng.below(32) as u8;
            let what = match prng.below(8) {
                0 => What::ReadAborted(code),
                1 => What::WriteAborted(code),
                2 => What::WriteForgotten,
                3 => What::Lost,
                4 => What::Turned(bit),
                5 => What::Other(bit),
                _ => What::Code(code),
            };
            if is_wrong(row, what) {
                return Self { object: (row.index, row.sub_index), what };
            }
        }
    }

    fn is_about(self, data: &[u8; 8]) -> bool {
        (index(data), data[3]) == self.object
    }

    /// What goes out in place of the node's answer: nothing, or an answer.
    pub(crate) fn answer(self, asked: [u8; 8]) -> Option<std::option::IntoIter<[u8; 8]>> {
        let (reads, writes) = (asked[0] == 0x40, asked[0] >> 5 == 1);
        if !self.is_about(&asked) || !(reads || writes) {
            return None;
        }
        let answer = match self.what {
            What::ReadAborted(code) if reads => Some(abort(&asked, code)),
            What::WriteAborted(code) if writes => Some(abort(&asked, code)),
            // A write in one frame; what follows one in segments has no transfer.
            What::WriteForgotten if writes => Some(confirm(&asked)),
            What::Lost => None,
            _ => return None,
        };
        Some(answer.into_iter())
    }

    /// What goes out in place of what the node answers.
    pub(crate) fn alter(self, asked: &[u8; 8], answer: [u8; 8]) -> [u8; 8] {
        if !self.is_about(asked) || !self.is_about(&answer) {
            return answer;
        }
        let mut altered = answer;
        match self.what {
            What::Turned(bit) => altered[usize::from(bit / 8)] ^= 1 << (bit % 8),
            What::Other(bit) if asked[0] == 0x40 && !is_abort(&answer) => {
                altered[4 + usize::from(bit / 8)] ^= 1 << (bit % 8);
            }
            What::Code(code) if is_abort(&answer) => altered = abort(&answer, code),
            _ => {}
        }
        altered
    }
}

/// A device that does this to an object of this access is not right, whatever the object means.
fn is_wrong(row: &Entry, what: What) -> bool {
    let (readable, writable) = (row.access.is_readable(), row.access.is_writable());
    match what {
        What::ReadAborted(_) => readable,
        What::WriteAborted(_) | What::WriteForgotten => writable,
        What::Lost => true,
        // The low bits of the command say nothing in some answers.
        What::Turned(bit) => bit >= 5,
        // What can be read only may have any value, a constant has its own, and what is written is read back.
        What::Other(bit) => {
            let known = row.access == Access::Const || readable && writable;
            known && usize::from(bit) < 8 * row.data_type.size().clamp(1, 4)
        }
        What::Code(code) => !writable && !matches!(code, 0x0601_0000 | 0x0601_0002),
    }
}

/// The first case that a node fails; nothing more is asked then.
fn noticed_by(description: &'static Description, change: Change) -> Option<&'static str> {
    let (network, capture) = (Network::new(), Capture::new());
    let mut world = World::new(Bitrate::K500, 1);
    let right = drive(description);
    world.add_station(Wrong::new(right, Kind::Drawn(change)));
    world.add_station(Tap::new(network.clone(), capture.clone()));
    world.run_for(Duration::from_secs(2));
    let suite = Suite::new(network, capture, Subject::of_model(node(), description), without_drives());
    let failed = Cell::new(None);
    let mut run = pin!(suite.run(|at| {
        if let Some(result) = at.result.filter(|result| result.result == Outcome::Fail) {
            failed.set(failed.get().or(Some(result.id)));
        }
    }));
    let ended = poll_fn(|context| match (run.as_mut().poll(context), failed.get()) {
        (_, Some(id)) => Poll::Ready(Some(id)),
        (Poll::Ready(report), None) => Poll::Ready(match report {
            Ok(report) => (!report.ok).then_some("what is put back"),
            Err(_) => Some("the answer to the first request"),
        }),
        (Poll::Pending, None) => Poll::Pending,
    });
    block_on_for(&mut world, LIMIT, ended).unwrap()
}

/// How many of the drawn nodes a run notices, as the page has it.
#[test]
fn fewer_than_one_in_twenty_nodes_that_are_wrong_by_chance_pass() {
    let mut prng = Prng::new(SEED);
    let rows = complete().dictionary.rows();
    let drawn: Vec<Change> = (0..NODES).map(|_| Change::draw(&mut prng, rows)).collect();
    let unnoticed: Vec<&Change> = drawn.iter().filter(|change| noticed_by(complete(), **change).is_none()).collect();
    assert!(unnoticed.len() * 20 < NODES, "{} of {NODES}: {unnoticed:#X?}", unnoticed.len());
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/conformance.md");
    let page = std::fs::read_to_string(page).unwrap();
    let said = format!("of {NODES} such nodes {} are noticed", NODES - unnoticed.len());
    assert!(page.contains(&said), "docs/conformance.md does not have '{said}': {unnoticed:#X?}");
}

//! The master's core under arbitrary answers, in any order and at any time.

use std::collections::BTreeSet;
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use canopen::nmt::NmtTarget;
use canopen::pdo::{MappingRecord, PdoNumber};
use canopen::{Mux, NmtCommand, NodeId};
use cia402::object::STATUSWORD;
use master::core::{Command, Core, Payload, PdoMap, Request, RpdoTrigger, Ticket, Transfer};

use super::selected_frame::selected_frame;

/// A chunk is an action, how long it waits before, and ten bytes that are a frame or the command's arguments.
pub(super) const SAMPLES: &[&[u8]] = &[
    // Upload 1008h of node 1; an expedited answer; a segmented one of FFFFFFFFh bytes; a segment.
    b"\x02\x00\x01\x08\x10\x00\x20\0\0\0\0\0\x00\x10\0\x08\x43\x08\x10\0\x01\x02\x03\x04",
    b"\x02\x00\x01\x08\x10\x00\x20\0\0\0\0\0\x00\x10\0\x08\x41\x08\x10\0\xFF\xFF\xFF\xFF\x00\x10\0\x08\x00\x01\x02\x03\x04\x05\x06\x07",
    // Download of 20 bytes, its answers, an abort.
    b"\x03\x00\x01\x08\x10\x14\x20\0\0\0\0\0\x00\x10\0\x08\x60\x08\x10\0\0\0\0\0\x00\x10\0\x08\x20\0\0\0\0\0\0\0\x00\x10\0\x08\x80\x08\x10\0\0\0\x02\x06",
    // A heartbeat of its own and a node that is kept fed, for some time and then no more.
    b"\x0A\x00\x01\x01\0\0\x14\0\0\0\0\0\x0B\x00\x00\x01\0\0\x0A\0\0\0\0\0\x08\xC8\0\0\0\0\0\0\0\0\0\0\x08\xC8\0\0\0\0\0\0\0\0\0\0\x0B\x00\x00\0\0\0\0\0\0\0\0\0",
    // A watched heartbeat that comes and stays away, a timer, SYNC, TPDO and RPDO.
    b"\x04\x00\x01\x20\0\0\0\0\0\0\0\0\x00\x10\x03\x01\x05\0\0\0\0\0\0\0\x05\xFF\x01\0\0\0\0\0\0\0\0\0\x06\x10\x08\0\0\0\0\0\0\0\0\0\x00\x10\x05\x08\x37\x02\0\0\0\0\0\0\x07\x10\x0F\0\0\0\0\0\0\0\0\0",
];

const CHUNK: usize = 12;

/// What a selector picks: answers of nodes 1 and 2, boot-up and heartbeat, EMCY, a TPDO, NMT, SYNC.
const IDS: [u16; 8] = [0x581, 0x582, 0x600, 0x701, 0x702, 0x081, 0x181, 0x080];

/// What the core may have queued to send after one call: its outbox, and an SDO frame of each node.
const MOST_QUEUED: usize = 128 + 127 + 16;
/// Events that are kept unread.
const MOST_EVENTS: usize = 256;

/// Whatever frames and commands come, each request and timer ends once, at the latest with time alone; queues are bounded.
pub(super) fn master_core(data: &[u8]) {
    let mut core = Core::new();
    let node = NodeId::MIN;
    let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010), MappingRecord::from_raw(0x6064_0020)]);
    core.image_mut().set_tpdo(node, PdoNumber::FIRST, 0x181, map.clone());
    core.image_mut().set_rpdo(node, PdoNumber::FIRST, 0x201, map, RpdoTrigger::Sync);
    let mut open = BTreeSet::new();
    let mut now = Instant::from_secs(1);
    for chunk in data.chunks(CHUNK) {
        let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
        let wait = Duration::from_micros(100) * u32::from(byte(1));
        // FFh is a late call: it says a time that was before.
        let at = if byte(1) == 0xFF { Instant::from_millis(500) } else { now + wait };
        now = now.max(at);
        match command(&mut core, chunk) {
            None if byte(0) % 12 == 8 => core.handle_timeout(at),
            None if byte(0) % 12 == 7 => {
                core.image_mut().write(node, STATUSWORD, u64::from(byte(2)));
            }
            None => core.handle_frame(&selected_frame(chunk.get(2..).unwrap_or(&[]), &IDS), at),
            Some(command) => {
                open.extend(command_ticket(&command));
                core.execute(command, at);
            }
        }
        settle(&mut core, &mut open, chunk);
    }
    end(&mut core, &mut open, now);
}

/// The command that a chunk asks for, unless it is a frame, time alone, or a value for an RPDO.
fn command(core: &mut Core, chunk: &[u8]) -> Option<Command> {
    let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
    let node = NodeId::new(1 + byte(2) % 2)?;
    let time = Duration::from_millis(u64::from(byte(6)));
    let request = |transfer| {
        let mux = Mux::new(u16::from_le_bytes([byte(3), byte(4)]), 0);
        Request { node, mux, transfer, timeout: time }
    };
    let ticket = core.ticket();
    Some(match byte(0) % 12 {
        1 => Command::Cancel(ticket),
        2 => Command::Request(ticket, request(Transfer::Upload)),
        3 => Command::Request(ticket, request(Transfer::Download(Payload::new(&vec![byte(7); usize::from(byte(5))])))),
        4 => Command::WatchHeartbeat(node, (byte(3) != 0).then(|| Duration::from_millis(u64::from(byte(3))))),
        5 => Command::Timer(ticket, Duration::from_millis(u64::from(byte(3)))),
        6 => Command::Sync((byte(2) != 0).then(|| Duration::from_millis(u64::from(byte(2))))),
        9 => Command::Nmt(NmtTarget::All, NmtCommand::Start),
        10 => Command::Heartbeat(node, (byte(3) != 0).then_some(time), (byte(4) != 0).then_some(3 * time)),
        11 => Command::KeepFed(node, (byte(3) != 0).then_some(time), (byte(4) != 0).then_some(3 * time)),
        _ => return None,
    })
}

fn command_ticket(command: &Command) -> Option<Ticket> {
    match command {
        Command::Request(ticket, _) | Command::Timer(ticket, _) => Some(*ticket),
        _ => None,
    }
}

/// Takes what came of a call, and finds it bounded.
fn settle(core: &mut Core, open: &mut BTreeSet<Ticket>, after: &[u8]) {
    let sent = std::iter::from_fn(|| core.poll_transmit()).take(2 * MOST_QUEUED).count();
    assert!(sent <= MOST_QUEUED, "{sent} frames after {after:02X?}");
    while let Some(finished) = core.poll_finished() {
        let ticket = finished.ticket;
        assert!(open.remove(&ticket), "{ticket:?} ended twice, or was not asked, after {after:02X?}");
    }
    // Half of the time events are not read: then the oldest are dropped.
    if after.last().is_some_and(|last| last & 1 == 0) {
        let events = std::iter::from_fn(|| core.poll_event()).take(2 * MOST_EVENTS).count();
        assert!(events <= MOST_EVENTS, "{events} events after {after:02X?}");
    }
}

/// With time alone everything ends.
fn end(core: &mut Core, open: &mut BTreeSet<Ticket>, mut now: Instant) {
    core.execute(Command::Sync(None), now);
    settle(core, open, &[]);
    for _ in 0..100_000 {
        let Some(due) = core.poll_timeout().filter(|_| !open.is_empty()) else { break };
        now = now.max(due);
        core.handle_timeout(now);
        settle(core, open, &[]);
    }
    assert!(open.is_empty(), "{} requests never end", open.len());
    // A request that timed out may still be answered: an answer without a request is ignored.
    core.handle_frame(&Frame::new(CanId::standard(0x581), &[0x60, 0, 0, 0, 0, 0, 0, 0]), now);
    settle(core, open, &[]);
}

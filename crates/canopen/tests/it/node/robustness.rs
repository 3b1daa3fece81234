//! Whatever arrives: no panic, no hang, and values change by valid writes only.

use std::time::Duration;

use can::{CanId, Frame};
use canopen::NodeEvent;
use canopen::od::Slot;

use crate::node::bench::Bench;
use crate::node::device::{LOOSE, STANDARD};

/// xorshift32: a sequence that is the same on every run.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    fn below(&mut self, end: u32) -> u32 {
        self.next() % end
    }
}

fn values(bench: &Bench) -> Vec<u32> {
    bench.node.table().iter().map(|(slot, _)| bench.node.dictionary().raw(slot)).collect()
}

/// What the events say was written, applied to `before`, must be what is there now.
#[track_caller]
fn assert_only_reported_changes(bench: &mut Bench, mut before: Vec<u32>, frame: &Frame) {
    let mut resets = false;
    for event in bench.events() {
        match event {
            NodeEvent::Written { slot, raw, .. } => before[Slot::position(slot)] = raw,
            NodeEvent::ResetNode | NodeEvent::ResetCommunication => resets = true,
            _ => {}
        }
    }
    assert_eq!(values(bench), before, "after {frame}");
    if resets {
        bench.boot();
    }
}

#[test]
fn every_first_byte_and_length_is_survived_in_every_state() {
    for state in ["", "> 000#0104\n < 184#0000", "> 000#0204"] {
        let mut fresh = Bench::new(&STANDARD);
        fresh.talk(state);
        for id in [0x000, 0x080, 0x204, 0x304, 0x604] {
            for first in 0..=255_u8 {
                for length in 0..=8 {
                    let mut bench = fresh.clone();
                    let bytes = [first, 0x17, 0x10, 0x00, 0x10, 0x00, 0x00, 0x00];
                    let frame = Frame::new(CanId::standard(id), &bytes[..length]);
                    let before = values(&bench);
                    bench.send_frame(&frame);
                    assert_only_reported_changes(&mut bench, before, &frame);
                    bench.wait(Duration::from_millis(20));
                }
            }
        }
    }
}

fn random_frame(random: &mut Random, indices: &[(u16, u8)]) -> Frame {
    let length = [8, 8, 8, 2, random.below(9) as usize][random.below(5) as usize];
    let id = match random.below(12) {
        0 => 0x000,
        1 => 0x080,
        2..=7 => 0x604,
        8 => 0x204 + 0x100 * random.below(4) as u16,
        9 => 0x184,
        _ => random.next() as u16,
    };
    let mut bytes = [0; 8];
    bytes.fill_with(|| random.next() as u8);
    let (index, sub_index) = indices[random.below(indices.len() as u32) as usize];
    if id == 0x604 {
        let specifiers = [0x40, 0x23, 0x2B, 0x2F, 0x22, 0x21, 0x20, 0x00, 0x01, 0x0B, 0x10, 0x1D, 0x60, 0x70, 0x80];
        bytes[0] = specifiers.get(random.below(17) as usize).copied().unwrap_or(bytes[0]);
        bytes[1..3].copy_from_slice(&index.to_le_bytes());
        bytes[3] = sub_index;
        if random.below(2) == 0 {
            bytes[4..].copy_from_slice(&random.below(300).to_le_bytes());
        }
    } else if id == 0 {
        bytes[0] = [0x01, 0x02, 0x80, 0x81, 0x82][random.below(5) as usize];
        bytes[1] = [0, 4, 5, bytes[1]][random.below(4) as usize];
    }
    match random.below(20) {
        0 => Frame::remote(CanId::standard(id), length as u8),
        1 => Frame::new(CanId::extended(u32::from(id)), &bytes[..length]),
        _ => Frame::new(CanId::standard(id), &bytes[..length]),
    }
}

#[test]
fn random_conversations_are_survived_and_change_only_what_is_reported() {
    for (seed, profile) in [(1, &STANDARD), (2, &LOOSE), (3, &STANDARD), (4, &LOOSE)] {
        let mut random = Random(0x9E37_79B9 ^ seed);
        let mut bench = Bench::new(profile);
        let mut indices: Vec<_> = bench.node.table().rows().iter().map(|row| (row.index, row.sub_index)).collect();
        indices.extend([(0x1003, 0), (0x1018, 9), (0x1600, 5), (0xFFFF, 0xFF)]);
        for _ in 0..20_000 {
            let frame = random_frame(&mut random, &indices);
            let before = values(&bench);
            bench.send_frame(&frame);
            assert_only_reported_changes(&mut bench, before, &frame);
            if random.below(4) == 0 {
                bench.wait(Duration::from_micros(u64::from(random.below(3_000))));
            }
            // Whatever happened, there is never more than one frame of each service for one frame received.
            assert!(bench.sent.len() < 200, "seed {seed}: {:?}", bench.sent);
            bench.sent.clear();
        }
        bench.wait(Duration::from_secs(2));
        bench.sent.clear();
        bench.talk("> 000#8004\n > 604#4000100000000000\n < 584#4300100092010400");
    }
}

#[test]
fn remote_frames_but_for_tpdos_and_extended_frames_do_nothing_at_all() {
    let mut bench = Bench::operational();
    for id in (0..=0x7FF).filter(|id| *id != 0x184) {
        for length in 0..=8 {
            bench.send_frame(&Frame::remote(CanId::standard(id), length));
            bench.send_frame(&Frame::new(CanId::extended(u32::from(id)), &[1; 8][..usize::from(length)]));
        }
    }
    assert_eq!(bench.events(), []);
    bench.talk("silence 1000ms");
}

#[test]
fn spurious_calls_do_nothing() {
    let mut bench = Bench::operational();
    for ms in 0..100 {
        bench.now = can::Instant::from_millis(ms);
        bench.wait(Duration::ZERO);
    }
    assert!(bench.sent.is_empty());
    assert_eq!(bench.events(), []);
}

#[test]
fn an_owner_that_never_polls_loses_the_oldest_events_but_not_a_reset() {
    let mut bench = Bench::operational();
    for _ in 0..100 {
        bench.send("204#0F00");
    }
    bench.send("000#8104");
    assert_eq!(bench.events(), [NodeEvent::ResetNode]);
}

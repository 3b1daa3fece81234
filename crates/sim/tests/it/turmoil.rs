//! Random goings-on: whatever is done to a world, the laws of the wire hold and no frame is lost or doubled.

use std::time::Duration;

use crate::common::frames;
use can::{Bitrate, CanId, Frame, INTERFRAME_SPACE_BITS, Instant, frame_bits};
use sim::fault::{Babble, Corruption, Delay, NodeFaults};
use sim::{Prng, StationId, World};

const PROBES: usize = 6;
const BIT_NS: u64 = 2_000;

/// Frames carry their sender and a running number.
fn numbered(probe: usize, number: u64, prng: &mut Prng) -> Frame {
    let id = CanId::standard((0x100 * (1 + prng.below(6)) + probe as u64) as u16);
    let mut data = number.to_be_bytes();
    data[0] = probe as u8;
    Frame::full(id, data)
}

fn disturb_something(world: &mut World, probes: &[StationId], prng: &mut Prng) {
    let probe = probes[prng.below(probes.len() as u64) as usize];
    match prng.below(7) {
        0 => world.cut(probe),
        1 | 2 => probes.iter().for_each(|probe| world.join(*probe)),
        3 => world.set_corruption(Corruption::with_probability(prng.below(4) as f64 * 0.1)),
        4 => {
            let late = Some(Delay { min_ns: 0, max_ns: prng.below(3_000_000) });
            world.set_node_faults(probe, NodeFaults { late, ..NodeFaults::default() });
        }
        5 => {
            let babble = Some(Babble { frame: Frame::new(CanId::standard(0x7FF), &[]), gap_ns: prng.below(500_000) });
            world.set_node_faults(probe, NodeFaults { babble, ..NodeFaults::default() });
        }
        _ => world.set_node_faults(probe, NodeFaults { silent: prng.below(2) == 0, ..NodeFaults::default() }),
    }
}

fn laws_of_the_wire_hold(world: &World, seed: u64) {
    let seen = frames(world);
    for (start, end, text) in &seen {
        let bits = u64::from(frame_bits(&text.parse().unwrap()));
        assert_eq!(end - start, bits * BIT_NS, "seed {seed}: {text} at {start}");
    }
    for pair in seen.windows(2) {
        let gap = u64::from(INTERFRAME_SPACE_BITS) * BIT_NS;
        assert!(pair[1].0 >= pair[0].1 + gap, "seed {seed}: {pair:?}");
    }
}

#[test]
fn in_any_turmoil_each_frame_gets_through_once() {
    for seed in 0..60 {
        let mut prng = Prng::new(seed);
        let mut world = World::new(Bitrate::K500, seed);
        world.log_mut().set_limit(usize::MAX);
        let probes: Vec<StationId> = (0..PROBES).map(|_| world.add_probe()).collect();
        let mut sent = Vec::new();
        for number in 0..300 {
            let probe = prng.below(PROBES as u64) as usize;
            let frame = numbered(probe, number, &mut prng);
            world.send(probes[probe], frame).unwrap();
            sent.push(frame.to_string());
            if prng.below(10) == 0 {
                disturb_something(&mut world, &probes, &mut prng);
            }
            world.run_for(Duration::from_nanos(prng.below(600_000)));
        }
        world.set_corruption(Corruption::none());
        for probe in &probes {
            world.join(*probe);
            world.set_node_faults(*probe, NodeFaults::default());
        }
        world.run_for(Duration::from_secs(2));
        laws_of_the_wire_hold(&world, seed);
        let mut got: Vec<String> = crate::common::texts(&world).into_iter().filter(|text| text != "7FF#").collect();
        got.sort();
        sent.sort();
        assert_eq!(got, sent, "seed {seed}");
    }
}

#[test]
fn a_world_resumed_in_the_middle_of_a_frame_ends_the_same() {
    for seed in 0..20 {
        let mut prng = Prng::new(seed);
        let mut world = World::new(Bitrate::K500, seed);
        let probes: Vec<StationId> = (0..PROBES).map(|_| world.add_probe()).collect();
        world.set_corruption(Corruption::with_probability(0.2));
        world.run_until(Instant::from_millis(1));
        for number in 0..50 {
            let probe = prng.below(PROBES as u64) as usize;
            world.send(probes[probe], numbered(probe, number, &mut prng)).unwrap();
        }
        world.run_for(Duration::from_micros(prng.below(5_000)));
        let mut resumed = world.snapshot();
        world.run_for(Duration::from_millis(50));
        resumed.run_for(Duration::from_millis(50));
        assert_eq!(world.digest(), resumed.digest(), "seed {seed}");
    }
}

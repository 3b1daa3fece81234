//! More than one drive, a disturbed wire, a wrong bit rate, a cut cable.

use std::time::Duration;

use can::{Bitrate, Frame};
use ferrodrive_tests::zlac8030l::objects;
use sim::fault::Corruption;
use sim::machine::zlac8030l;
use sim::{StationId, VirtualDrive, World};

use crate::bench::{Bench, NODE, RATE_500K, assert_within};

/// Value of 200Eh for 250 kbit/s.
const RATE_250K: u16 = 2;

struct Pair {
    world: World,
    host: StationId,
}

impl Pair {
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 3);
        let host = world.add_probe();
        for node in [2, 5] {
            world.add_drive(node, Box::new(zlac8030l(node, RATE_500K))).expect("another drive");
        }
        world.run_for(Duration::from_millis(10));
        Self { world, host }
    }

    /// Sends frames, 5 ms apart, and returns what was heard meanwhile.
    fn talk(&mut self, frames: &[&str]) -> Vec<String> {
        for frame in frames {
            self.world.send(self.host, frame.parse().expect("a frame")).expect("room");
            self.world.run_for(Duration::from_millis(5));
        }
        self.heard().iter().map(ToString::to_string).collect()
    }

    fn heard(&mut self) -> Vec<Frame> {
        std::iter::from_fn(|| self.world.poll_received(self.host)).map(|(_, frame)| frame).collect()
    }

    fn rpm(&mut self, node: u8) -> f64 {
        self.world.report(node).expect("the drive is there").velocity_rpm
    }
}

#[test]
fn two_drives_boot_as_their_nodes_and_each_obeys_its_own_frames() {
    let mut pair = Pair::new();
    assert_eq!(pair.talk(&[]), ["702#00", "705#00"]);
    let heard = pair.talk(&["602#2B00200000000000", "602#2F60600003000000", "602#23FF60003C000000"]);
    assert_eq!(heard, ["582#6000200000000000", "582#6060600000000000", "582#60FF600000000000"]);
    pair.talk(&["602#2B40600006000000", "602#2B40600007000000", "602#2B4060000F000000"]);
    pair.world.run_for(Duration::from_millis(900));
    assert_within("node 2", pair.rpm(2), 59.0, 61.0);
    assert_eq!(pair.rpm(5), 0.0);
    assert_eq!(pair.talk(&["605#40FF600000000000"]), ["585#43FF600000000000"]);
}

#[test]
fn one_sync_starts_both_drives_at_the_same_instant() {
    let mut pair = Pair::new();
    for node in [2, 5] {
        let setup = [
            "2B00200000000000",
            "2F60600003000000",
            "2F01140201000000",
            "2F01160000000000",
            "230116012000FF60",
            "2F01160001000000",
            "2B40600006000000",
            "2B40600007000000",
            "2B4060000F000000",
        ];
        let frames: Vec<_> = setup.iter().map(|data| format!("60{node}#{data}")).collect();
        pair.talk(&frames.iter().map(String::as_str).collect::<Vec<_>>());
    }
    pair.talk(&["000#0100", "302#3C000000"]);
    pair.world.run_for(Duration::from_millis(200));
    pair.talk(&["305#3C000000"]);
    pair.world.run_for(Duration::from_millis(200));
    assert_eq!((pair.rpm(2), pair.rpm(5)), (0.0, 0.0), "they wait for SYNC");
    pair.talk(&["080#"]);
    for _ in 0..50 {
        pair.world.run_for(Duration::from_millis(10));
        assert_eq!(pair.rpm(2), pair.rpm(5));
    }
    assert_within("speed", pair.rpm(2), 55.0, 61.0);
}

#[test]
fn noise_costs_time_and_never_changes_a_value() {
    let mut bench = Bench::new();
    bench.set(0x2010, 1);
    let rows: Vec<_> = objects().into_iter().filter(|row| row.index >= 0x2000 && !row.live).collect();
    let values = |bench: &mut Bench| -> Vec<i64> { rows.iter().map(|row| bench.get((row.index, row.sub))).collect() };
    let mut expected = values(&mut bench);
    bench.world.set_corruption(Corruption::with_probability(0.05));
    for round in 0..10 {
        for (row, value) in rows.iter().zip(&mut expected) {
            if (0x2018..=0x2021).contains(&row.index) {
                *value = round * 1111 + 7;
                bench.set((row.index, row.sub), *value);
            }
        }
        assert_eq!(values(&mut bench), expected, "round {round}");
    }
    let errors = bench.world.statistics().errors;
    assert!(errors > 50, "the noise struck {errors} times");
}

#[test]
fn an_rpdo_arrives_once_or_later_but_never_twice_or_damaged_under_noise() {
    let mut bench = Bench::new();
    for (sub, value) in [(0, 0), (1, 0x60FF_0020), (0, 1)] {
        bench.set((0x1601, sub), value);
    }
    bench.send("000#0104");
    bench.world.set_corruption(Corruption::with_probability(0.05));
    for target in 1..=200_i32 {
        let data = target.to_le_bytes().map(|byte| format!("{byte:02X}")).concat();
        bench.send(&format!("304#{data}")).run_ms(2).reads(0x60FF, i64::from(target));
    }
}

#[test]
fn a_new_bit_rate_acts_after_a_restart_and_then_only_its_own_bus_hears_the_drive() {
    let mut bench = Bench::new();
    bench.set(0x200E, i64::from(RATE_250K));
    assert_eq!(bench.get(0x200E), i64::from(RATE_250K), "until the restart it talks at the old rate");
    bench.let_store();
    bench.forget().power_cycle().run_ms(500);
    assert_eq!(bench.heard(), [""; 0], "no boot-up on the old bus");
    assert_eq!(bench.sdo(&[0x40, 0, 0x10, 0, 0, 0, 0, 0]), None);

    let memory = bench.operate(|drive, _| drive.nvm_image());
    let mut machine = zlac8030l(NODE, RATE_500K);
    machine.load_nvm(&memory).expect("its own memory");
    let mut world = World::new(Bitrate::K250, 1);
    let host = world.add_probe();
    world.add_drive(NODE, Box::new(machine)).expect("the first drive");
    world.run_for(Duration::from_millis(20));
    assert_eq!(world.poll_received(host).map(|(_, frame)| frame.to_string()).as_deref(), Some("704#00"));
}

#[test]
fn every_bit_rate_of_200eh_is_the_one_that_the_manual_lists() {
    let listed = [(0, 1_000_000), (1, 500_000), (2, 250_000), (3, 125_000), (4, 100_000)];
    for (value, bit_s) in listed {
        let bitrate = Bitrate::new(bit_s).expect("a bit rate");
        let mut world = World::new(bitrate, 1);
        let host = world.add_probe();
        world.add_drive(NODE, Box::new(zlac8030l(NODE, value))).expect("the first drive");
        world.run_for(Duration::from_millis(20));
        assert!(world.poll_received(host).is_some(), "200Eh = {value} at {bit_s} bit/s");
    }
}

#[test]
fn a_new_node_id_acts_after_a_restart_and_moves_every_identifier_with_it() {
    let mut bench = Bench::new();
    bench.set(0x200D, 0x15);
    assert_eq!(bench.get(0x200D), 0x15, "until the restart it is the old node");
    bench.let_store();
    bench.forget().power_cycle().hears(&["715#00"]);
    bench.node = 0x15;
    let moved = [(0x1200, 1, 0x615), (0x1200, 2, 0x595), (0x1014, 0, 0x95), (0x1400, 1, 0x215), (0x1803, 1, 0x495)];
    for (index, sub, identifier) in moved {
        assert_eq!(bench.get((index, sub)), identifier, "{index:04X}h:{sub:02X}");
    }
}

#[test]
fn the_dip_switch_goes_before_200dh() {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    world.add_drive(3, Box::new(zlac8030l(3, RATE_500K))).expect("the first drive");
    world.run_for(Duration::from_millis(10));
    let frames = ["603#400D200000000000", "603#2B0D200009000000"].map(|frame| frame.parse().expect("a frame"));
    for frame in frames {
        world.send(host, frame).expect("room");
        world.run_for(Duration::from_millis(10));
    }
    world.cut_power(3).expect("the drive");
    world.set_power(3, true).expect("the drive");
    world.run_for(Duration::from_millis(10));
    let heard: Vec<_> = std::iter::from_fn(|| world.poll_received(host)).map(|(_, frame)| frame.to_string()).collect();
    assert_eq!(heard, ["703#00", "583#4B0D200004000000", "583#600D200000000000", "703#00"]);
}

#[test]
fn a_cable_cut_in_motion_stops_the_motor_by_the_watch_over_the_host() {
    let mut bench = Bench::new();
    bench.set(0x6060, 3).set(0x6084, 300).enable().set(0x60FF, 60);
    for _ in 0..20 {
        bench.run_ms(100);
        bench.statusword();
    }
    bench.turns_at(59.0, 61.0);
    let drive = bench.world.drive_id(NODE).expect("the drive");
    bench.world.cut(drive);
    bench.run_ms(990);
    assert_within("speed after 990 ms", bench.report().velocity_rpm, 59.0, 61.0);
    bench.run_ms(500);
    assert_within("speed after 1490 ms", bench.report().velocity_rpm, -0.5, 0.5);
    bench.world.join(drive);
    bench.run_ms(50).shows(0xFF, 0x37).reads(0x603F, 0).reads(0x60FF, 0);
    bench.set(0x60FF, 60).run_ms(700);
    assert_within("speed with a new target", bench.report().velocity_rpm, 59.0, 61.0);
}

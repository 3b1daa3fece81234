//! More than one drive, a disturbed wire, a wrong bit rate, a cut cable.

use std::time::Duration;

use can::Bitrate;
use ferrodrive_tests::bench::boot_up_of;
use ferrodrive_tests::zlac8030l::objects;
use sim::VirtualDrive;
use sim::fault::Corruption;
use sim::machine::zlac8030l;

use crate::virtual_zlac8030l::bench::{Bench, NODE, RATE_500K, assert_within};

/// Value of 200Eh for 250 kbit/s.
const RATE_250K: u16 = 2;

/// Nodes 4 and 5.
fn two() -> Bench {
    let drive = |node| -> Box<dyn VirtualDrive> { Box::new(zlac8030l(node, RATE_500K)) };
    Bench::with(vec![drive(4), drive(5)])
}

fn rpm(bench: &mut Bench, node: u8) -> f64 {
    bench.world.report(node).expect("the drive is there").velocity_rpm
}

#[test]
fn two_drives_boot_as_their_nodes_obey_their_own_frames_and_start_by_one_sync_at_the_same_instant() {
    let mut bench = two();
    bench.hears(&["704#00", "705#00"]);
    for node in [4, 5] {
        bench.node = node;
        bench.set((0x1401, 2), 1).map(0x1601, &[0x60FF_0020]).enable_in(3);
    }
    bench.send("000#0100").send("304#3C000000").run_ms(200).send("305#3C000000").run_ms(200);
    assert_eq!((rpm(&mut bench, 4), rpm(&mut bench, 5)), (0.0, 0.0), "they wait for SYNC");
    bench.send("080#");
    for _ in 0..50 {
        bench.run_ms(10);
        assert_eq!(rpm(&mut bench, 4), rpm(&mut bench, 5));
    }
    assert_within("speed", rpm(&mut bench, 4), 55.0, 61.0);
    bench.send("304#46000000").send("080#").reads(0x60FF, 60).node = 4;
    bench.reads(0x60FF, 70);
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
    bench.map(0x1601, &[0x60FF_0020]).send("000#0104");
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
    assert_eq!(boot_up_of(machine, Bitrate::K250).as_deref(), Some("704#00"));
}

#[test]
fn every_bit_rate_of_200eh_is_the_one_that_the_manual_lists() {
    for (value, bit_s) in [(0, 1_000_000), (1, 500_000), (2, 250_000), (3, 125_000), (4, 100_000)] {
        let boot_up = boot_up_of(zlac8030l(NODE, value), Bitrate::new(bit_s).expect("a bit rate"));
        assert_eq!(boot_up.as_deref(), Some("704#00"), "200Eh = {value} at {bit_s} bit/s");
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
    let mut bench = Bench::with(vec![Box::new(zlac8030l(3, RATE_500K))]);
    bench.node = 3;
    bench.hears(&["703#00"]).reads(0x200D, 4).set(0x200D, 9).let_store().forget().power_cycle().hears(&["703#00"]);
}

#[test]
fn a_cable_cut_in_motion_stops_the_motor_by_the_watch_over_the_host_of_1000_ms_as_delivered() {
    let mut bench = Bench::new();
    bench.set(0x6060, 3).enable().set(0x60FF, 60);
    for _ in 0..20 {
        bench.run_ms(100);
        bench.statusword();
    }
    bench.turns_at(59.0, 61.0);
    let drive = bench.world.drive_id(NODE).expect("the drive");
    bench.world.cut(drive);
    bench.run_ms(990);
    assert_within("speed after 990 ms", bench.report().velocity_rpm, 59.0, 61.0);
    let stopped = bench.seconds_until(2.0, Duration::from_millis(1), |report| report.velocity_rpm < 1.0);
    assert_within("seconds to stand, 10 ms and a ramp of 500 ms", stopped, 0.40, 0.55);
    bench.run_ms(100).turns_about(0.0, 0.5);
    bench.world.join(drive);
    bench.run_ms(50).shows(0xFF, 0x37).reads(0x603F, 0).reads(0x60FF, 0);
    bench.set(0x60FF, 60).run_ms(700);
    assert_within("speed with a new target", bench.report().velocity_rpm, 59.0, 61.0);
}

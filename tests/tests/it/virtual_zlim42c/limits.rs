//! Limit switches and the emergency stop outside homing: 200Ah, 2030h, and the filter of the inputs.

use std::time::Duration;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

const LOOK: Duration = Duration::from_micros(500);
const REACHED: u16 = 1 << 10;

/// X0 is the positive limit, X1 the negative one, X2 the emergency stop.
fn with_switches(stop_mode: i64) -> Bench {
    let mut bench = Bench::new();
    for (sub, function) in [(2, 2), (3, 3), (4, 9)] {
        bench.set((0x2030, sub), function);
    }
    bench.set(0x200A, stop_mode).set(0x6084, 300).set(0x6085, 50);
    bench
}

#[test]
fn a_limit_stops_a_velocity_and_a_move_towards_it_as_200ah_says() {
    for (drive_mode, input, stop_mode, expected) in
        [(3, 0, 0, Some(0.3)), (3, 0, 1, Some(0.05)), (3, 0, 2, None), (1, 1, 0, Some(0.3)), (1, 1, 1, Some(0.05))]
    {
        let mut bench = with_switches(stop_mode);
        bench.enable_in(drive_mode);
        _ = if drive_mode == 3 { bench.set(0x60FF, 60) } else { bench.move_by(-100_000) };
        bench.run_ms(500).set_input(input, true);
        let Some(expected) = expected else {
            bench.run_ms(500).reads(0x606C, 60);
            continue;
        };
        let taken = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm == Some(0.0));
        // The filter's 10 ms come first.
        assert_within("seconds", taken - 0.010, expected - 0.002, expected + 0.003);
    }
}

#[test]
fn the_way_out_of_a_limit_is_free_and_the_way_in_is_not() {
    let mut bench = with_switches(0);
    bench.enable_in(3).input(1, true).set(0x60FF, -60).run_ms(300);
    assert_eq!(bench.get(0x6064), 0, "into the negative limit: no step");
    bench.set(0x60FF, 60).run_ms(300).reads(0x606C, 60);
    bench.input(1, false).set(0x60FF, -60).run_ms(700).reads(0x606C, -60);
}

#[test]
fn a_velocity_goes_on_when_the_limit_goes_off_and_a_move_does_not() {
    let mut bench = with_switches(0);
    bench.enable_in(3).set(0x60FF, 60).run_ms(300);
    bench.input(0, true).run_ms(400).reads(0x606C, 0);
    assert_eq!(bench.statusword() & 1 << 14, 0, "it stands");
    bench.input(0, false).run_ms(300).reads(0x606C, 60);
    bench.world("1 switch X0 9000 max").run_ms(3000).reads(0x606C, 0);
    bench.world("1 switch X0 1000000 max").run_ms(500).reads(0x606C, 60);

    let mut bench = with_switches(0);
    bench.enable_in(1).move_by(40_000).run_ms(300);
    bench.input(0, true).run_ms(400);
    let stopped = bench.get(0x6064);
    bench.input(0, false).run_ms(300).reads(0x6064, stopped);
}

#[test]
fn a_move_that_meets_a_limit_ends_there_and_does_not_count_as_reached() {
    let mut bench = with_switches(0);
    bench.enable_in(1).move_by(40_000).run_ms(500);
    bench.input(0, true).run_ms(500);
    let stopped = bench.get(0x6064);
    bench.shows(REACHED, 0);
    bench.move_by(1000).run_ms(500);
    assert_eq!(bench.get(0x6064), stopped, "further in: no step");
    bench.set(0x6040, 0x0F).move_by(-1000).run_ms(1000).reads(0x6064, stopped - 1000);
    assert_ne!(bench.statusword() & REACHED, 0);
}

#[test]
fn pulses_shorter_than_10_ms_are_not_seen() {
    let mut bench = with_switches(1);
    bench.enable_in(3).set(0x60FF, 60).run_ms(500);
    for (ms, seen) in [(5, false), (9, false), (12, true)] {
        bench.set_input(2, true).run_ms(ms);
        bench.set_input(2, false).run_ms(500);
        assert_eq!(bench.get(0x606C) == 0, seen, "{ms} ms");
    }
}

#[test]
fn each_pair_of_inputs_has_its_own_filter_time() {
    let mut bench = Bench::new();
    bench.set(0x204B, 2).set(0x204C, 50);
    for input in 0..4 {
        bench.set_input(input, true);
    }
    bench.run_ms(1).reads(0x2003, 0);
    bench.run_ms(10).reads(0x2003, 0b0011);
    bench.run_ms(50).reads(0x2003, 0b1111);
}

//! Halt, quick stop, emergency stop and step-down in every mode: how long the ramp takes, and what goes on after it.
//!
//! 605Ah, 605Bh, 605Ch and 605Dh name the ramps: normal is 6084h (609Ah in homing), quick is 6085h, at once is none.

use std::time::Duration;

use crate::bench::{Bench, assert_within};

const LOOK: Duration = Duration::from_micros(500);
const NORMAL_S: f64 = 0.3;
const QUICK_S: f64 = 0.05;
const HOMING_S: f64 = 0.2;
const EMERGENCY_STOP: i64 = 9;

const REACHED: u16 = 1 << 10;
const RUNNING: u16 = 1 << 14;

/// Turning at 120 r/min in a mode: far from any target or switch.
fn turning(mode: i64) -> Bench {
    let mut bench = Bench::new();
    for (index, value) in [(0x6084, 300), (0x6085, 50), (0x609A, 200), (0x6098, 18)] {
        bench.set(index, 0, value);
    }
    bench.set(0x2030, 4, EMERGENCY_STOP);
    bench.enable_in(mode);
    match mode {
        1 => bench.move_by(100_000),
        3 => bench.set(0x60FF, 0, 120),
        _ => bench.set(0x6040, 0, 0x1F),
    }
    bench.run_ms(500);
    assert_eq!(bench.get(0x606C, 0), 120, "mode {mode}");
    bench
}

/// Seconds until the commanded velocity is 0.
#[track_caller]
fn stops_within(bench: &mut Bench, at: &str, seconds: f64) {
    let taken = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm.is_none_or(|rpm| rpm == 0.0));
    assert_within(at, taken, seconds - 0.003, seconds + 0.0025);
}

fn ramp_s(mode: i64, option: i64) -> f64 {
    match option {
        1 if mode == 6 => HOMING_S,
        1 => NORMAL_S,
        2 => QUICK_S,
        _ => 0.0,
    }
}

#[test]
fn halt_takes_the_ramp_of_605dh_in_every_mode_and_stays_enabled() {
    for mode in [1, 3, 6] {
        for option in [1, 2, 3] {
            let at = format!("mode {mode}, 605Dh = {option}");
            let mut bench = turning(mode);
            bench.set(0x605D, 0, option);
            let controlword = if mode == 3 { 0x10F } else { 0x15F };
            bench.set(0x6040, 0, controlword);
            if option == 1 {
                assert_eq!(bench.statusword() & (REACHED | RUNNING), RUNNING, "{at}: it slows down");
            }
            // The SDO answer takes 0.5 ms of it, the look at the statusword 1 ms more.
            stops_within(&mut bench, &at, (ramp_s(mode, option) - if option == 1 { 0.0015 } else { 0.0005 }).max(0.0));
            bench.run_ms(2);
            assert_eq!(bench.statusword() & 0x6F, 0x27, "{at}: operation enabled");
            assert_eq!(bench.statusword() & (REACHED | RUNNING), REACHED, "{at}: it stands");
            bench.set(0x6040, 0, controlword & 0xFF);
            bench.run_ms(300);
            assert_eq!(bench.get(0x606C, 0), 120, "{at}: it goes on");
        }
    }
}

#[test]
fn a_set_point_given_under_halt_waits_for_its_end_at_rest_and_on_the_way() {
    for on_the_way in [false, true] {
        let mut bench = Bench::new();
        bench.enable_in(1);
        if on_the_way {
            bench.move_by(100_000);
            bench.run_ms(500);
        }
        bench.set(0x6040, 0, 0x10F);
        bench.set(0x607A, 0, 3000);
        bench.set(0x6040, 0, 0x13F);
        bench.run_ms(500);
        let halted = bench.get(0x6064, 0);
        bench.run_ms(500);
        assert_eq!(bench.get(0x6064, 0), halted, "on the way: {on_the_way}");
        assert!(on_the_way || halted == 0, "{halted}");
        bench.set(0x6040, 0, 0x0F);
        bench.run_ms(2000);
        assert_eq!(bench.get(0x6064, 0), 3000, "on the way: {on_the_way}");
    }
}

#[test]
fn quick_stop_takes_the_ramp_of_605ah_in_every_mode_and_nothing_goes_on_by_itself_but_a_velocity() {
    for mode in [1, 3, 6] {
        for (option, kind) in [(5, 1), (6, 2), (7, 3)] {
            let at = format!("mode {mode}, 605Ah = {option}");
            let mut bench = turning(mode);
            bench.set(0x605A, 0, option);
            bench.set(0x6040, 0, 0x02);
            stops_within(&mut bench, &at, (ramp_s(mode, kind) - 0.0005).max(0.0));
            bench.run_ms(100);
            assert_eq!(bench.statusword() & 0x206F, 0x2007, "{at}: quick stop active, energised");
            bench.set(0x6040, 0, 0x0F);
            bench.run_ms(300);
            assert_eq!(bench.statusword() & 0x6F, 0x27, "{at}: transition 16");
            assert_eq!(bench.get(0x606C, 0), if mode == 3 { 120 } else { 0 }, "{at}");
        }
    }
}

#[test]
fn an_emergency_stop_input_ends_a_move_and_a_homing_for_good() {
    for mode in [1, 3, 6] {
        let mut bench = turning(mode);
        bench.set(0x605A, 0, 6);
        bench.input(2, true);
        bench.run_ms(60);
        assert_eq!(bench.get(0x606C, 0), 0, "mode {mode}");
        let stopped = bench.get(0x6064, 0);
        // No start while it is active, none by itself after it.
        bench.set(0x6040, 0, 0x0F);
        bench.set(0x6040, 0, 0x5F);
        bench.run_ms(100);
        bench.input(2, false);
        bench.run_ms(300);
        assert_eq!((bench.get(0x6064, 0), bench.get(0x60FF, 0)), (stopped, 0), "mode {mode}");
        assert_eq!(bench.statusword() & (1 << 8), 0, "mode {mode}: homing attained");
        assert_eq!(bench.statusword() & 0x6F, 0x27, "mode {mode}");
    }
}

#[test]
fn shutdown_and_disable_operation_ramp_down_in_every_mode_before_they_act() {
    for mode in [1, 3, 6] {
        for (controlword, state) in [(0x06, 0x21), (0x07, 0x23)] {
            let at = format!("mode {mode}, 6040h = {controlword:02X}h");
            let mut bench = turning(mode);
            bench.set(0x6040, 0, controlword);
            assert_eq!(bench.statusword() & 0x6F, 0x27, "{at}: enabled on the ramp");
            stops_within(&mut bench, &at, ramp_s(mode, 1) - 0.0015);
            bench.run_ms(2);
            assert_eq!(bench.statusword() & 0x6F, state, "{at}");
            // What was under way is over.
            bench.set(0x60FF, 0, 0);
            bench.set(0x6040, 0, 0x0F);
            bench.run_ms(300);
            assert_eq!((bench.statusword() & 0x6F, bench.get(0x606C, 0)), (0x27, 0), "{at}: enabled again");
        }
    }
}

#[test]
fn disable_voltage_frees_the_motor_at_once_in_every_mode() {
    for mode in [1, 3, 6] {
        let mut bench = turning(mode);
        bench.set(0x6040, 0, 0x00);
        assert_eq!(bench.statusword() & 0x4F, 0x40, "mode {mode}: switch on disabled");
        assert_eq!(bench.report().velocity_demand_rpm, None, "mode {mode}: no ramp");
        bench.run_ms(50);
        assert_eq!((bench.report().current_a, bench.get(0x606C, 0)), (0.0, 0), "mode {mode}");
    }
}

#[test]
fn a_stop_at_once_from_high_speed_throws_the_rotor_out_of_step_and_a_ramp_does_not() {
    // 6084h = 1 s against no ramp at all, from 1500 r/min: the energy of the rotor has to go somewhere.
    for (option, keeps) in [(1, true), (3, false)] {
        let mut bench = Bench::new();
        bench.set(0x6083, 0, 1000);
        bench.set(0x6084, 0, 1000);
        bench.set(0x605D, 0, option);
        bench.enable_in(3);
        bench.set(0x60FF, 0, 1500);
        bench.run_ms(1500);
        bench.set(0x6040, 0, 0x10F);
        bench.run_ms(2000);
        let report = bench.report();
        let lost = report.position - report.rotor_position.expect("known here");
        assert_eq!((lost.abs() < 40, report.error_code), (keeps, 0), "605Dh = {option}: {lost} pulses, {report:?}");
    }
}

#[test]
fn another_mode_waits_until_the_motor_stands() {
    let mut bench = turning(3);
    bench.set(0x6060, 0, 1);
    bench.run_ms(100);
    assert_eq!((bench.get(0x6060, 0), bench.get(0x6061, 0), bench.get(0x606C, 0)), (1, 3, 120));
    bench.set(0x60FF, 0, 0);
    bench.run_ms(350);
    assert_eq!((bench.get(0x6061, 0), bench.get(0x606C, 0)), (1, 0));
    bench.set(0x6060, 0, 0);
    bench.run_ms(5);
    bench.set(0x60FF, 0, 120);
    bench.set(0x6040, 0, 0x1F);
    bench.run_ms(100);
    assert_eq!((bench.get(0x6061, 0), bench.get(0x606C, 0)), (0, 0), "without a mode nothing moves");
    assert_eq!(bench.statusword(), 0x2A37);
}

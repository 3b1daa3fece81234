//! What stops a moving motor, how fast and how far: halt, quick stop (4.6), stop (4.5), external stop (5.4), a silent host.

use std::time::Duration;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel::{self, COUNTS_PER_TURN, RAD_S_PER_RPM};

pub(crate) const LOOK: Duration = Duration::from_millis(1);
pub(crate) const RPM: f64 = 120.0;

/// Turning at 120 r/min in profile velocity; 6084h 400 ms, 6085h 100 ms.
pub(crate) fn turning() -> Bench {
    brought_to_speed(Bench::new())
}

/// The same with this drive.
pub(crate) fn brought_to_speed(mut bench: Bench) -> Bench {
    bench.set(0x6084, 400).set(0x6085, 100).enable_in(3).set(0x60FF, RPM as i64).run_ms(1500);
    bench
}

/// Seconds to standstill and counts gone, from now.
fn stop_of(bench: &mut Bench) -> (f64, f64) {
    let start = bench.report().position;
    let seconds = bench.seconds_until(3.0, LOOK, |report| report.velocity_rpm < 1.0);
    // A step of the demand may overshoot before it rests.
    bench.run_ms(600);
    assert_within("speed after the stop", bench.report().velocity_rpm, -1.0, 1.0);
    (seconds, (bench.report().position - start) as f64)
}

/// A ramp of `time_s` is an S, so its way is half of what full speed would go; at the current limit it is v^2 / 2a.
#[track_caller]
pub(crate) fn assert_stops(bench: &mut Bench, ramp: Ramp) {
    let (seconds, counts) = stop_of(bench);
    let (expected_s, slack_s) = match ramp {
        Ramp::Time(time_s) => (time_s, 0.03),
        Ramp::CurrentLimit => {
            let torque_nm = 30.0 * wheel::torque_per_a() + wheel::friction_nm(0.0);
            (RPM * RAD_S_PER_RPM * wheel::inertia_kg_m2() / torque_nm, 0.02)
        }
    };
    let expected_counts = RPM / 60.0 * COUNTS_PER_TURN * expected_s / 2.0;
    let slack_counts = RPM / 60.0 * COUNTS_PER_TURN * 0.012;
    assert_within("seconds to stand", seconds, expected_s * 0.8 - 0.002, expected_s + slack_s);
    assert_within("counts to stand", counts, expected_counts * 0.9 - 2.0, expected_counts + slack_counts);
}

#[derive(Clone, Copy)]
pub(crate) enum Ramp {
    Time(f64),
    CurrentLimit,
}

#[track_caller]
pub(crate) fn assert_coasts(bench: &mut Bench) {
    let rad_s = bench.report().velocity_rpm * RAD_S_PER_RPM;
    let seconds = bench.seconds_until(5.0, LOOK, |report| report.velocity_rpm.abs() < 0.01);
    let expected_s = wheel::coasting_time_s(rad_s);
    assert_within("seconds to stand by friction alone", seconds, expected_s * 0.98, expected_s * 1.02);
}

#[test]
fn only_an_input_with_function_9_stops_and_2030_01_turns_its_level_over() {
    let mut bench = turning();
    bench.set_input(1, true).run_ms(500);
    assert_within("X1 has function 0", bench.report().velocity_rpm, RPM - 1.0, RPM + 1.0);
    bench.set((0x2030, 3), 9).run_ms(800);
    assert_within("X1 has function 9", bench.report().velocity_rpm, -0.5, 0.5);

    let mut bench = turning();
    bench.set((0x2030, 1), 1).run_ms(800);
    assert_within("X0 is active low and not connected", bench.report().velocity_rpm, -0.5, 0.5);
}

/// 2000h is the time without the host (chapter 9); which frames are a sign of it is a reading, L083.
#[test]
fn data_to_the_node_keeps_the_watch_quiet_until_it_ends_and_what_goes_on_without_a_host_does_not() {
    for (frame, address, by_sync, kept) in [
        ("604#4041600000000000", "SDO", false, true),
        ("204#0F00", "RPDO", false, true),
        ("605#4041600000000000", "SDO of another node", false, false),
        ("080#", "SYNC", false, false),
        ("080#", "SYNC with L083=sync", true, true),
        ("000#0104", "NMT start", false, false),
        ("77F#05", "heartbeat of a master", false, false),
    ] {
        let mut bench = brought_to_speed(if by_sync { Bench::choosing("L083", "sync") } else { Bench::new() });
        bench.send("000#0104").set(0x2000, 300);
        for _ in 0..10 {
            bench.run_ms(150).send(frame);
        }
        assert_eq!(bench.report().velocity_rpm > RPM - 1.0, kept, "{address}");
        if kept {
            bench.run_ms(300);
            assert_stops(&mut bench, Ramp::Time(0.4));
        }
    }
}

#[test]
fn a_silent_host_stops_the_motor_after_2000h_with_the_ramp_of_605ah_in_each_mode_and_leaves_it_enabled() {
    for (option, time_s) in [(5, 0.4), (6, 0.1)] {
        let mut bench = turning();
        bench.set(0x605A, option).set(0x2000, 500).run_ms(490).turns_about(RPM, 1.0).run_ms(9);
        assert_stops(&mut bench, Ramp::Time(time_s));
        bench.shows(0xFF, 0x37).reads(0x603F, 0).reads(0x60FF, 0);
    }

    let mut bench = Bench::new();
    bench.set(0x605A, 6).set(0x6085, 100).enable_in(1).set(0x2000, 1000).set(0x607A, 100_000).set(0x6040, 0x1F);
    bench.run_ms(980);
    assert_within("speed of the move", bench.report().velocity_rpm, 118.0, 122.0);
    bench.run_ms(300).turns_at(-1.0, 1.0);
    let stands = bench.report().position;
    bench.set(0x2000, 0).run_ms(1000);
    assert_within("the move is over", (bench.report().position - stands) as f64, -30.0, 30.0);

    let mut bench = Bench::new();
    bench.set(0x6087, 0).enable_in(4).set(0x2000, 500).set(0x6071, 1000).run_ms(400);
    assert!(bench.report().velocity_rpm > 100.0);
    bench.run_ms(1500).turns_at(-1.0, 1.0).reads(0x6071, 0).shows(0xFF, 0x37);
}

#[test]
fn a_shutdown_ends_even_when_a_load_never_lets_the_motor_stand() {
    let mut bench = turning();
    bench.set((0x202E, 5), 1).set(0x2015, 20).set_load_inertia(0.3).set_load_torque(-2.0).set(0x6040, 0x06).run_ms(300);
    assert_eq!(bench.statusword() & 0xFF, 0x37, "on the ramp");
    bench.run_ms(1700).shows(0xFF, 0x31);
    assert!(bench.report().velocity_rpm > 60.0, "1.5 N m of the motor against 2 N m");
}

//! Emergency stops: 5.4 has one word for 605Ah = 7, 605Dh = 3, 200Ah = 1 and 6085h; `brake` and `coast` are the other readings
//! of it. What both ZL drives have of stops is asked in `every_drive`.

use std::time::Duration;

use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::scenarios::stops::turning;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

const LOOK: Duration = Duration::from_micros(500);
const EMERGENCY_STOP: i64 = 9;

/// Seconds until the commanded velocity is 0.
#[track_caller]
fn stops_within(bench: &mut Bench, at: &str, seconds: f64) {
    let taken = bench.seconds_until(1.0, LOOK, |report| report.velocity_demand_rpm.is_none_or(|rpm| rpm == 0.0));
    assert_within(at, taken, seconds - 0.003, seconds + 0.0025);
}

#[test]
fn an_emergency_stop_input_ends_a_move_a_velocity_and_a_homing_for_good_and_holds() {
    for mode in [1, 3, 6] {
        let mut bench = turning::<Zlim42c>(mode);
        bench.set((0x2030, 4), EMERGENCY_STOP).set(0x605A, 6).input(2, true).run_ms(60);
        assert_eq!(bench.get(0x606C), 0, "mode {mode}, 605Ah = 6: as 6085h");
        assert!(bench.report().current_a > 0.5, "mode {mode}: it holds");
        let stopped = bench.get(0x6064);
        // No start while it is active, none by itself after it.
        bench.set(0x60FF, 60).set(0x6040, 0x0F).set(0x6040, 0x5F).run_ms(300).reads(0x6064, stopped);
        bench.input(2, false).run_ms(300);
        assert_eq!((bench.get(0x6064), bench.get(0x60FF)), (stopped, 0), "mode {mode}");
        assert_eq!(bench.statusword() & (1 << 8), 0, "mode {mode}: homing attained");
        assert_eq!(bench.statusword() & 0x6F, 0x27, "mode {mode}");
        bench.set(0x6060, 3).run_ms(5).set(0x60FF, 60).run_ms(500).reads(0x606C, 60);
    }
}

/// Turning at `rpm` in profile velocity, after a ramp of a second.
fn at_speed(mut bench: Bench, rpm: i64) -> Bench {
    for index in [0x6083, 0x6084] {
        bench.set(index, 1000);
    }
    bench.enable_in(3).set(0x60FF, rpm).run_ms(1500);
    bench
}

/// Pulses that the rotor is away from the vector, two seconds later.
fn lost_pulses(bench: &mut Bench) -> i64 {
    bench.run_ms(2000);
    let report = bench.report();
    assert_eq!(report.error_code, 0, "{report:?}");
    (report.position - report.rotor_position.expect("known here")).abs()
}

/// 5.4: 605Ah = 7, 605Dh = 3, 200Ah = 1 by the way in which they are set off.
const EMERGENCY_STOPS: [&str; 3] = ["605Ah = 7", "605Dh = 3", "200Ah = 1"];

fn emergency_stop(bench: &mut Bench, how: &str) {
    match how {
        "605Ah = 7" => {
            bench.set(0x605A, 7).set(0x6040, 0x02);
        }
        "605Dh = 3" => {
            bench.set(0x605D, 3).set(0x6040, 0x10F);
        }
        _ => {
            for (index, sub, value) in [(0x200A, 0, 1), (0x2030, 2, 2), (0x204B, 0, 0)] {
                bench.set((index, sub), value);
            }
            bench.set_input(0, true);
        }
    }
}

#[test]
fn every_emergency_stop_takes_the_time_of_6085h() {
    for how in EMERGENCY_STOPS {
        for ms in [50, 400] {
            let mut bench = at_speed(Bench::new(), 120);
            bench.set(0x6085, ms);
            emergency_stop(&mut bench, how);
            stops_within(&mut bench, how, ms as f64 * 1e-3 - 0.0005);
        }
    }
}

#[test]
fn an_emergency_stop_that_brakes_at_once_loses_steps_where_the_ramp_of_6085h_loses_none() {
    // The rotor alone at 1000 r/min has J w² / 2 = 37 mJ; the field holds it with at most 2 K I / 50 = 10 mJ at 1.2 A.
    for how in EMERGENCY_STOPS {
        for (choice, keeps) in [("ramp", true), ("brake", false)] {
            let mut bench = at_speed(Bench::choosing("Z092", choice), 1000);
            emergency_stop(&mut bench, how);
            let lost = lost_pulses(&mut bench);
            assert_eq!(lost < 40, keeps, "{how}, {choice}: {lost} pulses");
            assert!(keeps || lost % 80 < 8 || lost % 80 > 72, "{how}: {lost} pulses are whole electrical turns");
        }
    }
}

#[test]
fn an_emergency_stop_that_coasts_switches_the_bridges_off_and_takes_the_motor_again_afterwards() {
    for how in EMERGENCY_STOPS {
        let mut bench = at_speed(Bench::choosing("Z092", "coast"), 300);
        emergency_stop(&mut bench, how);
        bench.run_ms(2);
        assert_eq!(bench.report().velocity_demand_rpm, None, "{how}: no ramp");
        bench.run_ms(300);
        assert_eq!((bench.report().current_a, bench.statusword() & 1 << 13), (0.0, 0), "{how}: free");
        let state = if how == "605Ah = 7" { 0x07 } else { 0x27 };
        assert_eq!(bench.statusword() & 0x6F, state, "{how}");
        // The cause goes, and the target velocity holds again.
        bench.set_input(0, false).set(0x6040, 0x0F).run_ms(1200);
        assert_eq!((bench.statusword() & 0x206F, bench.get(0x606C)), (0x2027, 300), "{how}");
    }
}

#[test]
fn a_move_halted_by_coasting_goes_on_to_its_target() {
    let mut bench = Bench::choosing("Z092", "coast");
    bench.set(0x605D, 3).enable_in(1).move_by(8000).run_ms(300);
    bench.set(0x6040, 0x15F).run_ms(300);
    assert_eq!(bench.report().current_a, 0.0);
    bench.set(0x6040, 0x5F).run_ms(2000).reads(0x6064, 8000);
}

//! The supply: what it gives, what its switch does, and how the drive lives through it.

use std::time::Duration;

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel;

/// The plant's 3 W of electronics, the ZLAC8030L's under-voltage of 18 V (a guess, see its readings) and the 9 V at which
/// its converter stops.
const CONSUMPTION_W: f64 = 3.0;
const UNDER_VOLTAGE_V: f64 = 18.0;
const CONVERTER_STOPS_V: f64 = 9.0;

const EMCY_UNDER_VOLTAGE: &str = "084#0200";

/// Time in which constant power takes a capacitor from one voltage to another: C (a^2 - b^2) / 2 P.
fn drain_s(from_v: f64, to_v: f64) -> f64 {
    let own_f = wheel::bus_capacitance_f() - wheel::source_capacitance_f();
    own_f * (from_v * from_v - to_v * to_v) / (2.0 * CONSUMPTION_W)
}

/// Seconds from now until the drive has died; its supply has been switched off, or will be.
fn seconds_to_live(bench: &mut Bench) -> f64 {
    bench.seconds_until(30.0, Duration::from_micros(500), |report| !report.powered)
}

#[test]
fn switched_off_the_drive_lives_on_its_capacitor_and_reports_under_voltage() {
    let mut bench = Bench::new();
    bench.forget().world("4 power off").run(Duration::from_secs_f64(drain_s(48.0, UNDER_VOLTAGE_V) - 0.002));
    bench.hears_of(EMCY_UNDER_VOLTAGE, &[]);
    assert_within("bus", bench.report().supply_v, UNDER_VOLTAGE_V, UNDER_VOLTAGE_V + 0.2);
    // Some periods of supervision for the fault.
    bench.run_ms(30);
    assert_eq!(bench.heard_of(EMCY_UNDER_VOLTAGE).len(), 1);
    assert_eq!(bench.get(0x603F), 0x0002, "it still answers");
    let dead_s = drain_s(48.0, CONVERTER_STOPS_V) - drain_s(48.0, UNDER_VOLTAGE_V);
    assert_within("seconds to live", seconds_to_live(&mut bench), dead_s - 0.035, dead_s);
    assert!(bench.ask("604#4041600000000000".parse().expect("a frame"), 0x584).is_none());
    // 81 V^2 / 3 W = 27 ohm discharge the rest.
    bench.run_ms(1000);
    assert!(bench.report().supply_v < 1e-3);
    bench.world("4 power on").run_ms(2500).reads(0x603F, 0);
}

#[test]
fn a_power_cycle_and_a_supply_that_comes_back_early_end_in_a_restart_once_the_bus_has_drained() {
    for commands in [&["4 power cycle"][..], &["4 power off", "4 power on"], &["4 power cycle", "4 power on"]] {
        let mut bench = Bench::new();
        bench.set(0x60FF, 50).forget();
        for command in commands {
            bench.world(command);
        }
        let drained_s = drain_s(48.0, CONVERTER_STOPS_V);
        bench.run(Duration::from_secs_f64(drained_s - 0.002));
        assert_eq!(bench.heard_of("704#00"), [""; 0], "{commands:?}");
        assert_eq!(bench.heard_of(EMCY_UNDER_VOLTAGE), [""; 0], "what was heard was taken");
        bench.run_ms(2500);
        assert_eq!(bench.heard_of("704#00").len(), 1, "{commands:?}");
        assert_eq!(bench.get(0x60FF), 0, "{commands:?} left nothing that is not stored");
    }
}

#[test]
fn cut_off_it_is_dead_at_once_and_says_nothing() {
    let mut bench = Bench::new();
    bench.forget().world("4 power cut");
    let report = bench.report();
    assert_eq!((report.powered, report.supply_v), (false, 0.0));
    bench.run_ms(1000).hears(&[]);
    bench.world("4 power cycle").run_ms(2500);
    assert_eq!(bench.heard_of("704#00").len(), 1);
}

/// Its diodes charge the empty capacitor up to the voltage of the motor (48 V at 521 r/min), from where the electronics draw as through
/// 81 V^2 / 3 W = 27 ohm: what the wheel loses beside its friction is that at most, with as much in the winding as in the capacitor.
#[test]
fn a_wheel_whose_supply_is_cut_coasts_as_one_without_power() {
    const COASTING_S: f64 = 0.4;
    const INERTIA_KG_M2: f64 = 0.05;
    let turning = || {
        let mut bench = Bench::new();
        bench.world(&format!("4 load inertia {INERTIA_KG_M2}")).enable_in(3).set(0x60FF, 60).run_ms(2000);
        bench
    };
    let after = |mut bench: Bench| {
        bench.run(Duration::from_secs_f64(COASTING_S));
        bench.report()
    };
    let mut free = turning();
    free.set(0x6040, 0);
    let free_rpm = after(free).velocity_rpm;
    assert_within("r/min without power", free_rpm, 40.0, 59.0);
    let motor_v = 48.0 * 60.0 / 521.0;
    let resistance_ohm = CONVERTER_STOPS_V * CONVERTER_STOPS_V / CONSUMPTION_W;
    let most_j = motor_v * motor_v * (COASTING_S / resistance_ohm + wheel::bus_capacitance_f());
    let rad_s = |rpm: f64| rpm * std::f64::consts::TAU / 60.0;
    let least_rpm = (rad_s(free_rpm).powi(2) - 2.0 * most_j / INERTIA_KG_M2).sqrt() / rad_s(1.0);
    for cut in ["4 power cut", "4 supply 0"] {
        let mut bench = turning();
        bench.world(cut);
        let report = after(bench);
        assert_within(cut, report.velocity_rpm, least_rpm, free_rpm + 0.5);
        assert_eq!(report.current_a, 0.0, "{cut}: what a drive that is off has measured last");
    }
}

/// A source that gives nothing is open, its capacitor still there: C (48^2 - V^2) / 2 P.
#[test]
fn a_short_interruption_is_bridged_by_the_capacitors_and_a_long_one_is_not() {
    let away_s = 0.02;
    let mut bench = Bench::new();
    bench.world("4 supply 48 limit 0").run(Duration::from_secs_f64(away_s));
    let left_v = (48.0_f64 * 48.0 - 2.0 * CONSUMPTION_W * away_s / wheel::bus_capacitance_f()).sqrt();
    assert_within("bus", bench.report().supply_v, left_v - 0.05, left_v + 0.05);
    bench.world("4 supply 48 limit 1000").run_ms(100).reads(0x603F, 0);
    let longer_s = wheel::bus_capacitance_f() * (48.0 * 48.0 - 15.0 * 15.0) / (2.0 * CONSUMPTION_W);
    bench
        .world("4 supply 48 limit 0")
        .run(Duration::from_secs_f64(longer_s))
        .world("4 supply 48 limit 1000")
        .run_ms(100);
    bench.reads(0x603F, 0x0002);
}

#[test]
fn a_wheel_that_turns_feeds_the_drive_until_it_is_slow() {
    let mut bench = Bench::new();
    bench.world("4 load inertia 0.5").world("4 load torque -4");
    bench.seconds_until(30.0, Duration::from_millis(1), |report| report.velocity_rpm > 300.0);
    bench.world("4 load torque 0").world("4 power off");
    // The rectified back-emf of 300 r/min (0.875 V s/rad between two wires) is above 18 V down to 206 r/min.
    let slow_s = bench.seconds_until(30.0, Duration::from_millis(1), |report| report.velocity_rpm < 215.0);
    assert!(slow_s > 2.0 * drain_s(48.0, CONVERTER_STOPS_V), "{slow_s} s");
    bench.reads(0x603F, 0);
    let bus_v = bench.report().supply_v;
    assert_within("the rectified voltage", bus_v, 0.95 * 0.875 * 22.5 - 1.0, 0.875 * 22.6);
    assert!(seconds_to_live(&mut bench) < 30.0);
}

#[test]
fn a_supply_at_its_limit_sags_until_the_drive_gives_up() {
    let mut bench = Bench::new();
    bench.world("4 load inertia 0.3").enable_in(3).set(0x6083, 10).world("4 supply 48 limit 0.3");
    // 14 W at 48 V, 5 W at 18 V: no way to 400 r/min within 10 ms, nor to stay there.
    bench.set(0x60FF, 400);
    let fell_s = bench.seconds_until(5.0, Duration::from_millis(1), |report| report.error_code == 0x0002);
    assert!(fell_s < 1.0, "{fell_s} s");
    // Without the motor what is left of 0.3 A charges what was lost: C V / I, with 3 W / 18 V taken from I at worst.
    bench.run(Duration::from_secs_f64(wheel::bus_capacitance_f() * 48.0 / (0.3 - 3.0 / 18.0) + 0.1));
    assert_within("bus", bench.report().supply_v, 47.8, 49.0);
    // As an ideal one it has no trouble.
    bench
        .world("4 supply 48 limit 1000")
        .set(0x6083, 2000)
        .set(0x6040, 0x80)
        .enable_in(3)
        .set(0x60FF, 400)
        .run_ms(3000);
    bench.reads(0x603F, 0);
    assert_within("r/min", bench.report().velocity_rpm, 395.0, 405.0);
}

#[test]
fn what_makes_no_sense_of_a_supply_is_refused_with_its_range_and_changes_nothing() {
    let mut bench = Bench::new();
    for (line, range) in [
        ("4 supply 48 limit 1001", "0 to 1000 A"),
        ("4 supply 48 resistance 1e9", "0.001 to 100 ohm"),
        ("4 supply 101 limit 5", "0 to 100 V"),
    ] {
        let answer = sim::command::answer(&mut bench.world, line).expect("an answer").json;
        assert!(answer.starts_with(r#"{"ok":false"#) && answer.contains(range), "{line}: {answer}");
    }
    bench.run_ms(100);
    assert_within("bus", bench.report().supply_v, 47.9, 48.0);
}

/// 0.05 ohm and 60 A as they come: P = (48 - V) / R * V.
#[test]
fn the_bus_sags_by_the_inner_resistance_that_is_set() {
    let mut bench = Bench::new();
    bench.world("4 supply 48 resistance 10").run_ms(3000);
    let expected_v = 24.0 + (24.0_f64.powi(2) - 10.0 * CONSUMPTION_W).sqrt();
    assert_within("bus", bench.report().supply_v, expected_v - 0.01, expected_v + 0.01);
}

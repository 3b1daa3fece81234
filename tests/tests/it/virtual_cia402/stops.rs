//! How the motor is stopped: every option code against `tests/data/cia402/option_codes.csv`.

use sim::{Component, VirtualDrive};

use crate::virtual_cia402::bench::{Bench, TURN};

const ROWS: &str = include_str!("../../../data/cia402/option_codes.csv");

/// Turns a second, and per second squared.
const SPEED: i64 = 20;
const SLOW: i64 = 50;
const QUICK: i64 = 200;

/// At its speed in profile velocity, perhaps on node 1's heartbeat.
pub fn turning(watching: bool) -> Bench {
    let mut bench = Bench::new();
    bench.set(&[(0x6084, 0, SLOW * TURN), (0x6085, 0, QUICK * TURN), (0x6083, 0, 1000 * TURN)]);
    bench.set(&[(0x1016, 1, if watching { 0x0001_0064 } else { 0 })]);
    bench.frame("701#05");
    bench.enable(3);
    bench.set(&[(0x60FF, 0, SPEED * TURN)]);
    for _ in 0..10 {
        bench.run_ms(50);
        bench.frame("701#05");
    }
    assert!((bench.rpm() - 60.0 * SPEED as f64).abs() < 12.0, "{}", bench.rpm());
    bench
}

/// Gives the event that an object is about.
fn give(bench: &mut Bench, object: &str) {
    match object {
        "605A" => bench.control(0x02),
        "605B" => bench.control(0x06),
        "605C" => bench.control(0x07),
        "605D" => bench.control(0x10F),
        _ => {
            let lost = bench.run_until(200, |bench| bench.emcy().contains(&0x8130));
            assert!(lost.is_some(), "the heartbeat is missed");
        }
    }
}

fn state(bench: &mut Bench) -> &'static str {
    let status = bench.status();
    match (status & 0x4F, status & 0x6F) {
        (0x40, _) => "switch_on_disabled",
        (0x08, _) => "fault",
        (0x0F, _) => "fault_reaction_active",
        (_, 0x21) => "ready_to_switch_on",
        (_, 0x23) => "switched_on",
        (_, 0x27) => "operation_enabled",
        (_, 0x07) => "quick_stop_active",
        _ => "none",
    }
}

/// When a shaft whose set-point is suddenly 0 passes through standstill.
///
/// The current limit is never met here: 3.8 N m on 0.173e-4 kg m2 would stop 20 turns/s in 0.6 ms, and the velocity loop asks for
/// less. Its proportional part is `w J`, its integral part `0.2 w^2 J` with w = 300 1/s
/// (`drives/src/servo/motor.rs`), so that without friction `v'' + w v' + 0.2 w^2 v = 0` with `v'(0) = -w v(0)`. The roots are
/// `-w (1 ± sqrt(0.2)) / 2`; the two exponentials cancel at `ln((w - a) / (w - b)) / (b - a)`.
fn stop_of_the_velocity_loop_ms() -> f64 {
    let w = 300.0_f64;
    let (a, b) = (w * (1.0 - 0.2_f64.sqrt()) / 2.0, w * (1.0 + 0.2_f64.sqrt()) / 2.0);
    1e3 * ((w - a) / (w - b)).ln() / (b - a)
}

#[test]
fn every_code_stops_along_its_ramp_and_ends_in_its_state() {
    let mut objects = Vec::new();
    for line in ROWS.lines().skip(1) {
        let [object, code, ramp, after] = line.split(',').collect::<Vec<_>>()[..] else { panic!("{line}") };
        let mut bench = turning(object == "605E");
        bench.set(&[(u16::from_str_radix(object, 16).unwrap(), 0, code.parse().unwrap())]);
        give(&mut bench, object);
        let took = bench.run_until(6000, |bench| bench.rpm() < 6.0).unwrap_or(f64::INFINITY);
        let expected_ms = match ramp {
            "6084" => 1000.0 * SPEED as f64 / SLOW as f64,
            "6085" => 1000.0 * SPEED as f64 / QUICK as f64,
            "limit" => stop_of_the_velocity_loop_ms(),
            // Friction of 0.025 N m, and as much again at 314 rad/s: some 60 ms.
            _ => 70.0,
        };
        // One control and one supervision period, the current loop's third of a millisecond, and the step of this bench.
        let tolerance_ms = if ramp == "limit" { 2.5 } else { 25.0 };
        assert!((took - expected_ms).abs() < tolerance_ms, "{line}: {took} ms, expected {expected_ms}");
        bench.run_ms(40);
        assert_eq!(state(&mut bench), after, "{line}");
        let duty =
            bench.machine.firmware().demand(0).is_some_and(|demand| *demand != drives::engine::axis::Demand::Off);
        let held = matches!(after, "quick_stop_active" | "operation_enabled");
        assert_eq!(duty, held, "{line}: whether the shaft is held");
        objects.push(object);
    }
    objects.dedup();
    assert_eq!(objects, ["605A", "605B", "605C", "605D", "605E"]);
}

/// A flywheel at full speed, and nothing that takes what it feeds back: a stop on the current limit is an over-voltage, one on the
/// voltage limit is slower and is not.
#[test]
fn a_stop_on_the_voltage_limit_keeps_the_bus_below_its_over_voltage() {
    let stopped = |object: u16, code: i64| {
        let mut bench = Bench::new();
        let motor = bench.machine.assembly_mut().motor_mut(0).unwrap();
        motor.rig.load.inertia_kg_m2 = 100.0 * motor.model.rotor.inertia_kg_m2;
        bench.machine.set_fault(Component::Bleeder, true, bench.now).unwrap();
        bench.set(&[(0x6065, 0, 0xFFFF_FFFF), (object, 0, code), (0x6083, 0, 100 * TURN)]);
        bench.enable(3);
        bench.set(&[(0x60FF, 0, 50 * TURN)]);
        bench.run_ms(2500);
        assert!((bench.rpm() - 3000.0).abs() < 60.0, "{}", bench.rpm());
        bench.control(if object == 0x605D { 0x10F } else { 0x02 });
        let mut highest_mv = 0;
        let took = bench.run_until(60_000, |bench| {
            highest_mv = highest_mv.max(bench.read(0x6079, 0));
            bench.rpm().abs() < 6.0
        });
        (took.expect("it comes to rest"), highest_mv, bench.emcy(), state(&mut bench))
    };
    let (_, _, emcy, after) = stopped(0x605A, 3);
    assert_eq!((emcy, after), (vec![0x3210], "fault"), "the case that the voltage limit is for");
    for (object, code, expected) in
        [(0x605A, 4, "switch_on_disabled"), (0x605A, 8, "quick_stop_active"), (0x605D, 4, "operation_enabled")]
    {
        let (took, highest_mv, emcy, after) = stopped(object, code);
        let case = format!("{object:04X}h = {code}: {took} ms, {highest_mv} mV");
        assert!(emcy.is_empty() && highest_mv < 283_000 * 140 / 100, "{case} {emcy:X?}");
        assert!(highest_mv > 283_000 * 131 / 100, "it brakes with what the bus takes: {case}");
        assert!(after == expected || after == "quick_stop_active", "{case}: {after}");
    }
}

/// CiA 402-2, 10.3 and 8.4.6: a halt with the slow down ramp interrupts a move, which goes on to its target. So the demand
/// stays on the way of the move: v^2 / 2a from where it was, and a load that comes meanwhile does not shift it. A quick stop
/// gives up the way.
#[test]
fn a_halted_move_stops_on_its_way_whatever_load_comes_meanwhile() {
    let stopped = |load_nm: f64| {
        let mut bench = Bench::new();
        bench.set(&[(0x6065, 0, 0xFFFF_FFFF), (0x6081, 0, SPEED * TURN), (0x6083, 0, 1000 * TURN)]);
        bench.set(&[(0x6084, 0, SLOW * TURN), (0x605D, 0, 1), (0x607A, 0, 1000 * TURN)]);
        bench.enable(1);
        bench.control(0x1F);
        bench.run_ms(500);
        let from = bench.read(0x6062, 0);
        bench.control(0x11F);
        bench.run_ms(100);
        bench.machine.set_load_torque(load_nm, bench.now).unwrap();
        bench.run_ms(1000);
        assert!(bench.has(0x0427), "{:04X}", bench.status());
        (bench.position() - from) as f64 / TURN as f64
    };
    let way = (SPEED * SPEED) as f64 / (2.0 * SLOW as f64);
    // A supervision and a control period of the way at full speed, and the position window as delivered.
    let tolerance = SPEED as f64 * 1.5e-3 + 1e-3;
    let (alone, loaded) = (stopped(0.0), stopped(1.0));
    assert!((alone - way).abs() < tolerance, "{alone} turns, expected {way}");
    assert!((alone - loaded).abs() < 1e-3, "{alone} turns, with a load {loaded}");
}

#[test]
fn after_a_quick_stop_that_stays_operation_goes_on_with_0f() {
    let mut bench = turning(false);
    bench.set(&[(0x605A, 0, 6)]);
    bench.control(0x02);
    bench.run_ms(300);
    assert_eq!(state(&mut bench), "quick_stop_active");
    bench.control(0x0F);
    bench.run_ms(500);
    assert_eq!(state(&mut bench), "operation_enabled");
    assert!((bench.rpm() - 60.0 * SPEED as f64).abs() < 12.0, "{}", bench.rpm());
}

/// Who is no longer watched cannot be missed: else only the lost host itself could ever end the fault. A watch that is written anew
/// waits for a first heartbeat (CiA 301, 7.2.8.3.2).
#[test]
fn a_fault_of_a_lost_heartbeat_can_be_reset_once_the_watch_is_written() {
    for watch in [0, 0x0001_0064] {
        let mut bench = turning(true);
        bench.set(&[(0x6007, 0, 1)]);
        bench.run_ms(1500);
        assert_eq!(state(&mut bench), "fault");
        bench.control(0x80);
        bench.run_ms(20);
        assert_eq!(state(&mut bench), "fault", "its cause is there");
        bench.control(0);
        bench.set(&[(0x1016, 1, watch)]);
        bench.control(0x80);
        bench.run_ms(20);
        assert_eq!(state(&mut bench), "switch_on_disabled", "1016h:01 = {watch:X}h");
        assert_eq!((bench.read(0x1001, 0), bench.emcy().last()), (0, Some(&0)));
        bench.run_ms(1000);
        assert_eq!((state(&mut bench), bench.rpm().abs() < 1.0), ("switch_on_disabled", true));
    }
}

#[test]
fn a_lost_heartbeat_does_what_6007h_says() {
    for (code, after) in [(0, "operation_enabled"), (1, "fault"), (2, "switch_on_disabled"), (3, "switch_on_disabled")]
    {
        let mut bench = turning(true);
        bench.set(&[(0x6007, 0, code)]);
        bench.run_ms(1500);
        assert_eq!(state(&mut bench), after, "6007h = {code}");
        assert!(bench.emcy().contains(&0x8130), "6007h = {code}: {:04X?}", bench.emcy());
        assert_eq!(bench.read(0x1001, 0) & 0x10, 0x10, "6007h = {code}");
        assert_eq!(bench.read(0x603F, 0), if code == 1 { 0x8130 } else { 0 });
        bench.frame("701#05");
        bench.control(0x80);
        bench.run_ms(20);
        assert_eq!(bench.read(0x1001, 0), 0, "6007h = {code}");
        assert_eq!(bench.emcy().last(), Some(&0), "6007h = {code}");
    }
}

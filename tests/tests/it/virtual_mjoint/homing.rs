//! Homing from every start of `homing.csv` (5.09).

use ferrodrive_tests::mjoint::{HomingStatus, homing_runs};

use crate::virtual_mjoint::bench::{Bench, TURN};

/// Where the switch's edge is, in counts from where the motor begins off the switch.
const EDGE: i64 = 20_000;

/// 100 r/min: half a turn in 0.3 s.
const PATIENCE_MS: u64 = 4000;

#[test]
fn every_run_ends_as_the_table_says() {
    let runs = homing_runs();
    assert_eq!(runs.len(), 20);
    for run in &runs {
        let row = &run.row;
        match row.start.as_str() {
            "off_switch" | "on_switch" => finds_its_origin(run),
            "beyond_switch" => goes_on(run),
            "stalls_on_the_way" => fails_at_the_stop(run),
            "mode_1_on_the_way" => is_left(run),
            other => panic!("unknown step {other}"),
        }
    }
}

/// The switch's pin, the side of the positions it lies on, and the edge that is the origin.
fn switch_of(method: i64) -> (&'static str, bool) {
    match method {
        18 => ("PU", true),
        19 | 20 => ("DIR", true),
        _ => ("DIR", false),
    }
}

fn started(run: &HomingStatus, line: &str) -> Bench {
    let mut bench = Bench::new();
    bench.world(line).run_ms(5);
    bench.set(0x6098, i64::from(run.row.method)).set(0x6060, 6);
    assert_eq!(bench.statusword(), run.running, "{run:?}");
    bench
}

fn finds_its_origin(run: &HomingStatus) {
    let method = i64::from(run.row.method);
    let (pin, positive) = switch_of(method);
    let on = run.row.start == "on_switch";
    // The switch reaches from its edge to the end of the way. On the switch the edge lies behind the motor.
    let edge = if positive == on { -EDGE } else { EDGE };
    let line = if positive { format!("1 switch {pin} {edge} max") } else { format!("1 switch {pin} min {edge}") };
    let mut bench = started(run, &line);
    bench.until(PATIENCE_MS, |bench| bench.statusword() == run.after);
    bench.run_ms(200);
    assert_eq!(bench.statusword(), run.after, "{run:?}");
    // "A number around 0" (5.10.1).
    let position = bench.position();
    assert!(position.abs() <= 20, "{run:?}: {position}");
    // The world's own counts began at 0: what 6064h lost is where the origin is.
    let origin = (bench.report().shaft_angle_rad / core::f64::consts::TAU * TURN as f64).round() as i64 - position;
    // It slows down from 100 r/min with 20000 (r/min)/s, in 5 ms: 137 counts beyond the edge.
    let expected = edge + 137 * i64::from(run.row.latch.as_ref().expect("an edge").direction);
    // Dry friction is worth 90 counts of the position loop.
    assert!((origin - expected).abs() <= 90, "{run:?}: origin at {origin}, edge at {edge}");
}

fn goes_on(run: &HomingStatus) {
    let (pin, positive) = switch_of(i64::from(run.row.method));
    // A short switch, on the side that the run does not go to.
    let (low, high) = if positive { (-EDGE - 500, -EDGE) } else { (EDGE, EDGE + 500) };
    let mut bench = started(run, &format!("1 switch {pin} {low} {high}"));
    bench.run_ms(3000);
    assert_eq!(bench.statusword(), run.after, "{run:?}");
    let turns = bench.position() as f64 / TURN as f64;
    let sign = if positive { 1.0 } else { -1.0 };
    assert!((turns * sign - 5.0).abs() < 0.1, "{run:?}: {turns} turns in 3 s at 100 r/min");
}

fn fails_at_the_stop(run: &HomingStatus) {
    let mut bench = Bench::new();
    // 30 % of the output at rest for 1 s, and a current limit that is not reached.
    bench.set(0x2618, 101).set(0x261D, 10_000).set(0x6098, i64::from(run.row.method)).set(0x6060, 6).run_ms(500);
    assert_eq!(bench.statusword(), run.running);
    bench.world("1 rotor lock");
    bench.until(6000, |bench| bench.get(0x260E) == 0x14);
    assert_eq!(bench.statusword(), run.after);
    bench.forget().run_ms(1010);
    assert!(bench.heard().contains(&"701#04".to_string()));
}

fn is_left(run: &HomingStatus) {
    let mut bench = started(run, "1 input DIR 0");
    bench.run_ms(500);
    let before = bench.position();
    bench.set(0x6060, 1).run_ms(500);
    assert_eq!(bench.statusword(), run.after);
    assert!((bench.position() - before).abs() < TURN, "stopped, and no new origin: {before}, {}", bench.position());
    bench.turns_about(0.0, 1.0);
}

#[test]
fn after_homing_the_position_is_about_zero_whatever_the_ramp_unless_the_edge_is_read_as_the_origin() {
    // 5.10.1, note 3. The ramp's way is v^2 / 2a: at 600 r/min and 5009 (r/min)/s 1000 r/min take 0.2 s, 54,500 counts.
    for acceleration in [20_000, 20_005, 20_009, 5_009, 1_000, 60_000] {
        for (choice, at_edge) in [("stand", false), ("edge", true)] {
            let mut bench = Bench::choosing("J113", choice);
            bench.world("1 switch DIR min -20000").run_ms(5);
            bench.set(0x6083, acceleration).set(0x6060, 6);
            bench.until(20_000, |bench| bench.statusword() == 0x1414);
            bench.run_ms(1500);
            let rpm = (acceleration % 10 + 1) as f64 * 100.0;
            let way =
                if acceleration < 60_000 { 0.5 * rpm * rpm / acceleration as f64 * TURN as f64 / 60.0 } else { 0.0 };
            // At the edge it is not faster than a ramp of 20000 counts allows.
            let way = way.min(20_000.0);
            let (position, expected) = (bench.position(), if at_edge { way } else { 0.0 });
            let tolerance = 60.0 + 0.05 * expected + if at_edge { 2.0 * rpm } else { 0.0 };
            let off = (position as f64 - expected).abs();
            assert!(off <= tolerance, "{acceleration}, {choice}: {position}, not {expected}");
        }
    }
}

#[test]
fn the_ones_digit_of_the_acceleration_is_the_speed() {
    let mut bench = Bench::new();
    bench.set(0x6083, 10_005).set(0x6060, 6).run_ms(500).turns_about(-600.0, 10.0);
}

#[test]
fn a_halt_holds_homing_and_its_end_lets_it_go_on() {
    let mut bench = Bench::new();
    bench.set(0x6060, 6).run_ms(300);
    bench.set(0x6040, 0x0100).run_ms(300).shows(0xFFFF, 0x0414);
    let held = bench.position();
    bench.run_ms(300).is_at(held, 2);
    bench.set(0x6040, 0).run_ms(300).shows(0xFFFF, 0x0014);
    assert!(bench.position() < held - 1000);
}

#[test]
fn homing_under_power_shows_the_mirrored_bits_and_position_mode_goes_on_from_the_origin() {
    let mut bench = Bench::new();
    bench.world("1 switch DIR min -5000").set(0x6040, 0x0F).set(0x6060, 6).shows(0xFFFF, 0x0037);
    bench.until(3000, |bench| bench.statusword() == 0x1437);
    bench.run_ms(50);
    bench.set(0x6060, 1).shows(0xFFFF, 0x0437);
    bench.set(0x6040, 0x2F).set(0x607A, 0).reaches(1000);
    let turns = bench.report().shaft_angle_rad / core::f64::consts::TAU;
    assert!((turns * TURN as f64 + 4999.0 - 137.0).abs() < 90.0, "{turns}: the edge, and the way of the ramp");
}

#[test]
fn homing_that_cannot_begin_fails_at_once() {
    let mut bench = Bench::new();
    bench.set(0x2601, 0).set(0x6060, 6).shows(0xFFFF, 0x2400);
    bench.run_ms(500);
    assert_eq!((bench.statusword(), bench.report().velocity_rpm.abs() < 1.0), (0x2400, true));
    bench.set(0x2601, 1);
    assert_eq!(bench.statusword(), 0x2404, "allowing the output begins nothing");
    bench.set(0x6060, 6);
    assert_eq!(bench.statusword(), 0x0014, "the next write does");
    let mut bench = Bench::new();
    bench.world("1 supply 60").run_ms(300);
    bench.set(0x6060, 6).reads(0x260E, 0x15).shows(0xFFFF, 0x200C);
}

#[test]
fn the_origin_lies_within_three_control_periods_of_the_edge_at_every_speed_and_from_any_distance() {
    for method in 17..=22 {
        let (pin, positive) = switch_of(method);
        // (6083 mod 10 + 1) * 100 r/min, and the way to the edge: less than it takes to get up to speed, or to slow down.
        for (digit, distance) in [(0, 40), (3, 700), (4, 20_000), (9, 300), (9, 60_000)] {
            let mut bench = Bench::choosing("J113", "edge");
            bench.set(0x6083, 20_000 + digit).set(0x6098, method);
            let edge = if positive { distance } else { -distance };
            let range = if positive { format!("{edge} max") } else { format!("min {edge}") };
            bench.world(&format!("1 switch {pin} {range}")).run_ms(5);
            bench.set(0x6060, 6);
            bench.until(6000, |bench| bench.statusword() == 0x1414);
            bench.run_ms(300);
            let shaft = (bench.report().shaft_angle_rad / core::f64::consts::TAU * TURN as f64).round() as i64;
            let expected = if positive { edge } else { edge + 1 };
            let counts_a_period = (digit + 1) as f64 * 100.0 / 60.0 * TURN as f64 * 50e-6;
            let off = (shaft - bench.position() - expected).abs() as f64;
            // The look at the switch, the command, and the encoder that takes it.
            assert!(off <= 3.0 * counts_a_period + 1.0, "{method}, digit {digit}, {distance} away: {off} counts");
        }
    }
}

#[test]
fn a_host_that_sends_mode_6_each_cycle_homes_once() {
    let mut bench = Bench::new();
    bench.world("1 switch DIR min -5000");
    for _ in 0..600 {
        bench.send("201#0F000600000000").run_ms(2);
    }
    bench.shows(0xFFFF, 0x1437).is_at(0, 200);
    bench.send("201#0F000100000000").send("201#0F000600000000");
    assert_eq!(bench.statusword(), 0x0037, "and again after another mode");
}

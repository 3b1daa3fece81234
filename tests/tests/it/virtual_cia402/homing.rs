//! Every homing method of CiA 402-2 from every start, against `tests/data/cia402/homing.csv`.
//!
//! The track, in turns from an index pulse: negative limit below -20.25, positive limit above 20.25, home switch as the row
//! says, index pulses at whole turns.

use crate::virtual_cia402::bench::{Bench, TURN};
use devices::servo::CIA402;
use eds::{Sheet, keep};

const ROWS: &str = include_str!("../../../data/cia402/homing.csv");
const STARTS: [f64; 5] = [-20.75, -10.3, 2.7, 10.3, 20.75];
const LOWER: f64 = 0.4;
const UPPER: f64 = 5.6;
const LIMIT: f64 = 20.25;

/// A look every supervision period at the speed of the last crossing, two turns a second, is 131 increments.
const EDGE_TOLERANCE: i64 = 140;
const INDEX_TOLERANCE: i64 = 2;

struct Row {
    method: i64,
    switch: [Option<f64>; 2],
    has_home: bool,
    edge: String,
    index: String,
    first: [String; 5],
}

fn rows() -> impl Iterator<Item = Row> {
    ROWS.lines().skip(1).map(|line| {
        let fields: Vec<_> = line.split(',').collect();
        let switch = match fields[1] {
            "from_0.4_up" => [Some(LOWER), None],
            "up_to_5.6" => [None, Some(UPPER)],
            _ => [Some(LOWER), Some(UPPER)],
        };
        Row {
            method: fields[0].parse().unwrap(),
            switch,
            has_home: fields[1] != "none",
            edge: fields[2].into(),
            index: fields[3].into(),
            first: std::array::from_fn(|start| fields[4 + start].into()),
        }
    })
}

fn turns(turns: f64) -> i64 {
    (turns * TURN as f64).round() as i64
}

/// Increments of the shaft from the index pulse of turn 0.
fn shaft(bench: &Bench) -> i64 {
    let motor = bench.machine.assembly().motor(0).unwrap();
    motor.rotor.angle.count(TURN as u32)
}

/// At rest at a place, with the switches of a row.
fn at(place: f64, row: &Row) -> Bench {
    let mut bench = Bench::new();
    // Positions count from where the shaft stands at power-on.
    let zero = shaft(&bench) - bench.position();
    let here = |place: f64| turns(place) - zero;
    bench.enable(1);
    bench.set(&[(0x6081, 0, 60 * TURN), (0x6083, 0, 2000 * TURN), (0x6084, 0, 2000 * TURN), (0x607A, 0, here(place))]);
    bench.control(0x1F);
    bench.run_until(5000, |bench| bench.has(0x0400)).expect("it arrives");
    bench.control(0x0F);
    bench.run_ms(50);
    bench.switch("NEG", None, Some(here(-LIMIT)));
    bench.switch("POS", Some(here(LIMIT)), None);
    if row.has_home {
        bench.switch("HOME", row.switch[0].map(here), row.switch[1].map(here));
    }
    bench.set(&[
        (0x6060, 0, 6),
        (0x6098, 0, row.method),
        (0x6099, 1, 20 * TURN),
        (0x6099, 2, 2 * TURN),
        (0x609A, 0, 2000 * TURN),
    ]);
    bench.run_ms(20);
    bench
}

/// Where the home position is, in increments from the index pulse of turn 0.
fn expected(row: &Row, start: f64) -> i64 {
    let edge = match row.edge.as_str() {
        "negative_limit" => -LIMIT,
        "positive_limit" => LIMIT,
        "lower" => LOWER,
        "upper" => UPPER,
        _ => start,
    };
    match row.index.as_str() {
        "below" => turns(edge.floor()),
        "above" => turns(edge.ceil()),
        _ => turns(edge),
    }
}

fn check(row: &Row, start: f64, first: &str) {
    let what = format!("method {} from {start}", row.method);
    let mut bench = at(start, row);
    let before = shaft(&bench);
    assert!(!bench.has(0x1000), "{what}: not homed yet");
    bench.control(0x1F);
    let mut moved = 0;
    let ended = bench.run_until(60_000, |bench| {
        if moved == 0 && (shaft(bench) - before).abs() > 20 {
            moved = (shaft(bench) - before).signum();
        }
        bench.status() & 0x3400 != 0 && bench.has(0x0400)
    });
    assert!(ended.is_some(), "{what}: never ends, {:04X}h at {}", bench.status(), shaft(&bench));
    if first == "fails" {
        assert_eq!(bench.status() & 0x3400, 0x2400, "{what}");
        return;
    }
    assert_eq!(bench.status() & 0x3400, 0x1400, "{what}: attained, target reached, no error");
    match first {
        "+" => assert_eq!(moved, 1, "{what}"),
        "-" => assert_eq!(moved, -1, "{what}"),
        _ => assert_eq!(moved, 0, "{what}"),
    }
    let zero = shaft(&bench) - bench.position();
    let tolerance = if row.index.is_empty() { EDGE_TOLERANCE } else { INDEX_TOLERANCE };
    let home = expected(row, start);
    assert!((zero - home).abs() <= tolerance, "{what}: home at {zero}, expected {home}, {} off", zero - home);
}

fn check_methods(methods: std::ops::RangeInclusive<i64>) {
    let mut some = false;
    for row in rows().filter(|row| methods.contains(&row.method)) {
        for (start, first) in STARTS.into_iter().zip(&row.first) {
            check(&row, start, first);
        }
        some = true;
    }
    assert!(some);
}

#[test]
fn the_rows_are_the_methods_of_the_standard() {
    assert!(cia402::HomingMethod::standard().map(|method| i64::from(method.0)).eq(rows().map(|row| row.method)));
}

#[test]
fn limit_switches_and_home_switches_at_one_end_with_index_pulse() {
    check_methods(1..=6);
}

#[test]
fn home_switches_between_the_limits_with_index_pulse() {
    check_methods(7..=14);
}

#[test]
fn limit_switches_and_home_switches_at_one_end() {
    check_methods(17..=22);
}

#[test]
fn home_switches_between_the_limits() {
    check_methods(23..=30);
}

/// A limit switch that is on forbids the way on: 33 and 34 know no way back.
#[test]
fn the_index_pulse_alone_and_here() {
    check_methods(33..=37);
}

#[test]
fn the_zero_position_is_the_home_position_and_the_offset() {
    let row = rows().find(|row| row.method == 34).unwrap();
    let mut bench = at(3.3, &row);
    bench.set(&[(0x607C, 0, 1000)]);
    bench.control(0x1F);
    bench.run_until(10_000, |bench| bench.has(0x1400)).expect("it is attained");
    let zero = shaft(&bench) - bench.position();
    assert!((zero - (4 * TURN + 1000)).abs() <= INDEX_TOLERANCE, "{zero}");
}

#[test]
fn without_a_method_or_a_switch_homing_fails_and_says_so() {
    let row = rows().find(|row| row.method == 24).unwrap();
    let mut bench = at(-10.0, &row);
    bench.set(&[(0x6098, 0, 0)]);
    bench.control(0x1F);
    bench.run_ms(20);
    assert!(bench.has(0x2000), "{:04X}", bench.status());
    // Both limits and no home switch between.
    let row = Row { has_home: false, ..row };
    let mut bench = at(-10.0, &row);
    bench.control(0x1F);
    assert!(bench.run_until(20_000, |bench| bench.has(0x2000)).is_some(), "{:04X}", bench.status());
    assert!(!bench.has(0x1000));
}

#[test]
fn halt_interrupts_homing_and_it_goes_on() {
    let row = rows().find(|row| row.method == 17).unwrap();
    let mut bench = at(10.0, &row);
    bench.control(0x1F);
    bench.run_ms(300);
    bench.control(0x11F);
    bench.run_ms(200);
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
    assert!(!bench.has(0x1000));
    bench.control(0x1F);
    assert!(bench.run_until(20_000, |bench| bench.has(0x1400)).is_some(), "{:04X}", bench.status());
}

/// Makers leave the default of 6502h open: what such a device can do is what its other objects are for.
#[test]
fn a_servo_whose_file_leaves_the_supported_modes_open_is_homed() {
    let mut file = Sheet::of(&CIA402).eds();
    let supported = file.objects.iter_mut().find(|object| object.index == 0x6502).unwrap();
    supported.variables[0].default = None;
    let mut bench = Bench::of(keep(&file).unwrap());
    bench.write(0x6098, 0, 37).unwrap();
    bench.enable(6);
    assert_eq!(bench.read(0x6061, 0), 6);
    bench.control(0x1F);
    assert!(bench.run_until(1_000, |bench| bench.has(0x1400)).is_some(), "{:04X}", bench.status());
    assert_eq!(bench.position(), 0);
}

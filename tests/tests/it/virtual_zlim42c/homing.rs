//! 5.3.6, homing from every start of `homing.csv` and `homing_by_prose.csv` in `tests/data/zlim42c`: the moves, the edge, and
//! how it ends.
//!
//! The track, in pulses from where the rotor stands at power-on: limits from ±8000 outwards, home from -400 to 400.
//! X0 is the home switch, X1 the positive and X2 the negative limit.

use ferrodrive_tests::homing::Latch;
use ferrodrive_tests::seeded::Seeded;
use ferrodrive_tests::zlim42c::{HomingResult, homing_runs, homing_runs_by_prose};
use sim::SwitchRange;

use crate::virtual_zlim42c::bench::{Bench, assert_within};

const HOME_OFFSET: i64 = 250;
const BITS: u16 = 1 << 8 | 1 << 10 | 1 << 14;

/// Pulses in 10 ms of filter time at 60 r/min, some periods more, and what the rotor swings about its place.
const FILTER_WAY: std::ops::RangeInclusive<f64> = 36.0..=46.0;

#[derive(Clone, Copy)]
struct Track {
    home: Option<(i64, i64)>,
    positive: Option<(Option<i64>, Option<i64>)>,
    negative: Option<(Option<i64>, Option<i64>)>,
}

const TRACK: Track =
    Track { home: Some((-400, 400)), positive: Some((Some(8000), None)), negative: Some((None, Some(-8000))) };

/// The track and the start that a row means.
fn scene(start: &str) -> (Track, i64) {
    let everywhere = Some((None, None));
    match start {
        "between" | "above_home" | "bit_4_falls_on_the_way" | "halt_on_the_way" => (TRACK, 3000),
        "below_home" => (TRACK, -3000),
        "on_home" => (TRACK, 0),
        "on_negative_limit" => (TRACK, -9000),
        "on_positive_limit" => (TRACK, 9000),
        "beyond_negative_limit" => (Track { negative: Some((Some(-4000), Some(-3000))), ..TRACK }, -5000),
        "beyond_positive_limit" => (Track { positive: Some((Some(3000), Some(4000))), ..TRACK }, 5000),
        "both_limits_on" => (Track { positive: everywhere, negative: everywhere, ..TRACK }, 0),
        "above_home_without_home_switch" => (Track { home: None, ..TRACK }, 3000),
        "below_home_without_home_switch" => (Track { home: None, ..TRACK }, -3000),
        "home_on_at_negative_limit" => (Track { negative: Some((None, Some(200))), ..TRACK }, 0),
        "no_input_configured" => (Track { home: None, positive: None, negative: None }, 0),
        other => panic!("no scene for {other}"),
    }
}

fn on_track(start: &str, method: i64) -> Bench {
    put_on_track(Bench::new(), start, method)
}

fn put_on_track(mut bench: Bench, start: &str, method: i64) -> Bench {
    let (track, position) = scene(start);
    let range = |(low, high)| SwitchRange { low, high };
    let home = track.home.map(|(low, high)| range((Some(low), Some(high))));
    let switches = [home, track.positive.map(range), track.negative.map(range)];
    for (n, switch) in switches.into_iter().enumerate() {
        if let Some(range) = switch {
            bench.operate(|drive, now| drive.set_switch(n, range, now)).expect("an input");
            bench.set((0x2030, 2 + n as u8), n as i64 + 1);
        }
    }
    bench.set(0x200A, 2).enable_in(1).move_by(position).run_ms(2500);
    assert_eq!(bench.report().rotor_position, Some(position));
    bench.set(0x6040, 0x0F).set(0x6098, method).set(0x607C, HOME_OFFSET).set(0x6060, 6).run_ms(5).reads(0x6061, 6);
    bench
}

/// Runs for `ms`; the plateaus of the commanded velocity, r/min. One look may catch a ramp in its middle, two do not.
fn plateaus(bench: &mut Bench, ms: u64) -> Vec<i64> {
    let (mut seen, mut last): (Vec<i64>, f64) = (Vec::new(), 0.0);
    for _ in 0..ms {
        bench.run_ms(1);
        let rpm = bench.report().velocity_demand_rpm.unwrap_or_default();
        let plateau = [120.0, -120.0, 60.0, -60.0].into_iter().find(|speed| (rpm - speed).abs() < 1e-6 && rpm == last);
        last = rpm;
        if let Some(plateau) = plateau.map(|speed| speed as i64)
            && seen.last() != Some(&plateau)
        {
            seen.push(plateau);
        }
    }
    seen
}

/// The plateaus that the moves of a row mean: moves that go on the same way at the same speed are one.
fn expected_plateaus(run: &HomingResult) -> Vec<i64> {
    // "No step is made" where the switch that ends the only move is on already.
    if matches!(&*run.row.start, "both_limits_on" | "home_on_at_negative_limit") {
        return Vec::new();
    }
    let speed = |name: &str| if name == "6099:01" { 120 } else { 60 };
    let mut all: Vec<i64> = run.row.moves.iter().map(|step| i64::from(step.direction) * speed(&step.speed)).collect();
    all.dedup();
    all
}

fn shaft_pulses(bench: &mut Bench) -> f64 {
    bench.report().shaft_angle_rad / std::f64::consts::TAU * 4000.0
}

/// Where an edge is, the direction in which it is crossed, and its input.
fn edge(latch: &Latch) -> (f64, f64, u16) {
    assert!(latch.rising, "{latch:?}");
    let input = match &*latch.switch {
        "home" => 0,
        "positive_limit" => 1,
        _ => 2,
    };
    let place = if input == 0 { -400.0 } else { 8000.0 };
    let direction = f64::from(latch.direction);
    (if input == 0 { place * direction } else { place.copysign(direction) }, direction, input)
}

#[test]
fn every_start_of_every_method_goes_and_ends_as_the_table_says() {
    let runs = homing_runs();
    assert_eq!(runs.len(), 32);
    runs.iter().for_each(|run| goes_and_ends_as_the_table_says(Bench::new(), run));
}

#[test]
fn by_the_prose_all_four_methods_go_the_other_way() {
    let runs = homing_runs_by_prose();
    assert_eq!(runs.len(), 24);
    runs.iter().for_each(|run| goes_and_ends_as_the_table_says(Bench::choosing("Z050", "prose"), run));
}

fn goes_and_ends_as_the_table_says(bench: Bench, run: &HomingResult) {
    let (method, start) = (run.row.method, &*run.row.start);
    let at = format!("method {method}, {start}");
    let mut bench = put_on_track(bench, start, i64::from(method));
    assert_eq!(bench.statusword() & BITS, 0, "5.3.6, bit 10: no home position before the first run");
    bench.set(0x6040, 0x1F);
    let seen = match start {
        "bit_4_falls_on_the_way" | "halt_on_the_way" => {
            let seen = plateaus(&mut bench, 300);
            bench.set(0x6040, if start == "halt_on_the_way" { 0x11F } else { 0x0F }).run_ms(300);
            seen
        }
        _ => plateaus(&mut bench, 6000),
    };
    assert_eq!(seen, expected_plateaus(run), "{at}");
    let expected = u16::from(run.bit_8) << 8 | u16::from(run.bit_10) << 10 | u16::from(run.bit_14) << 14;
    assert_eq!(bench.statusword() & BITS, expected, "{at}: {:04X}h", bench.statusword());
    let zero = shaft_pulses(&mut bench) - bench.report().position as f64;
    if let Some(latch) = &run.row.latch {
        // 6064h reads -607Ch where the drive saw the edge, its filter time beyond it, and there the motor stands.
        let (edge, direction, input) = edge(latch);
        let beyond = (zero - HOME_OFFSET as f64 - edge) * direction;
        assert_within(&at, beyond, *FILTER_WAY.start(), *FILTER_WAY.end());
        assert_eq!(bench.get(0x6064), -HOME_OFFSET, "{at}: it stops when the switch is found");
        assert_ne!(bench.get(0x2003) as u16 & 1 << input, 0, "{at}: it ends on the switch");
    } else {
        // A rotor that turns swings by a few pulses about its vector.
        assert_within(&format!("{at}: the zero is not moved"), zero, -6.0, 6.0);
    }
}

#[test]
fn a_halted_homing_goes_on_and_attains() {
    let mut bench = on_track("halt_on_the_way", 17);
    bench.set(0x6040, 0x1F).run_ms(300);
    bench.set(0x6040, 0x11F).run_ms(500).reads(0x606C, 0);
    bench.set(0x6040, 0x1F).run_ms(5000);
    assert_eq!(bench.statusword() & BITS, 1 << 8 | 1 << 10);
}

/// 605Bh = 1: slow down and go to Ready to switch on (CiA 402-2, shutdown option code); a shaft that stands has slowed down.
#[test]
fn a_homing_that_a_halt_holds_is_shut_down_and_left_for_another_mode() {
    for halt in [0x11F, 0x10F] {
        for (controlword, mask, state) in [(0x06, 0x6F, 0x21), (0x07, 0x6F, 0x23), (0x00, 0x4F, 0x40)] {
            let mut bench = on_track("halt_on_the_way", 17);
            bench.set(0x6040, 0x1F).run_ms(300);
            bench.set(0x6040, halt).run_ms(500).reads(0x606C, 0);
            bench.set(0x6040, controlword).run_ms(50);
            assert_eq!(bench.statusword() & mask, state, "{halt:X}h, then {controlword:X}h");
        }
        let mut bench = on_track("halt_on_the_way", 17);
        bench.set(0x6040, 0x1F).run_ms(300);
        bench.set(0x6040, halt).run_ms(500).reads(0x606C, 0);
        bench.set(0x6060, 3).set(0x60FF, 60).set(0x6040, 0x0F).run_ms(1000);
        assert_eq!((bench.get(0x6061), bench.get(0x606C)), (3, 60), "{halt:X}h");
    }
}

#[test]
fn an_interrupted_homing_starts_again_with_the_next_edge_and_a_quick_stop_ends_it() {
    let mut bench = on_track("between", 18);
    for controlword in [0x1F, 0x0F, 0x1F] {
        bench.set(0x6040, controlword).run_ms(200);
    }
    assert_eq!(bench.statusword() & BITS, 1 << 14);
    bench.set(0x6040, 0x02).run_ms(300);
    bench.set(0x6040, 0x0F).run_ms(300);
    assert_eq!((bench.get(0x606C), bench.statusword() & BITS), (0, 1 << 10), "it does not go on");
}

#[test]
fn an_output_shows_that_homing_is_done() {
    let mut bench = on_track("between", 18);
    bench.set((0x2030, 0x0E), 3).set(0x6040, 0x1F).run_ms(500).reads(0x2004, 0);
    bench.run_ms(4500);
    assert_eq!(bench.get(0x2004), 2, "Y1");
    bench.set((0x2030, 0x0C), 2).run_ms(2);
    assert_eq!(bench.get(0x2004), 0, "reversed");
}

/// Home and limits anywhere around the rotor, on any inputs of either polarity, any microsteps, any of the two speeds: the edge that the method names is
/// found, as far beyond it as the filter's 10 ms are at 6099h:02.
#[test]
fn any_start_and_any_speed_leads_to_the_edge_of_the_method() {
    for seed in 0..24 {
        let mut seeded = Seeded::new(seed);
        let mut up_to = |most: usize| seeded.below(most) as i64;
        let (setting, pulses_per_turn) = [(10, 4000), (4, 3200), (13, 10_000), (9, 2000)][up_to(4) as usize];
        let (search_rpm, latch_rpm, offset) = (60 + up_to(400), 5 + up_to(90), up_to(20_000) - 10_000);
        // The home switch is wide enough for the filter to see it at the speed of the search.
        let (half, end) = (search_rpm * pulses_per_turn / 60 / 50 + up_to(200), 4 * pulses_per_turn);
        let start = up_to(3 * end as usize) - end - end / 2;
        for method in [17, 18, 24, 29] {
            let at = format!("seed {seed}, method {method} from {start}");
            let mut bench = Bench::new();
            let track = [(Some(-half), Some(half)), (Some(end), None), (None, Some(-end))];
            bench.set(0x2006, setting);
            for (n, (low, high)) in track.into_iter().enumerate() {
                let shifted = |edge: Option<i64>, by: i64| edge.map(|edge| edge - start + by);
                let (input, opens) = ((n + seed as usize) % 4, n > 0 && seed & 4 != 0);
                // A limit that opens is high everywhere but on its switch.
                let (low, high) =
                    if opens { (shifted(high, 1), shifted(low, -1)) } else { (shifted(low, 0), shifted(high, 0)) };
                bench.operate(|drive, now| drive.set_switch(input, SwitchRange { low, high }, now)).expect("an input");
                let polarity = bench.get((0x2030, 1)) | i64::from(opens) << input;
                bench.set((0x2030, 1), polarity).run_ms(20).set((0x2030, 2 + input as u8), n as i64 + 1);
            }
            for (index, sub, value) in [(0x6099, 1, search_rpm), (0x6099, 2, latch_rpm), (0x607C, 0, offset)] {
                bench.set((index, sub), value);
            }
            bench.set(0x6098, method).enable_in(6).run_ms(50);
            bench.set(0x6040, 0x1F);
            let attained = |report: &sim::Report| report.statusword.is_some_and(|word| word & BITS == 1 << 8 | 1 << 10);
            bench.seconds_until(200.0, std::time::Duration::from_millis(10), attained);
            bench.run_ms(100);
            let (edge, direction) = match method {
                17 => (-end, -1.0),
                18 => (end, 1.0),
                _ => (-half, 1.0),
            };
            let report = bench.report();
            let turned = report.shaft_angle_rad / std::f64::consts::TAU * pulses_per_turn as f64;
            let zero = start as f64 + turned - report.position as f64 - offset as f64;
            let pulses_ms = (latch_rpm * pulses_per_turn) as f64 / 60_000.0;
            // What the rotor swings about its place: a few hundredths of a full step.
            let swing = 0.002 * pulses_per_turn as f64;
            let beyond = (zero - edge as f64) * direction;
            assert_within(&at, beyond, 9.0 * pulses_ms - swing, 11.5 * pulses_ms + swing);
        }
    }
}

#[test]
fn homing_that_fails_stops_at_once_and_not_along_a_ramp() {
    // 5.3.6: at the other limit the motor stops at once. 609Ah = 2 s would be a long way.
    let mut bench = on_track("above_home_without_home_switch", 24);
    bench.set(0x609A, 2000).set((0x6099, 1), 300).set(0x6040, 0x1F);
    let look = std::time::Duration::from_micros(500);
    let backwards = |report: &sim::Report| report.velocity_demand_rpm.is_some_and(|rpm| rpm < -20.0);
    bench.seconds_until(20.0, look, backwards);
    let mut last = 0.0;
    let stands = |report: &sim::Report| {
        let now = report.velocity_demand_rpm.unwrap_or_default();
        let before = std::mem::replace(&mut last, now);
        now == 0.0 && before != 0.0
    };
    bench.seconds_until(20.0, look, stands);
    bench.run_ms(1);
    assert_eq!(bench.statusword() & BITS, 1 << 10, "failed");
    // The limit is at -8000; 10 ms of filter at up to 300 r/min are 200 pulses.
    let position = bench.report().position;
    assert!((-8220..=-8000).contains(&position), "{position}");
}

#[test]
fn the_search_keeps_to_the_step_rate_limit() {
    // 6099h:01 = 3000 r/min at 25600 pulses a turn are 1.28 MHz; 200 kHz are 468.75 r/min (2.1).
    let mut bench = Bench::new();
    for (index, sub, value) in [(0x2006, 0, 7), (0x6098, 0, 18), (0x6099, 1, 3000), (0x609A, 0, 500)] {
        bench.set((index, sub), value);
    }
    bench.enable_in(6).set(0x6040, 0x1F).run_ms(700);
    assert_eq!(bench.report().velocity_demand_rpm, Some(468.75));
}

#[test]
fn off_its_switch_the_motor_goes_back_some_way_before_it_returns() {
    // docs/drives/zlim42c.md: 0.05 turns, 200 pulses, beyond the edge. At 5 r/min (333 pulses/s) the filter takes 3 pulses
    // more and the ramp of 30 ms 5.
    for (method, start, back, edge) in [
        (24, "on_home", -1, 400),
        (29, "on_home", -1, 400),
        (17, "on_negative_limit", 1, -8000),
        (18, "on_positive_limit", -1, -8000),
    ] {
        let mut bench = on_track(start, method);
        bench.set((0x6099, 2), 5).set(0x609A, 30).set(0x6040, 0x1F);
        let (mut farthest, back) = (i64::MIN, f64::from(back));
        while bench.report().velocity_demand_rpm.is_none_or(|rpm| rpm * back >= 0.0) {
            bench.run_ms(1);
            farthest = farthest.max(bench.report().position * back as i64);
        }
        let beyond = farthest - edge;
        assert_within(&format!("pulses, method {method}"), beyond as f64, 200.0, 215.0);
    }
}

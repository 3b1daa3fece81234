//! Homing by its figures: switches at fixed places, a shaft without ramps, and one that overshoots.

use super::*;
use cia402::HomingMethod;

const RUN: HomingParameters = HomingParameters {
    sequence: None,
    search_speed: 5.0,
    latch_speed: 1.0,
    ramps: VelocityRamps { start_speed: 0.0, max_speed: 0.0, acceleration: Ramp::NONE, deceleration: Ramp::NONE },
    end: Ramp::NONE,
    back_off: 20,
    single_pass: false,
    control: Control::Position,
};

/// Limits beyond ±1000, home from 0 to 100, an index pulse at every 30 counts.
fn switches(position: i32, before: i32) -> Switches {
    let (low, high) = (position.min(before), position.max(before));
    let pulse = high.div_euclid(30) * 30;
    Switches {
        home: (0..=100).contains(&position),
        positive_limit: position >= 1000,
        negative_limit: position <= -1000,
        index: (pulse >= low && position != before && pulse != before).then_some(pulse),
    }
}

/// Runs a method from `start`, without ramps; the home position, `None` if it fails.
fn home(method: i8, start: i32) -> Option<i32> {
    home_by(&HomingParameters { sequence: HomingMethod(method).sequence(), ..RUN }, start)
}

fn home_by(parameters: &HomingParameters, start: i32) -> Option<i32> {
    let mut homing = Homing::default();
    let (mut before, mut position, mut velocity) = (start, start, 0.0);
    if let Some(found) = homing.start(parameters, switches(start, start), start) {
        return Some(found);
    }
    for _ in 0..20_000 {
        let at = TrajectoryPoint::moving(position, velocity);
        if let Some(found) = homing.watch(parameters, switches(position, before), at, position) {
            assert!(homing.take_end() && homing.state() == HomingState::Stopping);
            return Some(found);
        }
        if homing.state() == HomingState::Failed {
            return None;
        }
        velocity = homing.velocity(parameters);
        before = position;
        position += velocity as i32;
    }
    panic!("{parameters:?} from {start} has no end");
}

#[test]
fn every_method_finds_its_edge_from_every_start() {
    // The figures of methods 17 to 30: limits go off just inside ±1000, home goes on at 0 and 100, off at -1 and 101.
    let expected = [(17, -999), (18, 999), (23, -1), (24, 0), (25, 100), (26, 101), (27, 101), (28, 100), (29, 0)];
    for (method, edge) in expected.into_iter().chain([(30, -1)]) {
        for start in [-1005, -990, -500, -1, 0, 50, 100, 101, 500, 990, 1005] {
            assert_eq!(home(method, start), Some(edge), "method {method} from {start}");
        }
    }
}

#[test]
fn a_method_with_an_index_pulse_takes_the_first_one_beyond_its_edge() {
    // Pulses at multiples of 30, looked for on the way that the edge was crossed.
    for (method, pulse) in [(1, -990), (2, 990), (7, -30), (8, 30), (9, 90), (10, 120), (11, 120), (14, -30)] {
        for start in [-1005, -500, 50, 500, 1005] {
            assert_eq!(home(method, start), Some(pulse), "method {method} from {start}");
        }
    }
    assert_eq!((home(33, 50), home(34, 50)), (Some(30), Some(60)));
    assert_eq!(home(34, 995), None, "the limit comes before the pulse");
}

#[test]
fn here_is_home_without_moving() {
    assert_eq!((home(35, 77), home(37, -77)), (Some(77), Some(-77)));
}

#[test]
fn a_limit_switch_may_be_left_and_met_again_from_inside() {
    const fn row(switch: HomingSwitch, search: Direction) -> HomingRow {
        let method = HomingMethod(-1);
        HomingRow { method, switch, search, reverses_at_limit: false, edge: SwitchEdge::Rising, crossing: search }
    }
    static ROWS: [HomingRow; 2] =
        [row(HomingSwitch::NegativeLimit, Direction::Negative), row(HomingSwitch::PositiveLimit, Direction::Positive)];
    for start in [-1005, -990, -500, 0, 500, 990, 1005] {
        for (row, edge) in ROWS.iter().zip([-1000, 1000]) {
            let sequence = Some(HomingSequence { switch: Some(row), index: None });
            assert_eq!(home_by(&HomingParameters { sequence, ..RUN }, start), Some(edge), "{row:?} from {start}");
        }
    }
}

#[test]
fn both_limits_without_a_home_switch_end_the_search() {
    let parameters = HomingParameters { sequence: HomingMethod(24).sequence(), ..RUN };
    let mut homing = Homing::default();
    homing.start(&parameters, Switches::default(), 0);
    let positive = Switches { positive_limit: true, ..Switches::default() };
    let negative = Switches { negative_limit: true, ..Switches::default() };
    for (switches, velocity) in [(Switches::default(), 5.0), (positive, -5.0)] {
        assert_eq!(homing.watch(&parameters, switches, TrajectoryPoint::rest(0), 0), None);
        assert_eq!((homing.velocity(&parameters), homing.state()), (velocity, HomingState::Running));
    }
    assert_eq!(homing.watch(&parameters, negative, TrajectoryPoint::rest(0), 0), None);
    assert!(homing.state() == HomingState::Failed && homing.take_end() && homing.velocity(&parameters) == 0.0);
}

#[test]
fn without_a_method_nothing_starts() {
    let mut homing = Homing::default();
    assert_eq!(homing.state(), HomingState::None, "homing was not asked for");
    assert_eq!(homing.start(&RUN, Switches::default(), 0), None);
    assert_eq!(homing.state(), HomingState::Failed);
}

/// Walks one count at a time at one speed, with the method's switch in `on`, overshooting each turn by `overshoot` counts.
fn walk(method: i8, from: i32, on: &core::ops::Range<i32>, overshoot: i32) -> Option<i32> {
    let sequence = HomingMethod(method).sequence();
    let parameters = HomingParameters { sequence, search_speed: 1.0, back_off: 0, single_pass: true, ..RUN };
    let switches = |at: i32| match sequence?.switch?.switch {
        HomingSwitch::Home => Some(Switches { home: on.contains(&at), ..Switches::default() }),
        HomingSwitch::NegativeLimit => Some(Switches { negative_limit: on.contains(&at), ..Switches::default() }),
        HomingSwitch::PositiveLimit => Some(Switches { positive_limit: on.contains(&at), ..Switches::default() }),
    };
    let mut homing = Homing::default();
    homing.start(&parameters, switches(from)?, from);
    let (mut at, mut moving, mut coast) = (from, homing.velocity(&parameters), 0);
    for _ in 0..100_000 {
        if homing.velocity(&parameters) != moving {
            coast += 1;
            if coast > overshoot {
                (moving, coast) = (homing.velocity(&parameters), 0);
            }
        }
        at += moving as i32;
        let found = homing.watch(&parameters, switches(at)?, TrajectoryPoint::moving(at, moving), at);
        if found.is_some() {
            return found;
        }
    }
    None
}

#[test]
fn one_speed_takes_the_first_edge_in_the_right_direction_from_either_side_and_from_the_switch() {
    // Limit switches reach to the end; origin switches too, on the side that the method expects.
    let (negative, positive) = (-10_000..-100, 100..10_000);
    for overshoot in [0, 37] {
        for (method, switch, off, on, edge) in [
            (17, &negative, 0, -500, -100),
            (18, &positive, 0, 500, 99),
            (19, &positive, 0, 500, 99),
            (20, &positive, 0, 500, 100),
            (21, &negative, 0, -500, -100),
            (22, &negative, 0, -500, -101),
        ] {
            assert_eq!(walk(method, off, switch, overshoot), Some(edge), "{method} from off the switch");
            assert_eq!(walk(method, on, switch, overshoot), Some(edge), "{method} from on the switch");
        }
    }
}

#[test]
fn a_short_switch_that_is_overrun_is_found_on_the_way_back() {
    assert_eq!(walk(17, 0, &(-110..-100), 50), Some(-100));
    assert_eq!(walk(21, 0, &(-110..-100), 50), Some(-100));
}

#[test]
fn a_short_switch_that_lies_behind_is_never_found() {
    for (method, behind) in [(17, 100..200), (18, -200..-100), (19, -200..-100), (20, -200..-100), (21, 100..200)] {
        assert_eq!(walk(method, 0, &behind, 0), None, "{method}");
    }
}

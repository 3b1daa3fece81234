//! Profiles of limited jerk: closed forms, and what holds for any input.

use motion::jerk::{JerkRamp, PositionMove, velocity_change};
use motion::{Point, Profile};
use proptest::prelude::*;

const RAMP: JerkRamp = JerkRamp { rate: 100.0, begin: 1000.0, end: 1000.0 };

fn near(actual: f64, expected: f64) -> bool {
    (actual - expected).abs() <= 1e-9 * expected.abs().max(1.0)
}

fn rest_to_rest(distance: f64) -> PositionMove {
    PositionMove { distance, max_speed: 50.0, up: RAMP, down: RAMP, ..PositionMove::default() }
}

#[test]
fn a_change_takes_its_velocity_over_the_rate_and_the_rate_over_the_jerk() {
    // dv / a + a / j; half of the way is done at half of the time.
    let profile = velocity_change(10.0, 0.0, 60.0, &RAMP);
    assert!(near(profile.duration(), 0.5 + 0.1));
    assert!(near(profile.at(0.3).velocity, 35.0) && near(profile.at(0.3).acceleration, 100.0));
    assert_eq!(profile.end(), Point { position: profile.at(0.6).position, velocity: 60.0, acceleration: 0.0 });
    assert!(near(profile.end().position, 0.6 * 35.0), "symmetric: the mean speed");
    // Too small for the rate: 2 sqrt(dv / j), and a peak of sqrt(dv j).
    let small = velocity_change(0.0, 0.0, -2.5, &RAMP);
    assert!(near(small.duration(), 0.1) && near(small.at(0.05).acceleration, -50.0));
}

#[test]
fn the_two_ends_of_a_ramp_have_their_own_jerks() {
    // dv / a + a / 2 j1 + a / 2 j2.
    let ramp = JerkRamp { rate: 100.0, begin: 1000.0, end: 250.0 };
    let profile = velocity_change(0.0, 0.0, 60.0, &ramp);
    assert!(near(profile.duration(), 0.6 + 0.05 + 0.2));
    assert!(near(profile.at(0.1).acceleration, 100.0) && near(profile.at(0.85 - 0.2).acceleration, 50.0));
}

#[test]
fn a_move_of_all_seven_stretches_takes_d_over_v_and_v_over_a_and_a_over_j() {
    for distance in [100.0, -100.0] {
        let profile = rest_to_rest(distance).plan();
        assert!(near(profile.duration(), 2.0 + 0.5 + 0.1), "{}", profile.duration());
        assert_eq!(profile.end(), Point { position: distance, velocity: 0.0, acceleration: 0.0 });
        assert!(near(profile.at(1.3).velocity, 0.5 * distance) && near(profile.at(1.3).position, 0.5 * distance));
    }
}

#[test]
fn a_move_speeds_up_and_slows_down_by_rates_of_their_own() {
    let down = JerkRamp { rate: 50.0, ..RAMP };
    let profile = PositionMove { down, ..rest_to_rest(100.0) }.plan();
    // v / a + a / j each, half of the speed on the average: 0.6 s and 15, 1.05 s and 26.25; the other 58.75 at 50 a second.
    assert!(near(profile.duration(), 0.6 + 58.75 / 50.0 + 1.05), "{}", profile.duration());
    let half_of_the_speed = [0.3, profile.duration() - 0.525].map(|time_s| profile.at(time_s).velocity);
    assert!(half_of_the_speed.iter().all(|velocity| near(*velocity, 25.0)), "{half_of_the_speed:?}");
}

#[test]
fn a_move_too_short_for_rate_and_speed_takes_four_times_the_cube_root() {
    // Four equal stretches: d = 2 j t^3, where the peak acceleration j t stays below the rate.
    let profile = rest_to_rest(0.25).plan();
    let expected = 4.0 * (0.25_f64 / 2000.0).cbrt();
    assert!(near(profile.duration(), expected), "{} {expected}", profile.duration());
    // Between the two: T = a / j + sqrt((a / j)^2 + 4 d / a).
    let profile = rest_to_rest(5.0).plan();
    let expected = 0.1 + (0.01_f64 + 0.2).sqrt();
    assert!((profile.duration() - expected).abs() < 1e-6, "{} {expected}", profile.duration());
}

#[test]
fn an_end_speed_is_had_at_the_target() {
    let profile = PositionMove { end_speed: 20.0, ..rest_to_rest(100.0) }.plan();
    let at_the_end = profile.at(profile.duration() - 1e-9);
    assert!((at_the_end.velocity - 20.0).abs() < 1e-6 && (at_the_end.position - 100.0).abs() < 1e-6, "{at_the_end:?}");
    assert_eq!(profile.end(), Point { position: 100.0, velocity: 0.0, acceleration: 0.0 });
}

#[test]
fn the_same_move_planned_anew_on_the_way_ends_when_it_would_have_ended() {
    let first = rest_to_rest(30.0).plan();
    for part in 1..40 {
        let elapsed = first.duration() * f64::from(part) / 40.0;
        let Point { position, velocity, acceleration } = first.at(elapsed);
        let anew = PositionMove { velocity, acceleration, ..rest_to_rest(30.0 - position) }.plan();
        let late = anew.duration() - (first.duration() - elapsed);
        assert!(late.abs() < 0.06, "{part}: {late} s later");
        assert!(anew.end().velocity == 0.0 && overshoot(&anew, 30.0 - position) < 1e-6, "{part}");
    }
}

fn overshoot(profile: &Profile, target: f64) -> f64 {
    let steps = (0..=1000).map(|step| profile.at(profile.duration() * f64::from(step) / 1000.0).position - target);
    steps.fold(0.0, f64::max)
}

fn ramp() -> impl Strategy<Value = JerkRamp> {
    (1.0..1e4_f64, 1.0..1e5_f64, 1.0..1e5_f64).prop_map(|(rate, begin, end)| JerkRamp { rate, begin, end })
}

/// Neither velocity nor acceleration steps on the way, and the position is that of the velocity.
fn is_smooth(profile: &Profile, start: Point, jerk: f64) -> Result<(), TestCaseError> {
    let steps = 2_000;
    let dt = profile.duration() / f64::from(steps);
    let mut before = start;
    // Not the end itself, where a move steps to rest from its end speed.
    let before_the_end = 1e-9 * profile.duration();
    for step in 1..=steps {
        let now = profile.at(dt * f64::from(step) - before_the_end);
        let scale = 1.0 + now.velocity.abs() + before.velocity.abs();
        prop_assert!((now.acceleration - before.acceleration).abs() <= jerk * dt * 1.001 + 1e-6 * scale, "{step}");
        let mean = 0.5 * (now.velocity + before.velocity);
        let moved = now.position - before.position;
        prop_assert!((moved - mean * dt).abs() <= jerk * dt * dt * dt + 1e-6 * scale * dt + 1e-9 * now.position.abs());
        before = now;
    }
    let (end, expected) = (before.position + before.velocity * before_the_end, profile.end().position);
    prop_assert!((end - expected).abs() <= 1e-6 * (1.0 + expected.abs()), "{end} {expected}");
    Ok(())
}

proptest! {
    #[test]
    fn a_change_keeps_to_rate_and_jerk_and_ends_at_its_velocity(
        from in -1e3..1e3_f64, to in -1e3..1e3_f64, share in -1.0..1.0_f64, ramp in ramp(),
    ) {
        let acceleration = share * ramp.rate;
        let profile = velocity_change(from, acceleration, to, &ramp);
        prop_assert_eq!(profile.end().velocity, to);
        let start = Point { position: 0.0, velocity: from, acceleration };
        is_smooth(&profile, start, ramp.begin.max(ramp.end))?;
        let fastest = (0..=100).map(|part| profile.at(profile.duration() * f64::from(part) / 100.0).acceleration.abs());
        prop_assert!(fastest.fold(0.0, f64::max) <= ramp.rate * 1.001);
    }

    #[test]
    fn a_move_ends_on_its_target_and_keeps_to_speed_rate_and_jerk(
        distance in -1e4..1e4_f64, share in -1.0..1.0_f64, max_speed in 1.0..1e3_f64, end in 0.0..1.0_f64,
        up in ramp(), down in ramp(),
    ) {
        let velocity = share * max_speed;
        let end_speed = end * max_speed;
        let profile = PositionMove { distance, velocity, acceleration: 0.0, max_speed, end_speed, up, down }.plan();
        prop_assert_eq!(profile.end().position, distance);
        let jerk = up.begin.max(up.end).max(down.begin).max(down.end);
        is_smooth(&profile, Point { position: 0.0, velocity, acceleration: 0.0 }, jerk)?;
        for part in 0..=100 {
            let at = profile.at(profile.duration() * f64::from(part) / 100.0);
            prop_assert!(at.velocity.abs() <= max_speed * 1.001);
            prop_assert!(at.acceleration.abs() <= up.rate.max(down.rate) * 1.001);
        }
    }

    #[test]
    fn no_input_breaks_the_planner(parts in prop::array::uniform11(prop_oneof![
        Just(0.0), Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), Just(1e300), Just(-1e-300), any::<f64>(),
    ])) {
        let [distance, velocity, acceleration, max_speed, end_speed, a, b, c, d, e, f] = parts;
        let up = JerkRamp { rate: a, begin: b, end: c };
        let down = JerkRamp { rate: d, begin: e, end: f };
        let plan = PositionMove { distance, velocity, acceleration, max_speed, end_speed, up, down }.plan();
        for time_s in [0.0, 1e-3, 1.0, 1e9, f64::NAN] {
            let at = plan.at(time_s);
            prop_assert!(at.velocity.is_finite() && !at.position.is_nan(), "{:?}", at);
        }
        prop_assert!(velocity_change(velocity, acceleration, max_speed, &up).duration().is_finite());
    }
}

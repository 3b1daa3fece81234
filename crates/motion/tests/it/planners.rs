//! Properties of the planners: ends, limits, continuity, durations, symmetry, and that no input breaks them.

use motion::{Point, Profile, scurve, trapezoid};
use proptest::prelude::*;

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs().max(1e-9)
}

/// A move from rest to rest over the two shapes, by paces of the plateau speed.
fn both(distance: f64, velocity: f64, start: f64, max: f64, end: f64, up_s: f64, down_s: f64) -> [Profile; 2] {
    let s = scurve::PositionMove {
        distance,
        velocity,
        start_speed: start,
        max_speed: max,
        end_speed: end,
        acceleration_time_s: up_s,
        deceleration_time_s: down_s,
    };
    let rate = |time_s: f64| if time_s > 0.0 { max / time_s } else { 0.0 };
    let t = trapezoid::PositionMove {
        distance,
        velocity,
        start_speed: start,
        max_speed: max,
        end_speed: end,
        acceleration: rate(up_s),
        deceleration: rate(down_s),
    };
    [s.plan(), t.plan()]
}

#[test]
fn a_full_move_takes_distance_over_speed_plus_half_of_both_ramps() {
    for profile in both(100_000.0, 0.0, 0.0, 20_000.0, 0.0, 0.5, 0.3) {
        assert!(near(profile.duration(), 5.0 + 0.25 + 0.15, 1e-12));
        assert_eq!(profile.end(), Point { position: 100_000.0, velocity: 0.0, acceleration: 0.0 });
        let plateau = profile.at(2.0);
        assert_eq!((plateau.velocity, plateau.acceleration), (20_000.0, 0.0));
        // Half way up the ramp a quarter of the time's way is not yet gone: symmetric ramps average half speed.
        assert!(near(profile.at(0.5).position, 5_000.0, 1e-12));
    }
}

#[test]
fn the_s_curve_peaks_at_twice_the_mean_acceleration_in_the_middle_and_is_smooth_at_its_ends() {
    let profile = scurve::velocity_change(0.0, 300.0, 0.6);
    assert!(near(profile.at(0.3).acceleration, 2.0 * 300.0 / 0.6, 1e-12));
    assert!(near(profile.at(0.3).velocity, 150.0, 1e-12));
    assert!(near(profile.at(0.15).velocity, 300.0 / 8.0, 1e-12));
    assert!(profile.at(1e-9).acceleration < 1e-4 && profile.at(0.6 - 1e-9).acceleration < 1e-4);
    assert!(near(profile.at(0.6).position, 90.0, 1e-12));
    assert!(near(profile.at(1.6).position, 390.0, 1e-12));
}

#[test]
fn the_trapezoid_keeps_its_acceleration() {
    let profile = trapezoid::velocity_change(100.0, -200.0, 600.0);
    assert!(near(profile.duration(), 0.5, 1e-12));
    assert_eq!(
        profile.at(0.25),
        Point { position: 100.0 * 0.25 - 600.0 * 0.25 * 0.25 / 2.0, velocity: -50.0, acceleration: -600.0 }
    );
}

#[test]
fn a_short_move_keeps_the_pace_with_a_lower_peak() {
    // 2 pace * peak^2 / 2 = distance, pace = 0.5 s / 1000.
    for profile in both(100.0, 0.0, 0.0, 1000.0, 0.0, 0.5, 0.5) {
        let peak = (100.0_f64 / (0.5 / 1000.0)).sqrt();
        assert!(near(profile.duration(), 2.0 * peak * 0.5 / 1000.0, 1e-12));
        assert!(near(profile.at(profile.duration() / 2.0).velocity, peak, 1e-9));
    }
}

#[test]
fn the_motion_begins_with_a_step_to_the_start_speed_and_ends_from_the_end_speed() {
    for profile in both(10_000.0, 0.0, 50.0, 1000.0, 80.0, 0.5, 0.5) {
        assert_eq!(profile.at(0.0).velocity, 50.0);
        assert!(near(profile.at(profile.duration() - 1e-9).velocity, 80.0, 1e-6));
        assert_eq!(profile.at(profile.duration()).velocity, 0.0);
        assert_eq!(profile.at(profile.duration()).position, 10_000.0);
    }
}

#[test]
fn without_times_the_speed_steps_and_the_distance_is_still_exact() {
    for profile in both(-5_000.0, 0.0, 0.0, 1000.0, 0.0, 0.0, 0.0) {
        assert_eq!(profile.duration(), 5.0);
        assert_eq!(profile.at(2.5), Point { position: -2_500.0, velocity: -1000.0, acceleration: 0.0 });
        assert_eq!(profile.at(5.0).position, -5_000.0);
    }
}

#[test]
fn a_move_begun_in_motion_away_from_the_target_stops_and_turns_back() {
    for profile in both(1_000.0, -400.0, 0.0, 1000.0, 0.0, 0.5, 0.5) {
        assert_eq!(profile.at(0.0).velocity, -400.0);
        // Pace 0.5 s / 1000: 0.2 s and 40 units to rest.
        assert!(near(profile.at(0.2).position, -40.0, 1e-9));
        assert!(profile.at(0.2).velocity.abs() < 1e-6);
        assert_eq!(profile.end().position, 1_000.0);
    }
}

#[test]
fn a_move_begun_too_fast_to_stop_runs_past_and_comes_back() {
    for profile in both(100.0, 800.0, 0.0, 1000.0, 0.0, 0.5, 0.5) {
        // 800^2 / 2 * 0.5 / 1000 = 160 units to rest.
        assert!(near(profile.at(0.4).position, 160.0, 1e-9));
        assert_eq!(profile.end().position, 100.0);
        assert!(profile.at(profile.duration() - 1e-3).velocity < 0.0);
    }
}

#[test]
fn a_move_begun_faster_than_its_plateau_slows_down_to_it_and_ends_from_the_end_speed() {
    for distance in [1000.0_f64, -1000.0] {
        // 400 1/s^2: to 200 in 0.5 s, from 200 to 100 in 0.25 s; (400^2 - 100^2) / 800 = 187.5 on both, the rest at 200.
        let velocity = 400_f64.copysign(distance);
        let s = both(distance, velocity, 0.0, 200.0, 100.0, 0.5, 0.25)[0];
        let t = both(distance, velocity, 0.0, 200.0, 100.0, 0.5, 0.5)[1];
        for profile in [s, t] {
            assert!(near(profile.duration(), 0.5 + 812.5 / 200.0 + 0.25, 1e-12), "{}", profile.duration());
            let before_the_end = profile.at(profile.duration() - 1e-9);
            assert!(near(before_the_end.velocity.abs(), 100.0, 1e-4) && near(before_the_end.position, distance, 1e-6));
        }
    }
}

#[test]
fn no_distance_from_rest_takes_no_time() {
    for profile in both(0.0, 0.0, 10.0, 1000.0, 10.0, 0.5, 0.5) {
        assert_eq!((profile.duration(), profile.at(0.0)), (0.0, Point::default()));
    }
}

#[test]
fn no_distance_from_motion_stops_and_returns() {
    for profile in both(0.0, 600.0, 0.0, 1000.0, 0.0, 0.5, 0.5) {
        assert!(near(profile.at(0.3).position, 90.0, 1e-9));
        assert_eq!(profile.end().position, 0.0);
    }
}

#[test]
fn no_speed_only_brings_the_motion_to_rest() {
    let s = scurve::PositionMove { distance: 100.0, velocity: 50.0, deceleration_time_s: 0.5, ..Default::default() };
    assert!(s.plan().end().position < 100.0);
    assert_eq!(s.plan().end().velocity, 0.0);
}

#[test]
fn two_to_the_31_counts_end_to_well_below_a_count() {
    let distance = 2_147_483_647.0;
    for profile in both(distance, 0.0, 0.0, 68_266.7, 0.0, 0.5, 0.5) {
        let before_end = profile.at(profile.duration() - 1e-6);
        assert!((before_end.position - distance).abs() < 1e-3, "{}", before_end.position - distance);
        assert_eq!(profile.at(profile.duration()).position, distance);
    }
}

/// Walks through a profile and checks what holds between neighbouring points.
fn check_walk(profile: &Profile, distance: f64, velocity: f64, limit: f64, rate: f64) -> Result<(), TestCaseError> {
    let steps = 2000;
    let dt = profile.duration() / f64::from(steps);
    let mut last = profile.at(0.0);
    for step in 1..=steps {
        let time = dt * f64::from(step);
        let point = profile.at(time);
        prop_assert!(point.position.is_finite() && point.velocity.is_finite() && point.acceleration.is_finite());
        prop_assert!(point.velocity.abs() <= limit * (1.0 + 1e-9), "{} over {limit}", point.velocity);
        prop_assert!(point.acceleration.abs() <= 2.0 * rate * (1.0 + 1e-6), "{} over {rate}", point.acceleration);
        // Position is the integral of velocity: no step is longer than the fastest of the limits.
        let way = (point.position - last.position).abs();
        prop_assert!(way <= limit * dt * (1.0 + 1e-6) + 1e-9 * distance.abs() + 1e-9, "{way} in {dt}");
        if step < steps {
            let jump = (point.velocity - last.velocity).abs();
            prop_assert!(jump <= 2.0 * rate * dt * (1.0 + 1e-6) + 1e-6 * limit, "{jump} in {dt}");
        }
        if velocity == 0.0 {
            prop_assert!((point.position - last.position) * distance >= -1e-9 * distance * distance, "turned back");
        }
        last = point;
    }
    prop_assert_eq!(profile.end(), Point { position: distance, velocity: 0.0, acceleration: 0.0 });
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn moves_from_rest_keep_limits_and_end_exactly(
        distance in -1e6..1e6_f64, max in 1.0..1e5_f64, up_s in 0.001..2.0_f64, down_s in 0.001..2.0_f64,
    ) {
        for profile in both(distance, 0.0, 0.0, max, 0.0, up_s, down_s) {
            check_walk(&profile, distance, 0.0, max, max / up_s.min(down_s))?;
        }
    }

    #[test]
    fn moves_begun_in_motion_keep_limits_and_end_exactly(
        distance in -1e5..1e5_f64, velocity in -1e4..1e4_f64, max in 1.0..1e4_f64,
        up_s in 0.01..2.0_f64, down_s in 0.01..2.0_f64,
    ) {
        let limit = max.max(velocity.abs());
        // The S curve's time is for the change from the present speed, so its pace may be faster than max / time
        // only when the present speed is far off; the trapezoid's never.
        let [s, t] = both(distance, velocity, 0.0, max, 0.0, up_s, down_s);
        check_walk(&t, distance, velocity, limit, max / up_s.min(down_s))?;
        check_walk(&s, distance, velocity, limit, max / up_s.min(down_s))?;
        prop_assert_eq!(s.at(0.0).velocity, velocity);
    }

    #[test]
    fn start_and_end_speeds_never_lengthen_a_move(
        distance in 1.0..1e5_f64, max in 10.0..1e4_f64, start in 0.0..1e4_f64, end in 0.0..1e4_f64,
        up_s in 0.01..2.0_f64, down_s in 0.01..2.0_f64,
    ) {
        let [_, plain] = both(distance, 0.0, 0.0, max, 0.0, up_s, down_s);
        let [_, stepped] = both(distance, 0.0, start, max, end, up_s, down_s);
        prop_assert!(stepped.duration() <= plain.duration() * (1.0 + 1e-9));
        for step in 0..200 {
            let point = stepped.at(stepped.duration() * f64::from(step) / 200.0);
            prop_assert!(point.velocity <= max * (1.0 + 1e-9) && point.position <= distance * (1.0 + 1e-9));
        }
        let near_end = stepped.at(stepped.duration() * (1.0 - 1e-12));
        prop_assert!((near_end.position - distance).abs() < 1e-6 * distance, "{} of {}", near_end.position, distance);
    }

    #[test]
    fn the_mirrored_move_is_the_mirror_of_the_move(
        distance in -1e5..1e5_f64, velocity in -1e4..1e4_f64, start in 0.0..100.0_f64, end in 0.0..100.0_f64,
        share in 0.0..1.0_f64,
    ) {
        let one = both(distance, velocity, start, 2000.0, end, 0.4, 0.3);
        let other = both(-distance, -velocity, start, 2000.0, end, 0.4, 0.3);
        for (one, other) in one.iter().zip(&other) {
            let (a, b) = (one.at(share * one.duration()), other.at(share * other.duration()));
            prop_assert_eq!((a.position, a.velocity, a.acceleration), (-b.position, -b.velocity, -b.acceleration));
        }
    }

    #[test]
    fn no_input_breaks_a_planner(
        distance in any::<f64>(), velocity in any::<f64>(), start in any::<f64>(), max in any::<f64>(),
        end in any::<f64>(), up in any::<f64>(), down in any::<f64>(), time in any::<f64>(),
    ) {
        let s = scurve::PositionMove {
            distance, velocity, start_speed: start, max_speed: max, end_speed: end,
            acceleration_time_s: up, deceleration_time_s: down,
        };
        let t = trapezoid::PositionMove {
            distance, velocity, start_speed: start, max_speed: max, end_speed: end, acceleration: up, deceleration: down,
        };
        let changes = [scurve::velocity_change(velocity, max, up), trapezoid::velocity_change(velocity, max, up)];
        for profile in [s.plan(), t.plan()].into_iter().chain(changes) {
            prop_assert!(profile.duration() >= 0.0 && profile.duration().is_finite());
            for share in [0.0, 0.1, 0.5, 0.9, 1.0, time] {
                let point = profile.at(share * profile.duration());
                if share.is_finite() && share.abs() < 1e15 {
                    let values = [point.position, point.velocity, point.acceleration];
                    prop_assert!(values.iter().all(|x| !x.is_nan()), "{point:?} at {share}");
                }
            }
        }
    }
}

//! The control loops against closed forms, on plants of the test's own.

use motion::commutation::{Commutation, CommutationModel};
use motion::foc::{FeedForward, Foc, FocGains, FocInput, modulate};
use motion::frames::{AlphaBeta, Dq, clarke, inverse_clarke, inverse_park, park};
use motion::observer::{Observer, ObserverGains};
use motion::pid::{Pi, PiGains};
use proptest::prelude::*;

const DT_S: f32 = 50e-6;

/// A coil stepped exactly: current under a constant voltage for one period.
fn coil(current_a: f64, volts: f64, resistance_ohm: f64, inductance_h: f64, dt_s: f64) -> f64 {
    let last = volts / resistance_ohm;
    last + (current_a - last) * (-dt_s * resistance_ohm / inductance_h).exp()
}

#[test]
fn a_cancelled_winding_rises_as_a_first_order_lag() {
    let (resistance_ohm, inductance_h, bandwidth) = (0.3, 0.7e-3, 500.0);
    let gains = PiGains::for_winding(bandwidth, resistance_ohm, inductance_h);
    let dt_s = 5e-6_f32;
    let (mut pi, mut current) = (Pi::default(), 0.0_f64);
    for tick in 0..2000 {
        let expected = 1.0 - (-f64::from(bandwidth) * f64::from(tick) * f64::from(dt_s)).exp();
        assert!((current - expected).abs() < 5e-3, "{current} {expected} at {tick}");
        let volts = pi.update(&gains, 1.0 - current as f32, 0.0, 100.0, dt_s);
        current = coil(current, f64::from(volts), 0.3, 0.7e-3, f64::from(dt_s));
    }
}

#[test]
fn a_pi_on_a_coil_follows_the_analytic_second_order_step() {
    // Integral action alone with R: s^2 L + s R + ki; kp = 0.7 V/A, ki chosen for a damping of 0.5.
    let (r, l, kp) = (0.3_f64, 0.7e-3_f64, 0.7_f64);
    let damping = 0.5;
    let natural = (r + kp) / (2.0 * damping * l);
    let ki = natural * natural * l;
    let gains = PiGains { proportional: kp as f32, integral_per_s: ki as f32 };
    let dt_s = 1e-6_f32;
    let (mut pi, mut current) = (Pi::default(), 0.0_f64);
    let damped = natural * (1.0 - damping * damping).sqrt();
    for tick in 0..8000 {
        let t = f64::from(tick) * f64::from(dt_s);
        // Step response of (kp s + ki) / (L s^2 + (R + kp) s + ki).
        let decay = (-damping * natural * t).exp();
        let expected = 1.0 - decay * ((damped * t).cos() + (damping * natural - kp / l) / damped * (damped * t).sin());
        assert!((current - expected).abs() < 5e-3, "{current} {expected} at {t}");
        let volts = pi.update(&gains, (1.0 - current) as f32, 0.0, 1000.0, dt_s);
        current = coil(current, f64::from(volts), r, l, f64::from(dt_s));
    }
}

/// At its set-point a current loop asks for the voltages of the motion alone: -w L_q i_q, and w (L_d i_d + psi).
#[test]
fn the_feed_forward_is_the_voltage_that_a_turning_motor_induces() {
    let motor = FeedForward { inductance_d_h: 0.4e-3, inductance_q_h: 0.7e-3, flux_linkage_wb: 6e-3 };
    let winding = PiGains::for_winding(500.0, 0.3, 0.7e-3);
    let gains =
        FocGains { d: winding, q: winding, feed_forward: Some(motor), modulation_limit: 1.0, voltage_delay_s: 0.0 };
    for (electrical_rad_s, current_a) in [(1000.0, Dq { d: -2.0, q: 5.0 }), (-300.0, Dq { d: 0.0, q: -4.0 })] {
        let (sin, cos) = motion::angle::sin_cos_turns(0.2);
        let phase_current_a = inverse_clarke(inverse_park(current_a, sin, cos));
        let input = FocInput { phase_current_a, electrical_turns: 0.2, electrical_rad_s, bus_v: 100.0 };
        let wanted = Foc::default().tick(&gains, current_a, &input, DT_S).wanted_v;
        let expected =
            Dq { d: -electrical_rad_s * 0.7e-3 * current_a.q, q: electrical_rad_s * (0.4e-3 * current_a.d + 6e-3) };
        assert!(
            (wanted.d - expected.d).abs() < 1e-3 && (wanted.q - expected.q).abs() < 1e-3,
            "{wanted:?} {expected:?}"
        );
    }
}

#[test]
fn an_integral_does_not_wind_up_at_the_limit() {
    let gains = PiGains { proportional: 2.0, integral_per_s: 100.0 };
    let mut pi = Pi::default();
    for _ in 0..100_000 {
        assert_eq!(pi.update(&gains, 10.0, 0.0, 5.0, 1e-3), 5.0);
    }
    // Back-calculation holds u at the limit plus the proportional part's excess: it leaves within a few periods.
    let mut periods = 0;
    while pi.update(&gains, -0.5, 0.0, 5.0, 1e-3) >= 5.0 {
        periods += 1;
        assert!(periods < 5);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_pi_never_exceeds_its_limit_and_stays_finite(
        errors in prop::collection::vec(-1e3..1e3_f32, 1..200), kp in 0.0..100.0_f32, ki in 0.0..1e5_f32,
        limit in 0.0..100.0_f32,
    ) {
        let gains = PiGains { proportional: kp, integral_per_s: ki };
        let mut pi = Pi::default();
        for error in errors {
            let out = pi.update(&gains, error, 0.0, limit, DT_S);
            prop_assert!(out.abs() <= limit && pi.integral.is_finite());
        }
    }

    #[test]
    fn transforms_undo_each_other(d in -30.0..30.0_f32, q in -30.0..30.0_f32, turns in 0.0..1.0_f32) {
        let (sin, cos) = motion::angle::sin_cos_turns(turns);
        let back = park(clarke(inverse_clarke(inverse_park(Dq { d, q }, sin, cos))), sin, cos);
        prop_assert!((back.d - d).abs() < 1e-4 && (back.q - q).abs() < 1e-4);
    }

    #[test]
    fn duties_give_any_voltage_within_the_circle_and_stay_between_the_rails(
        share in 0.0..1.0_f32, turns in 0.0..1.0_f32, bus_v in 10.0..80.0_f32,
    ) {
        let (sin, cos) = motion::angle::sin_cos_turns(turns);
        let amplitude = share * bus_v / 3.0_f32.sqrt();
        let wanted = AlphaBeta { alpha: amplitude * cos, beta: amplitude * sin };
        let duty = modulate(wanted, bus_v);
        prop_assert!(duty.iter().all(|d| (0.0..=1.0).contains(d)));
        let given = clarke(duty.map(|d| d * bus_v));
        prop_assert!((given.alpha - wanted.alpha).abs() < 1e-3 && (given.beta - wanted.beta).abs() < 1e-3);
    }
}

/// Runs an observer over a motion given as counts at each period.
fn observe(gains: &ObserverGains, periods: u32, position: impl Fn(f64) -> f64, mut seen: impl FnMut(u32, f64)) {
    let mut observer = Observer::new(position(0.0).floor() as i64 as u16);
    for period in 1..=periods {
        let count = position(f64::from(period) * f64::from(DT_S)).floor() as i64 as u16;
        let velocity = observer.update(gains, count) / DT_S;
        seen(period, f64::from(velocity));
    }
}

#[test]
fn constant_speeds_from_one_to_a_thousand_turns_per_minute_are_read_to_a_few_percent() {
    let gains = ObserverGains::new(2e-3, 0.2, DT_S);
    for r_min in [1.0, -1.0, 3.3, 10.0, 47.0, 100.0, 333.0, -1000.0, 1000.0] {
        let counts_s = r_min / 60.0 * 4096.0;
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        observe(
            &gains,
            40_000,
            |t| counts_s * t + 0.3,
            |period, velocity| {
                if period > 20_000 {
                    sum += velocity / 20_000.0;
                    worst = worst.max((velocity / counts_s - 1.0).abs());
                }
            },
        );
        assert!((sum / counts_s - 1.0).abs() < 0.005, "mean {sum} of {counts_s}");
        assert!(worst < 0.06, "worst {worst} at {r_min} r/min");
    }
}

#[test]
fn a_motor_that_stops_reads_less_and_less_and_then_zero() {
    let gains = ObserverGains::new(2e-3, 0.2, DT_S);
    let mut at_10_ms = f64::NAN;
    let mut at_end = f64::NAN;
    observe(
        &gains,
        10_000,
        |t| 2000.0 * t.min(0.1),
        |period, velocity| match period {
            2200 => at_10_ms = velocity,
            10_000 => at_end = velocity,
            _ => {}
        },
    );
    assert!((0.0..=101.0).contains(&at_10_ms), "{at_10_ms}");
    assert_eq!(at_end, 0.0);
}

#[test]
fn dither_over_one_edge_reads_as_no_motion() {
    let gains = ObserverGains::new(2e-3, 0.2, DT_S);
    observe(
        &gains,
        4_000,
        |t| 100.0 + 0.4 * (t * 300.0).sin(),
        |period, velocity| {
            if period > 1000 {
                assert_eq!(velocity, 0.0);
            }
        },
    );
}

#[test]
fn a_ramp_is_read_with_the_delay_of_half_the_span() {
    let gains = ObserverGains::new(2e-3, 0.2, DT_S);
    let slope = 100_000.0;
    let mut mean_lag_s = 0.0;
    observe(
        &gains,
        8_000,
        |t| 0.5 * slope * t * t,
        |period, velocity| {
            if period > 2000 {
                mean_lag_s += (f64::from(period) * f64::from(DT_S) - velocity / slope) / 6_000.0;
            }
        },
    );
    // Spans run from half a window to a window: 1.5 ms on average.
    assert!((0.5e-3..1.0e-3).contains(&mean_lag_s), "{mean_lag_s} s behind");
}

const MODEL: CommutationModel =
    CommutationModel { counts_per_turn: 4096, pole_pairs: 15, offset_turns: 0.0, sequence: [5, 1, 3, 2, 6, 4] };

/// True electrical angle, and what the sensors read, at a mechanical angle in turns.
fn sensors(turns: f64) -> (f64, u8, u16) {
    let electrical = (turns * 15.0).rem_euclid(1.0);
    let hall = MODEL.sequence[((electrical * 6.0) as usize).min(5)];
    (electrical, hall, (turns * 4096.0).floor() as i64 as u16)
}

fn difference(a: f64, b: f64) -> f64 {
    (a - b + 0.5).rem_euclid(1.0) - 0.5
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_angle_is_within_thirty_degrees_at_once_and_exact_after_a_hall_edge(
        start in 0.0..1.0_f64, step in 0.00001..0.0002_f64, backwards in any::<bool>(),
    ) {
        let step = if backwards { -step } else { step };
        let (true_angle, hall, count) = sensors(start);
        let mut commutation = Commutation::new(&MODEL, hall, count);
        let first = f64::from(commutation.update(&MODEL, hall, count));
        prop_assert!(difference(first, true_angle).abs() <= 1.0 / 12.0 + 0.004);
        for k in 1..4000 {
            let (true_angle, hall, count) = sensors(start + step * f64::from(k));
            let angle = f64::from(commutation.update(&MODEL, hall, count));
            // One count is 15/4096 electrical turns; the Hall edge is seen up to one step late.
            let slack = if commutation.is_aligned() { 15.0 * (2.0 / 4096.0 + step.abs()) } else { 1.0 / 12.0 + 0.01 };
            prop_assert!(difference(angle, true_angle).abs() <= slack, "{angle} {true_angle} at {k}");
        }
        prop_assert!(commutation.is_aligned());
        prop_assert!(commutation.disagreement_turns().abs() < 0.02);
    }
}

#[test]
fn lost_counts_show_as_disagreement() {
    let (_, hall, count) = sensors(0.0);
    let mut commutation = Commutation::new(&MODEL, hall, count);
    let mut lost = 0;
    for k in 0..8000 {
        let (_, hall, count) = sensors(f64::from(k) * 1e-5);
        if k == 4000 {
            lost = 40;
        }
        commutation.update(&MODEL, hall, count.wrapping_sub(lost));
    }
    // 40 counts of 15/4096 electrical turns.
    assert!((commutation.disagreement_turns() + 40.0 * 15.0 / 4096.0).abs() < 0.01);
}

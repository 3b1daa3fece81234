//! The control loops of this crate around the motor of crate `plant`: encoder and Hall in, duty cycles out, as a
//! drive's firmware joins them. Nothing is told to the controller that its sensors do not read.

mod rig;

use motion::cascade::{PositionDemand, VelocityDemand};
use motion::scurve::PositionMove;
use rig::{COUNTS_PER_TURN, Rig, rad_s};

#[test]
fn a_current_step_rises_with_the_chosen_bandwidth_and_does_not_overshoot() {
    let mut rig = Rig::new();
    rig.motor.load.locked = true;
    let mut peak = 0.0_f64;
    let mut at_time_constant = 0.0;
    // From the exact angle, so that d and q are what they are called.
    rig.align();
    for tick in 0..400 {
        rig.tick_current(5.0);
        peak = peak.max(rig.motor.pmsm.current_a.q);
        if f64::from(tick) * 50e-6 < 1.0 / 3000.0 {
            at_time_constant = rig.motor.pmsm.current_a.q;
        }
    }
    assert!((2.8..4.0).contains(&at_time_constant), "{at_time_constant} A after one time constant");
    assert!(peak < 5.0 * 1.05, "{peak}");
    assert!((rig.motor.pmsm.current_a.q - 5.0).abs() < 0.01);
}

#[test]
fn a_velocity_ramp_is_followed_with_less_than_ten_percent_overshoot() {
    let mut rig = Rig::new();
    let target = rad_s(200.0);
    let profile = motion::scurve::velocity_change(0.0, f64::from(target), 0.2);
    let mut peak = 0.0_f32;
    for tick in 0..20_000 {
        let point = profile.at(f64::from(tick) * 50e-6);
        let demand =
            VelocityDemand { velocity_rad_s: point.velocity as f32, acceleration_rad_s2: point.acceleration as f32 };
        rig.tick_velocity(&demand);
        peak = peak.max(rig.motor.rotor.velocity_rad_s as f32);
    }
    assert!(peak < target * 1.10, "{peak} of {target}");
    assert!((rig.motor.rotor.velocity_rad_s as f32 - target).abs() < 0.01 * target);
}

#[test]
fn a_velocity_step_without_a_ramp_overshoots_less_than_ten_percent() {
    let mut rig = Rig::new();
    let target = rad_s(100.0);
    let demand = VelocityDemand { velocity_rad_s: target, acceleration_rad_s2: 0.0 };
    let mut peak = 0.0_f32;
    for _ in 0..20_000 {
        rig.tick_velocity(&demand);
        peak = peak.max(rig.motor.rotor.velocity_rad_s as f32);
    }
    assert!(peak < target * 1.10, "{peak} of {target}");
    assert!((rig.motor.rotor.velocity_rad_s as f32 - target).abs() < 0.01 * target);
}

#[test]
fn one_turn_per_minute_is_held_smoothly() {
    let mut rig = Rig::new();
    let target = rad_s(1.0);
    let demand = VelocityDemand { velocity_rad_s: target, acceleration_rad_s2: 0.0 };
    for _ in 0..40_000 {
        rig.tick_velocity(&demand);
    }
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    let start = rig.motor.rotor.angle.as_rad();
    for _ in 0..40_000 {
        rig.tick_velocity(&demand);
        let velocity = rig.motor.rotor.velocity_rad_s;
        (least, most) = (least.min(velocity), most.max(velocity));
    }
    let mean = (rig.motor.rotor.angle.as_rad() - start) / 2.0;
    assert!((mean - f64::from(target)).abs() < 0.05 * f64::from(target), "mean {mean}");
    assert!(least > 0.0 && most < 2.0 * f64::from(target), "{least} to {most} about {target}");
}

#[test]
fn a_position_move_ends_within_two_counts_and_hardly_overshoots() {
    let mut rig = Rig::new();
    let distance = 10.0 * COUNTS_PER_TURN;
    let profile = PositionMove {
        distance,
        max_speed: 200.0 / 60.0 * COUNTS_PER_TURN,
        acceleration_time_s: 0.3,
        deceleration_time_s: 0.3,
        ..PositionMove::default()
    }
    .plan();
    let start = rig.position();
    let mut highest = 0.0_f64;
    let mut worst_lag = 0.0_f64;
    let ticks = (profile.duration() / 50e-6) as u32 + 10_000;
    for tick in 0..ticks {
        let point = profile.at(f64::from(tick) * 50e-6);
        let travelled = f64::from(rig.position() - start);
        rig.tick_position(&rig.demand(point, travelled));
        highest = highest.max(travelled - distance);
        worst_lag = worst_lag.max((point.position - travelled).abs());
    }
    let rest = f64::from(rig.position() - start) - distance;
    assert!(rest.abs() <= 2.0, "ended {rest} counts off");
    assert!(highest < 20.0, "overshot by {highest} counts");
    // The drive's own alarm threshold: object 2017h, 409 x 10 counts.
    assert!(worst_lag < 400.0, "lagged by {worst_lag} counts");
}

#[test]
fn a_load_step_is_fought_and_the_position_returns() {
    let mut rig = Rig::new();
    let start = rig.position();
    let mut worst = 0;
    for tick in 0..40_000 {
        if tick == 10_000 {
            rig.motor.load.torque_nm = 4.0;
        }
        let off = rig.position() - start;
        rig.tick_position(&rig.demand(motion::Point::default(), f64::from(off)));
        worst = worst.max(off.abs());
    }
    assert!((rig.position() - start).abs() <= 1, "{} counts off", rig.position() - start);
    assert!((2..60).contains(&worst), "gave way by {worst} counts");
    // Kt i_q carries the load; dry friction may help with its share.
    let q = rig.motor.pmsm.current_a.q;
    assert!((q - 4.0 / 0.7613).abs() < 0.2, "{q} A");
}

#[test]
fn nothing_moves_while_nothing_is_asked() {
    let mut rig = Rig::new();
    let before = rig.motor.rotor.angle;
    for _ in 0..2_000 {
        rig.tick_position(&PositionDemand::default());
    }
    assert_eq!(rig.motor.rotor.angle, before);
}

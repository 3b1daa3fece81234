//! The control loops of this crate around the motor of crate `plant`: encoder and Hall in, duty cycles out, as a
//! drive's firmware joins them. The controller gets nothing that its sensors do not read.

use crate::rig::{AT_1_KHZ, AT_4_KHZ, COUNTS_PER_TURN, Rig, rad_s};
use motion::cascade::{PositionDemand, VelocityDemand};
use motion::scurve::PositionMove;
use plant::HubMotorModel;

#[test]
fn a_current_step_rises_with_the_chosen_bandwidth_and_does_not_overshoot() {
    let mut rig = Rig::new(AT_4_KHZ);
    rig.motor.rig.load.locked = true;
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
    let mut rig = Rig::new(AT_4_KHZ);
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
    let mut rig = Rig::new(AT_4_KHZ);
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
fn the_fast_winding_runs_at_a_thousand_turns_per_minute() {
    let mut rig = Rig::with_motor(HubMotorModel::ZLLG65ASM250, AT_4_KHZ);
    let target = rad_s(1000.0);
    let profile = motion::scurve::velocity_change(0.0, f64::from(target), 0.5);
    let mut peak = 0.0_f64;
    for tick in 0..30_000 {
        let point = profile.at(f64::from(tick) * 50e-6);
        let demand =
            VelocityDemand { velocity_rad_s: point.velocity as f32, acceleration_rad_s2: point.acceleration as f32 };
        rig.tick_velocity(&demand);
        peak = peak.max(rig.motor.rotor.velocity_rad_s);
    }
    let target = f64::from(target);
    assert!(peak < 1.1 * target, "{peak} of {target}");
    assert!((rig.motor.rotor.velocity_rad_s - target).abs() < 0.01 * target);
    // The field is kept where it belongs: no d current to speak of.
    assert!(rig.motor.pmsm.current_a.d.abs() < 0.5, "{:?}", rig.motor.pmsm.current_a);
}

#[test]
fn one_turn_per_minute_is_held_smoothly() {
    let mut rig = Rig::new(AT_4_KHZ);
    let target = rad_s(1.0);
    let demand = VelocityDemand { velocity_rad_s: target, acceleration_rad_s2: 0.0 };
    for _ in 0..40_000 {
        rig.tick_velocity(&demand);
    }
    // Edges come 15 ms apart; the speed between them stays within two percent.
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    let start = rig.motor.rotor.angle.as_rad();
    for _ in 0..40_000 {
        rig.tick_velocity(&demand);
        let velocity = rig.motor.rotor.velocity_rad_s;
        (least, most) = (least.min(velocity), most.max(velocity));
    }
    let mean = (rig.motor.rotor.angle.as_rad() - start) / 2.0;
    let target = f64::from(target);
    assert!((mean - target).abs() < 0.005 * target, "mean {mean}");
    assert!(least > 0.98 * target && most < 1.02 * target, "{least} to {most} about {target}");
}

/// Two seconds for the integral to overcome the last of the dry friction.
const SETTLE_TICKS: u32 = 40_000;

/// Ten turns at 200 r/min with ramps of 0.3 s; returns where it ends, its overshoot and its worst lag, in counts.
fn move_ten_turns(rig: &mut Rig) -> (f64, f64, f64) {
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
    let (mut overshoot, mut lag) = (0.0_f64, 0.0_f64);
    let ticks = (profile.duration() / 50e-6) as u32 + SETTLE_TICKS;
    for tick in 0..ticks {
        let point = profile.at(f64::from(tick) * 50e-6);
        let travelled = f64::from(rig.position() - start);
        rig.tick_position(&rig.demand(point, travelled));
        overshoot = overshoot.max(travelled - distance);
        lag = lag.max((point.position - travelled).abs());
    }
    (f64::from(rig.position() - start) - distance, overshoot, lag)
}

#[test]
fn a_position_move_ends_within_two_counts_and_hardly_overshoots() {
    for outer_every in [AT_4_KHZ, AT_1_KHZ] {
        let (rest, overshoot, lag) = move_ten_turns(&mut Rig::new(outer_every));
        assert!(rest.abs() <= 2.0, "ended {rest} counts off");
        assert!(overshoot < 20.0, "overshot by {overshoot} counts");
        // A tenth of the drive's own alarm threshold: object 2017h, 409 x 10 counts.
        assert!(lag < 409.0, "lagged by {lag} counts");
    }
}

#[test]
fn five_times_the_inertia_is_still_well_damped() {
    let mut rig = Rig::new(AT_4_KHZ);
    rig.motor.rig.load.inertia_kg_m2 = 4.0 * rig.motor.model.rotor.inertia_kg_m2;
    let (rest, overshoot, _) = move_ten_turns(&mut rig);
    assert!(rest.abs() <= 2.0, "ended {rest} counts off");
    assert!(overshoot < 0.01 * 10.0 * COUNTS_PER_TURN, "overshot by {overshoot} counts");
}

#[test]
fn a_load_step_is_fought_and_the_position_returns() {
    let mut rig = Rig::new(AT_4_KHZ);
    let start = rig.position();
    let mut worst = 0;
    for tick in 0..40_000 {
        if tick == 10_000 {
            rig.motor.rig.load.torque_nm = 4.0;
        }
        let off = rig.position() - start;
        rig.tick_position(&rig.demand(motion::Point::default(), f64::from(off)));
        worst = worst.max(off.abs());
    }
    assert!((rig.position() - start).abs() <= 1, "{} counts off", rig.position() - start);
    assert!((2..100).contains(&worst), "gave way by {worst} counts");
    // Kt i_q carries the load; dry friction may help with its share.
    let q = rig.motor.pmsm.current_a.q;
    assert!((q - 4.0 / 0.7613).abs() < 0.2, "{q} A");
}

#[test]
fn nothing_moves_while_nothing_is_asked() {
    let mut rig = Rig::new(AT_4_KHZ);
    let before = rig.motor.rotor.angle;
    for _ in 0..2_000 {
        rig.tick_position(&PositionDemand::default());
    }
    assert_eq!(rig.motor.rotor.angle, before);
}

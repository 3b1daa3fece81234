//! Cost of a drive's control periods: the current loop with its sensors, the outer loops, a profile.

#[expect(dead_code, reason = "the bench needs a part of the rig")]
#[path = "../crates/motion/tests/it/rig/mod.rs"]
mod rig;

use criterion::{Criterion, criterion_group, criterion_main};
use motion::cascade::{Cascade, CascadeGains, PositionDemand};
use motion::commutation::{Commutation, CommutationModel};
use motion::filter::{LowPass, LowPassGains};
use motion::foc::{FeedForward, Foc, FocGains, FocInput};
use motion::frames::Dq;
use motion::observer::{Observer, ObserverGains};
use motion::pid::PiGains;
use motion::scurve::PositionMove;
use std::hint::black_box;

const DT_S: f32 = 50e-6;

/// Periods before a measurement: more than any integral needs to run into its limit.
const WARM_UP: u32 = 100_000;

fn current_loop(c: &mut Criterion) {
    let winding = PiGains::for_winding(3000.0, 0.263, 0.697e-3);
    let motor = FeedForward { inductance_d_h: 0.697e-3, inductance_q_h: 0.697e-3, flux_linkage_wb: 0.0338 };
    let gains = FocGains {
        d: winding,
        q: winding,
        feed_forward: Some(motor),
        modulation_limit: 0.95,
        voltage_delay_s: 0.5 * DT_S,
    };
    let mut foc = Foc::default();
    let input =
        FocInput { phase_current_a: [1.0, -0.4, -0.6], electrical_turns: 0.3, electrical_rad_s: 200.0, bus_v: 48.0 };
    // The currents do not answer the voltage here: a set-point that swings about them keeps the integrals from running
    // into the limit, where nothing but the limit would be measured.
    let flowing = foc.tick(&gains, Dq::default(), &input, DT_S).current_a;
    foc.reset();
    let mut swing_a = 0.1;
    let mut tick = || {
        swing_a = -swing_a;
        let setpoint_a = Dq { d: flowing.d + swing_a, q: flowing.q + swing_a };
        foc.tick(&gains, black_box(setpoint_a), black_box(&input), DT_S)
    };
    assert!((0..WARM_UP).all(|_| !tick().saturated));
    c.bench_function("foc_tick", |b| b.iter(&mut tick));

    let model =
        CommutationModel { counts_per_turn: 4096, pole_pairs: 15, offset_turns: 0.0, sequence: [5, 1, 3, 2, 6, 4] };
    let observer_gains = ObserverGains::new(2e-3, 0.2, DT_S);
    let smooth = LowPassGains::from_time_constant(0.5e-3, DT_S);
    let mut commutation = Commutation::new(&model, 5, 0);
    let mut observer = Observer::new(0);
    let mut filter = LowPass::default();
    let mut count = 0_u16;
    let mut foc = Foc::default();
    let mut tick = || {
        count = count.wrapping_add(1);
        let electrical_turns = commutation.update(&model, black_box(5), count);
        let velocity = filter.update(&smooth, observer.update(&observer_gains, count)) * 460.0;
        let input = FocInput { electrical_turns, electrical_rad_s: velocity, ..input };
        // The shaft turns under currents that stand: seen from the rotor they swing about nothing.
        foc.tick(&gains, black_box(Dq::default()), &input, DT_S)
    };
    assert!((0..WARM_UP).all(|_| !tick().saturated));
    c.bench_function("foc_tick_with_sensors", |b| b.iter(&mut tick));
}

fn outer_loops(c: &mut Criterion) {
    let gains = CascadeGains {
        position_per_s: 20.0,
        velocity_feed_forward: 1.0,
        velocity: PiGains::for_inertia(70.0, 0.014, 0.761, 8.0),
        acceleration_feed_forward: 0.018,
        friction_feed_forward: 0.0,
        velocity_limit_rad_s: 50.0,
    };
    let mut cascade = Cascade::default();
    let demand = PositionDemand { error_rad: 0.01, velocity_rad_s: 1.0, acceleration_rad_s2: 2.0 };
    c.bench_function("cascade_position", |b| {
        b.iter(|| cascade.position(&gains, black_box(&demand), 1.0, 15.0, 250e-6));
    });

    let profile = PositionMove {
        distance: 40_960.0,
        max_speed: 13_653.0,
        acceleration_time_s: 0.3,
        deceleration_time_s: 0.3,
        ..PositionMove::default()
    }
    .plan();
    c.bench_function("profile_at", |b| b.iter(|| profile.at(black_box(2.9))));
}

/// The current loop around the plant: what one 50 us control period of a virtual drive costs at the least.
fn with_plant(c: &mut Criterion) {
    let mut rig = rig::Rig::new(rig::AT_4_KHZ);
    let demand = motion::cascade::VelocityDemand { velocity_rad_s: 20.0, acceleration_rad_s2: 0.0 };
    for _ in 0..20_000 {
        rig.tick_velocity(&demand);
    }
    c.bench_function("velocity_loop_and_plant", |b| b.iter(|| rig.tick_velocity(black_box(&demand))));
}

criterion_group!(benches, current_loop, outer_loops, with_plant);
criterion_main!(benches);

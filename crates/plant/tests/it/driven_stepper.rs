//! A stepper that a load drives with its bridges off: friction, suppressors, heat and bearings.

use plant::angle::Angle;
use plant::{Bridges, StepperMotor, StepperMotorModel};

const DT_S: f64 = 50e-6;
const MODEL: StepperMotorModel = StepperMotorModel::ZLIM42_C_70;

fn driven(torque_nm: f64) -> StepperMotor {
    let mut motor = StepperMotor::new(MODEL, Angle::default(), 24.0, 25.0);
    motor.rig.load.torque_nm = torque_nm;
    motor
}

fn run(motor: &mut StepperMotor, seconds: f64) {
    (0..(seconds / DT_S) as u32).for_each(|_| motor.step(DT_S, &Bridges::Open));
}

fn closes(motor: &StepperMotor, stored_j: f64) {
    let gained = motor.stored_j() - stored_j;
    let rest = motor.rig.energy.balance_j() - gained;
    let through = motor.rig.energy.source_j + motor.rig.energy.load_j.abs() + stored_j;
    assert!(rest.abs() < 1e-3 * through, "{rest} J missing of {through} J: {:?}", motor.rig.energy);
}

#[test]
fn a_load_that_drives_the_free_motor_ends_where_drag_suppressors_and_windings_take_its_power() {
    let mut motor = driven(0.05);
    let stored = motor.stored_j();
    run(&mut motor, 2.0);
    closes(&motor, stored);
    // Its drag alone would let it reach (T - dry) / viscous; with the bus at the suppressors' voltage it is generator.
    let drag_only = (0.05 - MODEL.rotor.coulomb_nm) / MODEL.rotor.viscous_nm_s;
    let speed = -motor.rotor.velocity_rad_s;
    let unclamped = MODEL.clamp.from_v / MODEL.stepper.torque_constant_nm_a();
    assert!(speed > 0.9 * unclamped && speed < 0.95 * drag_only, "{speed} rad/s of {drag_only}, {unclamped}");
    // The mean of a second: what the load gives is what friction, heat and electronics take, part by part.
    let (before, from) = (motor.rig.energy, motor.rotor.angle.as_rad());
    run(&mut motor, 1.0);
    let energy = motor.rig.energy;
    let given_w = 0.05 * (from - motor.rotor.angle.as_rad());
    let drag_w = energy.friction_j - before.friction_j;
    let drag_nm = MODEL.rotor.coulomb_nm + MODEL.rotor.viscous_nm_s * speed;
    assert!((drag_w / (drag_nm * speed) - 1.0).abs() < 0.03, "{drag_w} W of friction at {speed} rad/s");
    let electric_w = energy.winding_j + energy.switches_j + energy.consumption_j + energy.source_j
        - (before.winding_j + before.switches_j + before.consumption_j + before.source_j);
    assert!((given_w - drag_w - electric_w).abs() < 0.03 * given_w, "{given_w} W: {drag_w} and {electric_w} W");
    let bus_v = motor.rig.supply.bus_v;
    let most_a = 2.0 * MODEL.stepper.flux_linkage_wb / MODEL.stepper.inductance_h;
    let most_v = MODEL.clamp.from_v + MODEL.clamp.resistance_ohm * most_a;
    assert!(bus_v > MODEL.clamp.from_v && bus_v < most_v, "{bus_v} V, short-circuit current {most_a} A: {most_v} V");
}

#[test]
fn a_rotor_that_runs_away_seizes_at_the_speed_limit_of_its_bearings() {
    for torque_nm in [2.0, -2.0] {
        let mut motor = driven(torque_nm);
        let (mut fastest, mut highest_v, stored) = (0.0_f64, 0.0_f64, motor.stored_j());
        for _ in 0..20_000 {
            motor.step(DT_S, &Bridges::Open);
            fastest = fastest.max(motor.rotor.velocity_rad_s.abs());
            highest_v = highest_v.max(motor.rig.supply.bus_v);
        }
        assert!(motor.is_seized() && motor.rotor.velocity_rad_s == 0.0);
        assert!(fastest <= MODEL.bearing_limit_rad_s && fastest > 0.95 * MODEL.bearing_limit_rad_s, "{fastest} rad/s");
        assert!(highest_v < 60.0, "{highest_v} V");
        closes(&motor, stored);
        motor.lock_rotor(false);
        motor.rig.load.torque_nm = 0.0;
        run(&mut motor, 0.1);
        assert!(!motor.is_seized() && !motor.rig.load.locked);
    }
}

#[test]
fn suppressors_that_are_fed_for_long_heat_the_board_until_a_transistor_breaks_down() {
    // 55 V of a supply: (55 - 46.75) V behind 0.1 and 1.91 ohm. 125 K of the board are 3.75 kJ, less what it gives off.
    let mut motor = driven(0.0);
    motor.rig.supply.source_v = 55.0;
    let current_a = (55.0 - MODEL.clamp.from_v) / (MODEL.clamp.resistance_ohm + MODEL.rig.supply.source_resistance_ohm);
    let power_w =
        current_a * (55.0 - current_a * MODEL.rig.supply.source_resistance_ohm) + MODEL.rig.supply.consumption_w;
    let body = MODEL.rig.heat_sink;
    // T = P R (1 - exp(-t / R C))
    let rise = MODEL.power_stage_limit_c - 25.0;
    let expected_s = -body.resistance_k_w * body.capacity_j_k * (1.0 - rise / (power_w * body.resistance_k_w)).ln();
    let mut seconds = 0.0;
    while !motor.is_overheated() {
        motor.step(DT_S, &Bridges::Open);
        seconds += DT_S;
        assert!(seconds < 2.0 * expected_s, "{} degC", motor.rig.heat_sink.temperature_c);
    }
    assert!((seconds / expected_s - 1.0).abs() < 0.02, "{seconds} s, expected {expected_s} s at {power_w} W");
    assert!(motor.broken_down);
    motor.rig.supply.source_v = 24.0;
    motor.set_broken_down(false);
    run(&mut motor, 1.0);
    assert!(!motor.broken_down && !motor.is_overheated());
}

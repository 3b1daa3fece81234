//! Gear and two masses against closed forms.

use plant::angle::Angle;
use plant::gear::{GearData, GearInput, GearModel};
use plant::mechanics::{Load, RotorData, RotorModel};
use proptest::prelude::*;

const DT_S: f64 = 50e-6;
const TAU: f64 = core::f64::consts::TAU;
const ROTOR: RotorModel = RotorModel { inertia_kg_m2: 0.69e-4, viscous_nm_s: 0.0, coulomb_nm: 0.0 };
const GEAR: GearModel = GearModel {
    ratio: 50.0,
    stiffness_nm_rad: 1.1e4,
    damping_nm_s_rad: 0.0,
    backlash_rad: 0.0,
    output_inertia_kg_m2: 1e-3,
    coulomb_nm: 0.0,
    viscous_nm_s: 0.0,
    mesh_loss: 0.0,
    output_coulomb_nm: 0.0,
    kinematic_error_rad: 0.0,
    rated_nm: f64::INFINITY,
    peak_nm: f64::INFINITY,
    ratchet_nm: f64::INFINITY,
};

/// Both shafts.
#[derive(Clone)]
struct Bench {
    gear: GearModel,
    rotor: RotorModel,
    data: GearData,
    motor: RotorData,
    load: Load,
    friction_j: f64,
    load_j: f64,
    brought_j: f64,
}

impl Bench {
    fn new(gear: GearModel, rotor: RotorModel, load: Load) -> Self {
        let (data, motor) = (GearData::default(), RotorData::default());
        Bench { gear, rotor, data, motor, load, friction_j: 0.0, load_j: 0.0, brought_j: 0.0 }
    }

    fn step(&mut self, motor_nm: f64) {
        let input = GearInput { motor_nm, brake_nm: 0.0, load: &self.load };
        let out = self.gear.step(&mut self.data, &self.rotor, &mut self.motor, DT_S, &input);
        self.friction_j += out.friction_j;
        self.load_j += out.load_j;
        self.brought_j += motor_nm * out.motor_velocity_rad_s * DT_S;
    }

    fn run(&mut self, steps: u32, motor_nm: f64) {
        for _ in 0..steps {
            self.step(motor_nm);
        }
    }

    fn output_rad(&self) -> f64 {
        self.gear.output_angle(&self.data, self.motor.angle).as_rad()
    }

    fn stored_j(&self) -> f64 {
        self.gear.spring_energy_j(&self.data)
            + self.gear.kinetic_energy_j(&self.data, &self.rotor, &self.motor, &self.load)
    }

    /// Frequency of the twist's swing about `middle_rad`, from its rising zero crossings.
    fn frequency_hz(&mut self, steps: u32, motor_nm: f64, middle_rad: f64) -> f64 {
        let mut crossings = Vec::new();
        for step in 0..steps {
            let before = self.data.twist_rad - middle_rad;
            self.step(motor_nm);
            let after = self.data.twist_rad - middle_rad;
            if before < 0.0 && after >= 0.0 {
                crossings.push((f64::from(step) - before / (after - before)) * DT_S);
            }
        }
        let periods = crossings.len() - 1;
        periods as f64 / (crossings[periods] - crossings[0])
    }
}

fn near(actual: f64, expected: f64, relative: f64) -> bool {
    (actual - expected).abs() <= relative * expected.abs()
}

#[test]
fn the_two_masses_swing_at_their_natural_frequency() {
    let load = Load { inertia_kg_m2: 0.099, ..Load::default() };
    let mut bench = Bench::new(GEAR, ROTOR, load);
    bench.data.twist_rad = 1e-4;
    let motor_at_output = ROTOR.inertia_kg_m2 * GEAR.ratio * GEAR.ratio;
    let expected = libm::sqrt(GEAR.stiffness_nm_rad * (1.0 / motor_at_output + 1.0 / 0.1)) / TAU;
    let frequency = bench.frequency_hz(20_000, 0.0, 0.0);
    assert!(near(frequency, expected, 1e-3), "{frequency} for {expected} Hz");
}

#[test]
fn with_a_locked_output_the_motor_swings_on_the_spring_alone() {
    let mut bench = Bench::new(GEAR, ROTOR, Load { locked: true, ..Load::default() });
    // 1 N m of the motor winds the gear up by T N / K.
    let windup = 50.0 / GEAR.stiffness_nm_rad;
    let frequency = bench.frequency_hz(20_000, 1.0, windup);
    let expected = libm::sqrt(GEAR.stiffness_nm_rad / ROTOR.inertia_kg_m2) / GEAR.ratio / TAU;
    assert!(near(frequency, expected, 1e-3), "{frequency} for {expected} Hz");
    assert_eq!(bench.data.output_velocity_rad_s, 0.0);
}

#[test]
fn the_swing_decays_with_the_damping_of_the_torsion() {
    let gear = GearModel { damping_nm_s_rad: 5.0, ..GEAR };
    let mut bench = Bench::new(gear, ROTOR, Load { locked: true, ..Load::default() });
    bench.data.twist_rad = 1e-3;
    let energy_j = bench.stored_j();
    bench.run(2_000, 0.0);
    // Energy falls with exp(-D / J t).
    let motor_at_output = ROTOR.inertia_kg_m2 * GEAR.ratio * GEAR.ratio;
    let expected = energy_j * libm::exp(-5.0 / motor_at_output * 0.1);
    assert!(near(bench.stored_j(), expected, 0.02), "{} for {expected}", bench.stored_j());
}

#[test]
fn a_load_winds_the_gear_up_by_torque_over_stiffness() {
    let gear = GearModel { damping_nm_s_rad: 40.0, ..GEAR };
    let held = RotorModel { coulomb_nm: 10.0, ..ROTOR };
    let mut bench = Bench::new(gear, held, Load { torque_nm: 34.0, ..Load::default() });
    bench.run(20_000, 0.0);
    assert_eq!(bench.motor.angle, Angle::default());
    assert!(near(bench.data.twist_rad, 34.0 / gear.stiffness_nm_rad, 1e-9), "{}", bench.data.twist_rad);
    assert!(near(bench.output_rad(), -34.0 / gear.stiffness_nm_rad, 1e-9));
    assert!(near(bench.data.torque_nm, 34.0, 1e-9));
}

#[test]
fn lost_motion_is_the_backlash_exactly() {
    let gear = GearModel { backlash_rad: 1e-3, damping_nm_s_rad: 40.0, ..GEAR };
    let mut bench = Bench::new(gear, ROTOR, Load { locked: true, ..Load::default() });
    let mut rest_at = |motor_nm: f64| {
        // Friction lets the motor settle; it is taken away before the reading.
        bench.rotor.viscous_nm_s = 0.01;
        bench.run(200_000, motor_nm);
        bench.motor.angle.as_rad() / gear.ratio
    };
    let torque_nm = 0.1;
    let lost = rest_at(torque_nm) - rest_at(-torque_nm);
    let windup = 2.0 * torque_nm * gear.ratio / gear.stiffness_nm_rad;
    assert!(near(lost, 1e-3 + windup, 1e-9), "{lost}");
}

#[test]
fn an_output_with_friction_follows_only_after_the_motor_has_crossed_the_backlash() {
    let gear = GearModel { backlash_rad: 2e-3, damping_nm_s_rad: 1.0, ..GEAR };
    let load = Load { coulomb_nm: 0.5, inertia_kg_m2: 0.01, ..Load::default() };
    let slow = RotorModel { viscous_nm_s: 0.05, ..ROTOR };
    let mut bench = Bench::new(gear, slow, load);
    bench.run(40_000, 0.1);
    assert!(bench.output_rad() > 0.01);
    bench.run(40_000, 0.0);
    let (output, motor) = (bench.output_rad(), bench.motor.angle.as_rad());
    // Backward: the output rests until the motor has gone back by the backlash and the windup against its friction.
    while (bench.output_rad() - output).abs() < 1e-8 {
        bench.step(-0.02);
    }
    let back = (motor - bench.motor.angle.as_rad()) / gear.ratio;
    let expected = 2e-3 + 0.5 / gear.stiffness_nm_rad;
    assert!((back - expected).abs() < 4e-6, "{back} for {expected}");
}

#[test]
fn endlessly_stiff_and_without_backlash_it_is_the_one_mass() {
    let rotor = RotorModel { viscous_nm_s: 1e-4, coulomb_nm: 0.02, ..ROTOR };
    let gear = GearModel { stiffness_nm_rad: 1e10, ..GEAR };
    let load = Load { torque_nm: 10.0, inertia_kg_m2: 0.4, ..Load::default() };
    let mut bench = Bench::new(gear, rotor, load);
    let square = gear.ratio * gear.ratio;
    let one_load = Load {
        torque_nm: load.torque_nm / gear.ratio,
        inertia_kg_m2: (load.inertia_kg_m2 + gear.output_inertia_kg_m2) / square,
        ..Load::default()
    };
    let mut one = RotorData::default();
    let mut angle_rad = 0.0;
    for step in 0..40_000 {
        let motor_nm = 0.3 + 0.6 * libm::sin(f64::from(step) * 2e-3);
        bench.step(motor_nm);
        angle_rad += rotor.step(&mut one, DT_S, motor_nm, &one_load, 0.0).velocity_rad_s * DT_S;
        let scale = 0.01 * one.velocity_rad_s.abs() + 0.05;
        assert!((bench.motor.velocity_rad_s - one.velocity_rad_s).abs() < scale, "{step}: {:?} {one:?}", bench.motor);
    }
    assert!(angle_rad.abs() > 10.0);
    assert!(near(bench.motor.angle.as_rad(), angle_rad, 1e-3), "{} {angle_rad}", bench.motor.angle.as_rad());
    assert!(near(bench.output_rad(), angle_rad / 50.0, 1e-3));
}

#[test]
fn the_loss_in_the_teeth_costs_when_driving_and_when_driven() {
    let gear = GearModel { mesh_loss: 0.25, damping_nm_s_rad: 40.0, ..GEAR };
    // Driving at constant speed: 1 N m * 50 / 1.25 = 40 N m.
    let mut bench = Bench::new(gear, ROTOR, Load { torque_nm: 40.0, inertia_kg_m2: 0.1, ..Load::default() });
    assert!(near(gear.driven_torque_nm(&ROTOR, 1.0, 100.0), 40.0, 1e-12));
    bench.data.twist_rad = 40.0 / gear.stiffness_nm_rad;
    bench.data.torque_nm = 40.0;
    bench.data.output_velocity_rad_s = 2.0;
    bench.motor.velocity_rad_s = 100.0;
    bench.run(20_000, 1.0);
    assert!(near(bench.motor.velocity_rad_s, 100.0, 1e-6), "{}", bench.motor.velocity_rad_s);
    // Held against the same load between (1 - 0.25) and (1 + 0.25) of 40 / 50 N m it does not move.
    for motor_nm in [0.61, 0.99] {
        let mut held = Bench::new(gear, ROTOR, bench.load);
        (held.data.twist_rad, held.data.torque_nm) = (40.0 / gear.stiffness_nm_rad, 40.0);
        held.run(20_000, motor_nm);
        assert!(held.motor.angle.as_rad().abs() < 1e-9, "{}", held.motor.angle.as_rad());
    }
    let mut falling = Bench::new(gear, ROTOR, bench.load);
    (falling.data.twist_rad, falling.data.torque_nm) = (40.0 / gear.stiffness_nm_rad, 40.0);
    falling.run(20_000, 0.59);
    assert!(falling.motor.velocity_rad_s < -1.0);
}

#[test]
fn dry_friction_holds_both_sides_exactly() {
    let rotor = RotorModel { coulomb_nm: 0.1, ..ROTOR };
    let gear = GearModel { damping_nm_s_rad: 40.0, ..GEAR };
    let mut bench = Bench::new(gear, rotor, Load { coulomb_nm: 1.0, ..Load::default() });
    bench.motor.velocity_rad_s = 30.0;
    bench.run(20_000, 0.0);
    assert_eq!((bench.motor.velocity_rad_s, bench.data.output_velocity_rad_s), (0.0, 0.0));
    let rest = (bench.motor.angle, bench.data.twist_rad);
    bench.run(1_000, 0.0);
    assert_eq!((bench.motor.angle, bench.data.twist_rad), rest);
}

#[test]
fn halved_steps_lead_to_the_same_motion() {
    let play = |dt_s: f64| {
        let gear = GearModel { damping_nm_s_rad: 2.0, ..GEAR };
        let load = Load { torque_nm: 3.0, inertia_kg_m2: 0.05, ..Load::default() };
        let (mut data, mut motor) = (GearData::default(), RotorData::default());
        for step in 0..(0.2 / dt_s).round() as u32 {
            let motor_nm = libm::sin((f64::from(step) + 0.5) * dt_s * 100.0);
            let input = GearInput { motor_nm, brake_nm: 0.0, load: &load };
            gear.step(&mut data, &ROTOR, &mut motor, dt_s, &input);
        }
        gear.output_angle(&data, motor.angle).as_rad()
    };
    let [coarse, middle, fine, reference] = [200e-6, 100e-6, 50e-6, 2e-6].map(play);
    for ratio in [(coarse - reference) / (middle - reference), (middle - reference) / (fine - reference)] {
        assert!((3.3..4.7).contains(&ratio), "{ratio}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_acts_the_energies_close_and_stay_finite(
        torques in prop::collection::vec(-3.0..3.0_f64, 1..40),
        load_nm in -40.0..40.0_f64,
        load_kg_m2 in 0.0..2.0_f64,
        coulomb_nm in 0.0..5.0_f64,
        stiffness in prop_oneof![Just(1e2), Just(1.1e4), Just(5e4), Just(1e8)],
        backlash in prop_oneof![Just(0.0), Just(1e-4), Just(1e-2)],
        mesh_loss in 0.0..0.5_f64,
    ) {
        let gear = GearModel {
            stiffness_nm_rad: stiffness,
            damping_nm_s_rad: 50e-6 * stiffness,
            backlash_rad: backlash,
            mesh_loss,
            ..GEAR
        };
        let rotor = RotorModel { viscous_nm_s: 1e-4, coulomb_nm: 0.03, ..ROTOR };
        let load = Load { torque_nm: load_nm, inertia_kg_m2: load_kg_m2, coulomb_nm, ..Load::default() };
        let mut bench = Bench::new(gear, rotor, load);
        for torque in torques {
            bench.run(25, torque);
            let through = bench.brought_j.abs() + bench.load_j.abs() + bench.stored_j() + bench.friction_j.abs();
            let rest = bench.brought_j - bench.load_j - bench.friction_j - bench.stored_j();
            prop_assert!(rest.abs() <= 1e-9 * through + 1e-12, "{rest} of {through}");
            // In a step in which a side turns round its friction's work may have either sign: a trace, but for gears
            // ten thousand times stiffer than real ones that rattle in their backlash.
            let bound = if stiffness < 1e6 { 0.01 } else { 0.2 };
            prop_assert!(bench.friction_j >= -bound * through - 1e-9, "friction gave {} of {through}", bench.friction_j);
            prop_assert!(bench.motor.velocity_rad_s.is_finite() && bench.data.twist_rad.is_finite());
        }
    }
}

const ERROR_RAD: f64 = 2.2e-4;

#[test]
fn the_output_runs_ahead_and_behind_twice_a_turn_of_the_motor() {
    let gear = GearModel { kinematic_error_rad: ERROR_RAD, damping_nm_s_rad: 40.0, ..GEAR };
    let mut bench = Bench::new(gear, ROTOR, Load::default());
    bench.motor.velocity_rad_s = 10.0;
    bench.data.output_velocity_rad_s = 0.2;
    let (mut most, mut turns, mut before, mut off_rad): (f64, u32, f64, f64) = (0.0, 0, 0.0, 0.0);
    while bench.motor.angle.as_turns() < 20.0 {
        bench.step(0.0);
        let ahead = bench.output_rad() - bench.motor.angle.as_rad() / gear.ratio;
        let expected = ERROR_RAD * libm::sin(2.0 * bench.motor.angle.as_rad());
        most = most.max(ahead.abs());
        off_rad = off_rad.max((ahead - expected).abs());
        turns += u32::from(before < 0.0 && ahead >= 0.0);
        before = ahead;
    }
    assert!(near(most, ERROR_RAD, 0.05), "{most}");
    assert!(off_rad < 0.05 * ERROR_RAD, "{off_rad}: an unloaded spring follows");
    assert!((39..=41).contains(&turns), "{turns} periods in 20 turns");
}

#[test]
fn an_error_drives_the_twist_of_a_locked_output_and_keeps_the_energies() {
    let gear = GearModel { kinematic_error_rad: ERROR_RAD, output_coulomb_nm: 1.0, damping_nm_s_rad: 5.0, ..GEAR };
    for locked in [false, true] {
        let load = Load { inertia_kg_m2: 0.1, locked, ..Load::default() };
        let mut bench = Bench::new(gear, ROTOR, load);
        for step in 0..40_000_u32 {
            bench.step(0.3 * libm::sin(f64::from(step) * 2e-3));
        }
        let rest_j = bench.brought_j - bench.stored_j() - bench.friction_j - bench.load_j;
        assert!(rest_j.abs() < 1e-9 * bench.friction_j.max(1.0), "{rest_j} J missing");
        assert!(bench.friction_j > 0.0);
        assert!(!locked || bench.output_rad().abs() < 1e-12, "{}", bench.output_rad());
    }
}

#[test]
fn behind_a_held_motor_the_output_stands_by_its_dry_friction_over_the_stiffness_off_the_middle_as_it_came() {
    let gear = GearModel { output_coulomb_nm: 2.0, damping_nm_s_rad: 40.0, ..GEAR };
    let rotor = RotorModel { coulomb_nm: 100.0, ..ROTOR };
    let stands_after = |from_nm: f64| {
        let mut bench = Bench::new(gear, rotor, Load::default());
        for step in 0..=20_000_u32 {
            bench.load.torque_nm = from_nm * (1.0 - f64::from(step) / 20_000.0);
            bench.step(0.0);
        }
        bench.output_rad()
    };
    let width = stands_after(-30.0) - stands_after(30.0);
    assert!(near(width, 2.0 * 2.0 / GEAR.stiffness_nm_rad, 0.1), "{width} rad");
}

#[test]
fn above_its_peak_a_gear_counts_overloads_and_from_its_ratcheting_torque_its_teeth_jump() {
    let gear = GearModel { peak_nm: 44.0, ratchet_nm: 190.0, damping_nm_s_rad: 40.0, ..GEAR };
    let load = Load { locked: true, ..Load::default() };
    let mut bench = Bench::new(gear, ROTOR, load);
    // 0.4 and 1.0 N m are 20 and 50 N m at the output.
    for (motor_nm, overloads) in [(0.4, 0), (1.0, 1), (0.4, 1), (1.0, 2)] {
        for step in 0..40_000_u32 {
            let before = bench.data.torque_nm / gear.ratio;
            bench.step(before + (motor_nm - before) * f64::from(step) / 40_000.0);
        }
        assert_eq!((bench.data.overloads, bench.data.jumps), (overloads, 0), "{motor_nm} N m");
    }
    assert_eq!(bench.data.slip_rad, 0.0);
    bench.run(20_000, 5.0);
    assert!(bench.data.jumps > 0 && bench.data.most_nm > gear.ratchet_nm, "{:?}", bench.data);
    // It jumps by what 190 N m wind up, at least, and the output has not moved.
    assert!(bench.data.slip_rad >= f64::from(bench.data.jumps) * 190.0 / GEAR.stiffness_nm_rad);
    assert!(bench.output_rad().abs() < 1e-12);
    let rest_j = bench.brought_j - bench.stored_j() - bench.friction_j;
    assert!(rest_j.abs() < 1e-9 * bench.friction_j, "{rest_j} J missing");
}

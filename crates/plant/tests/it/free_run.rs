//! Where a free shaft ends up, against the same motor that is let run for so long.

use plant::Motor;
use plant::attachment::{Attachment, Fan, Pulley};
use plant::{Actuation, Angle, Bridges, FreeRun, HubMotor, HubMotorModel, Inverter, JointMotor, JointMotorModel};
use plant::{StepperMotor, StepperMotorModel, joint_motor};

const DT_S: f64 = 50e-6;
const OPEN: Actuation = Actuation { inverter: Inverter::Open, bleeder_on: false, brake_released: true };

fn turns(foretold: Option<FreeRun>) -> f64 {
    match foretold {
        Some(FreeRun::Turns { velocity_rad_s }) => velocity_rad_s,
        other => panic!("{other:?}"),
    }
}

fn near(foretold: f64, came: f64, relative: f64) {
    assert!((foretold - came).abs() <= relative * came.abs(), "foretold {foretold}, came {came}");
}

fn wheel() -> HubMotor {
    HubMotor::new(HubMotorModel::ZLLG65ASM250_L, Angle::default(), 48.0, 25.0)
}

#[test]
fn a_wheel_turns_as_fast_as_was_foretold() {
    // Below 0.1 N·m of friction, below the voltage of the bus, into its suppressors, and with a fan.
    let fan = Attachment { fan: Some(Fan { torque_nm: 1.0, velocity_rad_s: 30.0 }), ..Default::default() };
    for (torque_nm, what) in
        [(0.2, Attachment::default()), (-2.5, Attachment::default()), (5.0, Attachment::default()), (0.7, fan)]
    {
        let mut motor = wheel();
        motor.rig.load.torque_nm = torque_nm;
        motor.attach(what);
        let foretold = turns(motor.free_run(true));
        for _ in 0..400_000 {
            motor.step(DT_S, &OPEN);
        }
        near(foretold, motor.rotor.velocity_rad_s, 0.03);
    }
}

#[test]
fn a_load_under_the_friction_is_held_and_one_over_everything_ends_in_the_bearings() {
    let mut motor = wheel();
    motor.rig.load.torque_nm = 0.09;
    assert_eq!(motor.free_run(true), Some(FreeRun::Held));
    motor.rig.load.torque_nm = 500.0;
    let limit = motor.model.bearing_limit_rad_s;
    assert_eq!(motor.free_run(true), Some(FreeRun::Seizes { velocity_rad_s: -limit }));
    motor.attach(Attachment { pulley: Some(Pulley { mass_kg: 1000.0, radius_m: -0.2 }), ..Default::default() });
    assert_eq!(motor.free_run(true), Some(FreeRun::Seizes { velocity_rad_s: limit }), "the weight pulls more");
    motor.rig.load.locked = true;
    assert_eq!(motor.free_run(true), None);
}

#[test]
fn a_joint_and_a_stepper_turn_as_fast_as_was_foretold() {
    let idle = joint_motor::Actuation { inverter: Inverter::Open, brake_released: true, set_origin: false };
    for torque_nm in [6.0, -12.0] {
        let mut joint = JointMotor::new(JointMotorModel::M4230E17B50, Angle::default(), 36.0, 25.0);
        joint.rig.load.torque_nm = torque_nm;
        let foretold = turns(joint.free_run(true));
        for _ in 0..100_000 {
            joint.step(DT_S, &idle);
        }
        near(foretold, joint.rotor.velocity_rad_s, 0.05);
    }
    for torque_nm in [0.03, -0.1] {
        let mut stepper = StepperMotor::new(StepperMotorModel::ZLIM42_C_70, Angle::default(), 24.0, 25.0);
        stepper.rig.load.torque_nm = torque_nm;
        let foretold = turns(stepper.free_run());
        for _ in 0..100_000 {
            stepper.step(DT_S, &Bridges::Open);
        }
        // The diodes of a stepper conduct in pieces, which the foretelling takes for sines.
        near(foretold, stepper.rotor.velocity_rad_s, 0.15);
    }
}

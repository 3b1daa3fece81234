//! Cost of one plant step, as a drive's simulation pays it: step and sense at a turning motor.

use criterion::{Criterion, criterion_group, criterion_main};
use plant::angle::Angle;
use plant::{Actuation, Bridges, HubMotor, HubMotorModel, Inverter};
use plant::{JointMotor, JointMotorModel, StepperMotor, StepperMotorModel};
use std::hint::black_box;

const DT_S: f64 = 50e-6;

fn hub_motor(c: &mut Criterion) {
    let mut group = c.benchmark_group("hub_motor");
    let start = HubMotor::new(HubMotorModel::ZLLG65ASM250_L, Angle::default(), 48.0, 25.0);
    for (name, inverter) in
        [("driven", Inverter::Driven([0.55, 0.5, 0.45])), ("shorted", Inverter::Shorted), ("open", Inverter::Open)]
    {
        let mut motor = start.clone();
        let actuation = Actuation { inverter, bleeder_on: false, brake_released: true };
        group.bench_function(name, |b| {
            b.iter(|| {
                // 190 r/min, whatever the field says: left alone, a field that stands would stop the shaft.
                motor.rotor.velocity_rad_s = 20.0;
                motor.step(DT_S, black_box(&actuation));
                motor.sense()
            })
        });
    }
    group.finish();
}

fn stepper_motor(c: &mut Criterion) {
    let mut group = c.benchmark_group("stepper_motor");
    let start = StepperMotor::new(StepperMotorModel::ZLIM42_C_70, Angle::default(), 24.0, 25.0);
    for (name, bridges) in [
        ("regulated", Bridges::Regulated([1.5, 0.5])),
        ("driven", Bridges::Driven([0.2, 0.1])),
        ("open", Bridges::Open),
    ] {
        let mut motor = start.clone();
        group.bench_function(name, |b| {
            b.iter(|| {
                // Ten turns a second, whatever the field says.
                motor.rotor.velocity_rad_s = 62.8;
                motor.step(DT_S, black_box(&bridges));
                motor.sense()
            })
        });
    }
    group.finish();
}

fn joint_motor(c: &mut Criterion) {
    let mut group = c.benchmark_group("joint_motor");
    let start = JointMotor::new(JointMotorModel::M4230E17B50, Angle::default(), 36.0, 25.0);
    for (name, inverter) in [("driven", Inverter::Driven([0.55, 0.5, 0.45])), ("shorted", Inverter::Shorted)] {
        let mut joint = start.clone();
        joint.rig.load.inertia_kg_m2 = 0.1;
        joint.rig.load.torque_nm = 5.0;
        let actuation = plant::joint_motor::Actuation { inverter, brake_released: true, set_origin: false };
        group.bench_function(name, |b| {
            b.iter(|| {
                // 1000 r/min of the motor, whatever the field says.
                joint.rotor.velocity_rad_s = 100.0;
                joint.gear.output_velocity_rad_s = 2.0;
                joint.step(DT_S, black_box(&actuation));
                joint.sense()
            })
        });
    }
    group.finish();
}

criterion_group!(benches, hub_motor, stepper_motor, joint_motor);
criterion_main!(benches);

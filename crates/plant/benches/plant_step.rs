//! Cost of one plant step, as a drive's simulation pays it: step and sense at a turning motor.

use criterion::{Criterion, criterion_group, criterion_main};
use plant::angle::Angle;
use plant::{Actuation, HubMotor, HubMotorModel, Inverter};
use std::hint::black_box;

const DT_S: f64 = 50e-6;

fn hub_motor(c: &mut Criterion) {
    let mut group = c.benchmark_group("hub_motor");
    let start = HubMotor::new(HubMotorModel::ZLLG65ASM250_L, Angle::default(), 48.0, 25.0);
    for (name, inverter) in
        [("driven", Inverter::Driven([0.55, 0.5, 0.45])), ("shorted", Inverter::Shorted), ("open", Inverter::Open)]
    {
        let mut motor = start.clone();
        motor.rotor.velocity_rad_s = 20.0;
        motor.load.torque_nm = -0.2;
        let actuation = Actuation { inverter, bleeder_on: false, brake_released: true };
        group.bench_function(name, |b| {
            b.iter(|| {
                motor.step(DT_S, black_box(&actuation));
                motor.sense()
            })
        });
    }
    group.finish();
}

criterion_group!(benches, hub_motor);
criterion_main!(benches);

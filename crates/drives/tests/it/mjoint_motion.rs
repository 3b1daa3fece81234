//! Modes of the M joint on its motor.

use crate::bench::Bench;
use crate::bench::joint::{Joint, TURN};
use drives::mjoint::Model;
use plant::JointMotorModel;

#[test]
fn an_absolute_move_takes_the_time_of_its_trapezoid_and_ends_within_the_tolerance() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x6081, 0, 1000);
    bench.write(0x6083, 0, 20_000);
    bench.enable_absolute();
    let from = bench.position();
    bench.write(0x607A, 0, from + 20 * TURN);
    assert_eq!(bench.statusword(), 0x0037);
    let ms = bench.until_reached(5000);
    // 20 turns at 1000 r/min are 1200 ms, and 50 ms for the ramps.
    assert!((1245..1300).contains(&ms), "{ms}");
    assert_eq!(bench.statusword(), 0x0437);
    bench.run_ms(300);
    assert!((bench.position() - from - 20 * TURN).abs() <= 12, "{}", bench.position() - from);
}

#[test]
fn every_model_reaches_its_speed_without_much_overshoot() {
    for (model, motor) in [
        (&Model::M4230E17B50, JointMotorModel::M4230E17B50),
        (&Model::M4230E17B80, JointMotorModel::M4230E17B80),
        (&Model::M8025E25B50, JointMotorModel::M8025E25B50),
        (&Model::M8025E25B80, JointMotorModel::M8025E25B80),
    ] {
        let mut bench = Bench::<Joint>::of(model, motor);
        bench.enable_speed();
        bench.write(0x60FF, 0, 1000);
        let mut most: f64 = 0.0;
        for _ in 0..800 {
            bench.run_ms(1);
            most = most.max(bench.rpm());
        }
        assert!((bench.rpm() - 1000.0).abs() < 5.0, "{}: {}", model.name, bench.rpm());
        assert!(most < 1060.0, "{}: {most}", model.name);
        assert_eq!(bench.statusword(), 0x0437, "{}", model.name);
        assert!((bench.read(0x606C, 0) - 10_000).abs() < 60, "{}", bench.read(0x606C, 0));
    }
}

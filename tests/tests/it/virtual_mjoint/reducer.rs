//! What the reducer bears and does, seen from outside ("Parameters", "Reducer parameters").

use crate::virtual_mjoint::bench::{Bench, MODELS, figure};

fn output(bench: &mut Bench) -> sim::OutputShaft {
    bench.report().output.expect("a joint has a reducer")
}

#[test]
fn a_load_that_takes_more_than_the_peak_start_stop_torque_is_reported_and_a_lighter_one_is_not() {
    // 44 N·m: 20000 (r/min)/s are 42 rad/s² behind a ratio of 50, and 3 kg·m² would take 126 N·m for them.
    for (inertia_kg_m2, overloaded) in [(0.3, false), (3.0, true)] {
        let mut bench = Bench::new();
        bench.world(&format!("1 load inertia {inertia_kg_m2}")).set(0x6040, 0x2F).set(0x607A, 300_000).run_ms(1500);
        let shaft = output(&mut bench);
        assert_eq!(shaft.overloads > 0, overloaded, "{inertia_kg_m2} kg·m²: {shaft:?}");
        assert_eq!(shaft.most_nm > 44.0, overloaded, "{inertia_kg_m2} kg·m²: {shaft:?}");
        assert_eq!(shaft.jumps, 0, "far from ratcheting");
        assert_eq!(bench.report().damage, None);
    }
}

#[test]
fn from_the_ratcheting_torque_on_the_output_stands_elsewhere_until_there_is_a_new_reducer() {
    let mut bench = Bench::new();
    bench.set(0x6040, 0x0F);
    // A blow of 400 N·m on a reducer whose teeth jump from 190 on.
    bench.world("1 load torque 400").run_ms(20);
    bench.world("1 load torque 0").run_ms(500);
    let shaft = output(&mut bench);
    assert!(shaft.jumps > 0 && shaft.slip_rad.abs() > 190.0 / 1.1e4, "{shaft:?}");
    let motor_rad = bench.report().shaft_angle_rad / 50.0;
    assert!((shaft.angle_rad - motor_rad + shaft.slip_rad).abs() < 1e-3, "{shaft:?}, motor {motor_rad}");
    let got = bench.world_answer("1 get");
    assert!(got.contains("\"output_shaft\":{\"angle_deg\":") && got.contains("teeth of the reducer jumped"), "{got}");
    bench.world("1 rotor free");
    assert_eq!((output(&mut bench).jumps, bench.report().damage), (0, None));
}

#[test]
fn the_output_follows_the_motor_but_for_the_reducers_error_and_twist() {
    for (model, error_arc_min) in MODELS.into_iter().zip([1.5, 1.5, 1.0, 1.0]) {
        let mut bench = Bench::of(1, model);
        bench.set(0x6060, 3).set(0x60FF, 60).set(0x6083, 1000).set(0x6040, 0x0F).run_ms(1000);
        let (mut least, mut most) = (f64::MAX, f64::MIN);
        for _ in 0..2000 {
            bench.run_ms(1);
            let ahead = output(&mut bench).angle_rad - bench.report().shaft_angle_rad / model.ratio;
            (least, most) = (least.min(ahead), most.max(ahead));
        }
        let arc_min = (most - least).to_degrees() * 60.0;
        assert!((arc_min / error_arc_min - 1.0).abs() < 0.15, "{}: {arc_min} arc minutes", model.name);
    }
}

#[test]
fn a_free_joint_stands_under_a_small_load_and_a_large_one_does_not_run_away() {
    for (model, rated_nm) in MODELS.into_iter().zip(figure("Output torque after deceleration")) {
        let mut bench = Bench::of(1, model);
        bench.set(0x6040, 1).world("1 load torque 2.5").run_ms(2000);
        assert!(bench.report().velocity_rpm.abs() < 1e-9, "{}: {}", model.name, bench.report().velocity_rpm);
        bench.world(&format!("1 load torque {rated_nm}")).run_ms(3000);
        let report = bench.report();
        // The motor feeds the bus through the idle bridge, and the suppressors hold that: 94 V at 16 A.
        assert!(report.supply_v < 94.0, "{}: {} V", model.name, report.supply_v);
        assert!((-4200.0..-5.0).contains(&report.velocity_rpm), "{}: {} r/min", model.name, report.velocity_rpm);
        assert_eq!(bench.get(0x260E), if report.supply_v > 52.0 { 0x15 } else { 0 }, "{}", model.name);
    }
}

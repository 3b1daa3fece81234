//! The printed figures of all four models, with the drive as delivered on its motor ("Parameters").

use drives::mjoint::Model;
use ferrodrive_tests::mjoint::figures;

use crate::bench::Bench;

const MODELS: [&Model; 4] = [&Model::M4230E17B50, &Model::M4230E17B80, &Model::M8025E25B50, &Model::M8025E25B80];

fn figure(parameter: &str) -> [f64; 4] {
    figures().into_iter().find(|figure| figure.parameter == parameter).expect("a figure of the table").values
}

fn turning(model: &'static Model, rpm: f64) -> Bench {
    let mut bench = Bench::of(1, model);
    bench.set(0x6060, 0, 3);
    bench.set(0x60FF, 0, rpm as i64);
    bench.set(0x6040, 0, 0x0F);
    bench
}

#[test]
fn without_load_each_model_nearly_reaches_its_maximum_speed_at_36_v_and_two_thirds_of_it_at_24_v() {
    for (model, maximum) in MODELS.into_iter().zip(figure("Maximum rotational speed")) {
        for (supply_v, share) in [(36.0, 1.0), (24.0, 2.0 / 3.0)] {
            let mut bench = turning(model, 3000.0);
            bench.tell(&format!("1 supply {supply_v}"));
            bench.run_ms(2500);
            let speed = bench.report().velocity_rpm / maximum;
            // Back-emf and bus are in balance but for friction and the switching's dead time.
            assert!((0.92 * share..share).contains(&speed), "{} at {supply_v} V: {speed}", model.name);
            assert_eq!(bench.get(0x260E, 0), 0, "{}", model.name);
        }
    }
}

#[test]
fn as_delivered_each_model_lifts_its_printed_torque_at_its_printed_speed() {
    let (torque, greatest, rated) = (
        figure("Output torque after deceleration"),
        figure("Speed range after deceleration, greatest"),
        figure("Rated speed"),
    );
    for (n, model) in MODELS.into_iter().enumerate() {
        // The printed range, or the motor's rated speed if that comes first.
        let rpm = (greatest[n] * model.ratio).min(rated[n]);
        let mut bench = turning(model, rpm);
        bench.run_ms(500);
        for share in 1..=20 {
            bench.tell(&format!("1 load torque {}", torque[n] * f64::from(share) / 20.0));
            bench.run_ms(50);
        }
        bench.run_ms(7000);
        let report = bench.report();
        assert!(
            (report.velocity_rpm / rpm - 1.0).abs() < 0.02,
            "{}: {} of {rpm} r/min",
            model.name,
            report.velocity_rpm
        );
        assert_eq!(bench.get(0x260E, 0), 0, "{} at {} A", model.name, report.current_a);
    }
}

/// Turns against a load that grows within a second; the share of the speed that is left a second later.
fn keeps(model: &'static Model, torque_nm: f64) -> f64 {
    let mut bench = turning(model, 300.0);
    bench.run_ms(300);
    for share in 1..=20 {
        bench.tell(&format!("1 load torque {}", torque_nm * f64::from(share) / 20.0));
        bench.run_ms(50);
    }
    bench.run_ms(1000);
    bench.report().velocity_rpm / 300.0
}

#[test]
fn the_m4230_lifts_the_printed_peak_torque_and_the_m8025_what_10_a_are_worth() {
    let printed_nm = figure("Peak start-stop torque");
    for (model, peak_nm) in MODELS.into_iter().zip(printed_nm).take(2) {
        assert!((keeps(model, peak_nm) - 1.0).abs() < 0.05, "{}", model.name);
        assert!(keeps(model, 1.3 * peak_nm) < 0.5, "{}: there is an end to it", model.name);
    }
    for (model, peak_nm) in MODELS.into_iter().zip(printed_nm).skip(2) {
        // 261Dh ends at 10 A, of 0.198 N·m each: the printed peak is what the teeth bear, not what the motor gives.
        let without_losses_nm = 10.0 * 0.198 * model.ratio;
        assert!(without_losses_nm < peak_nm, "{}", model.name);
        assert!((keeps(model, 0.6 * without_losses_nm) - 1.0).abs() < 0.05, "{}", model.name);
        assert!(keeps(model, without_losses_nm) < 0.5, "{}", model.name);
    }
}

//! The printed figures of all four models, with the drive as delivered on its motor ("Parameters").

use can::Bitrate;
use drives::mjoint::Model;
use sim::machine::mjoint;

use crate::virtual_mjoint::bench::{Bench, MODELS, assert_within, figure};

fn turning(model: &'static Model, rpm: f64) -> Bench {
    let mut bench = Bench::of(1, model);
    bench.turn(rpm as i64);
    bench
}

/// Pole pairs of both motors, and the inductance of a phase: half of what is printed between two wires.
const POLE_PAIRS: f64 = 21.0;

#[test]
fn without_load_each_model_reaches_its_maximum_speed_at_36_v_and_says_so_in_bit_10() {
    for (model, maximum) in MODELS.into_iter().zip(figure("Maximum rotational speed")) {
        let mut bench = turning(model, maximum);
        bench.run_ms(2500);
        let report = bench.report();
        assert!((report.velocity_rpm - maximum).abs() < 10.0, "{}: {} r/min", model.name, report.velocity_rpm);
        assert_eq!((bench.statusword(), bench.get(0x260E)), (0x0437, 0), "{}", model.name);
        // Nothing is faster, whatever 60FFh asks for.
        bench.set(0x60FF, 3000).run_ms(500);
        assert!(bench.report().velocity_rpm < maximum + 10.0, "{}", model.name);
    }
}

#[test]
fn at_24_v_and_without_an_advance_in_2604h_the_voltage_ends_the_speed() {
    let (maximum, inductance_mh) = (figure("Maximum rotational speed"), figure("Inductance"));
    let (torque, current) = (figure("Torque"), figure("Motor rated current"));
    for (n, model) in MODELS.into_iter().enumerate() {
        for (supply_v, advance) in [(36.0, 0), (24.0, 0), (24.0, 200)] {
            let mut bench = turning(model, 3000.0);
            bench.set(0x2604, advance).world(&format!("1 supply {supply_v}")).run_ms(2500);
            // Back-emf less what the d current takes of it, against the bus: v = speed * (Kt / 1.5 - p L i_d).
            let constant = torque[n] / (2.0_f64.sqrt() * current[n]) / 1.5;
            let direct_a = 10.0 * 2.0_f64.sqrt() * (0.1 * advance as f64).to_radians().sin();
            let per_rad_s = constant - POLE_PAIRS * 0.5e-3 * inductance_mh[n] * direct_a;
            let most = supply_v / 3.0_f64.sqrt() / per_rad_s * 60.0 / std::f64::consts::TAU;
            let share = bench.report().velocity_rpm / most.min(maximum[n]);
            // Friction, resistance and the switching's dead time take some of it.
            assert!((0.92..1.001).contains(&share), "{} at {supply_v} V, {advance}: {share}", model.name);
            assert_eq!(bench.get(0x260E), 0, "{}", model.name);
        }
    }
}

#[test]
fn at_the_rated_current_the_rated_torque_comes_out_and_the_supply_pays_for_it() {
    // "Parameters": 34, 51, 51 and 85 N·m at 3.5 and 7 A; 261Dh ends at rated current.
    let (torque, rated, resistance) =
        (figure("Output torque after deceleration"), figure("Motor rated current"), figure("Resistance"));
    for (n, model) in MODELS.into_iter().enumerate() {
        let mut bench = Bench::open_with(mjoint(model, 1, Bitrate::M1));
        bench.turn(500);
        bench.load_up_to(torque[n], 20, 50).run_ms(500);
        let shown_a = bench.get(0x6078) as f64 / 2000.0;
        // Printed at the rated speed, where friction is a little more.
        assert!((0.93..1.02).contains(&(shown_a / rated[n])), "{}: {shown_a} A", model.name);
        let speed_rpm = bench.get(0x606C) as f64 / 10.0;
        let energy = |bench: &mut Bench| bench.machine().assembly().motor().rig.energy;
        let before = energy(&mut bench);
        bench.run_ms(1000);
        let after = energy(&mut bench);
        let (given_w, friction_w) = (after.source_j - before.source_j, after.friction_j - before.friction_j);
        // Load, friction, three phases of half the printed resistance and 10 mohm of switches, 2 W of electronics. The
        // winding has warmed by up to 10 K.
        let load_w = torque[n] * speed_rpm / model.ratio * std::f64::consts::TAU / 60.0;
        let copper_w = 3.0 * shown_a * shown_a * (0.5 * resistance[n] + 0.01);
        let expected_w = load_w + friction_w + copper_w + 2.0;
        // The gear's kinematic error makes the current swing, which costs a little more.
        assert!((given_w / expected_w - 1.0).abs() < 0.03, "{}: {given_w} W, not {expected_w}", model.name);
        // With rated current allowed and no more, it still turns; half as much again stops it.
        bench.set(0x261D, (rated[n] * 1000.0) as i64).run_ms(500);
        assert!((bench.get(0x606C) - 5000).abs() < 100, "{}", model.name);
        bench.set_load_torque(1.5 * torque[n]).run_ms(1000);
        assert!(bench.get(0x606C) < 2500, "{}", model.name);
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
        bench.run_ms(500).load_up_to(torque[n], 20, 50).run_ms(7000);
        let report = bench.report();
        assert_within(&format!("{}: share of {rpm} r/min", model.name), report.velocity_rpm / rpm, 0.98, 1.02);
        assert_eq!(bench.get(0x260E), 0, "{} at {} A", model.name, report.current_a);
    }
}

/// Turns against a load that grows within a second; the share of the speed that is left a second later.
fn keeps(model: &'static Model, torque_nm: f64) -> f64 {
    let mut bench = turning(model, 300.0);
    bench.run_ms(300).load_up_to(torque_nm, 20, 50).run_ms(1000);
    bench.report().velocity_rpm / 300.0
}

#[test]
fn each_model_lifts_what_10_a_are_worth_which_for_the_m4230_is_more_than_its_reducer_bears() {
    let (peak, torque, output, rated) = (
        figure("Peak start-stop torque"),
        figure("Torque"),
        figure("Output torque after deceleration"),
        figure("Motor rated current"),
    );
    for (n, model) in MODELS.into_iter().enumerate() {
        // Friction without load is 5 to 8 % of the rated torque; in the rest the teeth have a fixed share.
        let motor_nm = torque[n] * (10.0 / rated[n] - 0.05);
        let most_nm = output[n] * motor_nm / (torque[n] * 0.92);
        assert_eq!(most_nm > peak[n], n < 2, "{}: {most_nm} N·m", model.name);
        assert!((keeps(model, 0.95 * most_nm) - 1.0).abs() < 0.05, "{}", model.name);
        assert!(keeps(model, 1.1 * most_nm) < 0.5, "{}: there is an end to it", model.name);
    }
}

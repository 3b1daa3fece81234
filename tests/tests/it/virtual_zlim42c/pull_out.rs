//! Pull-out torque above the corner speed: what bus voltage and current setting allow, by a closed form, whatever the setting.
//!
//! In the rotor's frame a turning motor obeys `v = Z i + j e` with `Z = R + j w L` and `e = w psi`, and its torque is
//! `K Im(i)`. The voltage holds `i` in a circle of radius `V / Z` about `-j e / Z`, the setting in one of radius `I` about zero.

use ferrodrive_tests::zlim42c::figure;
use plant::stepper_motor::StepperMotorModel;

use crate::virtual_zlim42c::bench::Bench;

const SUPPLY_V: f64 = 24.0;
/// Pulses of four full steps with 4000 pulses a turn.
const FOUR_STEPS: i64 = 80;

/// The highest torque of the currents that both circles allow, without friction, N m.
fn bound_nm(model: &StepperMotorModel, current_a: f64, rad_s: f64) -> f64 {
    let (stepper, omega) = (&model.stepper, f64::from(model.stepper.teeth) * rad_s);
    let (emf_v, resistance) =
        (stepper.flux_linkage_wb * omega, stepper.resistance_ohm + model.rig.switch_resistance_ohm);
    let reactance = stepper.inductance_h * omega;
    let impedance = resistance.hypot(reactance);
    // Torque of the voltage alone, at the top of its circle; the centre lies at the angle `centre`.
    let (radius_a, centre_a) = (SUPPLY_V / impedance, emf_v / impedance);
    let centre = 1.5 * std::f64::consts::PI - reactance.atan2(resistance);
    let (top_d, top_q) = (centre_a * centre.cos(), centre_a * centre.sin() + radius_a);
    if top_d.hypot(top_q) <= current_a {
        return stepper.pull_out_nm(SUPPLY_V, resistance, rad_s);
    }
    // Where the circles meet, or the setting's own top.
    let cos = (current_a * current_a + centre_a * centre_a - radius_a * radius_a) / (2.0 * current_a * centre_a);
    let angle = (centre - cos.clamp(-1.0, 1.0).acos()).max(std::f64::consts::FRAC_PI_2);
    stepper.torque_constant_nm_a() * current_a * angle.sin()
}

/// The torque that the motor gives, friction included, at the last load that it carries: one that grows from 60 % of the bound by
/// a hundredth of it every 50 ms.
fn carried_nm(mut bench: Bench, model: &StepperMotorModel, setting: i64, rpm: i64, bound_nm: f64) -> f64 {
    bench.set(0x2005, setting).set(0x2007, 1).set(0x6083, 500).enable_in(3).set(0x60FF, rpm).run_ms(800);
    let friction_nm = model.rotor.coulomb_nm + model.rotor.viscous_nm_s * rad_s(rpm.abs());
    let mut carried = 0.0;
    for percent in 0..=120 {
        let share = f64::from(percent) * 0.01;
        if percent > 60 || percent % 10 == 0 {
            let load_nm = (share * bound_nm - friction_nm).max(0.0);
            bench.set_load_torque(load_nm * rpm.signum() as f64).run_ms(50);
            let report = bench.report();
            let behind = report.position - report.rotor_position.expect("known here");
            if behind.abs() > FOUR_STEPS {
                break;
            }
            carried = share * bound_nm;
        }
    }
    carried
}

fn rad_s(rpm: i64) -> f64 {
    rpm as f64 * std::f64::consts::PI / 30.0
}

#[test]
fn above_the_corner_speed_the_motor_carries_what_voltage_and_setting_allow() {
    // The longer one has twice the inductance, and its corner at half the speed.
    let lengths: [(fn() -> Bench, _, _); 2] = [
        (Bench::new, StepperMotorModel::ZLIM42_C_70, [650, 700, 1000, 1200]),
        (Bench::long, StepperMotorModel::ZLIM42_C_82, [400, 500, 700, 1000]),
    ];
    for (new, model, speeds) in lengths {
        for rpm in speeds {
            let mut weaker = 0.0;
            for setting in 3..=7 {
                let current_a = figure("current", &setting.to_string(), "peak");
                let bound_nm = bound_nm(&model, current_a, rad_s(rpm));
                // Either way round.
                let rpm = if setting % 2 == 0 { -rpm } else { rpm };
                let carried_nm = carried_nm(new(), &model, setting, rpm, bound_nm);
                let case = format!("{}, {rpm} r/min, {current_a} A", model.name);
                let given = carried_nm / bound_nm;
                assert!((0.85..=1.02).contains(&given), "{case}: {carried_nm} of {bound_nm} N m");
                assert!(carried_nm >= 0.98 * weaker, "{case}: {carried_nm} N m, {weaker} with the setting below");
                weaker = f64::max(weaker, carried_nm);
            }
        }
    }
}

#[test]
fn no_setting_above_the_factorys_loses_the_rotor_between_the_corner_speed_and_the_highest() {
    for new in [Bench::new as fn() -> Bench, Bench::long] {
        for setting in 3..=7 {
            let mut bench = new();
            bench.set(0x2005, setting).set(0x6083, 1000).set(0x6084, 1000).enable_in(3);
            for rpm in [800, 1200, 2000, 3000] {
                bench.set(0x60FF, rpm).run_ms(1500);
            }
            bench.set(0x60FF, 0).run_ms(1500);
            let report = bench.report();
            let behind = report.position - report.rotor_position.expect("known here");
            // Dry friction may hold it some pulses off.
            assert!(behind.abs() <= 4 && report.error_code == 0, "2005h = {setting}: {behind} pulses, {report:?}");
        }
    }
}

/// Pulses lost by an emergency stop (605Ah = 7) at this speed.
fn lost_by_stopping(mut bench: Bench, setting: i64, rpm: i64, ramp_ms: i64) -> i64 {
    bench.set(0x2005, setting).set(0x605A, 7).set(0x6085, ramp_ms).set(0x6083, 1000).enable_in(3).set(0x60FF, rpm);
    bench.run_ms(2000).set(0x6040, 0x02).run_ms(2000);
    let report = bench.report();
    assert_eq!(report.error_code, 0, "{rpm} r/min");
    (report.position - report.rotor_position.expect("known here")).abs()
}

#[test]
fn the_ramp_of_an_emergency_stop_loses_no_more_than_a_vector_that_stands_at_once_and_nothing_where_the_torque_suffices()
{
    let motor = StepperMotorModel::ZLIM42_C_70;
    for (setting, current_a) in [(3, 1.2), (7, 2.2)] {
        for rpm in [1000, 1500, 2000, 2500] {
            // An S is steepest in its middle: one and a half times the mean.
            let asked_nm = |ramp_s: f64| 1.5 * motor.rotor.inertia_kg_m2 * rad_s(rpm) / ramp_s;
            let bound_nm = bound_nm(&motor, current_a, rad_s(rpm));
            let case = format!("2005h = {setting}, {rpm} r/min");
            assert!(asked_nm(0.05) < bound_nm, "{case}");
            assert_eq!(lost_by_stopping(Bench::new(), setting, rpm, 50) / FOUR_STEPS, 0, "{case}, 50 ms");
            let (ramp, at_once) = (
                lost_by_stopping(Bench::new(), setting, rpm, 10),
                lost_by_stopping(Bench::choosing("Z092", "brake"), setting, rpm, 10),
            );
            assert!(ramp <= at_once, "{case}: {ramp} pulses in 10 ms, {at_once} at once");
        }
    }
}

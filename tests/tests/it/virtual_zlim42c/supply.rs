//! 2.1: the supply of 20 to 30 V, and what is below it.

use crate::virtual_zlim42c::bench::{Bench, assert_within};

fn supply(bench: &mut Bench, supply_v: f64) {
    bench.set_supply(supply_v).run_ms(200);
}

#[test]
fn from_20_to_30_v_the_motor_does_its_work() {
    for supply_v in [20.0, 24.0, 30.0] {
        let mut bench = Bench::new();
        supply(&mut bench, supply_v);
        bench.set(0x2005, 7).set(0x2007, 1).enable_in(1);
        // Come at once, a torque swings the rotor twice as far: a third of the holding torque.
        bench.set_load_torque(0.16).set(0x6081, 300).move_by(8000).run_ms(2000);
        let report = bench.report();
        assert_eq!((report.position, report.error_code, report.powered), (8000, 0, true), "{supply_v} V");
        assert!(report.rotor_position.is_some_and(|rotor| (rotor - 8000).abs() < 20), "{supply_v} V: {report:?}");
    }
}

#[test]
fn below_20_v_the_drive_is_off_and_it_starts_anew_when_the_voltage_comes_back() {
    for supply_v in [19.0, 15.0, 0.0] {
        let mut bench = Bench::new();
        bench.enable_in(3).set(0x60FF, 60).run_ms(300);
        bench.forget();
        supply(&mut bench, supply_v);
        let report = bench.report();
        assert_eq!((report.powered, report.current_a, report.statusword), (false, 0.0, None), "{supply_v} V");
        assert_eq!(bench.sdo(&[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]), None, "{supply_v} V: no answer");
        supply(&mut bench, 24.0);
        assert_eq!(bench.heard_of("701#"), ["701#00"], "{supply_v} V");
        assert_eq!((bench.statusword(), bench.get(0x60FF)), (0x0270, 0), "{supply_v} V");
    }
}

/// The bus is empty then, and the diodes of the bridges charge it. At 15 V, where the drive is off too, none conducts at this speed.
#[test]
fn a_motor_whose_supply_is_cut_coasts_as_one_whose_bus_has_voltage() {
    let coasts = |line: &str| {
        let mut bench = Bench::new();
        bench.world("1 load inertia 0.01").set(0x6083, 500).enable_in(3).set(0x60FF, 30).run_ms(1500);
        bench.world(line).run_ms(50).report().velocity_rpm
    };
    let free_rpm = coasts("1 supply 15");
    for cut in ["1 power cut", "1 supply 0"] {
        // Some 3 V into a capacitor of a millifarad are a tenth of 49 mJ, which is a twentieth of the speed.
        assert_within(cut, coasts(cut), 0.93 * free_rpm, 1.01 * free_rpm);
    }
    assert_within("r/min", free_rpm, 20.0, 33.0);
}

#[test]
fn a_voltage_between_the_two_thresholds_changes_nothing() {
    // It stops below 19.3 V and starts from 19.8 V: a guess (docs/drives/zlim42c.md).
    let mut bench = Bench::new();
    supply(&mut bench, 19.5);
    assert!(bench.report().powered, "it runs on");
    supply(&mut bench, 19.0);
    supply(&mut bench, 19.5);
    assert!(!bench.report().powered, "it stays off");
    supply(&mut bench, 20.0);
    assert!(bench.report().powered, "2.1");
}

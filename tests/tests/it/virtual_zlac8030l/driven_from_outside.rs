//! A wheel that a load drives faster than the drive would: over-voltage, what limits it, and what is destroyed in the end.

use crate::virtual_zlac8030l::bench::{Bench, assert_within};
use crate::virtual_zlac8030l::wheel::{self, RAD_S_PER_RPM};

const OVER_VOLTAGE: i64 = 0x0001;
const DRIVER_TEMPERATURE: i64 = 0x0800;

/// The drive is disabled: the motor's voltage passes the bus's, charges it through the diodes, and the source takes nothing
/// back. What limits the bus takes the power in the end.
#[test]
fn a_free_wheel_under_2_5_nm_ends_where_the_bus_is_limited_and_over_voltage_is_reported() {
    let mut bench = Bench::new();
    bench.forget().world("4 load torque 2.5").run_ms(5000);
    let report = bench.report();
    assert_within("bus in V: 91 V and what 1 kW of suppressors rise by", report.supply_v, 91.25, 105.0);
    // Line-to-line back-EMF is the bus voltage, and the current's drop is small.
    let rad_s = -report.velocity_rpm * RAD_S_PER_RPM;
    let emf_v = rad_s * wheel::emf_per_rad_s() * 3_f64.sqrt();
    assert_within("back-EMF in V", emf_v, report.supply_v, report.supply_v * 1.03);
    bench.reads(0x603F, OVER_VOLTAGE).reads(0x1001, 0x05);
    assert_eq!(bench.heard_of("084#"), ["084#0100050000000000"], "reported once");
    assert_within("2029h in V", bench.get(0x2029) as f64 * 0.01, report.supply_v - 0.1, report.supply_v + 0.1);
    bench.run_ms(10_000);
    bench.turns_about(report.velocity_rpm, 2.0);
}

#[test]
fn the_bleeder_keeps_a_driven_bus_between_its_two_voltages() {
    let mut bench = Bench::new();
    bench.set((0x202E, 5), 1).world("4 load torque 1.5").run_ms(3000);
    let buses = [(); 2000].map(|()| bench.run_ms(1).report().supply_v);
    assert_within("highest bus in V", buses.into_iter().fold(0.0, f64::max), 69.0, 70.5);
    assert_within("lowest bus in V", buses.into_iter().fold(100.0, f64::min), 61.5, 63.0);
    bench.reads(0x603F, 0);
}

#[test]
fn a_bus_that_is_fed_for_long_makes_the_power_stage_hot_which_is_reported_before_it_burns() {
    let mut bench = Bench::new();
    bench.world("4 load torque 5");
    let reported_s = bench.seconds_until(60.0, std::time::Duration::from_millis(100), |report| {
        i64::from(report.error_code) & DRIVER_TEMPERATURE != 0
    });
    assert_within("driver in degC", bench.report().driver_c.expect("a sensor"), 79.0, 82.0);
    let burnt_s = bench.seconds_until(100.0, std::time::Duration::from_millis(100), |report| report.damage.is_some());
    assert!(reported_s > 10.0 && burnt_s > 30.0, "{reported_s} s, then {burnt_s} s");
    let answer = bench.world_answer("4 get");
    assert!(answer.contains("\"powered\":false") && answer.contains("power stage burnt"), "{answer}");
}

#[test]
fn a_burnt_power_stage_brakes_the_wheel_takes_the_drive_off_the_bus_and_a_new_one_is_as_before() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 200).run_ms(1000);
    bench.world("4 fault bridge on").run_ms(500).turns_at(-1.0, 1.0).is_silent();
    bench.forget().world("4 power cycle").run_ms(500);
    assert!(bench.heard().is_empty(), "no boot-up");
    assert!(!bench.report().powered && bench.report().damage.is_some(), "it burns the next fuse");
    bench.world("4 fault bridge off").world("4 power cycle").run_ms(500);
    assert_eq!(bench.report().damage, None);
    bench.enable_in(3).set(0x60FF, 60).run_ms(1000).turns_at(59.0, 61.0);
}

#[test]
fn a_wheel_that_runs_away_seizes_and_is_freed_by_hand() {
    let mut bench = Bench::new();
    bench.world("4 load torque 20").run_ms(10_000);
    let report = bench.report();
    assert!(report.damage.is_some_and(|damage| damage.contains("seized")) && report.velocity_rpm == 0.0, "{report:?}");
    bench.world("4 load torque 0").world("4 rotor free");
    assert_eq!(bench.report().damage, None);
}

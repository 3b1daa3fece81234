//! The motor's cable (chapter 8: a loose power cable is a cause of 0004h): a wire that comes off while the motor turns, wires that
//! touch, and the sound motor, which reports neither.

use sim::Component;
use sim::machine::Realism;

use crate::virtual_zlac8030l::bench::Bench;

const OVER_CURRENT: i64 = 0x0004;

/// Enabled in profile velocity, with this load, at this speed.
fn turning(rpm: i64, load_nm: f64) -> Bench {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, rpm).run_ms(1500).set_load_torque(load_nm).run_ms(1500);
    bench.reads(0x603F, 0);
    bench
}

#[test]
fn a_wire_that_comes_off_while_the_motor_turns_is_reported() {
    for rpm in [-300_i64, -100, 10, 30, 100, 300, 450] {
        for load_nm in [0.0, 1.0, 2.0, 4.0] {
            let load_nm = load_nm * rpm.signum() as f64;
            let mut bench = turning(rpm, load_nm);
            bench.set_fault(Component::Phase, true).run_ms(1000);
            assert_eq!(bench.get(0x603F) & OVER_CURRENT, OVER_CURRENT, "{rpm} r/min, {load_nm} N m");
        }
    }
}

#[test]
fn a_wire_that_comes_off_under_a_load_that_stops_the_motor_is_reported() {
    for load_nm in [6.0, 8.0] {
        let mut bench = turning(100, load_nm);
        bench.set_fault(Component::Phase, true).run_ms(1000);
        assert_eq!(bench.get(0x603F) & OVER_CURRENT, OVER_CURRENT, "{load_nm} N m");
    }
}

#[test]
fn wires_that_touch_are_reported_as_soon_as_the_drive_gives_them_a_voltage_and_mended_it_turns_again() {
    for rpm in [0, 100, 400] {
        let mut bench = turning(rpm, 0.0);
        bench.set_fault(Component::Short, true).set(0x60FF, if rpm == 0 { 50 } else { rpm }).run_ms(100);
        assert_eq!(bench.get(0x603F), OVER_CURRENT, "{rpm} r/min");
        // Mended and reset it turns again.
        bench.set_fault(Component::Short, false).run_ms(1000).set(0x60FF, 0).set(0x6040, 0x80).reads(0x603F, 0);
        bench.enable().set(0x60FF, 100).run_ms(1500).reads(0x603F, 0);
        assert!((bench.report().velocity_rpm - 100.0).abs() < 5.0, "{:?}", bench.report());
    }
}

#[test]
fn a_sound_motor_with_noise_and_cogging_has_lost_no_wire() {
    let mut bench = Bench::new();
    bench.operate(|drive, now| drive.set_realism(Realism::Full, 7, now));
    bench.enable_in(3);
    for rpm in [1_i64, 5, 20, 100, -20, 200, 400, 200, 0] {
        for load_nm in [0.0, 2.0, 0.0, -0.5] {
            bench.set(0x60FF, rpm).set_load_torque(load_nm * if rpm < 0 { -1.0 } else { 1.0 }).run_ms(700);
            assert_eq!(bench.get(0x603F), 0, "{rpm} r/min, {load_nm} N m");
        }
    }
}

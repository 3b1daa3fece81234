//! What holds a shaft that does not move by itself: brake (5.5), lock (200Fh), parking (5.2), position control.

use crate::virtual_zlac8030l::bench::{Bench, assert_within};

/// Turns of the shaft in 1 s under a torque that pulls it backwards.
fn turns_under(bench: &mut Bench, torque_nm: f64) -> f64 {
    let before = bench.report().shaft_angle_rad;
    bench.set_load_torque(torque_nm).run_ms(1000);
    (bench.report().shaft_angle_rad - before) / core::f64::consts::TAU
}

#[test]
fn the_brake_holds_its_torque_and_slides_beyond_and_the_drive_never_moves_it() {
    let mut bench = Bench::new();
    assert_eq!(bench.get(0x2004) & 4, 0, "open at power-on");
    bench.set((0x2030, 0x0E), 1).run_ms(2);
    assert_eq!(bench.get(0x2004) & 4, 4);
    // The virtual machine's brake holds 6 N m.
    assert_eq!(turns_under(&mut bench, 5.0), 0.0);
    assert!(turns_under(&mut bench, 8.0) < -0.5);
    bench.set_load_torque(0.0).run_ms(1000);
    bench.enable_in(3);
    assert_eq!(bench.get((0x2030, 0x0E)), 1, "enabling does not open it");
    bench.set(0x6040, 0).set((0x2030, 0x0E), 0);
    assert!(turns_under(&mut bench, 1.0) < -0.2);
}

#[test]
fn a_disabled_drive_lets_its_shaft_go_unless_200fh_locks_it() {
    // A stronger pull on the free wheel would end in over-voltage.
    for (lock, torque_nm, low, high) in [(0, 0.5, -10.0, -1.0), (1, 2.0, -0.02, 0.001)] {
        let mut bench = Bench::new();
        bench.set(0x200F, lock).run_ms(10).shows(0xFF, 0x70);
        assert_within(&format!("turns with 200Fh = {lock}"), turns_under(&mut bench, torque_nm), low, high);
        assert_eq!(bench.statusword() & 0xFF, 0x70, "holding is not enabling");
    }
}

#[test]
fn a_stored_lock_holds_from_power_on_but_not_in_fault() {
    let mut bench = Bench::new();
    bench.set(0x200F, 1).let_store().power_cycle();
    assert_within("turns", turns_under(&mut bench, 2.0), -0.02, 0.001);
    bench.set_load_torque(0.0).set_fault(sim::Component::Hall, true).run_ms(50);
    assert!(turns_under(&mut bench, 2.0) < -1.0);
}

/// 3 A are 2.28 N m: 2 N m are held, 2.7 N m are not; without parking both are.
#[test]
fn parking_holds_what_3_a_can_hold_and_no_more() {
    for (parking, torque_nm, holds) in [(1, 2.0, true), (1, 2.7, false), (0, 2.7, true)] {
        let mut bench = Bench::new();
        bench.enable_in(3).set((0x202F, 4), parking);
        turns_under(&mut bench, torque_nm);
        bench.run_ms(500);
        let speed = bench.report().velocity_rpm;
        assert_eq!(speed.abs() < 1.0, holds, "parking {parking}, {torque_nm} N m: {speed} r/min");
        let current = bench.report().current_a;
        assert!(parking == 0 || current.abs() < 3.1, "{current} A");
    }
}

#[test]
fn a_position_is_held_against_a_load_to_within_2002h() {
    let mut bench = Bench::new();
    bench.enable_in(1);
    turns_under(&mut bench, 5.0);
    bench.run_ms(1000);
    assert_within("counts off", bench.report().position as f64, -30.0, 30.0);
    assert_eq!(bench.statusword() & 0x2000, 0x2000, "in place");
}

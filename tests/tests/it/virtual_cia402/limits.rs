//! Windows, limits, following error, touch probes and units.

use crate::virtual_cia402::bench::{Bench, TURN};
use sim::VirtualDrive;

/// To a position along steep ramps; how long until target reached, ms.
fn move_to(bench: &mut Bench, position: i64) -> Option<f64> {
    bench.set(&[(0x607A, 0, position)]);
    bench.control(0x1F);
    bench.control(0x0F);
    bench.run_until(5000, |bench| bench.has(0x0400))
}

#[test]
fn the_position_window_has_its_time() {
    let reached = |time_ms: i64| {
        let mut bench = Bench::new();
        bench.enable(1);
        bench.set(&[(0x6068, 0, time_ms), (0x6081, 0, 20 * TURN)]);
        move_to(&mut bench, 2 * TURN).unwrap()
    };
    let (at_once, later) = (reached(0), reached(200));
    assert!((later - at_once - 200.0).abs() <= 1.0, "{at_once} {later}");
}

#[test]
fn a_shaft_that_is_pushed_out_of_its_window_has_not_reached_its_target() {
    let mut bench = Bench::new();
    bench.enable(1);
    bench.set(&[(0x6067, 0, 20), (0x6065, 0, 0xFFFF_FFFF)]);
    move_to(&mut bench, TURN).unwrap();
    // A sudden load of the rated torque turns the shaft before the loops answer.
    bench.machine.set_load_torque(1.27, bench.now).unwrap();
    assert!(bench.run_until(100, |bench| !bench.has(0x0400)).is_some());
    assert!(bench.run_until(1000, |bench| bench.has(0x0400)).is_some(), "the loops bring it back");
}

#[test]
fn velocity_reached_and_standstill_have_their_windows_and_times() {
    let mut bench = Bench::new();
    bench.set(&[(0x606E, 0, 100), (0x6070, 0, 50), (0x6083, 0, 1000 * TURN), (0x6084, 0, 1000 * TURN)]);
    bench.enable(3);
    bench.run_ms(100);
    assert!(bench.has(0x1000), "bit 12: speed 0");
    bench.set(&[(0x60FF, 0, 10 * TURN)]);
    let took = bench.run_until(1000, |bench| bench.has(0x0400)).unwrap();
    assert!((100.0..170.0).contains(&took), "10 ms of ramp, what the loops overshoot, and 100 ms: {took}");
    assert!(!bench.has(0x1000));
    bench.set(&[(0x60FF, 0, 0)]);
    let took = bench.run_until(1000, |bench| bench.has(0x1000)).unwrap();
    assert!((50.0..90.0).contains(&took), "10 ms of ramp and 50 ms: {took}");
}

#[test]
fn a_shaft_that_cannot_turn_has_not_reached_its_velocity_and_one_that_turns_keeps_it() {
    // As delivered 606Dh is 3 r/min.
    for rpm in [5, 27, 300, 3000] {
        let target = rpm * TURN / 60;
        let mut bench = Bench::new();
        bench.enable(3);
        bench.machine.set_rotor_locked(true, bench.now).unwrap();
        bench.set(&[(0x60FF, 0, target)]);
        assert_eq!(bench.run_until(500, |bench| bench.has(0x0400)), None, "{rpm} r/min, locked");
        bench.machine.set_rotor_locked(false, bench.now).unwrap();
        bench.run_until(3000, |bench| bench.has(0x0400)).unwrap();
        bench.run_ms(50);
        let left = bench.run_until(500, |bench| !bench.has(0x0400));
        assert_eq!(left, None, "{rpm} r/min, free");
    }
}

#[test]
fn software_limits_hold_targets_and_speeds() {
    let mut bench = Bench::new();
    bench.set(&[(0x607D, 1, -TURN), (0x607D, 2, 3 * TURN)]);
    bench.enable(1);
    move_to(&mut bench, 10 * TURN).unwrap();
    assert!((bench.position() - 3 * TURN).abs() < 200, "{}", bench.position());
    bench.set(&[(0x607A, 0, -50 * TURN)]);
    bench.control(0x5F);
    bench.control(0x4F);
    bench.run_ms(3000);
    assert!((bench.position() + TURN).abs() < 200, "relative: {}", bench.position());
    bench.set(&[(0x6060, 0, 3), (0x60FF, 0, 20 * TURN)]);
    let mut highest = i64::MIN;
    bench.run_until(3000, |bench| {
        highest = highest.max(bench.position());
        false
    });
    assert!((highest - 3 * TURN).abs() < TURN / 50, "{highest}");
    assert!(bench.rpm().abs() < 2.0 && bench.has(0x0800), "internal limit: {:04X}", bench.status());
}

#[test]
fn limits_in_cyclic_position_hold_the_set_point() {
    let mut bench = Bench::new();
    bench.set(&[(0x607D, 1, -TURN), (0x607D, 2, TURN)]);
    bench.enable(8);
    for step in 0..400 {
        bench.set(&[(0x607A, 0, step * TURN / 100)]);
        bench.run_ms(1);
    }
    assert!((bench.position() - TURN).abs() < 200, "{}", bench.position());
    assert!(bench.has(0x0800));
}

#[test]
fn a_following_error_outside_its_window_for_its_time_is_a_fault() {
    let mut bench = Bench::new();
    bench.set(&[(0x6065, 0, 2000), (0x6066, 0, 50)]);
    bench.enable(1);
    bench.machine.set_rotor_locked(true, bench.now).unwrap();
    bench.set(&[(0x607A, 0, 5 * TURN)]);
    bench.control(0x1F);
    let outside = bench.run_until(1000, |bench| bench.read(0x60F4, 0).abs() > 2000).unwrap();
    let fault = bench.run_until(1000, |bench| bench.has(0x0008)).unwrap();
    assert!((49.0..56.0).contains(&fault), "{outside} {fault}");
    assert_eq!(bench.read(0x603F, 0), 0x8611);
    assert_eq!(bench.emcy(), [0x8611]);
    assert_eq!(bench.read(0x1001, 0), 0x21, "profile specific and generic");
    assert_eq!(bench.read(0x1003, 1), 0x8611);
    bench.machine.set_rotor_locked(false, bench.now).unwrap();
    bench.run_ms(300);
    bench.control(0x00);
    bench.control(0x80);
    bench.run_ms(20);
    assert_eq!(bench.status() & 0x4F, 0x40);
    assert_eq!((bench.read(0x603F, 0), bench.read(0x1001, 0)), (0, 0));
}

#[test]
fn a_window_of_all_ones_switches_the_following_error_off() {
    let mut bench = Bench::new();
    bench.set(&[(0x6065, 0, 0xFFFF_FFFF), (0x6066, 0, 0)]);
    bench.enable(1);
    bench.machine.set_rotor_locked(true, bench.now).unwrap();
    bench.set(&[(0x607A, 0, 2 * TURN)]);
    bench.control(0x1F);
    bench.run_ms(600);
    assert!(bench.read(0x60F4, 0) > TURN && !bench.has(0x2000), "{:04X}", bench.status());
}

#[test]
fn a_limit_switch_stops_the_motion_towards_it_and_lets_it_go_back() {
    let mut bench = Bench::new();
    bench.enable(3);
    bench.switch("POS", Some(2 * TURN), None);
    assert!(!bench.has(0x0800), "bit 11: nothing limits it yet");
    bench.set(&[(0x60FF, 0, 10 * TURN)]);
    bench.run_ms(1000);
    assert!(bench.rpm().abs() < 1.0, "{}", bench.rpm());
    assert!(bench.has(0x0800));
    assert_eq!(bench.read(0x60FD, 0), 0b10);
    bench.set(&[(0x60FF, 0, -5 * TURN)]);
    bench.run_ms(300);
    assert!((bench.rpm() + 300.0).abs() < 6.0, "{}", bench.rpm());
}

#[test]
fn gear_feed_and_factors_scale_everything() {
    let mut bench = Bench::new();
    // Degrees at the end of a gear of 10:1, r/min for velocity.
    let gear = [(0x6091, 1, 10), (0x6091, 2, 1), (0x6092, 1, 360), (0x6096, 1, 60), (0x6096, 2, 360)];
    bench.set(&gear);
    bench.enable(1);
    bench.set(&[(0x6081, 0, 300), (0x6083, 0, 3000), (0x6084, 0, 3000), (0x607F, 0, 500)]);
    let took = move_to(&mut bench, 720).unwrap();
    // Two turns at 5 turns/s and 50 turns/s2: 0.4 s and 0.1 s.
    assert!((495.0..540.0).contains(&took), "{took}");
    assert_eq!(bench.position(), 720);
    let motor = bench.read(0x6063, 0);
    assert!((motor - 20 * TURN).abs() < 2000, "ten turns for each: {motor}");
    bench.set(&[(0x6060, 0, 3), (0x60FF, 0, 60)]);
    bench.run_ms(500);
    assert!((bench.rpm() - 600.0).abs() < 6.0, "{}", bench.rpm());
    assert!((bench.read(0x606C, 0) - 60).abs() <= 1);
}

#[test]
fn polarity_turns_positions_and_velocities_over() {
    let mut bench = Bench::new();
    bench.set(&[(0x607E, 0, 0xC0)]);
    bench.enable(1);
    move_to(&mut bench, TURN).unwrap();
    assert!((bench.position() - TURN).abs() < 200 && bench.read(0x6063, 0) < 0);
    bench.set(&[(0x6060, 0, 3), (0x60FF, 0, 5 * TURN)]);
    bench.run_ms(300);
    assert!((bench.rpm() + 300.0).abs() < 6.0, "{}", bench.rpm());
    assert!(bench.read(0x606C, 0) > 4 * TURN);
}

#[test]
fn touch_probes_latch_positions_at_edges_and_at_the_index_pulse() {
    let mut bench = Bench::new();
    bench.enable(3);
    bench.switch("P1", Some(TURN), Some(2 * TURN));
    // Probe 1: both edges of its input, once. Probe 2: every index pulse.
    bench.set(&[(0x60B8, 0, 0x1731), (0x60FF, 0, 5 * TURN)]);
    bench.run_until(2000, |bench| bench.position() > 3 * TURN).unwrap();
    assert_eq!(bench.read(0x60B9, 0), 0x0307);
    // 5 turns a second are 328 increments a supervision period.
    let (rising, falling) = (bench.read(0x60BA, 0), bench.read(0x60BB, 0));
    assert!((rising - TURN).abs() <= 340 && (falling - 2 * TURN).abs() <= 340, "{rising} {falling}");
    let index = bench.read(0x60BC, 0);
    bench.set(&[(0x60FF, 0, 0)]);
    bench.run_ms(300);
    let motor = bench.machine.assembly().motor(0).unwrap();
    let zero = motor.rotor.angle.count(TURN as u32) - i64::from(bench.machine.firmware().increments(0).unwrap());
    assert!(((index + zero).rem_euclid(TURN) + 2) % TURN <= 4, "{index} {zero}");
    bench.set(&[(0x60B8, 0, 0)]);
    bench.run_ms(2);
    assert_eq!(bench.read(0x60B9, 0), 0);
}

#[test]
fn the_brake_lets_go_with_the_power_stage_unless_the_host_sets_it() {
    let mut bench = Bench::new();
    let released = |bench: &Bench| bench.machine.report().outputs.iter().any(|level| level == ("brake released", true));
    // The motor as delivered has none: it is driven by the output, and there is nothing that holds the shaft.
    assert_eq!(bench.machine.report().brake, None);
    assert!(!released(&bench));
    bench.enable(3);
    assert!(released(&bench));
    bench.set(&[(0x60FE, 2, 1), (0x60FE, 1, 1)]);
    bench.run_ms(2);
    assert!(!released(&bench));
    bench.set(&[(0x60FE, 1, 0)]);
    bench.run_ms(2);
    assert!(released(&bench));
}

//! What the joint does by itself after power-on (2619h), and the position that the battery keeps.

use crate::virtual_mjoint::bench::{Bench, TURN};

fn saved(function: i64) -> Bench {
    let mut bench = Bench::new();
    bench.set(0x2619, function).save();
    bench
}

fn turn_to(bench: &mut Bench, counts: i64) {
    bench.set(0x6060, 1).set(0x6040, 0x2F).set(0x607A, counts).reaches(5000);
    bench.set(0x6040, 0);
}

#[test]
fn turns_are_kept_by_the_battery_also_when_the_shaft_is_turned_without_power() {
    let mut bench = Bench::choosing("J005", "free");
    turn_to(&mut bench, 7 * TURN + 5000);
    bench.world("1 power cut").world("1 load torque -20").run_ms(3000);
    bench.world("1 load torque 0").run_ms(500);
    let turned = bench.report().shaft_angle_rad / core::f64::consts::TAU * TURN as f64;
    assert!(turned > (8 * TURN) as f64, "the load turned it on: {turned}");
    bench.world("1 power on").run_ms(10);
    assert!((bench.position() as f64 - turned).abs() < 2.0, "{} {turned}", bench.position());
    bench.reads(0x260E, 0);
}

#[test]
fn without_battery_and_power_the_turns_are_lost_and_the_place_in_the_turn_is_known() {
    let mut bench = Bench::new();
    turn_to(&mut bench, 7 * TURN + 5000);
    bench.world("1 battery off").power_cycle();
    let position = bench.position();
    assert!((position - 5000).abs() <= 30, "{position}");
    bench.reads(0x260E, 0x10);
}

#[test]
fn an_origin_set_with_60006_and_60016_outlives_a_power_cycle() {
    let mut bench = Bench::new();
    turn_to(&mut bench, 3 * TURN + 777);
    bench.set(0x260A, 60_016);
    assert_eq!(bench.get(0x260A), 60_016, "alone it is a gear");
    bench.set(0x260A, 1234).set(0x260A, 60_006);
    assert!(bench.position() > 3 * TURN);
    bench.set(0x260A, 60_016).run_ms(1).is_at(0, 5).reads(0x260A, 1234);
    bench.power_cycle().is_at(0, 5);
}

#[test]
fn function_6_goes_back_to_the_origin_at_the_speed_of_the_ones_digit() {
    let mut bench = saved(6);
    bench.set(0x6083, 20_002).save();
    turn_to(&mut bench, 8 * TURN);
    bench.power_cycle().run_ms(500);
    let speed = bench.report().velocity_rpm;
    assert!((speed + 300.0).abs() < 10.0, "{speed}");
    assert_eq!(bench.statusword(), 0x0014, "it drives the motor by itself");
    bench.reaches(4000).is_at(0, 30);
}

#[test]
fn turns_that_are_lost_are_no_place_to_go_back_to() {
    let mut bench = saved(6);
    turn_to(&mut bench, 8 * TURN + 9000);
    bench.world("1 battery off").power_cycle().run_ms(1000);
    assert!((bench.position() - 9000).abs() <= 30 && bench.statusword() & 0x10 == 0);
}

#[test]
fn an_angle_is_turned_to_within_the_present_turn() {
    let mut bench = saved(16_384);
    turn_to(&mut bench, 2 * TURN + 1000);
    bench.power_cycle().reaches(3000).is_at(2 * TURN + 16_384, 30);
}

#[test]
fn functions_7_and_8_move_a_brake() {
    let mut bench = saved(7);
    assert_eq!(bench.report().brake, Some(sim::Brake::Released));
    bench.power_cycle();
    assert_eq!(bench.report().brake, Some(sim::Brake::Engaged));
    let before = bench.position();
    bench.world("1 load torque 20").run_ms(500);
    assert!((bench.position() - before).abs() < 200, "the brake holds");
    bench.set(0x6040, 0x0F).run_ms(5);
    assert_eq!(bench.report().brake, Some(sim::Brake::Released));
    bench.set(0x6040, 0).run_ms(5);
    bench.world("1 power off").run_ms(300);
    assert_eq!(bench.report().brake, Some(sim::Brake::Engaged), "without power it holds");
}

#[test]
fn function_9_and_a_gear_of_0_put_the_host_in_control() {
    for (index, value) in [(0x2619, 9), (0x260A, 0)] {
        let mut bench = Bench::new();
        bench.set(index, value).save().reads(0x2600, 0);
        bench.power_cycle();
        assert_eq!(bench.get(0x2600), 1, "{index:04X}h");
        bench.world("1 pulses 1000 10000").run_ms(300);
        assert!(bench.position().abs() < 2, "pulses are ignored");
    }
}

#[test]
fn with_a_brake_the_turns_outlive_a_power_off_without_a_battery() {
    let mut bench = saved(7);
    bench.world("1 battery off").power_cycle();
    assert_eq!(bench.get(0x260E), 0, "a brake in place of a battery: nothing is missing");
    turn_to(&mut bench, 7 * TURN + 5000);
    bench.world("1 load torque 20").run_ms(10).world("1 power off").run_ms(500);
    bench.world("1 power on").run_ms(10).reads(0x260E, 0).is_at(7 * TURN + 5000, 300);
    let position = bench.position();
    bench.send("000#8101").run_ms(10);
    assert_eq!((bench.position(), bench.get(0x260E)), (position, 0), "and an NMT reset");
}

#[test]
fn function_8_goes_back_to_the_origin_without_a_battery() {
    let mut bench = saved(8);
    bench.world("1 battery off").power_cycle().reaches(2000);
    bench.set(0x6040, 0x0F).set(0x260A, 60_006).set(0x260A, 60_016).run_ms(1);
    turn_to(&mut bench, -3 * TURN);
    bench.power_cycle();
    // Already on its way: 100 r/min for less than 10 ms.
    assert!((bench.position() + 3 * TURN).abs() < 1000, "{}", bench.position());
    bench.reaches(4000).is_at(0, 30);
    bench.power_cycle().is_at(0, 30);
}

#[test]
fn a_brake_without_a_readable_record_does_not_guess_the_turns() {
    let mut bench = saved(7);
    turn_to(&mut bench, 2 * TURN);
    bench.world("1 battery off").world("1 fault eeprom on").power_cycle().reads(0x260E, 0x10);
}

#[test]
fn a_battery_that_runs_empty_without_power_loses_the_turns_and_is_charged_again() {
    // 0.07 mA for 0.1 s are 1.9e-6 mA·h.
    for (charge_mah, position, alarm) in [(1e-5, 7 * TURN + 5000, 0), (1e-6, 5000, 0x10)] {
        let mut bench = Bench::open();
        turn_to(&mut bench, 7 * TURN + 5000);
        bench.machine().assembly_mut().motor_mut().encoder.battery.charge_mah = charge_mah;
        bench.power_cycle();
        assert!((bench.position() - position).abs() <= 60, "{charge_mah} mA·h: {}", bench.position());
        assert_eq!(bench.get(0x260E), alarm, "{charge_mah} mA·h");
        let charged = |bench: &mut Bench| bench.machine().assembly().motor().encoder.battery.charge_mah;
        let before = charged(&mut bench);
        bench.run_ms(900);
        // 4 mA.
        assert!((charged(&mut bench) - before - 1e-3).abs() < 1e-5);
    }
}

#[test]
fn beyond_60000_turns_the_position_goes_on_from_the_other_end_and_the_move_does_not_notice() {
    let mut bench = Bench::open_as("J005", "free");
    bench.operate(|drive, now| drive.cut_power(now));
    bench.machine().assembly_mut().motor_mut().rotor.angle = plant::Angle::new(59_999, 0.5);
    bench.power_cycle();
    assert_eq!(bench.position(), 59_999 * TURN + TURN / 2);
    bench.set(0x607A, TURN).set(0x6040, 0x4F).set(0x6040, 0x5F);
    let mut most: f64 = 0.0;
    for _ in 0..500 {
        bench.run_ms(1);
        most = most.max(bench.report().velocity_rpm.abs());
    }
    bench.is_at(-60_000 * TURN + TURN / 2, 30);
    assert!(most < 1700.0 && bench.statusword() == 0x0437, "one turn at 1500 r/min, and no more: {most}");
    // Back by two turns, over the same edge.
    bench.set(0x607A, -2 * TURN).set(0x6040, 0x5F).run_ms(500).is_at(59_998 * TURN + TURN / 2, 30);
}

#[test]
fn a_joint_that_takes_pulses_goes_back_to_where_it_was_at_power_off_and_holds() {
    // "Characteristic": "reenergize automatically back to the power off position".
    let pushed_away = |bench: &mut Bench| {
        turn_to(bench, 2 * TURN + 5000);
        bench.world("1 power cut").world("1 load torque -20").run_ms(200);
        bench.world("1 load torque 0").run_ms(3000);
        bench.world("1 power on").run_ms(10);
        assert!(bench.position() > 3 * TURN, "{}", bench.position());
    };
    let mut bench = Bench::new();
    pushed_away(&mut bench);
    assert_eq!(bench.statusword() & !0x0400, 0x0004, "as printed for a joint that was not enabled");
    bench.run_ms(10_000).is_at(2 * TURN + 5000, 40).shows(0xFFFF, 0x0404);
    bench.world("1 load torque 20").run_ms(500);
    assert!((bench.position() - 2 * TURN - 5000).abs() <= 200, "it holds: {}", bench.position());
    // Bit 0 of the controlword makes it the host's, and bit 1 is 0: free.
    bench.set(0x6040, 1).run_ms(500);
    assert!(bench.position() < 2 * TURN, "{}", bench.position());

    let mut bench = Bench::choosing("J005", "free");
    pushed_away(&mut bench);
    let free = bench.position();
    bench.run_ms(3000);
    assert!((bench.position() - free).abs() <= 5, "{}", bench.position() - free);
}

#[test]
fn at_the_first_power_on_after_an_nmt_reset_and_without_its_turns_a_joint_holds_where_it_is() {
    let mut bench = Bench::new();
    turn_to(&mut bench, TURN);
    bench.world("1 power cycle").run_ms(500);
    turn_to(&mut bench, 3 * TURN + 9000);
    bench.send("000#8101").run_ms(2000);
    assert!((bench.position() - 3 * TURN - 9000).abs() <= 60, "not to the last power-off: {}", bench.position());
    bench.world("1 battery off").power_cycle().run_ms(2000);
    assert!((bench.position() - 9000).abs() <= 60, "the place in the turn: {}", bench.position());
    bench.world("1 load torque 20").run_ms(500);
    assert!((bench.position() - 9000).abs() <= 260, "it holds: {}", bench.position());
}

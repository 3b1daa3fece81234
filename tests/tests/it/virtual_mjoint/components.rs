//! Components that break. The manual lists no alarm for any of them: what the joint shows follows from what it reads.

use crate::virtual_mjoint::bench::Bench;

#[test]
fn the_save_flag_never_reads_2_while_the_eeprom_does_not_answer() {
    let mut bench = Bench::new();
    bench.world("1 fault eeprom on").set(0x6081, 900).set(0x2614, 1).run_ms(200).reads(0x2614, 1);
    bench.world("1 fault eeprom off").run_ms(5);
    assert_eq!(bench.get(0x2614), 2, "what waits is stored as soon as it can be");
    bench.power_cycle().reads(0x6081, 900);
}

#[test]
fn a_save_that_failed_is_gone_after_a_power_cycle() {
    let mut bench = Bench::new();
    bench.set(0x6081, 900).save();
    bench.world("1 fault eeprom on").set(0x6081, 800).set(0x2614, 1).run_ms(50).power_cycle();
    assert_eq!((bench.get(0x2614), bench.get(0x6081)), (0, 1500), "what cannot be read is as delivered");
    bench.world("1 fault eeprom off").power_cycle();
    assert_eq!(bench.get(0x6081), 900, "what was stored before is still there");
}

#[test]
fn an_eeprom_that_could_not_be_read_at_power_on_is_written_anew_by_a_save() {
    let mut bench = Bench::new();
    bench.world("1 fault eeprom on").power_cycle();
    bench.world("1 fault eeprom off").set(0x6081, 700).save().power_cycle().reads(0x6081, 700);
}

#[test]
fn an_encoder_that_stands_still_looks_like_a_stall() {
    let mut bench = Bench::new();
    bench.turn(300).run_ms(400);
    let before = bench.position();
    bench.world("1 fault encoder on").run_ms(1000);
    let stuck = bench.position();
    assert!((stuck - before).abs() < 2000, "{before} {stuck}");
    let current = bench.report().current_a;
    // 16 % of 36 V / sqrt 3 on a phase of 0.44 ohm, r.m.s.
    let allowed = 0.16 * 36.0 / 3.0_f64.sqrt() / 0.44 / 2.0_f64.sqrt();
    // The speed that it does not see is asked for with all output.
    assert!((current / allowed - 1.0).abs() < 0.05, "{current} A of {allowed}");
    assert!(bench.report().velocity_rpm.abs() < 1.0, "the field stands, and the shaft with it");
    bench.until(5000, |bench| bench.get(0x260E) == 0x14);
    assert_eq!(bench.position(), stuck);
    bench.world("1 fault encoder off").set(0x6040, 0x8F).set(0x6040, 0x0F).run_ms(500);
    bench.reads(0x260E, 0).shows(0xFFFF, 0x0437).turns_about(300.0, 10.0);
}

#[test]
fn a_lost_phase_takes_torque_and_a_heavy_load_locks_the_rotor() {
    let mut bench = Bench::new();
    bench.turn(300).run_ms(400);
    // 5 A lift half as much again as the printed 34 N·m, two wires on average half of that.
    bench.set(0x261D, 5005).world("1 load torque 34").run_ms(1000).turns_about(300.0, 10.0);
    bench.world("1 fault phase on").run_ms(1000);
    assert!((bench.report().velocity_rpm - 300.0).abs() > 100.0, "{}", bench.report().velocity_rpm);
}

#[test]
fn parts_that_a_joint_does_not_have_cannot_break() {
    let mut bench = Bench::new();
    for (part, because) in [("hall", "its encoder is absolute"), ("reference", "no alarm reports one")] {
        let line = format!("1 fault {part} on");
        let answer = sim::command::answer(&mut bench.world, &line).expect("a line is answered").json;
        assert!(answer.starts_with("{\"ok\":false") || answer.contains("\"ok\":false"), "{answer}");
        assert!(answer.contains("a m4230e17b50 has no") && answer.contains(because), "{answer}");
    }
}

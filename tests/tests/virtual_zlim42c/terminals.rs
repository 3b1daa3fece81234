//! Functions and levels of inputs X0 to X3 and outputs Y0 and Y1 (5.4, 2003h, 2004h and 2030h).

use sim::Component;

use crate::bench::Bench;

/// Functions of 2030h:0D and 0E.
const ALARM: i64 = 1;
const DRIVE_STATUS: i64 = 2;
const IN_POSITION: i64 = 4;

/// What the drive says of its outputs (2004h), which is what a meter at them shows.
#[track_caller]
fn outputs(bench: &mut Bench) -> i64 {
    bench.run_ms(2);
    let told = bench.get(0x2004);
    // The lights stand behind Y0 and Y1.
    assert_eq!(i64::from(bench.report().outputs.bits & 3), told);
    told
}

#[test]
fn an_output_tells_what_its_function_names_in_either_polarity() {
    for (sub, mask) in [(0x0D, 1), (0x0E, 2)] {
        for reversed in [false, true] {
            let mut bench = Bench::new();
            bench.set((0x2030, 0x0C), if reversed { mask } else { 0 });
            let check = |bench: &mut Bench, function, active: bool| {
                bench.set((0x2030, sub), function);
                assert_eq!(outputs(bench) & mask != 0, active != reversed, "{function} at {sub:02X}h");
                assert_eq!(outputs(bench) & !mask, 0, "the other output");
            };
            for function in [0, ALARM, DRIVE_STATUS, IN_POSITION] {
                check(&mut bench, function, false);
            }
            bench.enable_in(1);
            check(&mut bench, DRIVE_STATUS, true);
            check(&mut bench, IN_POSITION, true);
            bench.move_by(40_000).run_ms(50);
            check(&mut bench, IN_POSITION, false);
            check(&mut bench, DRIVE_STATUS, true);
            bench.set_fault(Component::Reference, true).run_ms(20);
            check(&mut bench, ALARM, true);
            check(&mut bench, DRIVE_STATUS, false);
        }
    }
}

#[test]
fn a_drive_without_power_has_its_outputs_off() {
    let mut bench = Bench::new();
    bench.set((0x2030, 0x0C), 3);
    assert_eq!(outputs(&mut bench), 3);
    bench.operate(|drive, now| drive.cut_power(now));
    bench.run_ms(10);
    assert_eq!(bench.report().outputs.bits, 0);
}

#[test]
fn input_status_shows_the_levels_whatever_the_polarity_and_the_functions() {
    let mut bench = Bench::new();
    bench.set((0x2030, 1), 0b0101);
    for input in 0..4 {
        bench.input(input, true).reads(0x2003, (2 << input) - 1);
    }
    bench.input(1, false).reads(0x2003, 0b1101);
}

#[test]
fn an_input_acts_by_its_function_and_by_no_other_and_its_polarity_counts() {
    // 2030h: 2 positive limit, 3 negative limit, 9 emergency stop; 1 is the home switch and 4 to 8, 10 to 15 nothing.
    for input in 0..4 {
        for function in 0..16 {
            for reversed in [false, true] {
                let mut bench = Bench::new();
                bench.set((0x2030, 1), if reversed { 1 << input } else { 0 }).input(input, reversed);
                bench.set((0x2030, 2 + input as u8), function).set(0x200A, 1).enable_in(3).set(0x60FF, 60).run_ms(200);
                assert_eq!(bench.get(0x606C), 60, "X{input}, {function}: not active yet");
                bench.input(input, !reversed).run_ms(200);
                let stops = matches!(function, 2 | 9);
                assert_eq!(bench.get(0x606C), if stops { 0 } else { 60 }, "X{input}, function {function}");
            }
        }
    }
}

#[test]
fn stored_functions_act_again_after_a_power_cycle() {
    // 3.2 has them undefined at each power-on, 5.4 has them stored: docs/drives/zlim42c.md, Z009.
    let mut bench = Bench::new();
    bench.set((0x2030, 4), 9).set((0x2030, 0x0D), DRIVE_STATUS).let_store().power_cycle();
    bench.enable_in(3);
    assert_eq!(outputs(&mut bench), 1);
    bench.input(2, true).set(0x60FF, 60).run_ms(300);
    assert_eq!(bench.get(0x6064), 0, "X2 is the emergency stop");
}

//! Functions of the inputs X0 to X3 (5.4, 2030h). What both ZL drives have of their terminals is asked in `every_drive`.

use crate::virtual_zlim42c::bench::Bench;

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
    bench.set((0x2030, 4), 9).set((0x2030, 0x0D), 2).let_store().power_cycle().enable_in(3).run_ms(2).reads(0x2004, 1);
    bench.input(2, true).set(0x60FF, 60).run_ms(300);
    assert_eq!(bench.get(0x6064), 0, "X2 is the emergency stop");
}

//! Digital inputs and outputs: 2003h, 2004h and 2030h of both ZLTECH drives (ZLAC8030L, 5.4 and 5.5; ZLIM42-C, 3.2 and 5.4).

use crate::bench::Bench;
use crate::power_states::ZltechSubject;

/// Functions of an output.
const ALARM: i64 = 1;
const DRIVE_STATUS: i64 = 2;
const IN_POSITION: i64 = 4;

/// What the drive says of Y0 and Y1 (2004h), which is what a meter at them shows.
#[track_caller]
fn outputs<S: ZltechSubject>(bench: &mut Bench<S>) -> i64 {
    let levels = bench.run_ms(5).get(0x2004) & 3;
    assert_eq!((bench.report().outputs.bits & 3) as i64, levels);
    levels
}

/// 0 is not a function, and 3 is not connected or reports a homing that has not been done.
pub fn an_output_tells_what_its_function_names_in_either_polarity<S: ZltechSubject>() {
    for (sub, mask) in S::OUTPUT_FUNCTIONS.iter().zip([1, 2]) {
        for reversed in [false, true] {
            let mut bench = Bench::<S>::new();
            bench.set((0x2030, 0x0C), if reversed { mask } else { 0 });
            let reports = |bench: &mut Bench<S>, function, active: bool| {
                let now = outputs(bench.set((0x2030, *sub), function));
                assert_eq!(now & mask != 0, active != reversed, "{function} at 2030h:{sub:02X}, reversed {reversed}");
                assert_eq!(now & !mask, 0, "the other output");
            };
            for function in [0, ALARM, DRIVE_STATUS, 3] {
                reports(&mut bench, function, false);
            }
            reports(&mut bench, IN_POSITION, S::BOOTED & 1 << 10 != 0);
            bench.enable_in(1);
            reports(&mut bench, DRIVE_STATUS, true);
            reports(&mut bench, IN_POSITION, true);
            bench.move_by(4_000).run_ms(100);
            reports(&mut bench, IN_POSITION, false);
            reports(&mut bench, DRIVE_STATUS, true);
            bench.run_ms(2500);
            reports(&mut bench, IN_POSITION, true);
            bench.set(0x6040, 0);
            reports(&mut bench, DRIVE_STATUS, false);
            bench.enable().set((0x2030, S::OUTPUT_FUNCTIONS[0]), 0).break_down(true);
            for (function, active) in [(0, false), (ALARM, true), (DRIVE_STATUS, false), (3, false)] {
                reports(&mut bench, function, active);
            }
            bench.break_down(false).set(0x6040, 0).set(0x6040, 0x80);
            reports(&mut bench, ALARM, false);
        }
    }
}

/// 2004h and the terminals themselves.
pub fn a_drive_without_power_has_its_outputs_off<S: ZltechSubject>() {
    let mut bench = Bench::<S>::new();
    assert_eq!(outputs(bench.set((0x2030, 0x0C), 3)), 3);
    bench.operate(|drive, now| drive.cut_power(now));
    bench.run_ms(10);
    assert_eq!(bench.report().outputs.bits, 0);
}

/// 2003h.
pub fn input_status_shows_the_levels_whatever_the_polarity_and_the_functions<S: ZltechSubject>() {
    let mut bench = Bench::<S>::new();
    bench.set((0x2030, 1), 0b0101);
    for input in 0..S::INPUTS {
        bench.set_input(input, true).run_ms(15).reads(0x2003, (2 << input) - 1);
    }
    bench.set_input(1, false).run_ms(15).reads(0x2003, ((1 << S::INPUTS) - 1) & !2);
    bench.set_input(0, false).run_ms(15).reads(0x2003, ((1 << S::INPUTS) - 1) & !3);
}

/// X0 stops (function 9) by a contact that opens: its polarity is reversed (2030h:01) and its level high. A drive that starts reads
/// it as it is: one that is enabled within its debounce time keeps the speed that it is given then.
pub fn a_stop_input_that_is_active_low_stops_a_drive_that_has_just_started_only_if_it_is_low<S: ZltechSubject>() {
    for (level, rpm) in [(true, 100), (false, 0)] {
        let mut bench = Bench::<S>::new();
        bench.set((0x2030, 1), 1).set((0x2030, 2), 9).set_input(0, level).run_ms(50).let_store();
        bench.send("000#8104").send("000#8101");
        S::let_take_time(&mut bench);
        bench.enable_in(3).reads(0x2003, i64::from(level)).set(0x60FF, 100);
        bench.run_ms(2000).goes_at(rpm);
    }
}

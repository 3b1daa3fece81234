//! 3.2 and 5.4: the four inputs with their filter, inversion and functions, limits and emergency stop, the two outputs.

use std::time::Duration;

use super::position::go_to;
use super::steps::{TARGET_REACHED, enable_in, release};
use super::stopping::until_standing;
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// The input's filter (3.2).
const FILTER_S: f64 = 0.010;

/// 2003h, the levels; 2030h:01, inversion; pulses of less than 10 ms are not seen.
pub(super) fn inputs(bench: &mut Bench) {
    bench.section("3.2", "inputs");
    for (place, name) in ["X0", "X1", "X2", "X3"].into_iter().enumerate() {
        bench.step(format!("{name} on"));
        bench.machine(&format!("input {name} 1"));
        bench.run_ms(15);
        bench.expect_object(0x2003, 0, Expect::Bits(1 << place), "");
        bench.machine(&format!("input {name} 0"));
        bench.run_ms(15);
    }
    bench.step("X3 on for 5 ms");
    bench.machine("input X3 1");
    bench.run_ms(5);
    bench.machine("input X3 0");
    let mut seen = 0;
    for _ in 0..10 {
        bench.run_ms(2);
        seen |= bench.read(0x2003, 0).unwrap_or_default();
    }
    bench.expect("2003h", Expect::Bits(0), "", seen as f64);
}

/// 200Ah and 2030h:03 to 05: a limit stops the motion towards it, and an emergency stop both ways.
pub(super) fn limits_and_emergency_stop(bench: &mut Bench) {
    bench.section("5.4", "limits");
    bench.write("X1 is the positive limit", 0x2030, 3, 2);
    bench.write("X2 is the negative limit", 0x2030, 4, 3);
    bench.write("X3 is the emergency stop", 0x2030, 5, 9);
    bench.write("deceleration time 300 ms", 0x6084, 0, 300);
    for (mode, input, rpm, time_s) in
        [(0, "X1", 60, Some(0.3)), (0, "X2", -60, Some(0.3)), (1, "X1", 60, Some(0.05)), (2, "X1", 60, None)]
    {
        bench.write(format!("limit stop mode {mode} (200Ah)"), 0x200A, 0, mode);
        turn(bench, rpm);
        bench.step(format!("{input} on"));
        bench.machine(&format!("input {input} 1"));
        bench.mark(format!("limit {input}"), EventKind::Stop);
        if let Some(time_s) = time_s {
            let took_s = until_standing(bench);
            bench.expect("stands after", Expect::Near(FILTER_S + time_s, 0.004), "s", took_s);
            bench.write("back out of the limit", 0x60FF, 0, -i64::from(rpm));
            bench.run_ms(300);
            bench.expect_object(0x606C, 0, Expect::Near(f64::from(-rpm), 0.0), "r/min");
        } else {
            bench.run_ms(400);
            bench.expect_object(0x606C, 0, Expect::Near(rpm.into(), 0.0), "r/min");
        }
        bench.machine(&format!("input {input} 0"));
        bench.write("target speed 0", 0x60FF, 0, 0);
        bench.run_ms(350);
        release(bench);
    }
    bench.write("limit stop mode 0 (200Ah)", 0x200A, 0, 0);
    turn(bench, 60);
    bench.step("X3 on: emergency stop");
    bench.machine("input X3 1");
    bench.mark("emergency stop", EventKind::Stop);
    // 605Ah = 5: a normal stop.
    let took_s = until_standing(bench);
    bench.expect("stands after", Expect::Near(FILTER_S + 0.3, 0.004), "s", took_s);
    bench.step("X3 off: nothing starts on its own");
    bench.machine("input X3 0");
    bench.run_ms(300);
    bench.expect_object(0x606C, 0, Expect::Near(0.0, 0.0), "r/min");
    for sub_index in 3..=5 {
        bench.write("no function", 0x2030, sub_index, 0);
    }
    bench.write("deceleration time 100 ms", 0x6084, 0, 100);
    release(bench);
}

fn turn(bench: &mut Bench, rpm: i32) {
    bench.write(format!("target speed {rpm} r/min"), 0x60FF, 0, rpm.into());
    enable_in(bench, 3);
    bench.run_ms(300);
}

/// 2030h:0D and 0E, the functions of Y0 and Y1; 2030h:0C, inversion; 2004h.
pub(super) fn outputs(bench: &mut Bench) {
    bench.section("5.4", "outputs");
    bench.write("Y0 signals alarms", 0x2030, 0x0D, 1);
    bench.write("Y1 signals in position", 0x2030, 0x0E, 4);
    go_to(bench, 1000);
    expect_outputs(bench, "in position: Y1", 0b10);
    bench.write("target 3000", 0x607A, 0, 3000);
    bench.aim_at(3000.0);
    bench.write("absolute motion, 1Fh", 0x6040, 0, 0x1F);
    bench.run_ms(100);
    expect_outputs(bench, "on the way: none", 0);
    bench.write("Y0 inverted (2030h:0C)", 0x2030, 0x0C, 1);
    bench.run_ms(5);
    expect_outputs(bench, "inverted: Y0", 0b01);
    bench.write("not inverted", 0x2030, 0x0C, 0);
    bench.run_until(Duration::from_secs(2), |word| word & TARGET_REACHED != 0);
    bench.step("alarm");
    bench.machine("fault reference on");
    bench.run_ms(50);
    expect_outputs(bench, "alarm: Y0", 0b01);
    bench.machine("fault reference off");
    bench.run_ms(50);
    bench.write("fault reset (2011h)", 0x2011, 0, 1);
    bench.write("Y0 has no function", 0x2030, 0x0D, 0);
    bench.write("Y1 has no function", 0x2030, 0x0E, 0);
    release(bench);
}

fn expect_outputs(bench: &mut Bench, step: &str, levels: u32) {
    bench.step(step);
    bench.expect_object(0x2004, 0, Expect::Bits(levels), "");
    let pins = u32::from(bench.output("Y0")) | u32::from(bench.output("Y1")) << 1;
    bench.expect("Y0, Y1", Expect::Bits(levels), "", pins.into());
}

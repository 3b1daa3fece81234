//! Halt (bit 8) and the option codes 605Ah to 605Dh (5.4), each by the time it takes to stop.

use std::time::Duration;

use super::position::go_to;
use super::steps::{enable_in, expect_position, release};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// 6084h and 6085h as set here.
const NORMAL_S: f64 = 0.3;
const FAST_S: f64 = 0.05;

/// 5.3.4 and 5.3.5, bit 8: the motion stops as 605Dh says, and goes on when the bit falls.
pub(super) fn halt(bench: &mut Bench) {
    bench.section("5.3.4", "halt");
    go_to(bench, 0);
    bench.write("target 8000", 0x607A, 0, 8000);
    bench.aim_at(8000.0);
    bench.write("absolute motion, 1Fh", 0x6040, 0, 0x1F);
    bench.run_ms(500);
    bench.mark("halt", EventKind::Stop);
    bench.write("halt, 11Fh", 0x6040, 0, 0x11F);
    bench.run_ms(300);
    bench.expect_object(0x606C, 0, Expect::Near(0.0, 0.0), "r/min");
    bench.expect_status("bit 10: stands", 0x0400, 0x0400);
    bench.write("goes on, 1Fh", 0x6040, 0, 0x1F);
    bench.run_ms(2_500);
    expect_position(bench, 8000.0);
    release(bench);
}

/// 605Ah quick stop, 605Bh shutdown, 605Ch disable operation, 605Dh halt, 6085h.
pub(super) fn option_codes(bench: &mut Bench) {
    bench.section("5.4", "stop codes");
    bench.write("deceleration time 300 ms", 0x6084, 0, 300);
    bench.write("emergency deceleration 50 ms (6085h)", 0x6085, 0, 50);
    // State after: low bits of the statusword (5.3.1).
    let rows: [(&str, u16, i64, i64, f64, u16); 8] = [
        ("quick stop, normal", 0x605A, 5, 0x02, NORMAL_S, 0x07),
        ("quick stop, fast", 0x605A, 6, 0x02, FAST_S, 0x07),
        ("quick stop, emergency", 0x605A, 7, 0x02, FAST_S, 0x07),
        ("halt, normal", 0x605D, 1, 0x10F, NORMAL_S, 0x27),
        ("halt, fast", 0x605D, 2, 0x10F, FAST_S, 0x27),
        ("halt, emergency", 0x605D, 3, 0x10F, FAST_S, 0x27),
        ("shutdown, normal", 0x605B, 1, 0x06, NORMAL_S, 0x21),
        ("disable operation, normal", 0x605C, 1, 0x07, NORMAL_S, 0x23),
    ];
    for (name, object, option, controlword, time_s, state) in rows {
        bench.write(format!("{object:04X}h = {option}"), object, 0, option);
        bench.write("target speed 60 r/min", 0x60FF, 0, 60);
        enable_in(bench, 3);
        bench.run_ms(300);
        bench.write(format!("{name}: {controlword:02X}h"), 0x6040, 0, controlword);
        let took_s = until_standing(bench);
        bench.expect("stands after", Expect::Near(time_s, 0.004), "s", took_s);
        bench.run_ms(20);
        bench.expect_status("state", 0x6F, state);
        bench.write("target speed 0", 0x60FF, 0, 0);
        release(bench);
    }
    bench.write("605Ah = 5", 0x605A, 0, 5);
    bench.write("605Dh = 1", 0x605D, 0, 1);
    bench.write("deceleration time 100 ms", 0x6084, 0, 100);
}

/// The time until the commanded speed is 0, s.
pub(super) fn until_standing(bench: &mut Bench) -> f64 {
    const LOOK: Duration = Duration::from_micros(500);
    const LIMIT: Duration = Duration::from_secs(2);
    let begin = bench.now();
    while bench.report().velocity_demand_rpm.is_some_and(|rpm| rpm != 0.0) && bench.now() - begin < LIMIT {
        bench.run_silently(LOOK);
    }
    (bench.now() - begin).as_secs_f64()
}

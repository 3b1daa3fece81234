//! 5.09: the homing methods 17 to 22, each from off and from on its switch, the first one with the example's datagrams.

use std::f64::consts::TAU;
use std::time::Duration;

use super::steps::{COUNTS_PER_TURN, idle};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// From where the motor starts to the switch's edge, counts.
const WAY: i64 = 10_000;

/// The way that it takes to stop beyond the edge, from 100 r/min with 20000 (r/min)/s.
const RAMP_COUNTS: f64 = 0.5 * 100.0 * 100.0 / 20_000.0 * COUNTS_PER_TURN / 60.0;

/// What dry friction is worth in the position loop.
const STAND_COUNTS: f64 = 90.0;

const FOUND: u16 = 1 << 12;

/// A method, its switch's pin, and whether the switch reaches from its edge to positive positions.
const METHODS: [(u8, &str, bool); 6] = [
    (17, "DIR", false),
    (18, "PU", true),
    (19, "DIR", true),
    (20, "DIR", true),
    (21, "DIR", false),
    (22, "DIR", false),
];

/// 5.09.
pub(super) fn all(bench: &mut Bench) {
    bench.section("5.09", "homing");
    for (method, pin, positive) in METHODS {
        bench.mark(format!("homing {method}"), EventKind::Note);
        for on_switch in [false, true] {
            home(bench, method, pin, positive, on_switch);
        }
        bench.machine(&format!("input {pin} 0"));
    }
    idle(bench);
}

fn home(bench: &mut Bench, method: u8, pin: &str, positive: bool, on_switch: bool) {
    let begins = if on_switch { "on" } else { "off" };
    bench.ask(format!("method {method}, {begins} the switch"), &format!("2F 98 60 00 {method:02X}"), "60 98 60 00");
    let start = bench.report().position;
    let edge = if positive == on_switch { start - WAY } else { start + WAY };
    let range = if positive { format!("{edge} max") } else { format!("min {edge}") };
    bench.machine(&format!("switch {pin} {range}"));
    bench.run_ms(5);
    let edge_shaft = shaft_counts(bench) + (edge - start) as f64;
    bench.ask("work mode 6: homing starts", "2F 60 60 00 06", "60 60 60 00");
    bench.ask("status word: still looking", "40 41 60 00", "4B 41 60 00 14 00");
    bench.run_until(Duration::from_secs(5), |word| word & FOUND != 0);
    bench.run_ms(100);
    bench.ask("status word: found", "40 41 60 00", "4B 41 60 00 14 14");
    let position = bench.read_f64(0x6064, 0);
    bench.moved(format!("origin {:+.0} counts from the start", edge as f64 - start as f64));
    // The switch goes on or off between two counts.
    let expected = if positive { edge_shaft - 0.5 } else { edge_shaft + 0.5 };
    let origin = shaft_counts(bench) - position;
    let beyond = (origin - expected).round().abs();
    bench.expect("origin beyond the edge", Expect::Near(RAMP_COUNTS, STAND_COUNTS), "counts", beyond);
    // 5.10.1: "the return value is a number around 0".
    bench.expect("6064h", Expect::Near(0.0, 9.0), "counts", position);
}

/// Where the shaft truly is, in counts from where it stood at the start.
fn shaft_counts(bench: &mut Bench) -> f64 {
    bench.report().shaft_angle_rad / TAU * COUNTS_PER_TURN
}

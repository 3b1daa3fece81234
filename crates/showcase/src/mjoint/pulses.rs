//! "2. Command pulse + direction position control mode", "3. Orthogonal instruction pulse position control mode" and "1.
//! Internal acceleration and deceleration curve".

use super::steps::{COUNTS_PER_TURN, counts_s, power_cycle, save};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// Counts by which the following motor may be off at rest: 8 pulses of 4 counts.
const FOLLOWING_COUNTS: f64 = 32.0;

/// "Pulse frequency = 1000/60 * 8192 = 136533 Hz".
const HZ_AT_1000_RPM: f64 = 136_533.0;

/// Wiring 2.
pub(super) fn pulse_and_direction(bench: &mut Bench) {
    bench.section("wiring 2", "pulses");
    bench.write("no internal curve: acceleration 60000", 0x6083, 0, 60_000);
    send(bench, "8192 pulses (gear 4 to 1)", "pulses 8192 10000", COUNTS_PER_TURN);
    send(bench, "4096 pulses with DIR", "pulses -4096 10000", -COUNTS_PER_TURN / 2.0);
    bench.write("gear 256 to 25: 3200 pulses a turn", 0x260A, 0, 256);
    bench.write("gear denominator 25", 0x260B, 0, 25);
    send(bench, "6400 pulses", "pulses 6400 8000", 2.0 * COUNTS_PER_TURN);
    bench.write("gear 32768 (256/25 set back)", 0x260A, 0, 32_768);
    bench.write("gear denominator 8192", 0x260B, 0, 8192);
    bench.write("DIR polarity 1", 0x2609, 0, 1);
    send(bench, "4096 pulses the other way", "pulses 4096 10000", -COUNTS_PER_TURN / 2.0);
    bench.write("DIR polarity 0", 0x2609, 0, 0);
    bench.write("control word bit 0: pulses have no effect", 0x6040, 0, 0x0F);
    send(bench, "4096 pulses", "pulses 4096 10000", 0.0);
    bench.write("control word 0", 0x6040, 0, 0);
}

/// A pulse train, and how far the motor turns by it.
fn send(bench: &mut Bench, step: &str, train: &str, counts: f64) {
    bench.step(step);
    let from = bench.report().position as f64;
    bench.machine(train);
    bench.run_ms(1_200);
    let way = bench.report().position as f64 - from;
    bench.moved(format!("{way:+.0} counts"));
    bench.expect("way", Expect::Near(counts, FOLLOWING_COUNTS), "counts", way);
}

/// Parameter debugging 1: below 60000 the drive makes the ramp, from 60000 on the pulses do.
pub(super) fn internal_curve(bench: &mut Bench) {
    bench.section("debug 1", "internal curve");
    const RAMP_RPM_S: f64 = 5_000.0;
    let ramp_s = 1000.0 / RAMP_RPM_S;
    for (acceleration, half, whole) in [(5_000, 500.0, 1000.0), (60_000, 1000.0, 1000.0)] {
        bench.write(format!("acceleration {acceleration}"), 0x6083, 0, acceleration);
        bench.step("pulses of 136533 Hz at once");
        bench.mark(format!("acceleration {acceleration}"), EventKind::Note);
        let from = bench.report().position as f64;
        bench.machine("pulses 100000 136533");
        bench.run_ms(100);
        let speed = bench.report().velocity_rpm;
        bench.expect("after 0.1 s", Expect::Near(half, 40.0), "r/min", speed);
        bench.run_ms(100);
        let (speed, way) = (bench.report().velocity_rpm, bench.report().position as f64 - from);
        bench.expect("after 0.2 s", Expect::Near(whole, 60.0), "r/min", speed);
        // What the ramp of 0.2 s leaves out is half of its way.
        let lag = HZ_AT_1000_RPM * 0.2 * 4.0 - way;
        let expected = if acceleration < 60_000 { counts_s(1000.0) * ramp_s / 2.0 } else { 0.0 };
        bench.expect("lag", Expect::Near(expected.round(), 4_000.0), "counts", lag.round());
        bench.run_ms(1_500);
        let way = bench.report().position as f64 - from;
        bench.moved(format!("{way:+.0} counts"));
        bench.expect("in the end", Expect::Near(400_000.0, FOLLOWING_COUNTS), "counts", way);
    }
    bench.write("acceleration 20000", 0x6083, 0, 20_000);
}

/// Wiring 3: special function 2, in effect "after being repowered".
pub(super) fn quadrature(bench: &mut Bench) {
    bench.section("wiring 3", "quadrature");
    bench.write("special function 2", 0x2619, 0, 2);
    save(bench);
    power_cycle(bench);
    bench.write("no internal curve: acceleration 60000", 0x6083, 0, 60_000);
    // Gear 4 to 1: 4096 edges are 16384 counts.
    send(bench, "an encoder turns 4096 counts, PU ahead", "quadrature 4096 8000", COUNTS_PER_TURN / 2.0);
    send(bench, "4096 counts, DIR ahead", "quadrature -4096 8000", -COUNTS_PER_TURN / 2.0);
    bench.write("acceleration 20000", 0x6083, 0, 20_000);
}

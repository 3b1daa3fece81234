//! 5.4: currents, microsteps, what can be read, and where parameters are kept.

use std::f64::consts::TAU;

use super::position::go_to;
use super::steps::{TARGET_REACHED, enable_in, release};
use crate::bench::Bench;
use crate::expect::Expect;

/// 2005h: some of the peak currents; 2007h: half of it or all of it at rest.
pub(super) fn currents(bench: &mut Bench) {
    bench.section("5.4", "currents");
    for (setting, peak_a) in [(0, 0.3), (3, 1.2), (7, 2.2)] {
        for (lock, rest_a) in [(0, peak_a / 2.0), (1, peak_a)] {
            bench.write(format!("current {setting}: {peak_a} A peak (2005h)"), 0x2005, 0, setting);
            bench.write(if lock == 0 { "half at rest (2007h)" } else { "all at rest (2007h)" }, 0x2007, 0, lock);
            enable_in(bench, 3);
            bench.write("target speed 60 r/min", 0x60FF, 0, 60);
            bench.run_ms(300);
            let current = bench.report().current_a;
            // A turning rotor swings a little and induces what the current loop has to follow.
            bench.expect("turning", Expect::Near(peak_a, 0.05 * peak_a + 0.03), "A", current);
            bench.write("target speed 0", 0x60FF, 0, 0);
            bench.run_ms(500);
            let current = bench.report().current_a;
            bench.expect("at rest", Expect::Near(rest_a, 0.05 * rest_a), "A", current);
            release(bench);
        }
    }
    bench.write("shaft locked without enabling (200Bh = 1)", 0x200B, 0, 1);
    bench.run_ms(50);
    let current = bench.report().current_a;
    bench.expect("current", Expect::AtLeast(0.5), "A", current);
    bench.write("shaft free without enabling (200Bh = 0)", 0x200B, 0, 0);
    bench.run_ms(50);
    let current = bench.report().current_a;
    bench.expect("current", Expect::Near(0.0, 0.02), "A", current);
    bench.write("current 3: 1.2 A peak (2005h)", 0x2005, 0, 3);
    bench.write("half at rest (2007h)", 0x2007, 0, 0);
}

/// 2006h: pulses in a turn.
pub(super) fn microsteps(bench: &mut Bench) {
    bench.section("5.4", "microsteps");
    for (setting, pulses) in [(0, 200), (4, 3200), (7, 25_600), (10, 4000)] {
        bench.write(format!("microsteps {setting}: {pulses} a turn (2006h)"), 0x2006, 0, setting);
        bench.write(format!("{pulses} pulses"), 0x607A, 0, pulses);
        enable_in(bench, 1);
        bench.write("relative motion, 4Fh", 0x6040, 0, 0x4F);
        let from = bench.report().shaft_angle_rad;
        bench.write("relative motion, 5Fh", 0x6040, 0, 0x5F);
        bench.run_ms(10);
        bench.run_until(std::time::Duration::from_secs(3), |word| word & TARGET_REACHED != 0);
        bench.run_ms(100);
        let turns = (bench.report().shaft_angle_rad - from) / TAU;
        bench.moved(format!("{turns:+.3} turns"));
        bench.expect("turns", Expect::Near(1.0, 0.002), "", turns);
        release(bench);
    }
}

/// 2012h, 2069h, versions, speed and state.
pub(super) fn position_and_readings(bench: &mut Bench) {
    bench.section("5.4", "readings");
    bench.write("current position := 0 (2012h)", 0x2012, 0, 1);
    bench.run_ms(5);
    bench.expect_object(0x6064, 0, Expect::Near(0.0, 0.0), "pulses");
    for supply_v in [20.0, 24.0, 30.0] {
        bench.step(format!("supply {supply_v} V: bus voltage (2069h)"));
        bench.machine(&format!("supply {supply_v}"));
        bench.run_ms(300);
        bench.expect_object(0x2069, 0, Expect::Near(supply_v, 1.0), "V");
    }
    bench.machine("supply 24");
    bench.run_ms(300);
    bench.step("software version, twice (2088h, 100Ah)");
    let version = bench.read_f64(0x100A, 0);
    bench.expect_object(0x2088, 0, Expect::Near(version, 0.0), "");
}

/// 200Ch: each write is kept at once, or none; 2010h saves and restores all.
pub(super) fn storing(bench: &mut Bench) {
    bench.section("5.4", "storing");
    bench.write("each write is kept (200Ch = 0)", 0x200C, 0, 0);
    bench.write("current 5 (2005h)", 0x2005, 0, 5);
    restart(bench, "kept", 5);
    bench.write("writes are not kept (200Ch = 1)", 0x200C, 0, 1);
    bench.write("current 6 (2005h)", 0x2005, 0, 6);
    restart(bench, "as before", 5);
    bench.write("writes are not kept (200Ch = 1)", 0x200C, 0, 1);
    bench.write("current 6 (2005h)", 0x2005, 0, 6);
    bench.write("save all (2010h = 2)", 0x2010, 0, 2);
    restart(bench, "saved", 6);
    bench.write("factory settings (2010h = 1)", 0x2010, 0, 1);
    restart(bench, "restored", 3);
    go_to(bench, 500);
    release(bench);
}

fn restart(bench: &mut Bench, what: &str, current: i64) {
    bench.run_ms(300);
    bench.step(format!("restart: {what}"));
    bench.machine("power off");
    bench.run_ms(200);
    bench.machine("power on");
    bench.run_ms(100);
    bench.expect_object(0x2005, 0, Expect::Near(current as f64, 0.0), "");
}

//! 4.4 and 7.3: profile torque mode against a locked shaft.

use std::time::Duration;

use super::velocity::enable_again;
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// Torque slope as delivered (6087h), A/s.
const SLOPE_A_S: f64 = 0.3;

/// 6077h counts in 0.1 A.
const RESOLUTION_A: f64 = 0.1;

/// 4.4: the target is a motor current in mA, the ramp 6087h leads to it.
pub(super) fn profile_torque(bench: &mut Bench) {
    bench.section("4.4", "profile torque");
    bench.ask("torque mode", "2F 60 60 00 04 00 00 00", "60 60 60 00 00 00 00 00");
    bench.machine("rotor lock");
    bench.mark("shaft locked", EventKind::Note);
    enable_again(bench);
    let targets = [(1.0, "2B 71 60 00 E8 03 00 00"), (-1.0, "2B 71 60 00 18 FC FF FF")];
    let mut before_a = 0f64;
    for (target_a, request) in targets {
        bench.ask(format!("target {:.0} mA", target_a * 1e3), request, "60 71 60 00 00 00 00 00");
        let time_s = (target_a - before_a).abs() / SLOPE_A_S;
        bench.run(Duration::from_secs_f64(time_s / 2.0));
        let halfway = bench.report().current_a;
        bench.expect("halfway", Expect::Near((before_a + target_a) / 2.0, RESOLUTION_A), "A", halfway);
        bench.run(Duration::from_secs_f64(time_s / 2.0 + 0.5));
        let current = bench.read_f64(0x6077, 0) * RESOLUTION_A;
        bench.expect("6077h", Expect::Near(target_a, RESOLUTION_A), "A", current);
        let measured = bench.report().current_a;
        bench.moved(format!("{measured:+.2} A, shaft locked"));
        bench.step_in("7.3", "statusword at the target");
        let word = bench.statusword().unwrap_or_default();
        // Bit 5 no emergency stop, 10 reached, 15 no external stop.
        bench.expect("bits 5, 10, 15", Expect::Bits(0x0420), "", f64::from(word & 0x8420));
        before_a = target_a;
    }
    bench.ask("target 0 mA", "2B 71 60 00 00 00 00 00", "60 71 60 00 00 00 00 00");
    bench.ask("stop", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
    bench.machine("rotor free");
    bench.run(Duration::from_millis(300));
}

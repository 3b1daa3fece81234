//! 5.06 and 5.07: position and speed mode by SDO, with the datagrams of the worked examples; 5.04: incremental moves and
//! the values that can be read.

use super::steps::{TARGET_REACHED, counts_s, idle, move_time_s, until_reached};
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// As the examples set them.
const SPEED_RPM: f64 = 1000.0;
const ACCELERATION_RPM_S: f64 = 20_000.0;

/// Status word with and without bit 10, as printed; the examples that print 40 as the command mean 4B.
const REACHED: &str = "4B 41 60 00 37 04";
const ON_THE_WAY: &str = "4B 41 60 00 37 00";

const READ_STATUS: &str = "40 41 60 00";

/// 5.06.1.
pub(super) fn absolute(bench: &mut Bench) {
    bench.section("5.06.1", "absolute position");
    bench.ask("control word 0Fh: enable", "2B 40 60 00 0F 00", "60 40 60 00");
    bench.ask("work mode 1: position", "2F 60 60 00 01", "60 60 60 00");
    bench.ask("read the actual position", "40 64 60 00", "43 64 60 00 .. .. .. ..");
    let true_position = bench.report().position as f64;
    bench.expect_object(0x6064, 0, Expect::Near(true_position, 1.0), "counts");
    bench.ask("trapezoidal speed 1000 r/min", "23 81 60 00 E8 03 00 00", "60 81 60 00");
    bench.ask("acceleration 20000 (r/min)/s", "23 83 60 00 20 4E 00 00", "60 83 60 00");
    bench.ask("control word 2Fh: absolute, each target at once", "2B 40 60 00 2F 00", "60 40 60 00");
    for (target, request) in [(50_000.0, "23 7A 60 00 50 C3 00 00"), (-50_000.0, "23 7A 60 00 B0 3C FF FF")] {
        let from = bench.report().position as f64;
        bench.ask(format!("target {target:+}"), request, "60 7A 60 00");
        bench.ask("status word on the way", READ_STATUS, ON_THE_WAY);
        until_reached(bench, target, from, move_time_s(target - from, SPEED_RPM, ACCELERATION_RPM_S));
        bench.ask("status word at the target", READ_STATUS, REACHED);
    }
}

/// 5.06.2: 4Fh and 5Fh, and then 5Fh alone for each further move.
pub(super) fn relative(bench: &mut Bench) {
    bench.section("5.06.2", "relative position");
    bench.ask("control word 0Fh: enable", "2B 40 60 00 0F 00", "60 40 60 00");
    bench.ask("work mode 1: position", "2F 60 60 00 01", "60 60 60 00");
    bench.ask("target +50000, cached", "23 7A 60 00 50 C3 00 00", "60 7A 60 00");
    bench.ask("trapezoidal speed 1000 r/min", "23 81 60 00 E8 03 00 00", "60 81 60 00");
    bench.ask("acceleration 20000 (r/min)/s", "23 83 60 00 20 4E 00 00", "60 83 60 00");
    bench.ask("control word 4Fh: relative", "2B 40 60 00 4F 00", "60 40 60 00");
    go_on(bench, 50_000.0);
    bench.ask("next target -30000", "23 7A 60 00 D0 8A FF FF", "60 7A 60 00");
    go_on(bench, -30_000.0);
}

/// 5Fh: a move by so many counts from the last target.
fn go_on(bench: &mut Bench, counts: f64) {
    let from = bench.report().position as f64;
    bench.ask("control word 5Fh: go", "2B 40 60 00 5F 00", "60 40 60 00");
    until_reached(bench, from + counts, from, move_time_s(counts, SPEED_RPM, ACCELERATION_RPM_S));
    bench.ask("bit 4 has cleared itself", "40 40 60 00", "4B 40 60 00 4F 00");
    bench.ask("status word at the target", READ_STATUS, REACHED);
}

/// 5.04: 260Ch, "write direct updates".
pub(super) fn incremental(bench: &mut Bench) {
    bench.section("5.04", "incremental");
    for counts in [32_768, -16_384] {
        let from = bench.report().position as f64;
        bench.write(format!("incremental position {counts:+}"), 0x260C, 0, counts);
        let counts = counts as f64;
        until_reached(bench, from + counts, from, move_time_s(counts, SPEED_RPM, ACCELERATION_RPM_S));
    }
    idle(bench);
}

/// 5.07.1.
pub(super) fn speed(bench: &mut Bench) {
    bench.section("5.07.1", "speed");
    bench.ask("work mode 3: speed", "2F 60 60 00 03", "60 60 60 00");
    bench.ask("speed 500 r/min", "23 FF 60 00 F4 01 00 00", "60 FF 60 00");
    let (begin, from) = (bench.now(), bench.report().position as f64);
    bench.ask("control word 0Fh: start", "2B 40 60 00 0F 00", "60 40 60 00");
    bench.run_ms(1_000);
    let (time_s, way) = ((bench.now() - begin).as_secs_f64(), bench.report().position as f64 - from);
    bench.moved(format!("{way:+.0} counts in {time_s:.2} s"));
    // Half a ramp is missing: 500 r/min with 20000 (r/min)/s.
    let expected = counts_s(500.0) * (time_s - 500.0 / ACCELERATION_RPM_S / 2.0);
    bench.expect("way", Expect::Near(expected.round(), (0.01 * expected).round()), "counts", way);
    expect_speed(bench, 500.0, 2.0);
    bench.ask("status word at the speed", READ_STATUS, REACHED);
    bench.mark("stop (10Fh)", EventKind::Stop);
    bench.ask("control word 10Fh: stop", "2B 40 60 00 0F 01", "60 40 60 00");
    bench.run_ms(300);
    expect_speed(bench, 0.0, 1.0);
    let current = bench.report().current_a;
    bench.moved(format!("stands, held with {current:+.2} A"));
    bench.ask("status word at standstill", READ_STATUS, REACHED);
    bench.write("speed -800 r/min", 0x60FF, 0, -800);
    bench.write("control word 0Fh: go on", 0x6040, 0, 0x0F);
    bench.run_ms(600);
    expect_speed(bench, -800.0, 4.0);
    bench.expect_status("bit 10", TARGET_REACHED, TARGET_REACHED);
}

/// By SDO 606Ch is in 0.1 r/min (5.04).
fn expect_speed(bench: &mut Bench, rpm: f64, tolerance_rpm: f64) {
    let speed = bench.read_f64(0x606C, 0) / 10.0;
    bench.expect("606Ch", Expect::Near(rpm, tolerance_rpm), "r/min", speed);
}

/// 5.04: what can be read, against what is measured at the machine.
pub(super) fn readings(bench: &mut Bench) {
    bench.section("5.04", "readings");
    let report = bench.report();
    let values = [
        ("current, x/2000 A", 0x6078, 1.0 / 2000.0, "A", report.current_a.abs(), 0.15),
        ("speed, x/10 r/min", 0x606C, 0.1, "r/min", report.velocity_rpm, 4.0),
        ("system voltage, x/327 V", 0x6079, 1.0 / 327.0, "V", report.supply_v, 0.2),
        ("temperature", 0x2612, 1.0, "°C", report.driver_c.unwrap_or(f64::NAN), 2.0),
        ("alarm code", 0x260E, 1.0, "", 0.0, 0.0),
    ];
    for (name, index, per_count, unit, true_value, tolerance) in values {
        bench.step(format!("read {name} ({index:04X}h)"));
        let read = bench.read_f64(index, 0) * per_count;
        bench.expect("", Expect::Near(true_value, tolerance), unit, read);
    }
    bench.step("read the output's PWM (2613h)");
    bench.expect_object(0x2613, 0, Expect::AtMost(0.0), "");
    bench.write("speed 0", 0x60FF, 0, 0);
    bench.run_ms(300);
    idle(bench);
}

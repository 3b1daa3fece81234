//! 5.3.5: velocity mode. The example, and the S-shaped ramp by its middle.

use super::steps::{PULSES_S_PER_RPM, START_RPM, enable_in, release};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;

const ACCEPTED: &str = "60 40 60 00 00 00 00 00";

/// Statusword bits 10 (speed reached), 12 (speed is 0), 14 (running).
const MOTION_BITS: u16 = 0x5400;

/// The example at 60 r/min, and the other way.
pub(super) fn example(bench: &mut Bench) {
    bench.section("5.3.5", "velocity");
    bench.step("NMT start");
    bench.send(frame("000 01 00"));
    bench.ask("initialise the state machine", "2B 40 60 00 00 00 00 00", ACCEPTED);
    bench.ask("acceleration time 100 ms", "23 83 60 00 64 00 00 00", "60 83 60 00 00 00 00 00");
    bench.ask("deceleration time 100 ms", "23 84 60 00 64 00 00 00", "60 84 60 00 00 00 00 00");
    bench.ask("target speed 60 r/min", "23 FF 60 00 3C 00 00 00", "60 FF 60 00 00 00 00 00");
    bench.ask("velocity mode", "2F 60 60 00 03 00 00 00", "60 60 60 00 00 00 00 00");
    bench.ask("controlword 06h", "2B 40 60 00 06 00 00 00", ACCEPTED);
    bench.ask("controlword 07h", "2B 40 60 00 07 00 00 00", ACCEPTED);
    bench.ask("controlword 0Fh: start", "2B 40 60 00 0F 00 00 00", ACCEPTED);
    bench.run_ms(500);
    at_speed(bench, 60.0);
    for (target, request) in [(-60.0, "23 FF 60 00 C4 FF FF FF"), (0.0, "23 FF 60 00 00 00 00 00")] {
        bench.ask(format!("target speed {target} r/min"), request, "60 FF 60 00 00 00 00 00");
        bench.run_ms(500);
        at_speed(bench, target);
    }
}

/// The speed by 606Ch, 2002h and the rotor, the way of a second, and the bits of 5.3.5.
fn at_speed(bench: &mut Bench, rpm: f64) {
    bench.expect_object(0x606C, 0, Expect::Near(rpm, 0.0), "r/min");
    bench.expect_object(0x2002, 0, Expect::Near(rpm, 0.0), "r/min");
    bench.expect_object(0x2001, 0, Expect::Near(f64::from(u8::from(rpm != 0.0)), 0.0), "");
    let from = bench.report().position as f64;
    bench.run_ms(500);
    let way = bench.report().position as f64 - from;
    bench.moved(format!("{way:+.0} pulses in 0.5 s"));
    bench.expect("way", Expect::Near(rpm * PULSES_S_PER_RPM * 0.5, 1.0), "pulses", way);
    bench.step(format!("statusword at {rpm} r/min"));
    bench.expect_status("bits 10, 12, 14", MOTION_BITS, if rpm == 0.0 { 0x1400 } else { 0x4400 });
}

/// Half-way in time the ramp is half-way in speed; its way is the mean speed times its time.
pub(super) fn ramp(bench: &mut Bench) {
    bench.section("5.3.5", "ramp");
    bench.write("acceleration time 400 ms", 0x6083, 0, 400);
    let from = bench.report().position as f64;
    bench.write("target speed 300 r/min", 0x60FF, 0, 300);
    bench.run_ms(200);
    let speed = bench.report().velocity_demand_rpm.unwrap_or(f64::NAN);
    bench.expect("half-way", Expect::Near(f64::midpoint(START_RPM, 300.0), 4.0), "r/min", speed);
    bench.run_ms(200);
    let way = bench.report().position as f64 - from;
    let ramp = f64::midpoint(START_RPM, 300.0) * PULSES_S_PER_RPM * 0.4;
    // A millisecond at 300 r/min is 20 pulses.
    bench.expect("way of the ramp", Expect::Near(ramp.round(), 40.0), "pulses", way);
    bench.write("target speed 0", 0x60FF, 0, 0);
    bench.run_ms(300);
    bench.write("acceleration time 100 ms", 0x6083, 0, 100);
    release(bench);
    enable_in(bench, 3);
    release(bench);
}

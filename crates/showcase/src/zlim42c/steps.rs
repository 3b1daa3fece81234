//! Figures and steps that several procedures of the stepper share.

use crate::bench::Bench;
use crate::expect::Expect;

/// Pulses in a turn as delivered: 2006h = 10.
pub(super) const PULSES_PER_TURN: f64 = 4000.0;

/// Pulses a second in 1 r/min.
pub(super) const PULSES_S_PER_RPM: f64 = PULSES_PER_TURN / 60.0;

/// 200Eh and 6082h as delivered: the speeds that a move begins and ends with, r/min.
pub(super) const START_RPM: f64 = 5.0;
pub(super) const END_RPM: f64 = 10.0;

pub(super) const TARGET_REACHED: u16 = 1 << 10;
pub(super) const ACKNOWLEDGE: u16 = 1 << 12;

/// The controlwords 06h, 07h, 0Fh of the examples, as one row after the mode.
pub(super) fn enable_in(bench: &mut Bench, mode: i64) {
    bench.write(format!("mode {mode}"), 0x6060, 0, mode);
    bench.step("enable (06h, 07h, 0Fh)");
    let mut nibbles = Vec::new();
    for request in ["2B 40 60 00 06 00 00 00", "2B 40 60 00 07 00 00 00", "2B 40 60 00 0F 00 00 00"] {
        bench.send_sdo(request);
        bench.run_ms(10);
        nibbles.push(format!("{:X}", bench.statusword().unwrap_or_default() & 0xF));
    }
    let seen = nibbles.join(", ");
    let ok = seen == "1, 3, 7";
    bench.compare("6041h bits 0-3 1, 3, 7", seen, ok);
}

/// Controlword 0: the motor is free.
pub(super) fn release(bench: &mut Bench) {
    bench.aim_at_nothing();
    bench.ask("controlword 00h", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run_ms(20);
}

/// 6064h and where the rotor truly is, which the drive does not measure.
pub(super) fn expect_position(bench: &mut Bench, pulses: f64) {
    bench.expect_object(0x6064, 0, Expect::Near(pulses, 0.0), "pulses");
    let rotor = bench.report().rotor_position.map_or(f64::NAN, |rotor| rotor as f64);
    // Dry friction holds it some pulses off its vector.
    bench.expect("rotor", Expect::Near(pulses, 6.0), "pulses", rotor);
}

/// The time of a move with S-shaped ramps of 100 ms from [`START_RPM`] up and down to [`END_RPM`]: each covers the mean of
/// its speeds. One that is too short keeps the slopes and turns back at a lower speed.
pub(super) fn move_time_s(pulses: f64, rpm: f64) -> f64 {
    const RAMP_S: f64 = 0.1;
    let [start, top, end] = [START_RPM, rpm, END_RPM].map(|speed| speed * PULSES_S_PER_RPM);
    let ramps = (start + top) / 2.0 * RAMP_S + (top + end) / 2.0 * RAMP_S;
    let pulses = pulses.abs();
    if pulses >= ramps {
        return 2.0 * RAMP_S + (pulses - ramps) / top;
    }
    let (up, down) = (RAMP_S / (top - start), RAMP_S / (top - end));
    let peak = ((2.0 * pulses + start * start * up + end * end * down) / (up + down)).sqrt();
    (peak - start) * up + (peak - end) * down
}

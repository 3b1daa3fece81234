//! Every procedure of the ZLIM42-C's manual ("ZLIM42-C user manual V1.03", in Chinese).

mod communication;
mod faults;
mod homing;
mod open_loop;
mod parameters;
mod pdo;
mod position;
mod power;
mod stopping;
mod terminals;
mod velocity;

use super::bench::Bench;
use super::expect::Expect;

/// Pulses in a turn as delivered: 2006h = 10.
pub(super) const PULSES_PER_TURN: f64 = 4000.0;

/// Pulses a second in 1 r/min.
const PULSES_S_PER_RPM: f64 = PULSES_PER_TURN / 60.0;

/// 200Eh and 6082h as delivered: the speeds that a move begins and ends with, r/min.
const START_RPM: f64 = 5.0;
const END_RPM: f64 = 10.0;

const TARGET_REACHED: u16 = 1 << 10;
const ACKNOWLEDGE: u16 = 1 << 12;

/// All of it. What changes how the drive is reached comes last.
pub(super) fn procedures(bench: &mut Bench) {
    communication::boot_up(bench);
    communication::identity(bench);
    communication::sdo_commands(bench);
    power::initialisation(bench);
    power::state_machine(bench);
    power::modes(bench);
    position::example(bench);
    position::absolute(bench);
    position::short(bench);
    position::several_set_points(bench);
    velocity::example(bench);
    velocity::ramp(bench);
    homing::all(bench);
    stopping::halt(bench);
    stopping::option_codes(bench);
    terminals::inputs(bench);
    terminals::limits_and_emergency_stop(bench);
    terminals::outputs(bench);
    parameters::currents(bench);
    parameters::microsteps(bench);
    parameters::position_and_readings(bench);
    parameters::storing(bench);
    pdo::mapping(bench);
    open_loop::step_loss(bench);
    faults::all(bench);
    communication::heartbeat(bench);
    communication::node_and_bit_rate(bench);
}

/// The controlwords 06h, 07h, 0Fh of the examples, as one row after the mode.
fn enable_in(bench: &mut Bench, mode: i64) {
    bench.write(format!("mode {mode}"), 0x6060, 0, mode);
    bench.step("enable (06h, 07h, 0Fh)");
    let mut nibbles = Vec::new();
    for request in ["2B 40 60 00 06 00 00 00", "2B 40 60 00 07 00 00 00", "2B 40 60 00 0F 00 00 00"] {
        bench.tell(request);
        bench.run_ms(10);
        nibbles.push(format!("{:X}", bench.statusword().unwrap_or_default() & 0xF));
    }
    let seen = nibbles.join(", ");
    let ok = seen == "1, 3, 7";
    bench.compare("6041h bits 0-3 1, 3, 7", seen, ok);
}

/// Controlword 0: the motor is free.
fn release(bench: &mut Bench) {
    bench.aim_at_nothing();
    bench.ask("controlword 00h", "2B 40 60 00 00 00 00 00", "60 40 60 00 00 00 00 00");
    bench.run_ms(20);
}

/// 6064h and where the rotor truly is, which the drive does not measure.
fn expect_position(bench: &mut Bench, pulses: f64) {
    bench.expect_object(0x6064, 0, Expect::Near(pulses, 0.0), "pulses");
    let rotor = bench.report().rotor_position.map_or(f64::NAN, |rotor| rotor as f64);
    // Dry friction holds it some pulses off its vector.
    bench.expect("rotor", Expect::Near(pulses, 6.0), "pulses", rotor);
}

/// The time of a move with S-shaped ramps of 100 ms from [`START_RPM`] up and down to [`END_RPM`]: each covers the mean of
/// its speeds. One that is too short keeps the slopes and turns back at a lower speed.
fn move_time_s(pulses: f64, rpm: f64) -> f64 {
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

//! Every procedure of the ZLIM42-C's manual ("ZLIM42-C user manual V1.03", in Chinese).

mod communication;
mod faults;
mod homing;
mod open_loop;
mod parameters;
mod pdo;
mod position;
mod power;
mod steps;
mod stopping;
mod terminals;
mod velocity;

use super::bench::Bench;

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

//! Every procedure of the M joint's manual ("M Robot Joint Motor CanOpen Manual").
//!
//! Chapters without a number go by a word of their title: "wiring 2" is "2. Command pulse + direction position control
//! mode" of the wiring chapter.

mod alarms;
mod communication;
mod homing;
mod motion;
mod multi_turn;
mod pdo;
mod pulses;
mod special_function;
mod steps;

pub(super) use steps::{COUNTS_PER_TURN, IN_PLACE_COUNTS};

use super::bench::Bench;

/// All of it. What has to be set and restarted comes last, so that the worked examples find the joint as delivered.
pub(super) fn procedures(bench: &mut Bench) {
    communication::boot_up(bench);
    communication::device_information(bench);
    communication::sdo_format(bench);
    motion::absolute(bench);
    motion::relative(bench);
    motion::incremental(bench);
    motion::speed(bench);
    motion::readings(bench);
    communication::registers(bench);
    communication::nmt(bench);
    pdo::parameters(bench);
    pdo::synchronised(bench);
    pdo::absolute(bench);
    pdo::speed(bench);
    homing::all(bench);
    communication::host_heartbeat(bench);
    alarms::all(bench);
    multi_turn::zero_setting(bench);
    multi_turn::known_after_power_on(bench);
    multi_turn::origin_signal(bench);
    multi_turn::return_to_origin(bench);
    pulses::pulse_and_direction(bench);
    pulses::internal_curve(bench);
    pulses::quadrature(bench);
    special_function::duty_cycle(bench);
    special_function::communication_control(bench);
    special_function::angle(bench);
    special_function::brake(bench);
    communication::address(bench);
}

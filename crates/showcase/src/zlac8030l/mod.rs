//! Every procedure of the ZLAC8030L's manual ("ZLAC8030L quick start guide V1.00").

mod as_delivered;
mod communication;
mod faults;
mod functions;
mod pdo;
mod position;
mod torque;
mod velocity;

use super::bench::Bench;

/// All of it, in the manual's order as far as the drive's state allows.
pub(super) fn procedures(bench: &mut Bench) {
    communication::boot_up(bench);
    communication::sdo_format(bench);
    velocity::profile_velocity(bench);
    velocity::emergency_stop(bench);
    velocity::stop(bench);
    velocity::readings(bench);
    position::relative(bench);
    position::absolute(bench);
    torque::profile_torque(bench);
    functions::alarm_pwm(bench);
    functions::parking(bench);
    functions::speed_resolution(bench);
    functions::io_stop(bench);
    functions::brake(bench);
    pdo::tpdo(bench);
    pdo::rpdo(bench);
    faults::all(bench);
    communication::heartbeat(bench);
}

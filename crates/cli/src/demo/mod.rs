//! The demo: every procedure of the ZLAC8030L's manual against the virtual drive, datagram by datagram as printed.
//!
//! What is expected comes from the manual ("ZLAC8030L quick start guide V1.00") or from a closed form of its figures,
//! never from an earlier run. Each row of the table says what was asked, what answered, what moved and what was seen.

mod bench;
mod communication;
mod expect;
mod faults;
mod figure;
mod functions;
mod pdo;
mod position;
mod report;
mod row;
mod set_points;
mod torque;
mod velocity;

use bench::Bench;
pub(crate) use report::DemoReport;

use crate::failure::Failure;
use crate::plot::Figure;
use crate::progress::Progress;

/// Runs the demo: the table, and the picture of the motion.
pub(crate) fn run(progress: Progress) -> Result<(DemoReport, Figure), Failure> {
    let mut bench = Bench::new(&drives::zlac8030l::PROFILE, progress)?;
    communication::boot_up(&mut bench);
    communication::sdo_format(&mut bench);
    velocity::profile_velocity(&mut bench);
    velocity::emergency_stop(&mut bench);
    velocity::stop(&mut bench);
    velocity::readings(&mut bench);
    position::relative(&mut bench);
    position::absolute(&mut bench);
    torque::profile_torque(&mut bench);
    functions::alarm_pwm(&mut bench);
    functions::parking(&mut bench);
    functions::speed_resolution(&mut bench);
    functions::io_stop(&mut bench);
    functions::brake(&mut bench);
    pdo::tpdo(&mut bench);
    pdo::rpdo(&mut bench);
    faults::all(&mut bench);
    communication::heartbeat(&mut bench);
    let finished = bench.finish();
    let figure = figure::figure(&finished);
    Ok((DemoReport::new(finished), figure))
}

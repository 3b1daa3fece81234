//! The whole ZLAC8030L: CANopen, power state machine, motion, control loops and protection.

use drives::Firmware;
use drives::zlac8030l::{Actuation, Hardware, Sensors, Zlac8030l};

use crate::{Board, exchange};

/// A board with a motor.
pub trait MotorBoard: Board {
    /// What the drive measures, read at this moment.
    fn sensors(&mut self) -> Sensors;

    /// What the drive does, from the next period on.
    fn actuate(&mut self, actuation: &Actuation);
}

/// Power-on: the boot-up message.
pub fn start(drive: &mut Zlac8030l, board: &mut impl MotorBoard) {
    let now = board.now();
    drive.power_on(&Hardware::default(), now);
    exchange(drive, board, now);
}

/// One control period of 50 us, as a timer's interrupt begins it.
pub fn turn(drive: &mut Zlac8030l, board: &mut impl MotorBoard) {
    let now = board.now();
    let sensors = board.sensors();
    let actuation = drive.tick(&sensors, now);
    board.actuate(&actuation);
    exchange(drive, board, now);
}

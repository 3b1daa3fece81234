//! Where the two programs begin, and the board's own functions that they call: symbols that the linker finds by name.

use core::mem::MaybeUninit;

use can::{Frame, Instant};
use drives::zlac8030l::{Actuation, Sensors, Zlac8030l};

use crate::Board;
use crate::node::{self, Sensor};
use crate::servo::{self, MotorBoard};

// What a board's own code provides: registers of its timer, CAN controller, converters and PWM. It counts for nothing here.
unsafe extern "Rust" {
    safe fn board_now() -> Instant;
    safe fn board_receive() -> Option<Frame>;
    safe fn board_send(frame: &Frame);
    safe fn board_sensors() -> Sensors;
    safe fn board_actuate(actuation: &Actuation);
    safe fn board_wait();
}

struct Linked;

impl Board for Linked {
    fn now(&mut self) -> Instant {
        board_now()
    }

    fn receive(&mut self) -> Option<Frame> {
        board_receive()
    }

    fn send(&mut self, frame: &Frame) {
        board_send(frame);
    }
}

impl MotorBoard for Linked {
    fn sensors(&mut self) -> Sensors {
        board_sensors()
    }

    fn actuate(&mut self, actuation: &Actuation) {
        board_actuate(actuation);
    }
}

/// The node's RAM: not on the stack, so that the image says how much it is.
static mut SENSOR: MaybeUninit<Sensor> = MaybeUninit::uninit();
/// The drive's.
static mut DRIVE: MaybeUninit<Zlac8030l> = MaybeUninit::uninit();

/// The program of the node.
#[unsafe(no_mangle)]
extern "C" fn node_main() -> ! {
    // SAFETY: the only reference to SENSOR that is ever made: the start-up code calls this once.
    let sensor = unsafe { &mut *(&raw mut SENSOR) }.write(node::sensor());
    node::start(sensor, &mut Linked);
    loop {
        node::turn(sensor, &mut Linked);
        board_wait();
    }
}

/// The program of the ZLAC8030L.
#[unsafe(no_mangle)]
extern "C" fn zlac8030l_main() -> ! {
    // SAFETY: the only reference to DRIVE that is ever made: the start-up code calls this once.
    let drive = unsafe { &mut *(&raw mut DRIVE) }.write(Zlac8030l::new());
    servo::start(drive, &mut Linked);
    loop {
        servo::turn(drive, &mut Linked);
        board_wait();
    }
}

/// A panic stops the program; a board's watchdog then resets it, with its power stage off.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        board_wait();
    }
}

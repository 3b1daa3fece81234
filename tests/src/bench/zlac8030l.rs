//! The bench of a ZLAC8030L with its wheel motor.

use std::sync::LazyLock;

use can::Bitrate;
use plant::hub_motor::HubMotor;
use sim::Component;
use sim::machine::{Zlac8030lMachine, zlac8030l};

use super::{BenchSubject, Rows};
use crate::object_rows::{KeepingSubject, Memory};
use crate::power_states::{PowerSubject, ZltechSubject};
use crate::zlac8030l::{PowerCell, objects, power_states};

pub use super::{Abort, assert_within};

/// Value of 200Eh for 500 kbit/s.
pub const RATE_500K: u16 = 1;

/// The node of a drive as delivered, and its number in the world.
pub const NODE: u8 = Zlac8030l::NODE;

/// The drive.
#[derive(Debug)]
pub struct Zlac8030l;

/// Of all benches the same name.
pub type Drive = Zlac8030l;

/// Its bench.
pub type Bench = super::Bench<Zlac8030l>;

impl BenchSubject for Zlac8030l {
    type Machine = Zlac8030lMachine;

    const MODEL: &'static str = "zlac8030l";
    const NODE: u8 = 4;
    const BITRATE: Bitrate = Bitrate::K500;
    const REFUSED: &'static str = include_str!("../../data/zlac8030l/refused.csv");
    const AT_REST: &'static str = include_str!("../../data/zlac8030l/at_rest.csv");

    fn machine() -> Zlac8030lMachine {
        zlac8030l(NODE, RATE_500K)
    }

    fn rows() -> &'static Rows {
        static ROWS: LazyLock<Rows> = LazyLock::new(|| Rows::new(objects()));
        &ROWS
    }
}

impl PowerSubject for Zlac8030l {
    const BREAKABLE: Component = Component::Hall;
    const BROKEN: (u16, u8) = (0x0200, 0x81);
    const ABOVE: u16 = 0;
    const STATUSWORD_AT_REST: &'static str = include_str!("../../data/zlac8030l/statusword_at_rest.csv");
    // As the recorded one shows it.
    const BOOTED: u16 = 0x0670;
    const MOVING_MODES: &'static [i64] = &[1, 3];
    // 2002h as delivered.
    const IN_POSITION: i64 = 30;
    // At the current limit, L123.
    const EMERGENCY_STOP_S: f64 = 0.0;
    const HOMING_RAMP_S: f64 = 0.0;
    const STANDS_AFTER_MS: u64 = 600;
    const HAND_NM: f64 = 0.5;
    const COUNTS_PER_RPM: i64 = 10;
    const RIPPLE_RPM: f64 = 1.0;

    fn power_states() -> Vec<(PowerCell, u16)> {
        power_states().into_iter().map(|cell| (cell, 0)).collect()
    }

    fn let_take_time(bench: &mut Bench) {
        // The watch over the host.
        bench.set(0x2000, 0);
    }
}

impl ZltechSubject for Zlac8030l {
    const CLEARS_POSITION: &'static [u16] = &[0x2005, 0x2006];
    const START_SPEED: u16 = 0x2008;
    const INPUTS: usize = 2;
    const OUTPUT_FUNCTIONS: [u8; 2] = [0x0D, 0x0F];
}

impl KeepingSubject for Zlac8030l {
    const MEMORY: Memory = Memory {
        switch: 0x2010,
        command: 0x2009,
        // The bit rate: see `network`. The others do something and read 0 again.
        without: &[0x200E, 0x2005, 0x2006, 0x2009],
        node_id: Some(0x200D),
        two: [(0x2014, 150, 77), (0x2015, 300, 88)],
        eds: include_str!("../../data/zlac8030l/eds_defaults.csv"),
    };
}

impl Bench {
    /// The motor of an [`open`](Self::open) bench, as it is now.
    pub fn motor(&mut self) -> &mut HubMotor {
        self.machine().assembly_mut().motor_mut()
    }
}

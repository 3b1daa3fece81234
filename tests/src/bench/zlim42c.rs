//! The bench of a ZLIM42-C.

use std::sync::LazyLock;

use can::Bitrate;
use sim::Component;
use sim::machine::{Zlim42cMachine, zlim42c, zlim42c_82};

use super::{BenchSubject, Rows};
use crate::manual::PowerCell;
use crate::object_rows::{KeepingSubject, Memory};
use crate::power_states::{PowerSubject, ZltechSubject};
use crate::zlim42c::{objects, power_states};

pub use super::{Abort, assert_within};

/// Value of 2009h for 500 kbit/s.
pub const RATE_500K: u16 = 1;

/// The node of a drive as delivered, and its number in the world.
pub const NODE: u8 = Zlim42c::NODE;

/// The drive, of 70 mm.
#[derive(Debug)]
pub struct Zlim42c;

/// Of all benches the same name.
pub type Drive = Zlim42c;

/// Its bench.
pub type Bench = super::Bench<Zlim42c>;

impl BenchSubject for Zlim42c {
    type Machine = Zlim42cMachine;

    const MODEL: &'static str = "zlim42c";
    const NODE: u8 = 1;
    const BITRATE: Bitrate = Bitrate::K500;
    const REFUSED: &'static str = include_str!("../../data/zlim42c/refused.csv");
    const AT_REST: &'static str = include_str!("../../data/zlim42c/at_rest.csv");

    fn machine() -> Zlim42cMachine {
        zlim42c(NODE, RATE_500K)
    }

    fn rows() -> &'static Rows {
        static ROWS: LazyLock<Rows> = LazyLock::new(|| Rows::new(objects()));
        &ROWS
    }
}

impl PowerSubject for Zlim42c {
    const BREAKABLE: Component = Component::Reference;
    const BROKEN: (u16, u8) = (0xFF08, 0x81);
    // The motor is energised.
    const ABOVE: u16 = 1 << 13;
    const STATUSWORD_AT_REST: &'static str = include_str!("../../data/zlim42c/statusword_at_rest.csv");
    const BOOTED: u16 = 0x0270;
    const MOVING_MODES: &'static [i64] = &[1, 3, 6];
    const IN_POSITION: i64 = 0;
    // 5.4 has one word for 605Ah = 7, 605Dh = 3, 200Ah = 1 and 6085h (Z092).
    const EMERGENCY_STOP_S: f64 = 0.05;
    const HOMING_RAMP_S: f64 = 0.2;
    const STANDS_AFTER_MS: u64 = 2;
    const HAND_NM: f64 = 0.05;
    const COUNTS_PER_RPM: i64 = 1;
    // A fifth at 60 r/min: full steps excite the rotor.
    const RIPPLE_RPM: f64 = 12.0;

    fn power_states() -> Vec<(PowerCell, u16)> {
        power_states().into_iter().map(|it| (it.cell, if it.bit_13_after { Self::ABOVE } else { 0 })).collect()
    }

    fn let_home(bench: &mut Bench) {
        bench.set(0x609A, 200).set(0x6098, 18);
    }
}

impl ZltechSubject for Zlim42c {
    const CLEARS_POSITION: &'static [u16] = &[0x2012];
    const START_SPEED: u16 = 0x200E;
    const INPUTS: usize = 4;
    const OUTPUT_FUNCTIONS: [u8; 2] = [0x0D, 0x0E];
}

impl KeepingSubject for Zlim42c {
    const MEMORY: Memory = Memory {
        switch: 0x200C,
        command: 0x2010,
        // The bit rate: see `address`. The others do something and read 0 again.
        without: &[0x2009, 0x2010, 0x2011, 0x2012],
        // The address switches are set, and go before 2008h.
        node_id: None,
        two: [(0x2005, 3, 7), (0x2006, 10, 4)],
        eds: include_str!("../../data/zlim42c/eds_defaults.csv"),
    };
}

impl Bench {
    /// A drive with the longer motor, as delivered, that has just booted.
    #[must_use]
    pub fn long() -> Self {
        Self::with(vec![Box::new(zlim42c_82(NODE, RATE_500K))])
    }

    /// Level of a digital input, held long enough to pass its filter.
    #[track_caller]
    pub fn input(&mut self, input: usize, level: bool) -> &mut Self {
        self.set_input(input, level).run_ms(15)
    }
}

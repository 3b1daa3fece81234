//! The bench of the standard's own servo with its default motor.

use std::sync::LazyLock;

use can::Bitrate;
use canopen::NodeId;
use devices::servo::CIA402;
use sim::Component;
use sim::machine::{Order, ServoMachine, servo};

use super::{BenchSubject, Rows};
use crate::cia402::{objects, power_states};
use crate::manual::PowerCell;
use crate::power_states::PowerSubject;

/// 'save' of 1010h.
const SAVE: i64 = 0x6576_6173;

/// Velocity units in a turn per second, when they are r/min.
const RPM: i64 = 60;

/// Increments in a turn of the motor, which are the position units as delivered.
const TURN: i64 = 131_072;

/// The drive.
#[derive(Debug)]
pub struct Cia402;

/// Of all benches the same name.
pub type Drive = Cia402;

/// Its bench.
pub type Bench = super::Bench<Cia402>;

impl BenchSubject for Cia402 {
    type Machine = ServoMachine;

    const MODEL: &'static str = "cia402";
    const NODE: u8 = 6;
    const BITRATE: Bitrate = Bitrate::K500;
    const REFUSED: &'static str = include_str!("../../data/cia402/refused.csv");
    const AT_REST: &'static str = include_str!("../../data/cia402/at_rest.csv");
    const REMAPS_WHILE_VALID: bool = false;

    fn machine() -> ServoMachine {
        let node = NodeId::new(Self::NODE).expect("a node-ID");
        servo(&CIA402, &Order::new(&CIA402, node, Self::BITRATE)).expect("a servo as delivered")
    }

    fn rows() -> &'static Rows {
        static ROWS: LazyLock<Rows> = LazyLock::new(|| Rows::new(objects()));
        &ROWS
    }

    fn store(bench: &mut Bench) {
        bench.set((0x1010, 1), SAVE);
    }
}

impl PowerSubject for Cia402 {
    const BREAKABLE: Component = Component::Encoder;
    // Profile specific, and generic.
    const BROKEN: (u16, u8) = (0x7305, 0x21);
    const ABOVE: u16 = 0;
    const STATUSWORD_AT_REST: &'static str = include_str!("../../data/cia402/statusword_at_rest.csv");
    // Switch on disabled, voltage enabled, remote, nothing to be reached; bit 5 is left open in this state.
    const BOOTED: u16 = 0x0670;
    const FAULT: u16 = 0x18;
    const RUNNING: u16 = 0;
    const MOVING_MODES: &'static [i64] = &[1, 3, 6];
    // 6067h as delivered.
    const IN_POSITION: i64 = TURN / 1000;
    // At the current limit.
    const EMERGENCY_STOP_S: f64 = 0.0;
    const HOMING_RAMP_S: f64 = 0.2;
    const STANDS_AFTER_MS: u64 = 50;
    const HAND_NM: f64 = 0.3;
    const COUNTS: i64 = TURN / 4096;
    const COUNTS_PER_RPM: i64 = 1;
    const RIPPLE_RPM: f64 = 1.0;

    fn power_states() -> Vec<(PowerCell, u16)> {
        power_states().into_iter().map(|cell| (cell, 0)).collect()
    }

    /// A quick stop that stays, and no reaction to what NMT does.
    fn let_take_time(bench: &mut Bench) {
        bench.set(0x605A, 6).set(0x6007, 0);
        in_rpm(bench);
    }

    /// 6083h to 6085h are rates: 120 r/min in this time.
    fn set_ramp(bench: &mut Bench, object: u16, ms: i64) {
        in_rpm(bench);
        bench.set(object, 120 * 1000 / ms);
    }

    /// Method 18 searches for the positive limit switch.
    fn let_home(bench: &mut Bench) {
        Self::set_ramp(bench, 0x609A, 200);
        bench.set((0x6099, 1), 120).set(0x6098, 18);
    }
}

/// Velocities in r/min, and 120 r/min in half a second, as the laws have them.
fn in_rpm(bench: &mut Bench) {
    if bench.get((0x6096, 1)) == RPM {
        return;
    }
    bench.set((0x6096, 1), RPM).set((0x6096, 2), TURN);
    bench.set(0x6081, 120).set(0x6083, 240).set(0x6084, 240).set(0x6085, 2400).set(0x607F, 3000);
}

//! The described servo with its motor of 400 W: 131072 increments a turn, 3000 r/min and 4 A rated.

use can::Bitrate;
use canopen::NodeId;
use devices::servo::CIA402;
use sim::VirtualDrive;
use sim::machine::{Order, servo};

use super::in_mode;
use super::pair::{Act, Bound, NODE, Script, Subject, hand, hold, write};

struct Described;

impl Subject for Described {
    const BITRATE: Bitrate = Bitrate::M1;

    fn machine() -> Box<dyn VirtualDrive> {
        let order = Order::new(&CIA402, NodeId::new(NODE).expect("a node-ID"), Bitrate::M1);
        Box::new(servo(&CIA402, &order).expect("the standard's own servo"))
    }
}

/// A tenth of a per cent of 3000 r/min, and two per cent; two per cent of 4 A.
const BOUND: Bound =
    Bound { speed_rms_rpm: 3.0, speed_most_rpm: 60.0, on_the_way: 500.0, at_the_end: 64.0, current_rms_a: 0.08 };

fn increments(rpm: i64) -> i64 {
    rpm * 131_072 / 60
}

fn velocity(rpm: i64, more: Script) -> Script {
    in_mode(3, &[], [(20, write(0x60FF, 4, increments(rpm)))].into_iter().chain(more).collect())
}

#[test]
fn velocity_with_a_load_on_and_off_and_a_stop() {
    for rpm in [50, 500, 1500] {
        let more = vec![(700, hand("load torque 0.2")), (1200, hand("load torque 0")), (1700, write(0x60FF, 4, 0))];
        // Nothing holds a position in this mode: the step of load throws the shaft off by more than a turn.
        let bound = Bound { on_the_way: 5600.0, at_the_end: 5600.0, ..BOUND };
        hold::<Described>(&format!("{rpm} r/min, 0.2 N·m on and off"), &velocity(rpm, more), 2200, bound);
    }
}

#[test]
fn profile_position_and_every_way_to_stop() {
    let more = vec![(20, write(0x6040, 2, 0x1F))];
    let values = [(0x607A, 4, 655_360), (0x6081, 4, increments(500))];
    hold::<Described>("five turns", &in_mode(1, &values, more), 1500, BOUND);
    for (name, word) in [("quick stop", 0x0B), ("halt", 0x10F), ("shutdown", 0x06), ("disable operation", 0x07)] {
        // Each ends where it comes to rest.
        let bound = Bound { at_the_end: 500.0, ..BOUND };
        hold::<Described>(name, &velocity(250, vec![(300, write(0x6040, 2, word))]), 1000, bound);
    }
}

#[test]
fn homing_on_the_index_pulse() {
    let more = vec![(20, write(0x6040, 2, 0x1F))];
    let values = [(0x6098, 1, 34), (0x607C, 4, 0)];
    hold::<Described>("homing method 34", &in_mode(6, &values, more), 1500, Bound { on_the_way: 800.0, ..BOUND });
}

#[test]
fn cyclic_synchronous_position_and_velocity() {
    // A second of a sine of half a turn, a set-point each millisecond.
    let sine = |amplitude: f64, object: u16| -> Vec<(u64, Act)> {
        let at = |ms: u64| (ms as f64 * 1e-3 * std::f64::consts::TAU).sin();
        (20..1020).map(|ms| (ms, write(object, 4, (amplitude * at(ms - 20)) as i64))).collect()
    };
    // A set-point comes in the one supervision period or in the next.
    let bound = Bound { speed_rms_rpm: 6.0, ..BOUND };
    hold::<Described>("csp", &in_mode(8, &[], sine(32_768.0, 0x607A)), 1200, bound);
    hold::<Described>("csv", &in_mode(9, &[], sine(increments(100) as f64, 0x60FF)), 1200, BOUND);
}

#[test]
fn faults_from_physics() {
    let locked = velocity(150, vec![(300, hand("rotor lock"))]);
    hold::<Described>("locked", &locked, 4000, Bound { on_the_way: 800.0, at_the_end: 800.0, ..BOUND });
    for (name, cause) in
        [("over-voltage", "supply 420"), ("under-voltage", "supply 100"), ("overheat", "temperature motor 130")]
    {
        let bound = Bound { on_the_way: 1600.0, at_the_end: 1600.0, ..BOUND };
        hold::<Described>(name, &velocity(150, vec![(300, hand(cause))]), 900, bound);
    }
}

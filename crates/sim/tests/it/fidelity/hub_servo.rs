//! The ZLAC8030L with its wheel motor: 15 A rated (2014h), 4096 counts a turn.

use can::Bitrate;
use sim::VirtualDrive;
use sim::machine::zlac8030l;

use super::in_mode;
use super::pair::{Bound, NODE, Script, Subject, hand, hold, write};

pub(super) struct HubServo;

impl Subject for HubServo {
    const BITRATE: Bitrate = Bitrate::K500;

    fn machine() -> Box<dyn VirtualDrive> {
        Box::new(zlac8030l(NODE, 1))
    }
}

/// A degree of the wheel on the way; two per cent of a rated 200 r/min and of 15 A.
const BOUND: Bound =
    Bound { speed_rms_rpm: 0.3, speed_most_rpm: 4.0, on_the_way: 11.4, at_the_end: 2.0, current_rms_a: 0.3 };

/// Where a speed at the end of which nothing holds the position goes on: a coasting wheel keeps a difference of speed of a third
/// of a r/min until friction has stopped it.
const COASTING: Bound = Bound { speed_rms_rpm: 0.5, on_the_way: 40.0, at_the_end: 40.0, ..BOUND };

pub(super) fn velocity(rpm: i64, more: Script) -> Script {
    let more = [(20, write(0x60FF, 4, rpm))].into_iter().chain(more).collect();
    in_mode(3, &[(0x2000, 2, 0)], more)
}

fn position(counts: i64, more: Script) -> Script {
    let more = [(20, write(0x6040, 2, 0x1F))].into_iter().chain(more).collect();
    in_mode(1, &[(0x2000, 2, 0), (0x607A, 4, counts), (0x6081, 4, 120)], more)
}

#[test]
fn velocity_with_a_load_on_and_off_and_a_stop() {
    let more = vec![(700, hand("load torque 4")), (1200, hand("load torque 0")), (1700, write(0x60FF, 4, 0))];
    hold::<HubServo>("100 r/min, 4 N·m on and off", &velocity(100, more), 2500, Bound { at_the_end: 11.4, ..BOUND });
    hold::<HubServo>("3 r/min", &velocity(3, Vec::new()), 2000, BOUND);
}

#[test]
fn a_profile_position_ends_where_it_ends_at_full() {
    hold::<HubServo>("three turns", &position(12288, Vec::new()), 2500, BOUND);
}

#[test]
fn torque_and_the_first_motion_against_dry_friction() {
    let torque = |more| in_mode(4, &[(0x2000, 2, 0)], more);
    let steps = vec![(20, write(0x6071, 2, 500)), (2000, write(0x6071, 2, 100))];
    hold::<HubServo>("0.5 A", &torque(steps), 3000, Bound { on_the_way: 30.0, ..BOUND });
    // 2 mA more each 20 ms: until it breaks away it stands.
    let rising = (0..100).map(|n| (20 + n as u64 * 20, write(0x6071, 2, n * 2))).collect();
    hold::<HubServo>("up to dry friction", &torque(rising), 2300, BOUND);
}

#[test]
fn every_way_to_stop() {
    let stops = [("quick stop", 0x0B), ("halt", 0x10F), ("shutdown", 0x06), ("disable operation", 0x07)];
    for (name, word) in stops {
        hold::<HubServo>(name, &velocity(100, vec![(800, write(0x6040, 2, word))]), 2200, BOUND);
    }
    let free = velocity(100, vec![(800, write(0x6040, 2, 0))]);
    hold::<HubServo>("disable voltage", &free, 2200, COASTING);
}

#[test]
fn the_voltage_used_up() {
    let more = vec![(2000, write(0x60FF, 4, -600))];
    let bound = Bound { speed_rms_rpm: 0.8, on_the_way: 60.0, at_the_end: 60.0, ..BOUND };
    hold::<HubServo>("600 r/min asked for", &velocity(600, more), 4000, bound);
}

#[test]
fn overload_of_a_locked_rotor() {
    // It stands where it was locked.
    let bound = Bound { at_the_end: 11.4, ..BOUND };
    hold::<HubServo>("locked", &velocity(100, vec![(1000, hand("rotor lock"))]), 4300, bound);
}

#[test]
fn following_error_of_a_locked_rotor() {
    hold::<HubServo>("following error", &position(40960, vec![(1000, hand("rotor lock"))]), 2000, BOUND);
}

#[test]
fn faults_of_voltage_and_temperature() {
    hold::<HubServo>("under-voltage", &velocity(100, vec![(1000, hand("supply 15"))]), 1500, COASTING);
    hold::<HubServo>("over-voltage", &velocity(100, vec![(1000, hand("supply 78"))]), 1500, COASTING);
    hold::<HubServo>("overheat", &velocity(100, vec![(1000, hand("temperature motor 90"))]), 1500, COASTING);
    let braked = vec![
        (10, hand("load inertia 0.1")),
        (20, hand("fault bleeder on")),
        (1500, write(0x6084, 4, 10)),
        (1600, write(0x60FF, 4, 0)),
    ];
    let bound = Bound { speed_rms_rpm: 1.0, on_the_way: 80.0, at_the_end: 80.0, ..BOUND };
    hold::<HubServo>("over-voltage by braking", &velocity(250, braked), 2600, bound);
}

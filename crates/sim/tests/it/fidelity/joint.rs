//! A M4230E17B50: 32768 counts a turn of the motor, 50 turns of it in one of the output. Speeds are the motor's: 15 r/min of it are
//! 0.3 of the output.

use can::Bitrate;
use drives::mjoint::Model;
use sim::VirtualDrive;
use sim::machine::mjoint;

use super::in_mode;
use super::pair::{Bound, NODE, Script, Subject, hand, hold, write};

struct Joint;

impl Subject for Joint {
    const BITRATE: Bitrate = Bitrate::M1;

    fn machine() -> Box<dyn VirtualDrive> {
        Box::new(mjoint(Model::named("m4230e17b50").expect("a model"), NODE, Bitrate::M1))
    }
}

/// A tenth of a degree of the output; two per cent of 2000 r/min and of 3.5 A.
const BOUND: Bound =
    Bound { speed_rms_rpm: 4.0, speed_most_rpm: 40.0, on_the_way: 455.0, at_the_end: 100.0, current_rms_a: 0.1 };

fn velocity(rpm: i64, more: Script) -> Script {
    in_mode(3, &[], [(20, write(0x60FF, 4, rpm))].into_iter().chain(more).collect())
}

#[test]
fn velocity_with_a_load_on_and_off_and_a_stop_with_the_field_weakened_and_not() {
    for rpm in [1000, 2000] {
        let more = vec![(500, hand("load torque 5")), (900, hand("load torque 0")), (1300, write(0x60FF, 4, 0))];
        hold::<Joint>(&format!("{rpm} r/min, 5 N·m on and off"), &velocity(rpm, more), 1800, BOUND);
    }
}

#[test]
fn a_profile_position_ends_where_it_ends_at_full() {
    let more = vec![(20, write(0x6040, 2, 0x1F))];
    hold::<Joint>("five turns of the motor", &in_mode(1, &[(0x607A, 4, 163_840)], more), 1500, BOUND);
}

#[test]
fn quick_stop_and_halt() {
    for (name, word) in [("quick stop", 0x0B), ("halt", 0x10F)] {
        // The stop is abrupt: a supervision period sooner or later is 200 r/min, and half a degree of the output in what it goes on.
        let bound = Bound {
            speed_rms_rpm: 12.0,
            speed_most_rpm: 240.0,
            on_the_way: 600.0,
            at_the_end: 600.0,
            current_rms_a: 0.15,
        };
        hold::<Joint>(name, &velocity(1000, vec![(500, write(0x6040, 2, word))]), 1000, bound);
    }
}

#[test]
fn the_alarm_of_a_locked_output() {
    // What is wound up in the gear turns the free motor back: it comes to rest within a third of a turn.
    let bound = Bound { speed_rms_rpm: 6.0, speed_most_rpm: 130.0, ..BOUND };
    hold::<Joint>("locked", &velocity(500, vec![(500, hand("rotor lock"))]), 5800, bound);
}

#[test]
fn alarms_of_voltage_and_temperature() {
    for (name, cause) in
        [("over-voltage", "supply 54"), ("under-voltage", "supply 15"), ("overheat", "temperature driver 120")]
    {
        hold::<Joint>(name, &velocity(500, vec![(500, hand(cause))]), 1000, BOUND);
    }
}

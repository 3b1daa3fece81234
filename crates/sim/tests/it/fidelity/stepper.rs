//! The ZLIM42-C of both lengths, 4000 pulses a turn and 1.2 A as delivered. Its position is the commanded one; where its rotor is
//! comes beside it, in pulses, and in [`carried`](super::carried) what it stands.

use can::Bitrate;
use sim::machine::{zlim42c, zlim42c_82};
use sim::{Fidelity, VirtualDrive};

use super::in_mode;
use super::pair::{Act, Bound, NODE, Script, Subject, Trace, hand, hold, trace, write, write_entry};

/// Of 70 mm.
pub(super) struct Short;

impl Subject for Short {
    const BITRATE: Bitrate = Bitrate::K500;

    fn machine() -> Box<dyn VirtualDrive> {
        Box::new(zlim42c(NODE, 1))
    }
}

/// Of 82 mm.
pub(super) struct Long;

impl Subject for Long {
    const BITRATE: Bitrate = Bitrate::K500;

    fn machine() -> Box<dyn VirtualDrive> {
        Box::new(zlim42c_82(NODE, 1))
    }
}

/// A rotor at low speed swings with pulses and detent, at both, by up to 50 r/min: 10 r/min r.m.s. is what half a millisecond sooner or
/// later makes of that. Two per cent of 3000 r/min; half a millisecond of the way at 120 r/min; two per cent of 2.2 A, the rated current.
const BOUND: Bound =
    Bound { speed_rms_rpm: 10.0, speed_most_rpm: 60.0, on_the_way: 4.0, at_the_end: 0.5, current_rms_a: 0.044 };

pub(super) fn velocity(rpm: i64, more: Script) -> Script {
    let ramps = [(0x6083, 4, 200), (0x6084, 4, 200)];
    in_mode(3, &ramps, [(20, write(0x60FF, 4, rpm))].into_iter().chain(more).collect())
}

fn position(pulses: i64, rpm: i64, more: Script) -> Script {
    let more = [(20, write(0x6040, 2, 0x1F))].into_iter().chain(more).collect();
    in_mode(1, &[(0x607A, 4, pulses), (0x6081, 4, rpm)], more)
}

/// Half a millisecond of the way at this speed, and what a rotor swings, in pulses.
fn way(rpm: i64) -> f64 {
    4.0 + rpm as f64 * 4000.0 / 60e3 * 0.5
}

/// [`hold`] for the rotor, too: how far it is apart on the way and at the end, in pulses.
#[track_caller]
#[allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]
fn hold_rotor<S: Subject>(name: &str, script: &Script, ms: u64, bound: Bound, [most, end]: [f64; 2]) {
    hold::<S>(name, script, ms, bound);
    let [full, mechanical] = [Fidelity::Full, Fidelity::Mechanical].map(|fidelity| trace::<S>(fidelity, script, ms));
    let turned = |trace: &Trace, at: usize| trace.samples[at].shaft_angle_rad / std::f64::consts::TAU * 4000.0;
    let apart = |at: usize| (turned(&full, at) - turned(&mechanical, at)).abs();
    let (on_the_way, at_the_end) = ((0..ms as usize).map(apart).fold(0.0, f64::max), apart(ms as usize - 1));
    println!("{name}: rotor {on_the_way:.2}, {at_the_end:.2} pulses");
    assert!(on_the_way <= most && at_the_end <= end, "{name}: {on_the_way} and {at_the_end} pulses apart");
}

#[test]
fn velocity_with_a_load_on_and_off_and_a_stop() {
    for rpm in [1, 5, 20, 60, 100, 300, 600, 1000] {
        let more = || vec![(500, hand("load torque 0.1")), (800, hand("load torque 0")), (1100, write(0x60FF, 4, 0))];
        hold_rotor::<Short>(
            &format!("{rpm} r/min, 0.1 N·m on and off"),
            &velocity(rpm, more()),
            1800,
            BOUND,
            [way(rpm), 0.5],
        );
        hold_rotor::<Long>(
            &format!("82 mm, {rpm} r/min, 0.1 N·m on and off"),
            &velocity(rpm, more()),
            1800,
            BOUND,
            [way(rpm), 0.5],
        );
    }
}

#[test]
fn the_voltage_used_up() {
    for rpm in [1500, 2000] {
        let script = || velocity(rpm, vec![(1000, write(0x60FF, 4, -rpm)), (2000, write(0x60FF, 4, 0))]);
        hold_rotor::<Short>(&format!("{rpm} r/min both ways"), &script(), 2600, BOUND, [way(rpm), 0.5]);
        hold_rotor::<Long>(&format!("82 mm, {rpm} r/min both ways"), &script(), 2600, BOUND, [way(rpm), 0.5]);
    }
}

#[test]
fn profile_position_in_each_setting_of_the_microsteps() {
    for (setting, pulses) in [(10, 4000), (0, 200), (1, 400), (2, 800), (7, 25_600)] {
        let more = vec![(0, write(0x2006, 2, setting))];
        let script = position(3 * pulses, 120, more);
        // The rotor jumps from step to step and rings: half a millisecond of that. Position: a pulse.
        let (speed_rms_rpm, speed_most_rpm, current_rms_a) = match pulses {
            200 => (120.0, 300.0, 0.2),
            400 => (60.0, 250.0, 0.1),
            800 => (20.0, 120.0, 0.06),
            _ => (BOUND.speed_rms_rpm, BOUND.speed_most_rpm, BOUND.current_rms_a),
        };
        let on_the_way = 0.001 * 3.0 * pulses as f64 + 1.0;
        let bound = Bound { speed_rms_rpm, speed_most_rpm, current_rms_a, on_the_way, ..BOUND };
        hold_rotor::<Short>(&format!("three turns, {pulses} pulses a turn"), &script, 2500, bound, [12.0, 0.5]);
        hold_rotor::<Long>(&format!("82 mm, three turns, {pulses} pulses a turn"), &script, 2500, bound, [12.0, 0.5]);
    }
}

#[test]
fn every_way_to_stop() {
    let stops = [("quick stop", 0x0B), ("halt", 0x10F), ("shutdown", 0x06), ("disable operation", 0x07)];
    for (name, word) in stops {
        let script = velocity(100, vec![(500, write(0x6040, 2, word))]);
        hold_rotor::<Short>(name, &script, 1400, BOUND, [way(100), 0.5]);
    }
    // Where a free rotor comes to rest its detent says, to a fifth of a full step.
    let script = velocity(100, vec![(500, write(0x6040, 2, 0))]);
    hold_rotor::<Short>("disable voltage", &script, 1400, BOUND, [4.0, 4.0]);
}

#[test]
fn homing_on_a_switch() {
    for (method, switch) in [(24, "switch X0 1000 1500"), (29, "switch X0 -1500 -1000")] {
        let more = vec![(0, hand(switch)), (1, write_entry((0x2030, 2), 2, 1)), (20, write(0x6040, 2, 0x1F))];
        let script = in_mode(6, &[(0x6098, 1, method), (0x607C, 4, 0)], more);
        // The switch is seen a millisecond sooner or later: 8 pulses at 120 r/min, and the zero of the position comes then.
        let bound = Bound { speed_most_rpm: 130.0, on_the_way: 2000.0, at_the_end: 4.0, ..BOUND };
        hold_rotor::<Short>(&format!("homing method {method}"), &script, 4000, bound, [16.0, 8.0]);
        let last = trace::<Short>(Fidelity::Mechanical, &script, 4000).samples.pop().expect("a sample");
        let homed = last.statusword.is_some_and(|word| word & 1 << 8 != 0);
        assert!(homed && last.velocity_rpm == 0.0, "{last:?}");
    }
}

#[test]
fn faults_and_a_supply_that_goes() {
    let causes = [
        ("over-voltage", "supply 42"),
        ("a transistor breaks down", "fault bridge on"),
        ("reference", "fault reference on"),
        ("EEPROM", "fault eeprom on"),
        ("supply gone", "supply 15"),
    ];
    for (name, cause) in causes {
        let script = velocity(100, vec![(500, hand(cause))]);
        // A millisecond sooner or later, for which the current is there or not.
        let bound = Bound { on_the_way: 8.0, at_the_end: 8.0, current_rms_a: 0.08, ..BOUND };
        // A full step: so far are the places at which the detent brings a free rotor to rest.
        hold_rotor::<Short>(name, &script, 900, bound, [20.0, 20.0]);
    }
}

#[test]
fn braking_feeds_the_bus_until_its_over_voltage() {
    let braked: Vec<(u64, Act)> = vec![
        (10, hand("load inertia 0.0002")),
        (11, write(0x2005, 2, 7)),
        (12, write(0x6083, 4, 1000)),
        (13, write(0x6084, 4, 100)),
        (1500, write(0x60FF, 4, 0)),
    ];
    let bound = Bound { current_rms_a: 0.05, ..BOUND };
    hold_rotor::<Short>("0.0002 kg·m², 800 r/min", &velocity(800, braked), 2200, bound, [40.0, 40.0]);
}

#[test]
fn a_locked_rotor_loses_the_same_turns_of_the_field() {
    // 120 r/min are 8 pulses a millisecond: some 10, 33 and -20 turns of 80 pulses, and a fifth of one.
    for (rpm, locked_ms) in [(120, 105), (120, 335), (-120, 202), (120, 2)] {
        let more = vec![(500, hand("rotor lock")), (500 + locked_ms, hand("rotor free")), (1300, write(0x60FF, 4, 0))];
        let script = velocity(rpm, more);
        for name in ["70 mm", "82 mm"] {
            let lost = [Fidelity::Full, Fidelity::Mechanical].map(|fidelity| {
                let trace = if name == "70 mm" {
                    trace::<Short>(fidelity, &script, 1800)
                } else {
                    trace::<Long>(fidelity, &script, 1800)
                };
                let last = trace.samples.last().expect("a sample").clone();
                last.position - last.rotor_position.expect("known here")
            });
            assert_eq!(lost[0], lost[1], "{name}, {rpm} r/min locked for {locked_ms} ms");
            assert_eq!(lost[0] % 80, 0, "{name}, {rpm} r/min locked for {locked_ms} ms");
            assert_eq!(lost[0] == 0, locked_ms == 2, "{name}, {rpm} r/min locked for {locked_ms} ms");
        }
    }
}

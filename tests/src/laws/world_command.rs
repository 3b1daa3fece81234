//! World commands: any lines, at any time, while a host commands the drives.

use std::time::Duration;

use can::{Bitrate, CanId, Frame};
use drives::mjoint::Model;
use sim::command::answer;
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{Report, StationId, World};

/// Lines; what follows a NUL is how many milliseconds pass, in a byte.
pub(super) const SAMPLES: &[&[u8]] = &[
    b"4 power off\n\0\x054 power on\n\0\x054 power cycle\n\0\x144 get\n",
    b"4 load torque 1000\n\0\x304 load inertia 1000\n\0\x304 supply 0\n\0\x104 supply 100\n\0\x20now\n",
    b"2 load torque -100\n\0\x402 supply 1e-3\n\0\x102 load inertia 1e-300\n\0\x202 get\n",
    b"1 load torque 1000\n\0\x301 rotor lock\n\0\x101 rotor free\n1 pulses -5 1e300\n\0\x101 duty 99\n1 clock 1e9\n\0\x20",
    b"4 load pulley 10000 10\n\0\x304 load stop -100 100 1e7 0\n\0\x304 load spring 1e6 -360000\n\0\x204 load none\n4 get\n",
    b"2 load stop min max\n2 load stop -1000 9000\n\0\x302 load fan 1000 1\n\0\x302 load friction 1e-300 static 1000 stribeck 1e-4\n\0\x20",
    b"2 load gear 0.01 90 1e7\n\0\x302 load pulley 10000 -10\n\0\x302 load gear off\n4 load gear 1000 0 1\n\0\x304 load torque 1000\n\0\x40",
    b"1 load spring 1e6 360000\n\0\x301 load pulley 1e4 10\n\0\x301 load stop 0 0 1 1e5\n1 load friction 1000 viscous 1000\n\0\x301 load gear 2 2\n",
    b"1 battery off\n1 power cycle\n\0\x101 fault phase on\n4 fault hall on\n2 fault short on\n2 fault bridge on\n\0\x40",
    b"4 switch X0 min max\n4 input X1 1\n\0\x104 switch X0 -9223372036854775808 9223372036854775807\n1 switch PU 5 4\n",
    b"4 temperature motor 200\n4 temperature driver -55\n\0\x204 temperature motor auto\n4 cable cut\n\0\x084 cable join\n",
    b"4 supply nan\n4 supply -1\n4 load torque inf\n4 load inertia 1e999\n\xFF\xFE\n4 load torque 1e308\n quit\n",
];

/// Every line that is neither blank nor a comment gets one line of JSON that begins with whether it was done, and whatever was done, what
/// can be measured at each drive stays a number.
pub(super) fn world_command(data: &[u8]) {
    let (mut world, host) = world();
    for part in data.split(|byte| *byte == b'\n' || *byte == b'\r') {
        let (line, pause) = match part.strip_prefix(b"\0") {
            Some([pause, line @ ..]) => (line, *pause),
            _ => (part, 0),
        };
        world.run_for(Duration::from_millis(pause.min(50).into()));
        let line = String::from_utf8_lossy(line);
        let answer = answer(&mut world, &line);
        let says_nothing = line.trim().is_empty() || line.trim_start().starts_with('#');
        assert_eq!(answer.is_none(), says_nothing, "{line:?}");
        if let Some(answer) = answer {
            let begins = answer.json.starts_with(r#"{"ok":true,"#) || answer.json.starts_with(r#"{"ok":false,"#);
            let one_line = !answer.json.contains(['\n', '\r']) && answer.json.ends_with('}');
            assert!(begins && one_line, "{line:?} was answered {}", answer.json);
            assert!(!answer.json.contains("null,\"current_a\"") && !answer.json.contains("NaN"), "{}", answer.json);
        }
        all_finite(&mut world, &line);
    }
    while world.poll_received(host).is_some() {}
    world.run_for(Duration::from_millis(5));
    all_finite(&mut world, "the end");
}

/// The three drives, each commanded to turn.
fn world() -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let host = world.add_probe();
    let added = [
        world.add_drive(4, Box::new(zlac8030l(4, 1))),
        world.add_drive(2, Box::new(zlim42c(2, 1))),
        world.add_drive(1, Box::new(mjoint(&Model::M4230E17B50, 1, Bitrate::K500))),
    ];
    assert!(added.iter().all(Result::is_ok), "three numbers");
    world.run_for(Duration::from_millis(2));
    // Profile velocity, 100 r/min, and the controlwords that enable each.
    for (node, controlwords) in [(4, &[0x06, 0x07, 0x0F][..]), (2, &[0x06, 0x07, 0x0F]), (1, &[0x0F])] {
        let target = [*b"\x2F\x60\x60\0\x03\0\0\0", *b"\x23\xFF\x60\0\x64\0\0\0"];
        let enable = controlwords.iter().map(|word| [0x2B, 0x40, 0x60, 0, *word, 0, 0, 0]);
        for data in target.into_iter().chain(enable) {
            let sent = world.send(host, Frame::new(CanId::standard(0x600 + node), &data));
            assert!(sent.is_ok(), "the adapter has room");
            world.run_for(Duration::from_millis(1));
        }
    }
    (world, host)
}

fn all_finite(world: &mut World, after: &str) {
    for number in [4, 2, 1] {
        let report = world.report(number).expect("it was added");
        let Report { velocity_rpm, current_a, supply_v, shaft_angle_rad, motor_c, driver_c, .. } = report;
        let all = [velocity_rpm, current_a, supply_v, shaft_angle_rad, motor_c.unwrap_or(0.0), driver_c.unwrap_or(0.0)];
        assert!(all.iter().all(|value| value.is_finite()), "node {number} after {after:?}: {report:?}");
    }
}

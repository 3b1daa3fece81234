//! A drive whose sensors are broken does not see its shaft, and its master does not either.

use std::time::Duration;

use master::drive::MotionOptions;
use master::units::Rpm;
use sim::{Place, Stimulus};

use super::{Bench, Motion, Moving, NODES, options};

impl Bench {
    /// From now on the first drive has this load and this fault.
    fn break_sensor(&mut self, load: &str, fault: &str) {
        for what in [load, fault] {
            let stimulus: Stimulus = what.parse().unwrap();
            self.world.apply(Place::node(NODES[0]), &stimulus).unwrap().unwrap();
        }
    }
}

/// Which sensor of which model can be broken, and the load with which its shaft coasts. A joint's gear holds it at once.
const BROKEN: [(&str, &str, &str); 5] = [
    ("zlac8030l", "fault hall on", "load inertia 0.5"),
    ("zlac8030l", "fault encoder on", "load inertia 0.5"),
    ("m4230e17b50", "fault encoder on", "load inertia 0.5"),
    ("cia402", "fault hall on", "load inertia 0.05"),
    ("cia402", "fault encoder on", "load inertia 0.05"),
];

/// With the Hall sensors alone broken the encoder of a ZLAC8030L still shows its speed; that of the others is not to be believed.
#[track_caller]
fn check(what: &str, speed: f64, stands: Result<(), String>) {
    let joint = what.starts_with("m4230e17b50");
    assert!(joint || speed > 10.0, "{what}: {speed} r/min, and so nothing to be wrong about");
    assert_eq!(stands.is_ok(), joint, "{what}: {stands:?} at {speed} r/min");
}

/// At a fault the motor has no power, and a heavy shaft coasts on.
#[test]
fn a_shaft_that_coasts_behind_a_broken_sensor_is_not_said_to_stand() {
    for (name, broken, load) in BROKEN {
        let mut bench = Bench::new(name);
        let [drive, _] = bench.drives.clone();
        bench.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        bench.moving = vec![NODES[0]];
        bench.break_sensor(load, broken);
        bench.world.run_for(Duration::from_millis(50));
        let stopped = bench.run(bench.network.clone().stop_and_release());
        let speed = bench.fastest();
        let [stopped] = &stopped[..] else { panic!("{name}: {stopped:?}") };
        let stands = stopped.outcome.as_ref().map(drop).map_err(ToString::to_string);
        if (name, broken) == ("zlac8030l", "fault hall on") {
            // It is seen to coast, and seen to stand.
            assert!(speed < 2.0 || stands.is_err(), "{name}, {broken}: {speed} r/min, {stands:?}");
            continue;
        }
        check(&format!("{name}, {broken}"), speed, stands);
    }
}

#[test]
fn a_group_or_base_with_a_shaft_that_coasts_behind_a_broken_sensor_is_not_closed_as_one_that_stands() {
    for (name, broken, load) in BROKEN {
        for motion in [Motion::GroupMove, Motion::Base] {
            let mut bench = Bench::new(name);
            let Some(mut moving) = bench.set_in_motion(motion) else { continue };
            bench.break_sensor(load, broken);
            for _ in 0..20 {
                bench.step_whatever(&mut moving);
            }
            let closed = match moving {
                Moving::Group(group) => bench.run(group.close()).map_err(|error| error.to_string()),
                Moving::Base(base) => bench.run(base.close()).map_err(|error| error.to_string()),
                Moving::Alone => unreachable!("both have two axes"),
            };
            bench.moving = vec![NODES[0]];
            check(&format!("{name}, {broken}, {motion:?}"), bench.fastest(), closed);
        }
    }
}

impl Bench {
    /// One cycle, whether it fails or not.
    fn step_whatever(&mut self, moving: &mut Moving) {
        match moving {
            Moving::Group(group) => drop(self.run(group.cycle())),
            Moving::Base(base) => drop(self.run(base.cycle())),
            Moving::Alone => {}
        }
    }
}

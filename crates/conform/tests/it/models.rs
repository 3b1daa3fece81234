//! Every model of ours passes: what it departs in is stated by its manual.

use can::Bitrate;
use conform::{Options, Subject};
use sim::World;

use crate::bench::{drive, failed, node, run_in, shown};

fn passes(name: &str) {
    let model = devices::model(name).unwrap();
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(5, drive(model)).unwrap();
    let options = Options { allow_motion: true, allow_store: true, ..Options::default() };
    let report = run_in(&mut world, Subject::of_model(node(), model), options);
    assert!(report.ok, "{name}: {:?}\n{}", report.not_restored, shown(&report, failed));
}

#[test]
fn the_servo_of_the_standard_passes() {
    passes("cia402");
}

#[test]
fn the_zlac8030l_passes() {
    passes("zlac8030l");
}

#[test]
fn the_zlim42c_passes() {
    passes("zlim42c");
}

#[test]
fn the_m4230e17b50_passes() {
    passes("m4230e17b50");
}

#[test]
fn the_other_models_pass() {
    let others = ["m4230e17b80", "m8025e25b50", "m8025e25b80", "zlim42c-82"];
    let all: Vec<_> = devices::all().iter().map(|model| model.name).collect();
    let tested = ["cia402", "zlac8030l", "zlim42c", "m4230e17b50"];
    assert_eq!(all.len(), others.len() + tested.len(), "{all:?}");
    others.into_iter().for_each(passes);
}

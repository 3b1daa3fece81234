//! Every model of ours passes: what it departs in is stated by its manual.

use can::Bitrate;
use conform::{Options, Outcome, Subject};
use devices::servo::CIA402;
use eds::{Eds, Sheet, keep, write};
use sim::{Fidelity, World};

use crate::bench::{drive, drive_with, failed, node, run_in, shown};

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

/// CiA 402-2 reserves some option codes and leaves others to makers, which limits of a file do not say.
#[test]
fn a_servo_passes_by_a_file_with_wide_limits_and_an_option_code_that_is_read_only() {
    let sheet = write(&Sheet::of(&CIA402).eds());
    let mut section = "";
    let mut text = String::new();
    for line in sheet.lines() {
        section = if line.starts_with('[') { line } else { section };
        let key = line.split('=').next().unwrap_or_default();
        text += match (section, key) {
            ("[605B]", "AccessType") => "AccessType=ro",
            ("[605A]" | "[6098]", "LowLimit" | "HighLimit") => continue,
            ("[605A]", "DefaultValue") => "DefaultValue=2\nLowLimit=-32768\nHighLimit=8",
            ("[6098]", "DefaultValue") => "DefaultValue=0\nLowLimit=-128\nHighLimit=40",
            _ => line,
        };
        text.push('\n');
    }
    let description = keep(&Eds::load(text.as_bytes()).unwrap().eds).unwrap();
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(5, drive_with(description, Fidelity::Mechanical)).unwrap();
    let wanted = [("OD 06", Outcome::Pass), ("402-12", Outcome::Pass), ("402-13", Outcome::NotApplicable)];
    let options = Options { only: wanted.map(|(id, _)| id.into()).to_vec(), ..Options::default() };
    let report = run_in(&mut world, Subject::of_file(node(), description), options);
    let came: Vec<_> = report.cases.iter().map(|case| (case.id, case.result)).collect();
    assert_eq!(came, wanted, "{}", shown(&report, |_| true));
}

#[test]
fn the_other_models_pass() {
    let others = ["m4230e17b80", "m8025e25b50", "m8025e25b80", "zlim42c-82"];
    let all: Vec<_> = devices::all().iter().map(|model| model.name).collect();
    let tested = ["cia402", "zlac8030l", "zlim42c", "m4230e17b50"];
    assert_eq!(all.len(), others.len() + tested.len(), "{all:?}");
    others.into_iter().for_each(passes);
}

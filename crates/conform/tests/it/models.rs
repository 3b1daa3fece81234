//! Every model of ours passes: what it departs in is stated by its manual.

use std::time::Duration;

use can::{Bitrate, Tap};
use conform::{Capture, Options, Outcome, Report, Subject, Suite};
use devices::Description;
use devices::servo::CIA402;
use eds::{Eds, Sheet, keep, write};
use master::Network;
use sim::{Fidelity, World, block_on_for};

use crate::bench::{LIMIT, drive, drive_with, failed, node, run, run_in, shown, values};
use crate::wrong::{Kind, Wrong, answer, reads};

/// With motion and stores; all values are what they were.
fn passes(name: &str) {
    let model = devices::model(name).unwrap();
    let (network, capture) = (Network::new(), Capture::new());
    let mut world = World::new(Bitrate::K500, 1);
    world.add_drive(5, drive(model)).unwrap();
    world.add_station(Tap::new(network.clone(), capture.clone()));
    world.run_for(Duration::from_secs(2));
    let before = values(&mut world, &network, model);
    let options = Options { allow_motion: true, allow_store: true, ..Options::default() };
    let suite = Suite::new(network.clone(), capture, Subject::of_model(node(), model), options);
    let report = block_on_for(&mut world, LIMIT, suite.run(|_| ())).unwrap().unwrap();
    assert!(report.ok, "{name}: {:?}\n{}", report.not_restored, shown(&report, failed));
    assert_eq!(values(&mut world, &network, model), before, "{name}");
    each_departure_is_shown_and_cited(name, model, &report);
}

/// What a manual states is looked at, and its section is named: by the tables of the manuals each departure has one.
fn each_departure_is_shown_and_cited(name: &str, model: &Description, report: &Report) {
    let sections: Vec<&str> = model.sections.iter().map(|part| part.section).collect();
    for case in report.cases.iter().filter(|case| case.result == Outcome::Expected) {
        assert!(!case.frames.is_empty(), "{name}: {} shows no frame: {}", case.id, case.why);
        let cites = |section: &&str| case.why.contains(&format!(" ({}, {section}): ", model.manual));
        assert!(sections.iter().any(cites), "{name}: {} cites no section: {}", case.id, case.why);
    }
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

/// A drive that has what its manual calls absent, and one whose statusword has the states that its manual denies, are not what the
/// manual states.
#[test]
fn what_a_manual_calls_absent_and_is_there_fails() {
    let has_store = Kind::Answer(|_, asked| reads(&asked, 0x1010, 0).then(|| answer(&asked, 0x4F, 1)));
    let has_states = Kind::Answer(|_, asked| reads(&asked, 0x6041, 0).then(|| answer(&asked, 0x4B, 0x0240)));
    let cases: [(_, _, &[_], _); 2] = [
        ("zlac8030l", has_store, &["OTHER 01", "OTHER 51"], "no objects 1010h and 1011h"),
        ("m4230e17b50", has_states, &["402-01", "402-20"], "no CiA 402 states"),
    ];
    for (name, kind, ids, stated) in cases {
        let model = devices::model(name).unwrap();
        let only = ids.iter().map(|id| (*id).to_owned()).collect();
        let station = Wrong::new(drive_with(model, Fidelity::Mechanical), kind);
        let report = run(station, Subject::of_model(node(), model), Options { only, ..Options::default() });
        let came = shown(&report, |_| true);
        assert_eq!(report.summary.fail, 1, "{came}");
        let case = report.failures().next().unwrap();
        assert_eq!(case.id, ids[0], "{came}");
        assert!(case.why.contains(stated) && case.why.contains("the manual states"), "{came}");
        assert!(!case.frames.is_empty(), "{came}");
    }
}

//! Nodes and bus as FMUs do what a world with the same drives does, to the nanosecond and to the last bit.

use can::{Bitrate, Frame, Instant};
use ferrodrive_fmu::variable::Value;
use sim::World;
use sim::machine::TimingMode;
use words::drive::drive_spec;

use crate::importer::Importer;

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

/// Enables node 4 in profile velocity at 60 r/min, halts it, starts it again; node 5 is asked for things beside it.
fn script() -> Vec<(u64, Frame)> {
    let lines = [
        (1_600, "604#2F60600003000000"),
        (1_605, "604#2B40600006000000"),
        (1_610, "604#2B40600007000000"),
        (1_615, "604#2B4060000F000000"),
        (1_620, "604#23FF60003C000000"),
        (1_621, "605#4041600000000000"),
        (1_700, "000#0104"),
        (1_701, "080#"),
        (1_705, "605#4000100000000000"),
        (1_800, "604#4041600000000000"),
        (2_000, "604#2B4060000F010000"),
        (2_100, "000#8105"),
        (2_300, "604#4064600000000000"),
    ];
    lines.into_iter().map(|(ms, text)| (ms * 1_000_000 + 137, frame(text))).collect()
}

#[test]
fn frames_and_shafts_are_those_of_a_world() {
    let specs = ["zlac8030l@4", "m4230e17b50@5"];
    let end = Instant::from_millis(2_600);

    let mut world = World::new(Bitrate::K500, 1);
    world.set_timing(TimingMode::Device);
    for spec in specs {
        let spec = drive_spec(spec).ok().unwrap();
        let drive = sim::machine::order(spec.model, &spec.order(Bitrate::K500)).unwrap();
        world.add_drive(spec.node.raw(), drive).unwrap();
    }
    let probe = world.add_probe();
    for (at, frame) in script() {
        world.run_until(Instant::from_nanos(at));
        world.send(probe, frame).unwrap();
    }
    world.run_until(end);
    let mut expected = Vec::new();
    while let Some((at, frame)) = world.poll_received(probe) {
        expected.push((at.as_nanos(), frame));
    }

    let mut importer = Importer::new(&specs, script());
    importer.run(end);
    assert!(expected.len() > 12, "{}", expected.len());
    assert_eq!(importer.script.heard, expected);
    for (drive, number) in importer.drives.iter_mut().zip([4, 5]) {
        let report = world.report(number).unwrap();
        assert_eq!(drive.get(200).unwrap(), Value::Float64(report.shaft_angle_rad), "angle of {number}");
        assert_eq!(drive.get(204).unwrap(), Value::Float64(report.current_a), "current of {number}");
        assert_eq!(drive.get(208).unwrap(), Value::UInt16(report.statusword.unwrap()), "statusword of {number}");
    }
    // It has turned: 60 r/min for a good half second are about three quarters of a turn.
    let Value::Float64(angle_rad) = importer.drives[0].get(200).unwrap() else { panic!() };
    assert!((1.0..6.0).contains(&angle_rad.abs()), "{angle_rad}");
}

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

/// What the same drives do in a world, and as FMUs on a bus: the frames are the same, and so are the drives at the end.
fn alike(specs: &[&str], script: &[(u64, Frame)], end: Instant) -> (Importer, Vec<(u64, Frame)>) {
    let mut world = World::new(Bitrate::K500, 1);
    world.set_timing(TimingMode::Device);
    let mut numbers = Vec::new();
    for spec in specs {
        let spec = drive_spec(spec).ok().unwrap();
        let drive = sim::machine::order(spec.model, &spec.order(Bitrate::K500)).unwrap();
        world.add_drive(spec.node.raw(), drive).unwrap();
        numbers.push(spec.node.raw());
    }
    let probe = world.add_probe();
    for (at, frame) in script {
        world.run_until(Instant::from_nanos(*at));
        world.send(probe, *frame).unwrap();
    }
    world.run_until(end);
    let mut expected = Vec::new();
    while let Some((at, frame)) = world.poll_received(probe) {
        expected.push((at.as_nanos(), frame));
    }

    let mut importer = Importer::new(specs, script.to_vec());
    importer.run(end);
    assert_eq!(importer.script.heard, expected);
    for (drive, number) in importer.drives.iter_mut().zip(numbers) {
        let report = world.report(number).unwrap();
        assert_eq!(drive.get(200).unwrap(), Value::Float64(report.shaft_angle_rad), "angle of {number}");
        assert_eq!(drive.get(204).unwrap(), Value::Float64(report.current_a), "current of {number}");
        assert_eq!(drive.get(208).unwrap(), Value::UInt16(report.statusword.unwrap()), "statusword of {number}");
    }
    (importer, expected)
}

/// How far the shaft of a drive has turned.
fn turned_rad(importer: &mut Importer, drive: usize) -> f64 {
    let Value::Float64(angle_rad) = importer.drives[drive].get(200).unwrap() else { panic!() };
    angle_rad.abs()
}

#[test]
fn frames_and_shafts_are_those_of_a_world() {
    let (mut importer, frames) = alike(&["zlac8030l@4", "m4230e17b50@5"], &script(), Instant::from_millis(2_600));
    assert!(frames.len() > 12, "{}", frames.len());
    // It has turned: 60 r/min for a good half second are about three quarters of a turn.
    let angle_rad = turned_rad(&mut importer, 0);
    assert!((1.0..6.0).contains(&angle_rad), "{angle_rad}");
}

/// What is chosen when an FMU is packed acts in it: a reading (L083: SYNC keeps the watch of 1 s quiet) and a firmware (L066: a speed above
/// 200Ah is fault 2000h); both in docs/drives/zlac8030l.md.
#[test]
fn a_reading_and_a_firmware_are_those_of_a_world() {
    // Node 5 gets 50 r/min as its maximum speed first; the target of both is 60.
    let enable = ["2F60600003000000", "2B40600006000000", "2B40600007000000", "2B4060000F000000", "23FF60003C000000"];
    let mut script = vec![(1_590, frame("605#2B0A200032000000"))];
    for node in [4_u64, 5] {
        let lines = enable.iter().zip(0_u64..);
        script.extend(lines.map(|(data, line)| (1_600 + 10 * line + node, frame(&format!("60{node}#{data}")))));
    }
    script.extend([2_000, 2_500, 3_000, 3_500, 4_000].map(|ms| (ms, frame("080#"))));
    script.sort_by_key(|(ms, _)| *ms);
    script.iter_mut().for_each(|(ms, _)| *ms *= 1_000_000);
    let end = Instant::from_millis(4_200);
    let (mut importer, frames) = alike(&["zlac8030l@4,reading=L083:sync", "zlac8030l@5,firmware=2.01"], &script, end);
    // 60 r/min from 1.64 s on, and not only for the second after the last SDO.
    let angle_rad = turned_rad(&mut importer, 0);
    assert!(angle_rad > 2.0 * std::f64::consts::TAU, "{angle_rad}");
    let is_emcy = |frame: &Frame| frame.to_string().starts_with("085#0020");
    assert!(frames.iter().any(|(_, frame)| is_emcy(frame)), "{frames:?}");

    let (mut importer, frames) = alike(&["zlac8030l@4", "zlac8030l@5"], &script, end);
    let angle_rad = turned_rad(&mut importer, 0);
    assert!(angle_rad < 1.5 * std::f64::consts::TAU, "{angle_rad}");
    assert!(!frames.iter().any(|(_, frame)| is_emcy(frame)), "{frames:?}");
}

//! Commands that are asked to end while a drive moves or is written to. That each signal reaches a command, and a second one, is asked
//! in `tests/processes/tests/real_time/interrupted.rs`.

use std::time::Duration;

use processes::scratch;
use serde_json::Value;

use super::virtual_bus::VirtualBus;
use crate::signals::Signal;

const DRIVES: [(u8, &str); 4] = [(4, "zlac8030l"), (2, "zlim42c"), (1, "m4230e17b50"), (5, "cia402")];

fn bench() -> VirtualBus {
    let drives = DRIVES.map(|(node, model)| format!("{model}@{node}"));
    VirtualBus::of(&drives.each_ref().map(String::as_str))
}

/// The commands that move a drive until they are ended: velocity, with a time and without one, and position on each model; torque
/// where the model has it, home where it looks for a switch that is not there.
fn motions(node: &str) -> [Vec<&str>; 4] {
    let velocity = vec!["velocity", node, "100rpm", "--for", "1h"];
    let endless = vec!["velocity", node, "100rpm"];
    let position = vec!["move", node, "200turn", "--relative", "--profile-velocity", "100rpm"];
    let last = match node {
        "4" => vec!["torque", node, "1A"],
        "5" => vec!["torque", node, "100mA", "--for", "1h"],
        _ => vec!["home", node, "--method", "17"],
    };
    [velocity, endless, position, last]
}

#[test]
fn ctrl_c_stops_every_drive_before_it_ends_with_130() {
    let bench = bench();
    for (id, model) in DRIVES {
        let (node, model) = (id.to_string(), format!("{id}={model}"));
        for motion in motions(&node) {
            let words = [&["--model", &model], &motion[..]].concat();
            let began = bench.report(id).position;
            let ended = bench.run_until(&words, &[(Duration::from_secs(3), Signal::Interrupt)]);
            let report = bench.report(id);
            let rpm = report.velocity_rpm;
            assert!(rpm.abs() < 20.0, "{motion:?}: still at {rpm} r/min");
            assert!(report.position.abs_diff(began) > 1000, "{motion:?}: it has turned: {began}, {}", report.position);
            let said = ended.err;
            assert_eq!(ended.status, Some(130), "{motion:?}: {said}");
            assert!(
                said.contains(&format!("node {node} was set in motion and has been quick-stopped")),
                "{motion:?}: {said}"
            );
            bench.done(&["--model", &model, "disable", &node]);
        }
    }
}

/// Axes that are held have their power until the time is over or the command is ended.
#[test]
fn held_axes_keep_their_power_until_the_time_is_over_or_ctrl_c() {
    let bench = VirtualBus::of(&["zlac8030l@4", "cia402@5"]).with(&["--model", "4=zlac8030l", "--model", "5=cia402"]);
    let group = ["group", "move", "--relative", "4=30deg", "5=-30deg", "--within", "1s"];
    let is_powered = |node| bench.report(node).statusword.is_some_and(|word| word & 0x6F == 0x27);
    let held = bench.done(&[&group[..], &["--hold", "2s"]].concat());
    assert!(held.err.contains("2 axes hold for 2 s, then their power is taken"), "{}", held.err);
    assert!(held.out.contains("and held for 2.0") && held.out.contains("the drives are without power"), "{}", held.out);
    assert!(!is_powered(4) && !is_powered(5));
    let ended =
        bench.run_until(&[&group[..], &["--hold", "1h"]].concat(), &[(Duration::from_secs(8), Signal::Interrupt)]);
    assert_eq!(ended.status, Some(130), "{}", ended.err);
    assert!(ended.err.contains("2 axes hold for 3600 s"), "{}", ended.err);
    for node in [4, 5] {
        assert!(
            ended.err.contains(&format!("node {node} was set in motion and has been quick-stopped")),
            "{}",
            ended.err
        );
        assert!(!is_powered(node), "node {node}");
    }
}

/// A conformance test writes many objects; whenever it is interrupted, they have again what they had.
#[test]
fn a_conformance_test_that_is_interrupted_puts_back_what_it_wrote() {
    let bench = VirtualBus::of(&["cia402@5"]).with(&["--model", "5=cia402"]);
    let values = || ["1017", "1800:02", "1A00:01"].map(|object| bench.json(&["read", "5", object])["value"].clone());
    bench.done(&["write", "5", "1017", "777"]);
    let before: [Value; 3] = values();
    let folder = scratch("interrupted_conformance");
    let log = folder.path("frames.log");
    let mut mappings_changed = 0;
    for after in (1..).map(|step| Duration::from_millis(400) * step) {
        let words = ["--log", &log, "conform", "5", "--only", "PDO"];
        let ended = bench.run_until(&words, &[(after, Signal::Interrupt)]);
        assert_eq!(values(), before, "after {after:?}: {}", ended.err);
        if ended.status != Some(130) {
            break;
        }
        if std::fs::read_to_string(&log).unwrap().contains("605#2F001A00") {
            mappings_changed += 1;
            assert!(ended.err.contains("what had been written was put back"), "after {after:?}: {}", ended.err);
        }
    }
    assert!(mappings_changed > 0);
}

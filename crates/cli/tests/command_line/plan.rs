//! `ferrodrive plan`: of a machine file whose frames are counted by hand, of a bus that is too full, and with wrong words.

use processes::{done, ferrodrive, scratch};
use serde_json::Value;

fn frame<'a>(report: &'a Value, name: &str, node: Option<u8>) -> &'a Value {
    let rows = report["frames"].as_array().expect("a list");
    let found = rows.iter().find(|row| row["frame"] == name && row["node"].as_u64() == node.map(u64::from));
    found.unwrap_or_else(|| panic!("{name} of {node:?} in {report}"))
}

/// Two ZLAC8030L that are moved by RPDO1 (controlword and target velocity, 6 bytes) and send status, speed and current in TPDO1
/// (8 bytes): frames of 55 + 10 s bits (CiA 301's identifiers, ISO 11898-1).
#[test]
fn the_frames_of_a_cycle_have_the_times_that_are_counted_by_hand() {
    let directory = scratch("plan");
    let file = directory.join("base.toml");
    let drives = "[[drive]]\nmodel = 'zlac8030l'\nnode = 1\n[[drive]]\nmodel = 'zlac8030l'\nnode = 2\n";
    std::fs::write(&file, format!("bitrate = '1M'\n{drives}")).unwrap();
    let file = file.to_str().unwrap();
    let report = done(&["--json", "plan", file, "--cycle", "5ms", "--mode", "pv", "--by-priority"]).json();
    assert_eq!((&report["ok"], &report["fits"], &report["bitrate"]), (&true.into(), &true.into(), &1_000_000.into()));
    let lengths: Vec<_> = [("SYNC", None), ("RPDO1", Some(1)), ("TPDO1", Some(2)), ("SDO request", None)]
        .map(|(name, node)| frame(&report, name, node))
        .map(|row| (row["id"].as_str().unwrap(), row["bytes"].as_u64().unwrap(), row["wire_us"].as_f64().unwrap()))
        .into();
    assert_eq!(lengths, [("080", 0, 55.0), ("201", 6, 115.0), ("182", 8, 135.0), ("602", 8, 135.0)]);
    // SYNC waits for one frame that has begun: 8 bytes, of an SDO or an EMCY; alone in its cycle for a TPDO.
    assert_eq!(
        (&frame(&report, "SYNC", None)["worst_us"], &frame(&report, "SYNC", None)["cycle_worst_us"]),
        (&190.0.into(), &190.0.into())
    );
    // In a cycle: two RPDOs of 115 us, two TPDOs of 135 us and SYNC, in 5 ms.
    let load = report["cycle_load"].as_f64().unwrap();
    assert!((load - (55.0 + 2.0 * 115.0 + 2.0 * 135.0) / 5_000.0).abs() < 1e-4, "{report}");
    // As many as it says fit, and one more does not.
    let most = report["most_drives"].as_u64().unwrap();
    assert!(report["most_drives_in_cycle"].as_u64().unwrap() >= most && most >= 2, "{report}");
    for (count, status) in [(most, 0), (most + 1, 1)] {
        let many = directory.join("many.toml");
        let drives: String =
            (1..=count).map(|node| format!("[[drive]]\nmodel = 'zlac8030l'\nnode = {node}\n")).collect();
        std::fs::write(&many, format!("bitrate = '1M'\n{drives}")).unwrap();
        let words = ["plan", many.to_str().unwrap(), "--cycle", "5ms", "--mode", "pv", "--by-priority"];
        assert_eq!(ferrodrive(&words).status, Some(status), "{count} drives, of {most}");
    }
    // A queue of a computer makes nothing faster.
    let in_order = done(&["--json", "plan", file, "--cycle", "5ms", "--mode", "pv"]).json();
    for row in report["frames"].as_array().unwrap() {
        let name = row["frame"].as_str().unwrap();
        let same = frame(&in_order, name, row["node"].as_u64().map(|node| node as u8));
        assert!(same["worst_us"].as_f64().unwrap() >= row["worst_us"].as_f64().unwrap(), "{row} {same}");
    }
    let text = done(&["plan", file, "--cycle", "5ms", "--mode", "pv"]).out;
    assert!(text.contains("no frame is late") && text.contains("; 2 are planned"), "{text}");
}

#[test]
fn a_bus_that_is_too_full_ends_with_1_and_says_what_is_late() {
    let ended = ferrodrive(&["--json", "plan", "--cycle", "400us", "--mode", "4=pv"]);
    let report = ended.json();
    assert_eq!((ended.status, &report["ok"], &report["fits"]), (Some(1), &false.into(), &false.into()));
    assert!(report["frames"].as_array().unwrap().iter().any(|row| row["in_time"] == false));
    let ended = ferrodrive(&["plan", "--cycle", "400us", "--mode", "4=pv"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.out.contains("late") && ended.out.contains("some frames are late"), "{}", ended.out);
}

/// Six drives at 1 Mbit/s and 2 ms: 6 RPDOs, 6 TPDOs and a SYNC fit in a cycle, which an SDO request and six EMCY do beside it not.
#[test]
fn late_frames_on_a_bus_that_is_not_full_are_explained() {
    let directory = scratch("plan_late");
    let file = directory.join("arm.toml");
    let drives: String = (1..=6).map(|node| format!("[[drive]]\nmodel = 'cia402'\nnode = {node}\n")).collect();
    std::fs::write(&file, format!("bitrate = '1M'\n{drives}")).unwrap();
    let words = ["--json", "plan", file.to_str().unwrap(), "--cycle", "2ms", "--mode", "csp"];
    let ended = ferrodrive(&words);
    let report = ended.json();
    assert_eq!((ended.status, &report["fits"]), (Some(1), &false.into()));
    assert!(report["load"].as_f64().unwrap() < 0.8, "{report}");
    let notes = report["notes"].to_string();
    assert!(notes.contains("is an average") && notes.contains("without SDO and EMCY nothing is late"), "{notes}");
    // What it names is enough, and half a millisecond less is not.
    let named = notes.split("from a cycle of ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    let shortest: f64 = named.parse().unwrap();
    for (cycle_ms, status) in [(shortest, 0), (shortest - 0.5, 1)] {
        let cycle = format!("{cycle_ms}ms");
        let words = ["plan", file.to_str().unwrap(), "--cycle", &cycle, "--mode", "csp"];
        assert_eq!(ferrodrive(&words).status, Some(status), "{cycle}");
    }
    let alone = ["plan", file.to_str().unwrap(), "--cycle", "2ms", "--mode", "csp", "--sdo", "0s", "--emcy", "0s"];
    assert_eq!(ferrodrive(&alone).status, Some(0));
}

#[test]
fn what_cannot_be_planned_is_refused_with_what_to_do() {
    let cases: [(&[&str], &str); 6] = [
        (&["plan", "--cycle", "1us"], "250us"),
        (&["plan", "--mode", "fast"], "csp"),
        (&["plan", "--mode", "9=pv"], "node 9"),
        (&["plan", "--mode", "4=hm"], "node 4"),
        (&["plan", "/no/such/machine.toml"], "machine file"),
        (&["--bus", "can7", "plan"], "--bitrate"),
    ];
    for (arguments, expected) in cases {
        let ended = ferrodrive(arguments);
        assert!(ended.status.is_some_and(|status| status != 0), "{arguments:?}");
        assert!(ended.err.contains(expected) && ended.out.is_empty(), "{arguments:?}: {}{}", ended.err, ended.out);
    }
}

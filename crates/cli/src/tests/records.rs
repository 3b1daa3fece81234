//! What a master records of a bus, and what a log does to it when it is sent again.

use std::path::Path;

use processes::scratch;
use recording::{Kind, Recorded, read};

use super::virtual_bus::{VirtualBus, without_bus};

fn recorded(path: &Path) -> Recorded {
    let kind = Kind::of_name(path.to_str().unwrap()).unwrap();
    read(kind, &std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_master_records_objects_by_sdo_and_by_the_pdos_that_carry_them() {
    let place = scratch("master-record");
    for name in ["run.mcap", "run.csv"] {
        let path = place.join(name);
        let bench = VirtualBus::of(&["zlac8030l@4"]).with(&["--model", "4=zlac8030l"]);
        let master = |words: &[&str]| bench.done(words);
        let report = |time: &str| {
            let record = ["record", "4", "statusword", "position_actual_value", "--for", time, "--json", "--out"];
            master(&[&record[..], &[path.to_str().unwrap()]].concat()).json()
        };
        // As it comes from the factory its TPDOs carry nothing.
        let by_sdo = report("200ms");
        let values = 2 * by_sdo["samples"].as_u64().unwrap();
        assert_eq!((&by_sdo["by_sdo"], &by_sdo["by_pdo"], &by_sdo["missing"]), (&values.into(), &0.into(), &0.into()));
        let found = recorded(&path);
        let of = |found: &Recorded, name: &str| -> Vec<f64> {
            let series = found.series.iter().find(|series| series.column.name() == name);
            series.unwrap_or_else(|| panic!("{name}")).points.iter().map(|(_, value)| *value).collect()
        };
        let reported = master(&["read", "4", "statusword", "--json"]).json();
        assert_eq!(reported["value"].as_f64(), of(&found, "4.statusword").last().copied(), "{name}: {reported}");
        assert_eq!(found.series.len(), 2, "{name}");
        // CiA 301, 7.5.2.36: PDO off, mapping off, entries, how many, PDO on.
        for (object, value) in [
            ("1800:1", "0x80000184"),
            ("1A00:0", "0"),
            ("1A00:1", "0x60640020"),
            ("1A00:2", "0x60410010"),
            ("1A00:0", "2"),
            ("1800:1", "0x184"),
        ] {
            master(&["write", "4", object, value]);
        }
        master(&["nmt", "4", "start"]);
        // No host drives the wheel: its load turns it, and the TPDO comes with each change.
        bench.apply(4, "load torque -1");
        let by_pdo = report("2s");
        assert!(by_pdo["by_pdo"].as_u64() > Some(0) && by_pdo["missing"] == 0, "{name}: {by_pdo}");
        let positions = of(&recorded(&path), "4.position_actual_value_counts");
        assert!(positions.is_sorted() && positions.last() > positions.first(), "{name}: {positions:?}");
    }
}

#[test]
fn what_is_true_of_a_virtual_drive_is_captured_beside_what_it_says_and_refused_on_another_bus() {
    let place = scratch("true-capture");
    let path = place.join("run.csv");
    let words = ["capture", "4", "velocity", "true_velocity", "true_shaft_angle", "--for", "100ms"];
    let out = ["-o", path.to_str().unwrap(), "--json"];
    let ended = without_bus(&[&["--bus", "sim"], &words[..], &out].concat());
    assert_eq!(ended.status, Some(0), "{}{}", ended.out, ended.err);
    let report = ended.json();
    let by = report["captures"][0]["traces"].as_array().unwrap().iter().map(|trace| trace["by"].as_str().unwrap());
    assert_eq!(by.skip(1).collect::<Vec<_>>(), ["world", "world"]);
    let found = recorded(&path);
    let lengths: Vec<usize> = found.series.iter().map(|series| series.points.len()).collect();
    assert!(lengths.len() == 3 && lengths.iter().all(|length| *length == lengths[0] && *length > 95), "{lengths:?}");
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    bench.refused(&words, &["cannot be captured on this bus", "of a virtual drive alone", "--bus sim"]);
}

#[test]
fn a_replay_does_to_a_drive_what_was_done_when_the_log_was_written() {
    let directory = scratch("replayed");
    let log = directory.join("enable.blf");
    let log = log.to_str().unwrap();
    let model = ["--model", "4=zlac8030l"];
    VirtualBus::of(&["zlac8030l@4"]).with(&model).done(&["enable", "4", "--log", log]);
    let second = VirtualBus::of(&["zlac8030l@4"]);
    let state = || second.json(&[&model[..], &["state", "4"]].concat())["state"].clone();
    assert_ne!(state(), "Operation enabled");
    second.done(&["replay", log, "--only", "sent", "--allow-motion"]);
    assert_eq!(state(), "Operation enabled");
}

#[test]
fn a_record_in_virtual_time_refuses_viewers_who_could_not_come_in_time() {
    let place = scratch("viewers-of-a-record");
    let path = place.join("run.csv");
    let words = ["--bus", "sim", "record", "4", "606C", "-o", path.to_str().unwrap(), "--foxglove", "127.0.0.1:0"];
    let ended = without_bus(&words);
    assert_eq!(ended.status, Some(2), "{}{}", ended.out, ended.err);
    assert!(ended.err.contains("over before anyone could look") && ended.err.contains("sim --serve"), "{}", ended.err);
    assert!(!path.exists());
}

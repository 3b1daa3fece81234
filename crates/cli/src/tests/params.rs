//! `ferrodrive params` on a bus that goes on: refusals during the writes, and the way back.

use processes::scratch;

use super::virtual_bus::{VirtualBus, without_bus};

fn bench() -> VirtualBus {
    VirtualBus::of(&["zlac8030l@4"])
}

#[test]
fn a_refusal_at_the_third_value_puts_the_first_two_back() {
    let (bench, folder) = (bench(), scratch("params_rollback"));
    let [before, journal] = ["before.toml", "node4.journal"].map(|name| folder.path(name));
    bench.done(&["params", "backup", "4", "-o", &before]);
    // 6060h may be mapped into an RPDO, 1017h into nothing: only the drive knows by its refusal.
    let wanted = "1017 = 200\nprofile_acceleration = 150\n\"1A00:00\" = 1\n\"1A00:01\" = 0x10170010\n";
    let file = folder.values("wanted.toml", wanted);
    let ended = bench.run(&["params", "apply", "4", &file, "--journal", &journal, "--json"]);
    let failure = ended.json();
    assert_eq!((ended.status, failure["error"]["kind"].as_str()), (Some(1), Some("rolled_back")), "{failure}");
    assert_eq!(failure["error"]["abort"], 0x0604_0041);
    assert!(failure["error"]["object"].as_str().is_some_and(|object| object.starts_with("1A00h")), "{failure}");
    assert!(failure["error"]["message"].as_str().is_some_and(|text| text.contains("read as before")), "{failure}");
    bench.done(&["params", "verify", "4", &before]);
    assert!(!std::path::Path::new(&journal).exists(), "nothing is left to go back to");
}

#[test]
fn values_of_another_model_are_counted_and_the_first_ones_named() {
    let (bench, folder) = (bench(), scratch("params_other_model"));
    let values: Vec<String> = (0x3000..0x3019).map(|index| format!("\"{index:X}\" = \"u16:1\"\n")).collect();
    let error = bench.run(&["params", "apply", "4", &folder.values("other.toml", &values.concat())]).err;
    assert!(error.contains("cannot have 25 values") && error.contains("3009h") && !error.contains("300Ah"), "{error}");
    assert!(error.contains("and 15 more") && error.contains("another model"), "{error}");
}

#[test]
fn a_drive_at_work_is_left_alone_and_the_way_out_is_said() {
    let (bench, folder) = (bench(), scratch("params_at_work"));
    let file = folder.values("wanted.toml", "1017 = 200\n");
    let apply = ["params", "apply", "4", &file, "--journal", &folder.path("node4.journal")];
    bench.done(&["enable", "4"]);
    bench.refused(&apply, &["Operation enabled", "ferrodrive disable 4"]);
    bench.done(&["disable", "4"]);
    bench.done(&apply);
    bench.done(&["params", "verify", "4", &file]);
}

#[test]
fn a_journal_of_another_device_or_half_a_one_is_refused() {
    let (bench, folder) = (bench(), scratch("params_journal"));
    let journal = "node = 4\nvendor_id = 0x100\nproduct_code = 0xABC\nundo = [\n  [\"1017:00\", \"0000\"],\n]\n";
    let file = folder.write("node4.journal", journal);
    bench.refused(&["params", "rollback", "4", &file], &["not written to its end"]);
    folder.write("node4.journal", &format!("{journal}whole = true\n"));
    bench.refused(&["params", "rollback", "4", &file], &["product ABCh"]);
    bench.refused(&["params", "rollback", "5", &file], &["belongs to node 4"]);
}

#[test]
fn a_pdo_that_was_set_up_comes_and_before_it_was_said_why_not() {
    let (bench, folder) = (VirtualBus::of(&["zlac8030l@4", "cia402@5"]), scratch("pdo_apply"));
    let shown = |part: &str| {
        let ended = bench.done(&["pdo", "show", "4"]);
        assert!(ended.out.contains(part), "{part}: {}", ended.out);
    };
    shown("node 4 TPDO1, TPDO2, TPDO3, TPDO4, RPDO2, RPDO3, RPDO4: nothing is mapped into it");
    shown("node 4 RPDO1: no node was heard sending it");
    let apply = ["pdo", "apply", "4", "tpdo1=statusword,position_actual_value", "tpdo2=off", "--type", "1"];
    bench.done(&[&apply[..], &["--journal", &folder.path("node4.journal")]].concat());
    shown("TPDO2: off: bit 31 of its COB-ID is set");
    shown("TPDO1: it waits for SYNC, and none was heard");
    bench.done(&["nmt", "4", "start"]);
    // Another node sends SYNC.
    bench.apply(5, "bus babble 080# 20");
    let shown = bench.json(&["pdo", "show", "4"]);
    let tpdo = &shown["nodes"][0]["pdos"][0];
    assert_eq!((&tpdo["pdo"], &tpdo["silent"]), (&"TPDO1".into(), &serde_json::json!([])), "{shown}");
}

#[test]
fn what_cannot_be_stored_for_want_of_a_model_is_refused_before_the_first_write() {
    let (bench, folder) = (bench(), scratch("params_unknown"));
    let file = folder.values("wanted.toml", "1017 = 200\n");
    bench.refused(&["params", "apply", "4", &file, "--save"], &["--model 4=zlac8030l", "Nothing was sent"]);
}

/// What a node derives from its node-ID is the same where the other derives it too.
#[test]
fn two_nodes_are_compared_as_if_they_had_one_node_id() {
    let bench = VirtualBus::of(&["m4230e17b50@4", "m4230e17b50@5"]);
    assert!(bench.done(&["params", "diff", "4", "5"]).out.contains("node 4 has the values of node 5"));
    bench.done(&["write", "5", "1800:03", "1500"]);
    bench.done(&["write", "5", "1800:01", "0x80000199"]);
    let compared = bench.json(&["params", "diff", "4", "5"]);
    let rows = compared["differences"].as_array().unwrap();
    let objects: Vec<_> = rows.iter().map(|row| row["object"].as_str().unwrap()).collect();
    assert_eq!(objects, ["1800h:01", "1800h:03"], "{compared}");
    assert!(rows[1]["second"]["text"].as_str().is_some_and(|text| text.starts_with("150.0 ms")), "{compared}");
}

/// A file of a servo by its data sheet says the type of each value: it is read where that sheet is not known, and on the drive again.
#[test]
fn the_files_of_a_servo_by_its_data_sheet_are_compared_without_that() {
    let folder = scratch("params_of_sheet");
    let sheet = folder.write("maker.eds", &without_bus(&["eds", "cia402"]).out);
    let unknown = VirtualBus::of(&["io401@5"]);
    // What the standard names has its name all the same.
    assert_eq!(unknown.json(&["read", "5", "device_type"])["object"], "1000h:00");
    let strange = unknown.run(&["read", "5", "wheel_speed"]);
    assert_eq!(strange.status, Some(2), "{}", strange.err);
    assert!(
        strange.err.contains("not an object of CiA 301 or CiA 402") && strange.err.contains("--model"),
        "{}",
        strange.err
    );
    let bench = VirtualBus::of(&[&format!("{sheet}@5")]).with(&["--model", &format!("5={sheet}")]);
    let [before, after] = ["before.toml", "after.toml"].map(|name| folder.path(name));
    bench.done(&["params", "backup", "5", "-o", &before]);
    bench.done(&["write", "5", "6072", "100"]);
    bench.done(&["params", "backup", "5", "-o", &after]);
    let compared = without_bus(&["--json", "params", "diff", &before, &after]).json();
    let differences = compared["differences"].as_array().unwrap();
    assert!(differences.len() == 1 && differences[0]["object"] == "6072h:00", "{compared}");
    bench.done(&["params", "apply", "5", &before]);
    assert_eq!(bench.json(&["read", "5", "6072"])["value"], 3000);
    let other = std::fs::read_to_string(&after).unwrap().replace("\"u16:100\"", "\"u8:100\"");
    folder.write("other.toml", &other);
    bench.refused(
        &["params", "apply", "5", &folder.path("other.toml")],
        &["'u8:100' for 6072h:00 max_torque", "UNSIGNED16"],
    );
}

//! `ferrodrive boot` by the wrong data sheet.

use processes::{ferrodrive, scratch};
use serde_json::Value;

/// The letter of the standard's error status with which a node ended.
fn letter(report: &Value, node: u64) -> Option<String> {
    let nodes = report["nodes"].as_array().expect("nodes");
    let found = nodes.iter().find(|found| found["node"] == node).expect("the node");
    found["letter"].as_str().map(str::to_owned)
}

#[test]
fn the_data_sheet_of_another_device_is_told_with_what_differs_and_nothing_is_written() {
    let folder = scratch("boot_wrong_eds");
    let [sheet, machine] = ["other.eds", "machine.toml"].map(|name| folder.join(name));
    let eds = ferrodrive(&["eds", "cia402"]);
    assert_eq!(eds.status, Some(0), "{}", eds.err);
    std::fs::write(&sheet, &eds.out).expect("an EDS");
    std::fs::write(&machine, "[[drive]]\nmodel = \"other.eds\"\nnode = 4\n[drive.start_up]\n1017 = 200\n")
        .expect("a file");
    let simulator = processes::Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on = |words: &[&str]| ferrodrive(&[&["--bus", &bus, "--timeout", "10s"], words].concat());
    // A hub motor driver of this maker says 40192h of itself, a servo 20192h (CiA 402-1): device type is letter C.
    let ended = on(&["boot", machine.to_str().expect("UTF-8"), "--json"]);
    assert_eq!((ended.status, letter(&ended.json(), 4).as_deref()), (Some(1), Some("C")), "{}{}", ended.out, ended.err);
    let text = on(&["boot", machine.to_str().expect("UTF-8")]).out;
    assert!(text.contains("1000h:00") && text.contains("20192h") && text.contains("40192h"), "{text}");
    // Its heartbeat is as it was delivered (ZLAC8030L quick start guide V1.00, chapter 9: 1017h is 0).
    assert_eq!(on(&["read", "4", "1017", "--json"]).json()["value"], 0);
}

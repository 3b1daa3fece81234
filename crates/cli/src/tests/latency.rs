//! `ferrodrive latency` on a bus that others may use too.

use serde_json::Value;

use super::virtual_bus::VirtualBus;

fn figure(report: &Value, what: &str, figure: &str) -> f64 {
    report[what][figure].as_f64().unwrap_or_else(|| panic!("{what} {figure} in {report}"))
}

#[test]
fn a_tpdo_that_follows_sync_is_measured_and_is_no_faster_than_its_wire() {
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    // TPDO1 with 6041h behind each SYNC (1800h:02 = 1).
    for (object, value) in [("1A00:01", "0x60410010"), ("1A00:00", "1"), ("1800:02", "1")] {
        bench.done(&["--model", "4=zlac8030l", "write", "4", object, value]);
    }
    // Without NMT start nothing comes, and that is reported.
    let measured = |count: &str| bench.json(&["latency", "4", "--count", count]);
    let silent = measured("3");
    assert!(silent["notes"].to_string().contains("operational"), "{silent}");
    bench.done(&["nmt", "4", "start"]);
    let report = measured("30");
    assert!(figure(&report, "pdo", "count") >= 30.0, "{report}");
    // 44 bits and two bytes, without stuff bits, at 500 kbit/s: 120 us.
    assert!(figure(&report, "pdo", "min_us") >= 120.0, "{report}");
}

#[test]
fn a_bus_with_a_motor_switched_on_is_sent_no_sync() {
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    bench.done(&["--model", "4=zlac8030l", "enable", "4"]);
    // Not only the node that is asked counts.
    let report = bench.json(&["latency", "4", "--count", "10"]);
    assert_eq!(report["producer"], Value::Null, "{report}");
    assert!(report["notes"][0].as_str().unwrap().contains("the motor of node 4 is switched on"), "{report}");
}

#[test]
fn answers_and_sync_are_measured_on_any_bus_and_the_text_has_its_bars() {
    let bench = VirtualBus::of(&["zlac8030l@4"]);
    let report = bench.json(&["latency", "4", "--count", "30"]);
    assert_eq!(figure(&report, "sdo", "count"), 30.0);
    assert!(figure(&report, "sync", "count") >= 30.0, "{report}");
    let text = bench.done(&["latency", "4", "--count", "30"]).out;
    assert!(text.contains("SDO answer") && text.contains("SYNC period") && text.contains('#'), "{text}");
}

//! Identification of models: a scan of drives that answer the same, and what is refused until the model is given.

use processes::scratch;
use serde_json::{Value, json};

use super::virtual_bus::{VirtualBus, without_bus};

/// Both ZL drives and a joint, on a bus that does not say which they are.
fn bench() -> VirtualBus {
    VirtualBus::of(&["zlac8030l@4", "zlim42c@2", "m4230e17b50@1"])
}

/// 2009h of the ZLIM42-C: its bit rate, 1 for 500 kbit/s.
fn stepper_bit_rate(bench: &VirtualBus) -> Value {
    bench.json(&["--model", "2=zlim42c", "read", "2", "2009"])["value"].clone()
}

#[test]
fn a_scan_says_that_it_cannot_know_and_how_the_user_can() {
    let bench = bench();
    let found = bench.json(&["scan"]);
    let nodes = found["nodes"].as_array().unwrap();
    let stated: Vec<_> =
        nodes.iter().map(|node| (&node["node"], &node["model"], &node["guess"], &node["evidence"])).collect();
    let expected = [
        (&json!(1), &Value::Null, &Value::Null, &Value::Null),
        (&json!(2), &Value::Null, &json!("zlim42c"), &json!("2069h:00")),
        (&json!(4), &Value::Null, &json!("zlac8030l"), &json!("2029h:00")),
    ];
    assert_eq!(stated, expected);
    assert_eq!(nodes[1]["models"], json!(["zlac8030l", "zlim42c", "zlim42c-82"]));
    assert_eq!(nodes[2]["models"], nodes[1]["models"]);
    let text = bench.run(&["scan"]).out;
    for part in [
        "node 1: cannot tell: m4230e17b50, m4230e17b80, m8025e25b50 and m8025e25b80 answer the same identity and have",
        "node 2: cannot tell: zlac8030l, zlim42c and zlim42c-82 answer the same identity; it has 2069h:00 as zlim42c",
        "Name its model: --model 2=zlim42c",
        "node 4: cannot tell: zlac8030l, zlim42c and zlim42c-82 answer the same identity; it has 2029h:00 as zlac8030l has",
        "Name its model: --model 4=zlac8030l, or a machine file",
    ] {
        assert!(text.contains(part), "{part:?} in {text}");
    }
}

#[test]
fn a_scan_names_what_was_stated_and_says_what_speaks_against_it() {
    let bench = bench();
    let node = |found: &Value, id: u64| {
        found["nodes"].as_array().unwrap().iter().find(|node| node["node"] == id).cloned().unwrap()
    };
    let found = bench.json(&["--model", "4=zlac8030l", "scan"]);
    assert_eq!((&node(&found, 4)["model"], &node(&found, 4)["remark"]), (&json!("zlac8030l"), &Value::Null));
    let found = bench.json(&["--model", "4=zlim42c", "--model", "1=zlim42c", "scan"]);
    assert_eq!(node(&found, 4)["model"], Value::Null);
    assert!(node(&found, 4)["remark"].as_str().unwrap().contains("has 2029h:00, as a zlac8030l has"), "{found}");
    assert!(node(&found, 1)["remark"].as_str().unwrap().contains("its identity is that of another model"), "{found}");
}

#[test]
fn storing_is_refused_until_the_model_is_said() {
    let bench = bench();
    bench.refused(&["save", "4"], &["not known for sure", "--model 4=zlac8030l", "Nothing was sent"]);
    bench.refused(&["restore", "2"], &["--model 2=zlim42c (or zlim42c-82)"]);
    bench.refused(&["save", "1"], &["--model 1=m4230e17b50"]);
    assert_eq!(bench.json(&["--model", "4=zlac8030l", "save", "4"])["object"], "2009h:00");
    assert_eq!(bench.json(&["--model", "2=zlim42c", "save", "2"])["object"], "2010h:00");
    assert_eq!(bench.json(&["--model", "1=m4230e17b50", "save", "1"])["object"], "2614h:00");
    assert_eq!(stepper_bit_rate(&bench), 1);
}

#[test]
fn a_wrong_model_is_refused_before_anything_is_changed() {
    let bench = bench();
    let before = bench.report(4);
    let wrong = ["--model", "4=zlim42c"];
    for command in [
        &["save", "4"][..],
        &["restore", "4"],
        &["write", "4", "2009", "2"],
        &["enable", "4"],
        &["velocity", "4", "60rpm"],
    ] {
        bench.refused(&[&wrong[..], command].concat(), &["it has no 2069h:00", "scan"]);
    }
    bench.refused(&["--model", "2=zlac8030l", "save", "2"], &["it has no 2029h:00"]);
    assert_eq!(stepper_bit_rate(&bench), 1);
    let after = bench.report(4);
    assert_eq!((before.statusword, before.position), (after.statusword, after.position));
}

#[test]
fn a_write_that_means_something_else_on_the_other_model_is_refused() {
    let bench = bench();
    bench.refused(&["write", "2", "2009", "2"], &["write 2009h:00", "--model 2=zlim42c"]);
    bench.refused(&["write", "4", "2010", "1"], &["write 2010h:00", "--model 4=zlac8030l"]);
    assert_eq!(stepper_bit_rate(&bench), 1);
    let written = bench.run(&["write", "4", "6083", "300"]);
    assert_eq!(written.status, Some(0), "{}", written.err);
    assert!(
        written.err.contains("its model is not certain") && written.err.contains("--model 4=zlac8030l"),
        "{}",
        written.err
    );
    assert_eq!(bench.json(&["write", "4", "6083", "300"])["guess"], "zlac8030l");
}

#[test]
fn reading_and_moving_use_the_guess_and_say_so() {
    let bench = bench();
    // 606Ch is in 0.1 r/min on one and in r/min on the other.
    for (node, guess) in [("4", json!("zlac8030l")), ("2", json!("zlim42c")), ("1", Value::Null)] {
        let moved = bench.json(&["velocity", node, "60rpm", "--for", "500ms"]);
        assert!((moved["before_stop"]["velocity_rpm"].as_f64().unwrap() - 60.0).abs() < 3.0, "{moved}");
        assert_eq!((&moved["model"], &moved["guess"]), (&Value::Null, &guess));
    }
    let state = bench.run(&["state", "4"]);
    assert_eq!(state.err.matches("its model is not certain").count(), 1, "{}", state.err);
    let state = bench.run(&["--model", "4=zlac8030l", "state", "4"]);
    assert!(state.err.is_empty() && state.out.starts_with("node 4 (zlac8030l): "), "{}{}", state.out, state.err);
}

#[test]
fn a_machine_file_says_which_models_are_where_on_any_bus() {
    let bench = bench();
    let directory = scratch("machine");
    let file = directory.join("machine.toml");
    let text = "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nload = { torque_nm = 0.5 }\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n";
    std::fs::write(&file, text).unwrap();
    let path = file.to_str().unwrap();
    let found = bench.json(&["--machine", path, "scan"]);
    let models: Vec<_> = found["nodes"].as_array().unwrap().iter().map(|node| node["model"].as_str()).collect();
    assert_eq!(models, [None, Some("zlim42c"), Some("zlac8030l")]);
    assert_eq!(bench.json(&["--machine", path, "save", "4"])["done"], "stored");
    // The command line overrules it.
    bench.refused(&["--machine", path, "--model", "4=zlim42c", "save", "4"], &["it has no 2069h:00"]);
    std::fs::write(&file, "[[drive]]\nmodel = 'zlac'\nnode = 4").unwrap();
    let ended = bench.run(&["--machine", path, "scan"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("did you mean zlac8030l?"), "{}", ended.err);
}

#[test]
fn signed_values_are_signed_whether_the_model_is_said_or_not() {
    let bench = bench();
    for node in ["1", "2", "4"] {
        bench.json(&["write", node, "60FF", "-30"]);
        assert_eq!(bench.json(&["read", node, "60FF"])["value"], -30, "node {node}");
        assert_eq!(bench.json(&["read", node, "target_velocity"])["value"], -30, "node {node}");
        // Counts of an encoder on one, pulses to a stepper on the other.
        let named = ["m4230e17b50", "zlim42c", "", "zlac8030l"][node.parse::<usize>().unwrap() - 1];
        bench.json(&["--model", &format!("{node}={named}"), "write", node, "607A", "-5000"]);
        assert_eq!(bench.json(&["read", node, "607A"])["value"], -5000, "node {node}");
    }
}

/// A data sheet of the servo with another name for its bus voltage.
const SHEET: &str = "[FileInfo]\nFileName=wheel.eds\n[DeviceInfo]\nVendorName=Anyone\nProductName=Wheel\n\
    VendorNumber=0x100\nProductNumber=1\nRevisionNumber=0\n\
    [MandatoryObjects]\nSupportedObjects=1\n1=0x1000\n\
    [OptionalObjects]\nSupportedObjects=2\n1=0x6040\n2=0x6041\n\
    [ManufacturerObjects]\nSupportedObjects=1\n1=0x2029\n\
    [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nDefaultValue=0x40192\n\
    [2029]\nParameterName=Rail voltage\nObjectType=7\nDataType=6\nAccessType=ro\n\
    [6040]\nParameterName=Controlword\nObjectType=7\nDataType=6\nAccessType=rw\n\
    [6041]\nParameterName=Statusword\nObjectType=7\nDataType=6\nAccessType=ro\n";

#[test]
fn a_data_sheet_stands_for_a_model_wherever_one_is_asked_for() {
    let folder = scratch("data_sheet");
    let sheet = folder.join("wheel.eds");
    std::fs::write(&sheet, SHEET).unwrap();
    let sheet = sheet.to_str().unwrap();
    let bench = bench();
    let listed = without_bus(&["--json", "objects", sheet]).json();
    assert_eq!((&listed["model"], listed["objects"].as_array().unwrap().len()), (&json!("wheel"), 4));

    let stated = format!("4={sheet}");
    let read = bench.json(&["--model", &stated, "read", "4", "rail_voltage"]);
    assert_eq!((&read["object"], &read["value"]), (&json!("2029h:00"), &json!(4800)));
    let found = bench.json(&["--model", &stated, "scan"]);
    let four = found["nodes"].as_array().unwrap().iter().find(|node| node["node"] == 4).cloned().unwrap();
    assert_eq!((&four["model"], &four["remark"]), (&json!("wheel"), &Value::Null));
    assert!(four["models"].as_array().unwrap().contains(&json!("wheel")), "{four}");
    // 1000h of the joint is another one.
    bench.refused(
        &["--model", &format!("1={sheet}"), "read", "1", "6041"],
        &["Anyone Wheel", "device type (1000h) is 20192h"],
    );

    std::fs::write(sheet, "no data sheet").unwrap();
    let ended = without_bus(&["objects", sheet]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("wheel.eds"), "{}", ended.err);
}

#[test]
fn every_model_can_be_simulated_and_a_scan_from_outside_says_what_it_cannot_tell() {
    let drives = ["zlac8030l@4", "zlim42c@2", "zlim42c-82@3", "m4230e17b50@10", "m4230e17b80@11", "m8025e25b50@12"];
    let bench = VirtualBus::of(&[&drives[..], &["m8025e25b80@13"]].concat());
    let found = bench.json(&["--model", "4=zlac8030l", "scan"]);
    let answered: Vec<_> = found["nodes"].as_array().unwrap().iter().map(|node| node["node"].clone()).collect();
    assert_eq!(answered, [2, 3, 4, 10, 11, 12, 13]);
    let node = |id: u64| found["nodes"].as_array().unwrap().iter().find(|node| node["node"] == id).unwrap();
    assert_eq!((&node(4)["model"], &node(4)["remark"]), (&"zlac8030l".into(), &Value::Null));
    assert!(node(2)["model"].is_null() && node(12)["model"].is_null());
    assert!(node(2)["remark"].as_str().unwrap().contains("--model 2=zlim42c"), "{found}");
    // The 82 mm stepper is distinguished from the ZLAC8030L and not from the one of 70 mm.
    assert!(node(3)["remark"].as_str().unwrap().contains("--model 3=zlim42c (or zlim42c-82)"), "{found}");
}

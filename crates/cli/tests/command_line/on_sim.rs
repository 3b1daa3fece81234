//! Commands on the embedded virtual bus: what they print for programs, and what they do.

use processes::{done, ferrodrive, scratch};
use serde_json::json;

#[test]
fn scan_finds_the_drives_and_names_their_models() {
    let found = done(&["--json", "scan"]).json();
    let nodes = found["nodes"].as_array().unwrap();
    let known: Vec<_> = nodes.iter().map(|node| (node["node"].as_u64(), node["model"].as_str())).collect();
    // A model that is delivered with another node-ID is behind these.
    assert_eq!(known[..3], [(Some(1), Some("m4230e17b50")), (Some(2), Some("zlim42c")), (Some(4), Some("zlac8030l"))]);
    // "ZLAC8030L quick start guide V1.00", chapter 9, and "ZLIM42-C user manual V1.03", 5.4: the same.
    for node in &nodes[1..3] {
        assert_eq!((node["device_type"].as_u64(), node["vendor_id"].as_u64()), (Some(0x40192), Some(0x100)));
    }
    // "M Robot Joint Motor CanOpen Manual", 5.04.
    assert_eq!((nodes[0]["device_type"].as_u64(), nodes[0]["vendor_id"].as_u64()), (Some(0x20192), Some(0x331)));
    assert!(nodes.iter().all(|node| node["remark"].is_null()), "on this bus the models are known: {found}");
}

#[test]
fn an_object_is_read_by_number_and_by_name() {
    for object in ["200B", "0x200B", "200Bh:00", "encoder_lines"] {
        let read = done(&["--json", "read", "4", object]).json();
        assert_eq!((&read["node"], &read["value"]), (&json!(4), &json!(1024)), "{object}");
        assert_eq!(read["name"], "encoder_lines");
        assert_eq!(read["bytes"], "00 04");
    }
    let speed = done(&["read", "4", "profile_velocity"]);
    assert_eq!(speed.out, "node 4 6081h:00 profile_velocity = 120 r/min\n");
}

#[test]
fn a_value_is_written_with_unit_or_word() {
    let written = done(&["--json", "write", "4", "target_velocity", "-60rpm"]).json();
    assert_eq!((&written["value"], &written["unit"]), (&json!(-60), &json!("r/min")));
    let written = done(&["--json", "write", "4", "6060", "profile velocity"]).json();
    assert_eq!((&written["value"], &written["meaning"]), (&json!(3), &json!("profile velocity")));
}

#[test]
fn what_the_drive_refuses_is_reported_with_its_reason() {
    let ended = ferrodrive(&["write", "4", "6064", "5"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("6064h") && ended.err.contains("0601 0002h"), "{}", ended.err);
    let ended = ferrodrive(&["read", "4", "6502"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("0602 0000h"), "{}", ended.err);
}

#[test]
fn an_absent_node_is_a_failure_with_a_reason() {
    let ended = ferrodrive(&["read", "9", "6064"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("node 9") && ended.err.contains("6064h"), "{}", ended.err);
    assert!(ended.out.is_empty());
}

#[test]
fn a_speed_is_reached_held_and_stopped() {
    let moved = done(&["--json", "velocity", "4", "60rpm", "--for", "1s"]).json();
    assert_eq!((&moved["reached"], &moved["stopped"]), (&json!(true), &json!(true)));
    let speed = moved["before_stop"]["velocity_rpm"].as_f64().unwrap();
    assert!((speed - 60.0).abs() < 1.0, "{speed}");
    // What is reported of a stopped drive is what it does now: standing is less than 1 r/min.
    let speed = moved["velocity_rpm"].as_f64().unwrap();
    assert!(speed.abs() < 1.0, "{speed}");
    // 6083h: 500 ms from 0 to the target; reached is within 5 %.
    let reached = moved["reached_after_s"].as_f64().unwrap();
    assert!((0.35..0.7).contains(&reached), "{reached}");
    assert_eq!(moved["limits"]["acceleration_ms"], 500.0);
}

#[test]
fn a_move_ends_where_it_should_and_when_it_should() {
    let moved = done(&["--json", "move", "4", "90deg", "--profile-velocity", "30rpm"]).json();
    let position = moved["position"].as_i64().unwrap();
    assert!((position - 1024).abs() <= 30, "{position}");
    // A quarter turn at half a turn a second, and half of each 500 ms ramp.
    let reached = moved["reached_after_s"].as_f64().unwrap();
    assert!((0.85..1.3).contains(&reached), "{reached}");
    let back = done(&["--json", "move", "4", "--relative", "-0.5turn"]).json();
    let position = back["position"].as_i64().unwrap();
    assert!((position + 2048).abs() <= 30, "{position}");
}

#[test]
fn a_torque_is_a_motor_current() {
    let pushed = done(&["--json", "torque", "4", "500mA"]).json();
    assert_eq!(pushed["reached"], false);
    assert_eq!(pushed["asked"], "apply 0.5 A");
    // The example of its help. What holds in this mode is said: no profile of a speed does.
    let stopped = done(&["--json", "torque", "4", "1.5A", "--for", "2s"]).json();
    assert!(stopped["before_stop"]["velocity_rpm"].as_f64().unwrap() > 100.0, "{stopped}");
    assert!(stopped["velocity_rpm"].as_f64().unwrap().abs() < 1.0, "{stopped}");
    assert!(stopped["limits"]["profile_velocity_rpm"].is_null(), "{stopped}");
    assert!(stopped["limits"]["current_a"].as_f64().unwrap() >= 1.5, "{stopped}");
}

#[test]
fn the_same_commands_move_all_three_drives() {
    for node in ["1", "2", "4"] {
        let moved = done(&["--json", "velocity", node, "60rpm", "--for", "1s"]).json();
        let speed = moved["before_stop"]["velocity_rpm"].as_f64().unwrap();
        assert!((speed - 60.0).abs() < 3.0, "node {node}: {speed}");
        assert!(moved["velocity_rpm"].as_f64().unwrap().abs() < 1.0, "node {node}: {moved}");
        let moved = done(&["--json", "move", node, "90deg", "--profile-velocity", "60rpm"]).json();
        let angle = moved["angle_deg"].as_f64().unwrap();
        assert!((angle - 90.0).abs() < 4.0, "node {node}: {angle}");
        let state = |arguments: &[&str]| done(&[&["--json"], arguments].concat()).json()["state"].clone();
        assert_eq!(state(&["state", node]), "Switch on disabled");
        assert_eq!(state(&["enable", node]), "Operation enabled");
        assert!(done(&["objects", node]).out.contains("6064h:00"));
    }
    // 0404h: "M Robot Joint Motor CanOpen Manual", 5.10.1.
    let joint = done(&["--json", "state", "1"]).json();
    assert_eq!((&joint["statusword"], &joint["bits"]), (&json!(0x0404), &json!(["output enabled", "target reached"])));
}

#[test]
fn a_torque_is_refused_where_the_model_has_no_such_mode() {
    for node in ["1", "2"] {
        let ended = ferrodrive(&["torque", node, "500mA"]);
        assert_eq!(ended.status, Some(1));
        assert!(
            ended.err.contains("has no mode 4 (profile torque): its 6060h takes 1 (profile position)"),
            "{}",
            ended.err
        );
    }
}

#[test]
fn a_value_that_is_refused_is_reported_with_what_the_object_takes() {
    let said = |arguments: &[&str], status| {
        let ended = ferrodrive(arguments);
        assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
        ended.err
    };
    // "M Robot Joint Motor CanOpen Manual", 5.04: 60FFh is -3000 to 3000 r/min.
    let error = said(&["write", "1", "60FF", "99999"], 1);
    assert!(error.contains("60FFh:00 target_velocity takes -3000 to 3000 in units of r/min"), "{error}");
    // "ZLIM42-C user manual V1.03", 5.3.6: methods 17, 18, 24 and 29.
    for error in [said(&["write", "2", "6098", "99"], 1), said(&["home", "2", "--method", "99"], 1)] {
        assert!(["17 (", "18 (", "24 (", "29 ("].iter().all(|method| error.contains(method)), "{error}");
    }
}

#[test]
fn texts_say_a_thing_once() {
    assert_eq!(done(&["write", "4", "60FF", "60rpm"]).out, "node 4 60FFh:00 target_velocity written: 60 r/min\n");
    let refused = ferrodrive(&["home", "4", "--method", "17"]).err;
    assert!(
        refused.contains("its 6060h takes 1 (profile position), 3 (profile velocity), 4 (profile torque)\n"),
        "{refused}"
    );
}

#[test]
fn a_joint_is_operational_by_itself_and_its_statusword_in_its_own_words() {
    let nodes = done(&["--json", "scan"]).json()["nodes"].clone();
    let states: Vec<_> = nodes.as_array().unwrap().iter().map(|node| node["nmt_state"].as_str().unwrap()).collect();
    assert_eq!(states[..3], ["operational", "pre-operational", "pre-operational"]);
    assert_eq!(done(&["--json", "state", "1"]).json()["nmt_state"], "operational");
    let read = done(&["read", "1", "statusword"]).out;
    assert_eq!(read, "node 1 6041h:00 statusword = 0x404 (1028)  output enabled, target reached\n");
}

#[test]
fn a_joint_homes_on_the_switch_of_its_machine_file() {
    let directory = scratch("homing");
    let file = directory.join("joint.toml");
    let text = "[[drive]]\nmodel = 'm4230e17b50'\nnode = 1\nswitches = { DIR = ['min', -16384] }\n";
    std::fs::write(&file, text).unwrap();
    let bus = format!("sim:{}", file.display());
    let homed = done(&["--bus", &bus, "--json", "home", "1", "--method", "17"]).json();
    assert_eq!(homed["reached"], true);
    // A joint has its speed of the search in 6083h, and those of moves do not count.
    assert!(
        homed["limits"]["profile_velocity_rpm"].is_null() && homed["limits"]["search_speed_rpm"].is_null(),
        "{homed}"
    );
    assert!(homed["bits"].as_array().unwrap().contains(&json!("homing attained")), "{homed}");
}

#[test]
fn homing_that_finds_nothing_in_time_is_reported_with_what_to_check() {
    let ended = ferrodrive(&["home", "2", "--method", "17", "--within", "2s"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("still looks for its reference") && ended.err.contains("switch"), "{}", ended.err);
    assert!(ended.err.contains("it has been quick-stopped and stands"), "{}", ended.err);
    // 6099h:01 of the ZLIM42-C is 120 r/min as delivered ("ZLIM42-C user manual V1.03", 5.4).
    let begun = done(&["--json", "home", "2", "--method", "17", "--no-wait"]).json();
    assert_eq!(begun["limits"]["search_speed_rpm"], 120.0, "{begun}");
    assert!(
        begun["limits"]["profile_velocity_rpm"].is_null() && begun["limits"]["acceleration_ms"].is_null(),
        "{begun}"
    );
    assert_eq!(ferrodrive(&["home", "2", "--method", "99"]).status, Some(1));
}

#[test]
fn homing_is_refused_with_the_reason() {
    let ended = ferrodrive(&["home", "4", "--method", "17"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("has no mode 6 (homing)") && ended.err.contains("6060h takes 1"), "{}", ended.err);
}

#[test]
fn states_follow_the_commands() {
    let state = |arguments: &[&str]| done(&[&["--json"], arguments].concat()).json()["state"].clone();
    assert_eq!(state(&["state", "4"]), "Switch on disabled");
    assert_eq!(state(&["enable", "4"]), "Operation enabled");
    assert_eq!(state(&["disable", "4"]), "Switch on disabled");
    assert_eq!(state(&["reset", "4"]), "Switch on disabled");
    for node in ["1", "2", "4"] {
        assert_eq!(state(&["quick-stop", node]), "Switch on disabled", "a motor without power is left so");
    }
    let text = done(&["state", "4"]).out;
    assert!(text.contains("fault       none") && text.contains("48.0 V"), "{text}");
}

#[test]
fn parameters_are_stored_and_restored() {
    let saved = done(&["--json", "save", "4"]).json();
    assert_eq!((&saved["done"], &saved["object"]), (&json!("stored"), &json!("2009h:00")));
    assert_eq!(done(&["--json", "save", "1"]).json()["object"], "2614h:00");
    assert_eq!(done(&["--json", "save", "2"]).json()["object"], "2010h:00");
    let restored = done(&["--json", "restore", "4"]).json();
    assert_eq!(restored["done"], "restored to factory values");
}

#[test]
fn a_reset_node_boots_again() {
    assert_eq!(done(&["--json", "nmt", "4", "reset"]).json()["booted"], true);
    assert_eq!(done(&["--json", "nmt", "all", "start"]).json()["node"], serde_json::Value::Null);
    assert_eq!(ferrodrive(&["nmt", "9", "reset"]).status, Some(1));
}

#[test]
fn the_dump_is_a_log_that_dump_reads() {
    let directory = scratch("dump");
    let log = directory.join("trace.log");
    let shown = done(&["dump", "--log", log.to_str().unwrap()]);
    assert!(shown.out.contains("704#00") && shown.out.contains("boot-up node 4"), "{}", shown.out);
    let bus = format!("log:{}", log.display());
    let again = done(&["--json", "--bus", &bus, "dump"]);
    let lines = again.out.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let line = lines.into_iter().find(|line| line["frame"] == "704#00").unwrap();
    assert_eq!(line["text"], "boot-up node 4");
}

#[test]
fn a_machine_file_describes_the_bus() {
    let directory = scratch("machine");
    let file = directory.join("two.toml");
    let text = "bitrate = '250k'\n[[drive]]\nmodel = 'zlac8030l'\nnode = 2\nsupply_v = 56\n\
                [[drive]]\nmodel = 'zlac8030l'\nnode = 3\nfaults = ['hall']\n";
    std::fs::write(&file, text).unwrap();
    let bus = format!("sim:{}", file.display());
    let state = done(&["--bus", &bus, "--json", "state", "2"]).json();
    assert!((state["supply_v"].as_f64().unwrap() - 56.0).abs() < 0.5, "{state}");
    let state = done(&["--bus", &bus, "--json", "state", "3"]).json();
    assert_eq!(state["fault_code"], 0x200);
    assert!(state["faults"][0]["remedy"].as_str().unwrap().contains("Hall"));
}

#[test]
fn objects_are_listed_and_searched() {
    let all = done(&["--json", "objects", "zlac8030l"]).json();
    assert!(all["objects"].as_array().unwrap().len() > 190);
    let found = done(&["--json", "objects", "4", "6064"]).json();
    assert_eq!(found["objects"][0]["name"], "position_actual_value");
    assert_eq!(ferrodrive(&["objects", "zlac8030l", "zebra"]).status, Some(1));
}

#[test]
fn completions_are_scripts() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(done(&["completions", shell]).out.contains("ferrodrive"), "{shell}");
    }
}

#[test]
fn the_demo_of_one_drive_is_only_of_that_drive() {
    let directory = scratch("demo of one");
    let svg = directory.join("demo.svg");
    let demo = done(&["--json", "demo", "--drive", "zlim42c", "--svg", svg.to_str().unwrap()]).json();
    assert_eq!((&demo["ok"], demo["drives"].as_array().unwrap().len()), (&true.into(), 1));
    assert!(demo["rows"].as_array().unwrap().iter().all(|row| row["drive"] == "ZLTECH ZLIM42-C (70 mm)"));
    assert_eq!(ferrodrive(&["demo", "--drive", "toaster"]).status, Some(2));
}

#[test]
fn the_demo_passes_and_draws() {
    let directory = scratch("demo");
    let svg = directory.join("demo.svg");
    let demo = done(&["--json", "demo", "--svg", svg.to_str().unwrap()]).json();
    assert_eq!(demo["ok"], true);
    assert_eq!(demo["steps"], demo["passed"]);
    let picture = std::fs::read_to_string(&svg).unwrap();
    assert!(picture.starts_with("<svg ") && picture.contains("absolute position"));
    let text = |row: &serde_json::Value, key: &str| row[key].as_str().unwrap().to_owned();
    let sections: std::collections::BTreeSet<_> =
        demo["rows"].as_array().unwrap().iter().map(|row| (text(row, "drive"), text(row, "section"))).collect();
    let manuals = [
        ("ZLAC8030L", "3.4 4.1 4.2 4.3 4.4 4.5 4.6 5.1 5.2 5.3 5.4 5.5 6.1 6.2 8"),
        ("M4230E17B50", "5.04 5.05 5.06.1 5.06.2 5.07.1 5.08 5.08.4 5.09 5.10.1 5.10.2 5.11.1 5.11.2"),
        ("ZLIM42-C", "4.1 5.2 5.3.1 5.3.2 5.3.3 5.3.4 5.3.5 5.3.6 5.4 603Fh"),
        ("Three joints, interpolation at 2 ms", "5.10.3"),
    ];
    for (drive, wanted) in manuals {
        for section in wanted.split(' ') {
            let step = (drive.to_owned(), section.to_owned());
            assert!(sections.contains(&step), "{step:?} in {sections:?}");
        }
    }
}

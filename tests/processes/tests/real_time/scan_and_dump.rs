//! Reports on nodes that were not heard in time, and on objects of nodes with an unknown model.

use std::path::Path;

use processes::{Ended, Simulator, ferrodrive, scratch};
use serde_json::{Value, json};

#[test]
fn a_scan_tells_who_beats_each_second_who_never_and_who_has_not_been_heard_yet() {
    let drives = ["--drive", "m4230e17b50@1", "--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"];
    let simulator = Simulator::start(&drives);
    let bus = simulator.bus("socketcand");
    let on_bus = |arguments: &[&str]| {
        let ended = ferrodrive(&[&["--bus", &bus], arguments].concat());
        assert_eq!(ended.status, Some(0), "{arguments:?}: {}", ended.err);
        ended
    };
    let found = on_bus(&["--json", "--timeout", "1s", "scan"]).json();
    let said = |place: usize| {
        let node = &found["nodes"][place];
        (node["node"].as_u64(), node["nmt_state"].clone(), node["heartbeat_ms"].clone())
    };
    // "M Robot Joint Motor CanOpen Manual", 5.04: 1017h is 1000 ms; "ZLAC8030L quick start guide V1.00", chapter 9: 0.
    assert_eq!(said(0), (Some(1), json!("operational"), json!(1000)));
    assert_eq!(said(1), (Some(4), Value::Null, json!(0)));
    let text = on_bus(&["--timeout", "1s", "scan"]).out;
    assert!(text.contains("sends no heartbeat") && !text.contains("not heard yet"), "{text}");

    on_bus(&["--model", "4=zlac8030l", "write", "4", "1017", "30000"]);
    let text = on_bus(&["--timeout", "1s", "scan"]).out;
    assert!(text.contains("heartbeat every 30000 ms, not heard yet"), "{text}");
}

fn dump(log: &Path, arguments: &[&str]) -> Ended {
    let bus = format!("log:{}", log.display());
    ferrodrive(&[&["--bus", &bus], arguments, &["dump"]].concat())
}

#[test]
fn objects_that_all_models_name_alike_are_named_without_a_model_and_have_no_unit_that_they_do_not_share() {
    let directory = scratch("names");
    let log = directory.join("trace.log");
    // Uploads of 6041h, 606Ch, 6064h, 6061h, 60F4h and 200Ah.
    let frames = ["4B41600037020000", "436C6000C4FFFFFF", "43646000007D0000", "4F61600003000000", "43F46000FFFFFFFF"];
    let lines: String = frames.iter().map(|frame| format!("(1.0) can0 584#{frame}\n")).collect();
    std::fs::write(&log, lines + "(1.0) can0 584#4B0A2000E8030000\n").unwrap();
    let text = dump(&log, &[]).out;
    for part in [
        "6041h:00 statusword = 0237h (Operation enabled)",
        "606Ch:00 velocity_actual_value = -60\n",
        "6064h:00 position_actual_value = 32000\n",
        "6061h:00 modes_of_operation_display = 3 (profile velocity)",
        "60F4h:00 following_error_actual_value = -1\n",
        // The motor's largest speed on one model, the way of stopping at a limit on another.
        "200Ah:00 = 03E8h (1000)",
    ] {
        assert!(text.contains(part), "{part:?} in {text}");
    }
    let known = dump(&log, &["--model", "4=zlac8030l"]).out;
    assert!(known.contains("606Ch:00 velocity_actual_value = -60 [0.1 r/min]"), "{known}");
}

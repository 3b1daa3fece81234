//! Lines that `dump` reads.

use std::path::Path;

use processes::{Ended, ferrodrive, scratch};
use serde_json::{Value, json};

fn dump(log: &Path, arguments: &[&str]) -> Ended {
    let bus = format!("log:{}", log.display());
    ferrodrive(&[&["--bus", &bus], arguments, &["dump"]].concat())
}

#[test]
fn a_line_that_is_no_frame_is_told_with_its_number_and_passed_over() {
    let directory = scratch("torn");
    let log = directory.join("trace.log");
    let lines = "(1.0) can0 704#00\n(1.1) can0 604##111223344\n(1.15) can0 60\n(1.2) can0 704#05\n(1.3) can0 70\n(1.4) can0 704#7F\n";
    std::fs::write(&log, lines).unwrap();
    let shown = dump(&log, &[]);
    assert_eq!(shown.status, Some(0), "{}", shown.err);
    assert_eq!(shown.out.lines().count(), 4, "{}", shown.out);
    assert!(shown.out.contains("CAN FD frame 604 with 4 bytes passed over"), "{}", shown.out);
    assert!(shown.err.contains("warning: line 3 passed over, '(1.15) can0 60'"), "{}", shown.err);
    assert!(shown.err.contains("line 5") && shown.err.contains("3 frames read; 2 places skipped"), "{}", shown.err);

    let shown = dump(&log, &["--json"]);
    let rows: Vec<Value> = shown.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(rows[1]["note"], "fd_frame", "{}", rows[1]);
    assert_eq!((&rows[2]["line"], &rows[2]["skipped"]), (&json!(3), &json!("(1.15) can0 60")));
    assert_eq!(rows[6], json!({ "ok": true, "frames": 3, "lines_skipped": 2, "fd_frames": 1 }));
    assert_eq!((rows.len(), shown.err.as_str()), (7, ""));

    std::fs::write(&log, "no log\n".repeat(1000)).unwrap();
    let shown = dump(&log, &[]);
    assert_eq!(shown.status, Some(1));
    assert!(shown.err.contains("no frame, and 1000 places skipped") && shown.err.lines().count() < 30, "{}", shown.err);
}

/// Heartbeats of node 4 and SYNCs, by their times in the log.
#[test]
fn the_identifiers_of_a_log_have_a_row_each() {
    let directory = scratch("identifiers");
    let log = directory.join("trace.log");
    let lines = "(1.000) can0 704#05\n(1.010) can0 080#\n(1.030) can0 080#\n(2.000) can0 704#05\n(2.500) can0 704#7F\n(3.0) can0 18FEF100#01\n";
    std::fs::write(&log, lines).unwrap();
    let options = |options: &[&str]| {
        let bus = format!("log:{}", log.display());
        ferrodrive(&[&["--bus", &bus, "dump", "--identifiers"], options].concat())
    };
    let shown = options(&[]);
    let rows: Vec<Vec<&str>> = shown.out.lines().map(|line| line.split_whitespace().take(4).collect()).collect();
    assert_eq!(
        rows[1..],
        [["080", "2", "20.000", "20.000"], ["704", "3", "500.000", "1000.000"], ["18FEF100", "1", "-", "-"]]
    );
    assert!(
        shown.out.contains("heartbeat node 4: pre-operational") && shown.err.contains("6 frames in 2.000 s"),
        "{}",
        shown.err
    );
    let of_sync = options(&["--service", "sync", "--json"]);
    let row: Value = serde_json::from_str(&of_sync.out).unwrap();
    assert_eq!((&row["id"], &row["count"], &row["least_ms"]), (&json!("080"), &json!(2), &json!(20.0)), "{row}");
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

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

//! Values that are rounded or refused.

use processes::{done, ferrodrive};
use serde_json::json;

#[test]
fn what_is_sent_is_said_where_it_is_not_what_was_asked_for() {
    for node in ["1", "2", "4"] {
        let text = done(&["velocity", node, "2.7rpm"]).out;
        assert!(text.starts_with(&format!("node {node}: turn at 3 r/min (2.7 r/min asked for): reached")), "{text}");
        assert!(text.contains("speed: 2.7 r/min asked for, 3 r/min sent (60FFh:00 = 3)"), "{text}");
        let report = done(&["--json", "velocity", node, "2.7rpm", "--acceleration", "300ms"]).json();
        assert_eq!(
            report["commanded"][0],
            json!({ "what": "speed", "requested": 2.7, "commanded": 3.0, "unit": "r/min", "object": "60FFh:00",
                    "raw": 3, "rounded": true })
        );
    }
    let exact = done(&["velocity", "4", "60rpm"]).out;
    assert!(exact.starts_with("node 4: turn at 60 r/min: reached") && !exact.contains("sent"), "{exact}");
    // 4096 counts a turn: 1 degree is 11.4 of them.
    let moved = done(&["move", "4", "1deg"]).out;
    assert!(moved.contains("move to 0.9668 deg (1° asked for)"), "{moved}");
}

#[test]
fn what_would_be_nothing_is_a_usage_error() {
    for arguments in [
        &["velocity", "4", "0.4rpm"][..],
        &["move", "4", "--relative", "0.004deg"],
        &["torque", "4", "0.3mA"],
        &["move", "4", "90deg", "--profile-velocity", "0.2rpm"],
        &["velocity", "2", "60rpm", "--acceleration", "0.3ms"],
        &["velocity", "1", "60rpm", "--acceleration", "0.2rpm/s"],
    ] {
        let ended = ferrodrive(&[&["--json"], arguments].concat());
        assert_eq!(ended.status, Some(1), "{arguments:?}: {}", ended.out);
        let error = &ended.json()["error"];
        // 6081h begins at 1 r/min: what is below is out of its range.
        let kind = if arguments.contains(&"--profile-velocity") { "out_of_limits" } else { "too_fine" };
        assert_eq!(error["kind"], kind, "{arguments:?}: {error}");
        assert!(error["message"].as_str().unwrap().contains("was not sent"), "{error}");
    }
    let ended = ferrodrive(&["velocity", "4", "60rpm", "--acceleration", "0rpm/s"]);
    assert!(ended.status == Some(2) && ended.err.contains("rate of zero"), "{}", ended.err);
}

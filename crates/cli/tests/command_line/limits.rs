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

#[test]
fn the_limit_in_force_and_what_it_follows_from_are_named() {
    // "ZLAC8030L quick start guide V1.00", chapter 9: -1000 to 1000 r/min; 5.3: times the resolution.
    let ended = ferrodrive(&["write", "4", "60FF", "1001"]);
    assert_eq!(ended.status, Some(1));
    let takes = "60FFh:00 target_velocity takes -1000 to 1000 in units of r/min, by 202Fh:05 set_speed_resolution = 1";
    assert!(ended.err.contains(takes), "{}", ended.err);
    let ended = ferrodrive(&["velocity", "4", "9999rpm"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("takes -1000 to 1000 in units of r/min"), "{}", ended.err);
    assert!(!ended.err.contains("10000"), "{}", ended.err);
    let accepts = |whose| {
        let rows = done(&["objects", whose, "60FF"]).out;
        rows.lines().last().unwrap().split_once("r/min  ").unwrap().1.to_owned()
    };
    assert_eq!(accepts("zlac8030l"), "-1000 to 1000, times 202Fh:05; acts up to 200Ah:00");
    assert!(accepts("4").starts_with("-1000 to 1000 in units of r/min, by 202Fh:05 set_speed_resolution = 1"));
    assert_eq!(accepts("zlim42c"), "-3000 to 3000");
}

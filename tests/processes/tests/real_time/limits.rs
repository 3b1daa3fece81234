//! Values that are limited: that the named limits are those in force.

use processes::{Simulator, done, ferrodrive};
use serde_json::json;

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

#[test]
fn limits_follow_what_is_written_to_the_objects_that_move_them() {
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on_bus = |arguments: &[&str]| ferrodrive(&[&["--bus", &bus, "--model", "4=zlac8030l"], arguments].concat());
    let ended = on_bus(&["write", "4", "200A", "500"]);
    assert_eq!(ended.status, Some(0), "{}", ended.err);
    let now = on_bus(&["--json", "objects", "4", "60FF"]).json()["objects"][0]["now"].clone();
    let by = &now["by"];
    assert_eq!((&now["limits"], &now["acts_up_to"]), (&json!([-1000, 1000]), &json!(500)), "{now}");
    assert_eq!(
        (&by[1]["object"], &by[1]["name"], &by[1]["value"]),
        (&json!("200Ah:00"), &json!("maximum_speed_of_motor"), &json!(500))
    );
    let error = on_bus(&["velocity", "4", "800rpm"]).err;
    assert!(error.contains("acts up to 500, by 200Ah:00 maximum_speed_of_motor = 500"), "{error}");
    let written = on_bus(&["write", "4", "60FF", "800"]).out;
    assert!(written.contains("the drive limits it to 500, by 200Ah:00 maximum_speed_of_motor = 500"), "{written}");

    // A new resolution acts from the next restart on (5.3), and so do the limits.
    let written = on_bus(&["write", "4", "202F:05", "10"]).out;
    assert!(written.contains("takes effect at the next restart") && written.contains("ferrodrive save 4"), "{written}");
    let error = on_bus(&["write", "4", "60FF", "1001"]).err;
    assert!(error.contains("202Fh:05 has been written since the drive's last restart"), "{error}");
    assert_eq!(on_bus(&["save", "4"]).status, Some(0));
    // The store takes its time, and a reset would cut it short.
    simulator.pass(std::time::Duration::from_millis(300));
    assert_eq!(on_bus(&["nmt", "4", "reset"]).status, Some(0));
    let written = on_bus(&["--json", "write", "4", "60FF", "2.7rpm"]).json();
    assert_eq!((&written["value"], &written["quantity"], &written["unit"]), (&json!(27), &json!(2.7), &json!("r/min")));
    assert_eq!(on_bus(&["read", "4", "60FF"]).out, "node 4 60FFh:00 target_velocity = 2.7 r/min (27)\n");
    let ended = on_bus(&["write", "4", "60FF", "10001"]);
    assert!(ended.err.contains("takes -10000 to 10000 in units of r/min / 10"), "{}", ended.err);
    let ended = on_bus(&["velocity", "4", "2.7rpm", "--for", "100ms"]);
    assert!(ended.out.starts_with("node 4: turn at 2.7 r/min: reached"), "{}{}", ended.out, ended.err);
}

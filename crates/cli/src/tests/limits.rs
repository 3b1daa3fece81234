//! Values that are limited: that the named limits are those in force, and follow what is written.

use std::time::Duration;

use processes::scratch;
use serde_json::json;

use super::virtual_bus::{VirtualBus, without_bus};

#[test]
fn limits_follow_what_is_written_to_the_objects_that_move_them() {
    let bench = VirtualBus::of(&["zlac8030l@4"]).with(&["--model", "4=zlac8030l"]);
    let on_bus = |words: &[&str]| bench.run(words);
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
    bench.pass(Duration::from_millis(300));
    assert_eq!(on_bus(&["nmt", "4", "reset"]).status, Some(0));
    let written = on_bus(&["--json", "write", "4", "60FF", "2.7rpm"]).json();
    assert_eq!((&written["value"], &written["quantity"], &written["unit"]), (&json!(27), &json!(2.7), &json!("r/min")));
    assert_eq!(on_bus(&["read", "4", "60FF"]).out, "node 4 60FFh:00 target_velocity = 2.7 r/min (27)\n");
    let ended = on_bus(&["write", "4", "60FF", "10001"]);
    assert!(ended.err.contains("takes -10000 to 10000 in units of r/min / 10"), "{}", ended.err);
    let ended = on_bus(&["velocity", "4", "2.7rpm", "--for", "100ms"]);
    assert!(ended.out.starts_with("node 4: turn at 2.7 r/min: reached"), "{}{}", ended.out, ended.err);
}

/// 607Fh as delivered is 83 turns a second, 6072h is 300 % of 2.8 A. The same of a servo by its data sheet, and after a change.
#[test]
fn what_a_servo_by_the_profile_holds_back_is_refused_before_anything_moves() {
    let folder = scratch("servo-limits");
    let sheet = folder.write("maker.eds", &without_bus(&["eds", "cia402"]).out);
    for model in ["cia402", sheet.as_str()] {
        let bench = VirtualBus::of(&[&format!("{model}@5")]).with(&["--model", &format!("5={model}")]);
        for (words, by) in [
            (&["velocity", "5", "6000rpm"][..], "607Fh:00"),
            (&["torque", "5", "20A"], "6072h:00"),
            (&["move", "5", "1turn", "--profile-velocity", "6000rpm"], "607Fh:00"),
        ] {
            let ended = bench.run(words);
            assert!(
                ended.status == Some(1) && ended.err.contains(&format!("by {by}")),
                "{model} {words:?}: {}",
                ended.err
            );
            assert!(ended.err.contains("It was not sent"), "{model} {words:?}: {}", ended.err);
            assert!(bench.report(5).velocity_rpm.abs() < 1.0, "{model} {words:?}");
        }
        bench.done(&["write", "5", "6072", "100"]);
        let ended = bench.run(&["torque", "5", "2A"]);
        assert!(ended.err.contains("6072h:00 max_torque = 100"), "{model}: {}", ended.err);
        bench.done(&["velocity", "5", "60rpm", "--for", "100ms"]);
        // 6080h is in r/min of the motor (CiA 402-2, max motor speed).
        bench.done(&["write", "5", "6080", "100"]);
        for words in [&["velocity", "5", "120rpm"][..], &["move", "5", "1turn", "--profile-velocity", "120rpm"]] {
            let ended = bench.run(words);
            assert!(ended.err.contains("by 6080h:00 max_motor_speed = 100"), "{model} {words:?}: {}", ended.err);
        }
        // At the very bound, between two counts: 131072 increments a turn, so 109226.67 of them a second at 50 r/min.
        bench.done(&["write", "5", "6080", "50"]);
        bench.done(&["velocity", "5", "50rpm", "--for", "100ms"]);
    }
}

/// The motor of the M8025 does 1500 r/min, that of the M4230 2000 ("M Robot Joint Motor CanOpen Manual", Parameters), and 60FFh takes 3000.
#[test]
fn a_joint_is_not_asked_for_more_than_its_motor_does() {
    for (model, most) in [("m8025e25b50", 1500), ("m4230e17b50", 2000)] {
        let bench = VirtualBus::of(&[&format!("{model}@1")]).with(&["--model", &format!("1={model}")]);
        let ended = bench.run(&["velocity", "1", &format!("{}rpm", most + 1)]);
        let said = format!("it acts up to {most}, by the highest speed of its motor");
        assert!(ended.status == Some(1) && ended.err.contains(&said), "{}", ended.err);
        let taken = bench.json(&["objects", "1", "60FF"]);
        assert_eq!(taken["objects"][0]["now"]["acts_up_to"], most, "{taken}");
        let turned = bench.done(&["velocity", "1", &format!("{}rpm", most - 200), "--for", "100ms"]).out;
        assert!(turned.contains(&format!("limits  speed up to {most} r/min, acceleration")), "{turned}");
    }
}

/// 607Dh (CiA 402-2, software position limit): a move beyond it is refused, and a motor that turns into it is not held by a load.
#[test]
fn software_limits_are_named_before_a_move_and_where_a_motor_has_turned_into_them() {
    let bench = VirtualBus::of(&["cia402@5"]).with(&["--model", "5=cia402"]);
    for (object, value) in [("607D:01", "-500"), ("607D:02", "500")] {
        bench.done(&["write", "5", object, value]);
    }
    for (words, by) in [
        (&["move", "5", "1turn"][..], "it acts up to 500, by 607Dh:02 max_position_limit = 500"),
        (&["move", "5", "-501counts"], "it acts up to -500, by 607Dh:01 min_position_limit = -500"),
        (&["move", "5", "501counts", "--relative"], "607Dh:02"),
    ] {
        let ended = bench.run(words);
        assert!(ended.status == Some(1) && ended.err.contains(by), "{words:?}: {}", ended.err);
        assert_eq!(bench.report(5).position, 0, "{words:?}");
    }
    bench.done(&["move", "5", "400counts"]);
    let ended = bench.run(&["velocity", "5", "60rpm"]);
    assert!(ended.status == Some(1) && ended.err.contains("its end there is 500 (607Dh:02)"), "{}", ended.err);
    assert!(!ended.err.contains("shaft is held"), "{}", ended.err);
    bench.done(&["velocity", "5", "-10rpm", "--for", "50ms"]);
}

#[test]
fn what_a_tuning_is_asked_for_is_checked_before_a_bus_is_looked_for() {
    let refused = without_bus(&["--bus", "bus_of_nobody", "tune", "4", "--travel", "0"]);
    assert_eq!(refused.status, Some(2), "{}", refused.err);
    assert!(refused.err.contains("expected a travel from 0.1 to 10000 turns, got 0"), "{}", refused.err);
    // A turn is 360 degrees.
    for (travel, said) in [
        ("18deg", "expected a travel from 0.1 to 10000 turns, got 0.05"),
        ("3.6e6deg", ""),
        ("100counts", "expected an angle in turns or degrees"),
        ("far", "does not begin with a number"),
    ] {
        let refused = without_bus(&["--bus", "bus_of_nobody", "tune", "4", "--travel", travel]);
        assert!(refused.err.contains(said), "{travel}: {}", refused.err);
        assert_eq!(refused.status == Some(2), !said.is_empty(), "{travel}: {}", refused.err);
    }
}

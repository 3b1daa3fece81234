//! `group move` and `drive-base` on the embedded bus.

use std::path::PathBuf;

use processes::{done, fed, ferrodrive};
use serde_json::Value;

fn example(name: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "..", "examples", name].iter().collect();
    path.display().to_string()
}

#[track_caller]
fn refused(arguments: &[&str], status: i32, part: &str) {
    let ended = ferrodrive(arguments);
    assert_eq!(ended.status, Some(status), "{arguments:?}: {}", ended.err);
    assert!(ended.err.contains(part), "{arguments:?} should say {part:?}, but says: {}", ended.err);
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn axes_that_are_named_go_where_they_are_sent_in_the_time_that_is_given() {
    let moved = done(&["--json", "group", "move", "1=90deg", "4=0.5turn", "--within", "3s"]).json();
    assert_eq!(number(&moved["time_s"]), 3.0);
    assert_eq!(moved["missed_cycles"], 0);
    for (axis, (node, to)) in moved["axes"].as_array().unwrap().iter().zip([(1, 90.0), (4, 180.0)]) {
        assert_eq!((axis["node"].as_u64(), number(&axis["to_deg"])), (Some(node), to), "{axis}");
        assert!((number(&axis["at_deg"]) - to).abs() < 1.0, "{axis}");
        assert_eq!(number(&axis["limits"]["velocity_rpm"]), 30.0, "{axis}");
    }
}

/// The drawn path ends where it begins, after 3 s; at each of its points the axes are where it has them.
#[test]
fn a_recorded_path_is_followed_in_its_time_and_a_bad_one_is_refused_before_there_is_a_bus() {
    let (file, path) = (example("two_axes.toml"), example("two_axes.csv"));
    let followed = done(&["--json", "group", "follow", &file, &path, "--relative", "--hold", "500ms"]).json();
    assert_eq!((number(&followed["time_s"]), &followed["missed_cycles"]), (3.0, &serde_json::json!(0)));
    assert!(number(&followed["held_s"]) >= 0.5, "{followed}");
    let axes = followed["axes"].as_array().unwrap();
    assert_eq!(axes.len(), 2);
    for axis in axes {
        assert!((number(&axis["to_deg"]) - number(&axis["from_deg"])).abs() < 0.01, "{axis}");
        assert!((number(&axis["at_deg"]) - number(&axis["to_deg"])).abs() < 1.0, "{axis}");
    }
    refused(&["group", "follow", &file, &path, "--relative", "--group", "legs"], 1, "the machine file has: pair");
    refused(
        &["group", "follow", &file, &path, "--relative", "--acceleration", "6deg/s2"],
        1,
        "let the path take 16.94 s, 5.647 times as long",
    );
    refused(&["group", "follow", &file, &path, "--relative", "--approach"], 2, "cannot be used with");
    refused(&["group", "follow", &file, &path, "--hold"], 2, "--hold needs a time");
    refused(&["group", "follow", &file], 2, "expected the path to follow");
    refused(&["group", "follow", &path, &path], 2, "two paths");
    refused(&["group", "follow", &file, &file, &path], 2, "two machine files");
    refused(&["group", "follow", "path.txt"], 2, "expected a path, NAME.csv");
    refused(&["group", "follow", "/no/such/path.csv"], 1, "/no/such/path.csv cannot be followed");
}

#[test]
fn the_end_says_that_a_load_may_turn_a_shaft_whose_power_is_gone() {
    let said = done(&["group", "move", "1=2deg", "4=2deg", "--period", "4ms"]).out;
    assert!(said.contains("the drives are without power"), "{said}");
    assert!(said.contains("a load that pulls (an arm, a slope) moves a motor without power"), "{said}");
}

#[test]
fn the_limits_of_the_command_line_are_those_of_the_path() {
    let limits = ["--velocity", "360deg/s", "--acceleration", "1800deg/s2", "--rounding", "100ms"];
    let moved = done(&[&["--json", "group", "move", "4=1turn"], &limits[..]].concat()).json();
    // v = 1 turn/s, a = 5 turns/s^2, j = 50 turns/s^3: L/v + v/a + a/j.
    assert!((number(&moved["time_s"]) - 1.3).abs() < 1e-6, "{moved}");
}

#[test]
fn a_group_of_the_file_holds_the_axes_that_are_not_named_and_keeps_to_its_software_limits() {
    let file = example("two_axes.toml");
    let moved = done(&["--json", "group", "move", &file, "2=-45deg"]).json();
    let [joint, stepper] = &moved["axes"].as_array().unwrap()[..] else { panic!("{moved}") };
    assert!((number(&joint["at_deg"]) - number(&joint["from_deg"])).abs() < 0.5, "{joint}");
    assert!((number(&stepper["at_deg"]) + 45.0).abs() < 1.0, "{stepper}");
    assert_eq!(stepper["limits"]["range_deg"], serde_json::json!([-360.0, 360.0]));
    refused(&["group", "move", &file, "1=181deg"], 1, "outside its software limits of -180 to 180 deg");
    refused(&["group", "move", &file, "1=1deg", "--group", "legs"], 1, "the machine file has: pair");
    refused(&["group", "move", &file, "4=1deg"], 1, "node 4");
    refused(&["group", "move", &file, "1=90deg", "--within", "10ms"], 1, "give more time, or raise a limit");
}

/// A screw with a pitch of 5 mm: 20 mm are four turns.
#[test]
fn an_axis_with_a_feed_goes_to_a_length() {
    let folder = processes::scratch("group-feed");
    let drives = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\nunits = { feed_constant = '5mm' }\n[[drive]]\nmodel = 'm4230e17b50'\nnode = 1\n";
    let file = folder.write("screw.toml", drives);
    let moved = done(&["--json", "group", "move", &file, "2=20mm", "1=10deg", "--velocity", "240rpm"]).json();
    let at = |axis: usize| number(&moved["axes"][axis]["at_deg"]);
    assert!((at(0) - 4.0 * 360.0).abs() < 2.0 && (at(1) - 10.0).abs() < 1.0, "{moved}");
    refused(&["group", "move", &file, "1=20mm"], 1, "node 1");
}

/// M Robot Joint Motor CanOpen Manual, 5.10.3: an interpolation cycle each 2 ms. The ZLAC8030L is moved by speeds.
#[test]
fn a_period_in_which_a_joint_does_not_move_evenly_is_said() {
    const WARNING: &str = "node 1: it takes 2ms from one point to the next";
    let move_both = |options: &[&str]| done(&[&["group", "move", "1=2deg", "4=2deg"][..], options].concat()).err;
    for (options, uneven) in [(&[][..], true), (&["--period", "4ms"], true), (&["--period", "2ms"], false)] {
        let said = move_both(options);
        assert_eq!(said.contains(WARNING), uneven, "{options:?}: {said}");
        assert_eq!(said.contains("give --period 2ms"), uneven, "{options:?}: {said}");
        assert!(!said.contains("node 4: it takes"), "{options:?}: {said}");
    }
}

#[test]
fn what_is_no_group_move_is_refused() {
    refused(&["group", "move", "1=90deg", "1=0deg"], 2, "two positions for node 1");
    refused(&["group", "move", "90deg"], 2, "expected a machine file, FILE.toml, or NODE=POSITION");
    refused(&["group", "move", "4=NaN"], 2, "does not begin with a number");
    refused(&["group", "move", "4=30"], 2, "'30' has no unit: expected an angle, e.g. 30deg");
    refused(&["group", "move", "4=1turn", "--acceleration", "300ms"], 2, "expected a rate above 0");
    refused(&["group", "move", "4=1turn", "--velocity", "9000rpm"], 1, "the drive does 1000 r/min at most");
    refused(&["group", "move", "/no/such/file.toml", "4=1turn"], 1, "cannot use the machine file");
}

#[test]
fn a_base_goes_the_way_of_its_twist() {
    let file = example("base.toml");
    let driven = done(&["--json", "drive-base", &file, "--linear", "0.3", "--angular", "0.2", "--for", "3s"]).json();
    let pose = &driven["pose"];
    let heading = number(&pose["heading_deg"]);
    // Ramps up and down are alike, so that the way is speed times time: 0.6 rad on a circle of 1.5 m; whole r/min and cycles.
    assert!((heading - 0.6_f64.to_degrees()).abs() < 1.5, "{pose}");
    let (x, y) = (1.5 * 0.6_f64.sin(), 1.5 * (1.0 - 0.6_f64.cos()));
    assert!((number(&pose["x_m"]) - x).abs() < 0.02 && (number(&pose["y_m"]) - y).abs() < 0.02, "{pose}");
    assert_eq!(driven["dead_man_stops"], 0);
}

#[test]
fn what_is_no_drive_of_a_base_is_refused() {
    let file = example("base.toml");
    refused(&["drive-base"], 2, "expected a machine file with a [base]");
    refused(&["drive-base", &example("two_axes.toml")], 1, "the machine file has no [base]");
    let elsewhere = format!("sim:{}", example("two_axes.toml"));
    refused(&["--bus", &elsewhere, "drive-base", &file, "--linear", "0.1", "--for", "1s"], 2, "two machine files");
    refused(&["drive-base", &file, "--linear", "0.3"], 2, "--for");
    refused(&["drive-base", &file, "--linear", "nan", "--for", "1s"], 2, "expected a finite number");
    refused(&["drive-base", &file, "--for", "1s", "--dead-man", "1s"], 2, "cannot be used with");
    refused(&["drive-base", &file, "--dead-man", "0s"], 2, "the limit watchdog in seconds is 0");
}

#[test]
fn lines_of_twists_are_driven_one_after_the_other_and_bad_ones_are_told() {
    let file = example("base.toml");
    // Ten lines of 100 ms each; a line that is not a twist takes no time.
    let lines = format!("{}\nnan 0\nfast\n0.2\n1 2 3\n", "0.3 0\n".repeat(10));
    let driven = fed(&["--json", "drive-base", &file], &lines);
    assert_eq!(driven.status, Some(0), "{}", driven.err);
    let report = driven.json();
    assert!((number(&report["pose"]["x_m"]) - 0.3).abs() < 0.02, "{report}");
    assert_eq!(report["bad_lines"], 4);
    assert_eq!(driven.err, "");
    let said = fed(&["drive-base", &file], &lines).err;
    assert!(said.contains("expected a twist of two numbers, m/s and rad/s, e.g. 0.3 -0.1, got 'fast'"), "{said}");
}

#[test]
fn what_a_base_cannot_do_is_said_with_what_it_does_instead() {
    let driven = fed(&["drive-base", &example("base.toml")], "1e308 0\n1e308 0\n0.1 0\n");
    assert_eq!(driven.status, Some(0), "{}", driven.err);
    assert_eq!(driven.err.matches("are beyond the limits of the base: it is driven at").count(), 1, "{}", driven.err);
}

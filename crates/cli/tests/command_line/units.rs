//! Units of a machine file: commands in angles, speeds and ways of the output behind a gear.

use processes::{Scratch, done, ferrodrive, scratch};
use serde_json::Value;

/// A stepper of 4000 counts a turn (ZLIM42-C user manual V1.03, 2006h = 10) behind a gear of 4 and a spindle of 10 mm, and one
/// without.
const FILE: &str = "[[drive]]\nmodel = 'zlim42c'\nnode = 2\nunits = { gear_ratio = 4, feed_constant = '10mm' }\n\
                    [[drive]]\nmodel = 'zlac8030l'\nnode = 4\n";

fn bus(test: &str) -> (Scratch, String) {
    let folder = scratch(test);
    let file = folder.join("machine.toml");
    std::fs::write(&file, FILE).unwrap();
    let bus = format!("sim:{}", file.display());
    (folder, bus)
}

#[test]
fn a_way_is_moved_at_a_speed_along_it_and_reported_in_all_units() {
    let (_folder, bus) = bus("along");
    let command =
        ["--bus", &bus, "--json", "move", "2", "40mm", "--profile-velocity", "20mm/s", "--acceleration", "100mm/s2"];
    let moved = done(&command).json();
    // 4 turns of the spindle, 16 of the shaft.
    assert_eq!(moved["commanded"][0]["raw"], 64_000);
    assert_eq!(moved["position"], 64_000);
    // 2 turns of the spindle a second, 8 of the shaft: 480 r/min.
    assert_eq!(
        (&moved["commanded"][1]["raw"], moved["commanded"][1]["requested"].as_f64()),
        (&480.into(), Some(120.0))
    );
    assert!((moved["position_mm"].as_f64().unwrap() - 40.0).abs() < 1e-9, "{moved}");
    assert!((moved["angle_deg"].as_f64().unwrap() - 1440.0).abs() < 1e-6, "{moved}");
    assert_eq!((&moved["gear"]["ratio"], moved["gear"]["feed_constant_mm"].as_f64()), (&4.0.into(), Some(10.0)));
    // 40 mm at 20 mm/s take 2 s, and two ramps of 0.2 s.
    let took = moved["reached_after_s"].as_f64().unwrap();
    assert!((2.0..3.0).contains(&took), "{took}");

    let turned = done(&["--bus", &bus, "velocity", "2", "-5mm/s", "--for", "1s"]);
    assert!(turned.out.contains("-5.00 mm/s") && turned.out.contains("-30.000 r/min"), "{}", turned.out);
    let state = done(&["--bus", &bus, "state", "2"]);
    assert!(state.out.contains("gear ratio 4, feed constant 10 mm"), "{}", state.out);
}

#[test]
fn a_way_of_a_drive_that_moves_nothing_along_is_refused_with_what_to_write() {
    let (_folder, bus) = bus("no_feed");
    let ended = ferrodrive(&["--bus", &bus, "move", "4", "40mm"]);
    assert_eq!(ended.status, Some(1));
    assert!(ended.err.contains("node 4") && ended.err.contains("feed_constant = \"10mm\""), "{}", ended.err);
    let wrong = ferrodrive(&["--bus", &bus, "move", "2", "40mm/s"]);
    assert_eq!(wrong.status, Some(2), "{}", wrong.err);
}

/// What names an object is the drive's own, with or without units.
#[test]
fn objects_stay_the_drives_own() {
    let (_folder, bus) = bus("objects");
    let state = done(&["--bus", &bus, "state", "4"]);
    assert!(!state.out.contains("gear"), "{}", state.out);
    let read = done(&["--bus", &bus, "read", "2", "profile_velocity"]);
    let without = done(&["read", "2", "profile_velocity"]);
    assert_eq!(read.out, without.out);
}

/// The servo `cia402` behind a gear of 50 and a spindle of 10 mm, in a group, and two wheels behind gears of 10.
const MACHINE: &str = "[[drive]]\nmodel = 'cia402'\nnode = 1\nunits = { gear_ratio = 50, feed_constant = '10mm' }\n\
    [[drive]]\nmodel = 'zlac8030l'\nnode = 4\nunits = { gear_ratio = 10 }\n\
    [[drive]]\nmodel = 'zlac8030l'\nnode = 5\nunits = { gear_ratio = 10 }\n\
    [[group]]\nname = 'table'\nperiod = '5ms'\n[[group.axis]]\nnode = 1\nmode = 'csp'\nvelocity_deg_s = 60\n\
    acceleration_deg_s2 = 300\njerk_deg_s3 = 3000\nfollowing_error_deg = 5\n\
    [base]\nwheels = [4, 5]\nturns = [1, -1]\nmode = 'pv'\nwheel_base_m = 0.4\nwheel_radius_m = 0.1\nlinear_m_s = 0.1\n\
    angular_rad_s = 1\nwheel_m_s = 0.1\nwheel_m_s2 = 0.5\n";

/// What a scenario's lines say, each a read of a number: the numbers in their order.
fn read_by_scenario(folder: &Scratch, lines: &[&str]) -> Vec<i64> {
    let file = folder.join("scenario.toml");
    let lines: Vec<_> = lines.iter().map(|line| format!("{line:?}")).collect();
    std::fs::write(&file, format!("machine = 'machine.toml'\n[[host]]\ndo = [{}]\n", lines.join(", "))).unwrap();
    let report = done(&["run", file.to_str().unwrap(), "--json"]).json();
    let rows = report["rows"].as_array().expect("rows").iter();
    let number = |row: &Value| row["seen"].as_str()?.split(' ').next()?.parse().ok();
    rows.filter(|row| row["asked"].as_str().is_some_and(|asked| asked.contains(" read "))).filter_map(number).collect()
}

/// The same file, the same intent, the same counts: by a command of its own, as a group, and from a scenario.
#[test]
fn one_file_and_one_intent_are_the_same_counts_by_every_door() {
    let folder = scratch("doors");
    let file = folder.join("machine.toml");
    std::fs::write(&file, MACHINE).unwrap();
    let file = file.to_str().unwrap();
    let bus = format!("sim:{file}");
    // 131072 counts a turn of the shaft, 50 of which are one of the output: the hundredth part of a turn.
    let state = done(&["--bus", &bus, "--json", "state", "1"]).json();
    let counts_per_turn = 131_072.0 * 50.0;
    let expected = (3.6 / 360.0 * counts_per_turn) as i64;
    let near = |door: &str, counts: i64| assert!((counts - expected).abs() <= 20, "{door}: {counts}, not {expected}");
    assert_eq!(state["gear"]["ratio"], 50.0, "{state}");

    let target = |words: &[&str]| {
        let command: Vec<_> = ["--bus", &bus, "--json"].iter().chain(words).copied().collect();
        done(&command).json()["commanded"][0]["raw"].as_i64().expect("counts")
    };
    near("move, an angle", target(&["move", "1", "3.6deg"]));
    near("move, a way", target(&["move", "1", "0.1mm"]));
    let read = ["1 move 3.6deg at 6rpm", "1 read target_position", "1 read position_actual_value"];
    read_by_scenario(&folder, &read).into_iter().for_each(|counts| near("run, an angle", counts));
    let read = ["1 move by 0.1mm at 1mm/s acceleration 20mm/s2", "1 read target_position", "1 read profile_velocity"];
    let by_way = read_by_scenario(&folder, &read);
    near("run, a way", by_way[0]);
    // 1 mm/s is a tenth of a turn a second of the output.
    assert!((by_way[1] - (0.1 * counts_per_turn) as i64).abs() <= 20, "{by_way:?}");
    let speed = target(&["velocity", "1", "6rpm", "--for", "100ms"]);
    let read = ["1 velocity 6rpm", "1 read target_velocity", "1 stop"];
    assert_eq!(read_by_scenario(&folder, &read), [speed]);

    let log = folder.join("frames.log");
    let log = log.to_str().unwrap();
    done(&["--log", log, "group", "move", file, "1=3.6deg"]);
    near("group", set_points(log, "201").last().copied().expect("set-points"));
    // 0.1 m/s are 9.549 r/min of a wheel of 0.1 m, and ten times that of its shaft, in whole r/min; the right one turns the other way.
    done(&["--log", log, "drive-base", file, "--linear", "0.1", "--for", "1s"]);
    assert_eq!(
        (set_points(log, "204").into_iter().max(), set_points(log, "205").into_iter().min()),
        (Some(95), Some(-95))
    );
}

/// What the RPDO of this COB-ID carries behind a controlword, in each of its frames in a log.
fn set_points(log: &str, cob_id: &str) -> Vec<i64> {
    let text = std::fs::read_to_string(log).unwrap();
    let frames = text.lines().filter_map(|line| line.split(' ').nth(2)?.strip_prefix(cob_id)?.strip_prefix('#'));
    let number = |data: &str| data.get(4..12).and_then(|hex| u32::from_str_radix(hex, 16).ok());
    frames.filter_map(number).map(|raw| i64::from(raw.swap_bytes() as i32)).collect()
}

//! Units of a machine file: commands in angles, speeds and ways of the output behind a gear.

use processes::{Scratch, done, ferrodrive, scratch};

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
fn a_way_is_moved_at_a_speed_along_it_and_told_in_all_units() {
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

//! `check`: groups and bases of a machine file, held against what their drives do.

use std::path::Path;

use machine::check::{Finding, Place, Severity, of_machine};

/// The ZLAC8030L does 1000 r/min (60FFh, object table of its manual), or what 6080h is set to.
#[test]
fn what_a_group_states_and_its_drives_do_not_do_or_do_not_know_is_said() {
    let text = |limits: &str, units: &str, axis: &str, more: &str| {
        format!(
            "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n{limits}{units}[[group]]\nname = \"arm\"\nperiod = \"10ms\"\n[[group.axis]]\n\
             node = 4\n{axis}acceleration_deg_s2 = 600\njerk_deg_s3 = 6000\nfollowing_error_deg = 20\n{more}"
        )
    };
    let by_rule = |text: &str, rule: &str| -> Vec<Finding> {
        let all = of_machine(text, Path::new("")).unwrap_or_else(|bad| panic!("{text}{bad}")).findings;
        all.into_iter().filter(|finding| finding.rule == rule).collect()
    };
    let found = |text: &str| by_rule(text, "group-limits");
    assert_eq!(found(&text("", "", "velocity_deg_s = 6000\n", "")), []);
    // Its modes are those for profiles: position, velocity, torque.
    for (mode, missing) in [("csp", true), ("pv", false)] {
        let said = by_rule(&text("", "", &format!("mode = \"{mode}\"\nvelocity_deg_s = 60\n"), ""), "group-mode");
        assert_eq!(said.len(), usize::from(missing), "{said:?}");
        assert!(
            said.iter().all(|said| said.severity == Severity::Error && said.next.contains("profile velocity")),
            "{said:?}"
        );
    }
    // 6001 deg/s are 1000.17 r/min; behind a gear of 10 the output does a tenth.
    for (units, speed, most) in
        [("", "6001", "6000 deg/s (1000 r/min)"), ("units = { gear_ratio = 10 }\n", "601", "600 deg/s (100 r/min)")]
    {
        let said = found(&text("", units, &format!("velocity_deg_s = {speed}\n"), ""));
        assert_eq!((said.len(), said[0].severity, said[0].node), (1, Severity::Warning, Some(4)), "{said:?}");
        assert!(said[0].what.contains(most) && said[0].next.contains("lower its `velocity_deg_s`"), "{said:?}");
    }
    // "M Robot Joint Motor CanOpen Manual", Parameters: the motor of the M8025 does 1500 r/min, and 60FFh takes 3000.
    for (speed, is_said) in [("9000", false), ("9006", true)] {
        let joint = text("", "", &format!("velocity_deg_s = {speed}\n"), "").replace("zlac8030l", "m8025e25b50");
        let said = found(&joint);
        assert_eq!(said.len(), usize::from(is_said), "{said:?}");
        assert!(
            said.iter().all(|said| said.what.contains("(1500 r/min) at most by the highest speed of its motor")),
            "{said:?}"
        );
    }
    let range = "range_deg = [-90, 45.5]\nvelocity_deg_s = 60\n";
    let said = found(&text("", "", range, ""));
    assert_eq!((said.len(), said[0].severity), (1, Severity::Note), "{said:?}");
    assert!(
        said[0].what.contains("`range_deg = [-90, 45.5]` binds the group 'arm' alone: `ferrodrive move 4`"),
        "{said:?}"
    );
    let other = "[[group]]\nname = \"two\"\n[[group.axis]]\nnode = 4\nvelocity_deg_s = 61\nacceleration_deg_s2 = 600\njerk_deg_s3 = 6000\n\
                 following_error_deg = 20\n";
    let said = found(&text("", "", "velocity_deg_s = 60\n", other));
    assert_eq!((said.len(), said[0].at.line), (1, 13), "{said:?}");
    assert!(said[0].what.contains("the groups 'arm' and 'two' state other limits"), "{said:?}");
}

#[test]
fn wheels_of_an_unlikely_size_are_named_where_the_file_says_it() {
    // Lines 1 to 6 are the drives.
    let drives = "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n[[drive]]\nmodel = \"zlac8030l\"\nnode = 5\n";
    let body =
        "[[body]]\nname = \"b\"\nkind = \"differential-drive\"\ndrives = [4, 5]\nmass_kg = 30\nwheel_base_m = 0.5\n";
    let base = "[base]\nwheels = [4, 5]\nturns = [1, -1]\nwheel_base_m = 0.5\nlinear_m_s = 0.5\nangular_rad_s = 1\n\
                wheel_m_s = 0.9\nwheel_m_s2 = 0.7\n";
    for (table, line, radius, named) in [
        (body, 13, "86.5", true),
        (body, 13, "2.1", true),
        (body, 13, "0.004", true),
        (body, 13, "0.0865", false),
        (body, 13, "2", false),
        (base, 15, "84", true),
        (base, 15, "0.084", false),
    ] {
        let text = format!("{drives}{table}wheel_radius_m = {radius}\n");
        let checked = of_machine(&text, std::path::Path::new(".")).unwrap_or_else(|bad| panic!("{text}{bad}"));
        let found: Vec<_> = checked.findings.iter().filter(|finding| finding.rule == "wheel-radius").collect();
        assert_eq!(!found.is_empty(), named, "{text}: {found:?}");
        for finding in found {
            assert_eq!(
                (finding.severity, finding.at, finding.node),
                (Severity::Note, Place { line, column: 18 }, None)
            );
            assert!(finding.what.contains(&format!("{radius} m")) && finding.next.contains("86.5 mm"), "{finding:?}");
        }
    }
}

/// "M Robot Joint Motor CanOpen Manual", Parameters: "rate 1 M", and no object for another; 200Eh of the ZLAC8030L and 2009h of the ZLIM42-C
/// choose one.
#[test]
fn a_joint_is_not_on_a_bus_of_another_bit_rate() {
    let found = |rate: &str| -> Vec<(Severity, Option<u8>)> {
        let drives = [("zlac8030l", 4), ("m4230e17b50", 1), ("zlim42c", 2), ("cia402", 5)];
        let drives = drives.map(|(model, node)| format!("[[drive]]\nmodel = '{model}'\nnode = {node}\n")).concat();
        let all = of_machine(&format!("{rate}{drives}"), Path::new("")).expect("it is read").findings;
        let found = all.into_iter().filter(|finding| finding.rule == "bitrate");
        found.map(|finding| (finding.severity, finding.node)).collect()
    };
    assert_eq!(found("bitrate = '1M'\n"), []);
    for rate in ["bitrate = '500k'\n", ""] {
        assert_eq!(found(rate), [(Severity::Warning, Some(1))]);
    }
}

/// 60FFh of the ZLAC8030L: -1000 to 1000 r/min, in whole r/min by 202Fh:05 as delivered (object table of its manual). A wheel of 84 mm
/// goes 2 pi 0.084 / 60 = 0.0088 m/s at 1 r/min.
#[test]
fn a_base_is_held_against_its_drives_and_against_the_body_that_they_move() {
    let text = |wheel_m_s: &str, start_up: &str, body: &str| {
        format!(
            "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n{start_up}[[drive]]\nmodel = \"zlac8030l\"\nnode = 5\n{start_up}{body}[base]\n\
             wheels = [4, 5]\nturns = [1, -1]\nwheel_base_m = 0.5\nwheel_radius_m = 0.084\nlinear_m_s = 0.5\nangular_rad_s = 1\n\
             wheel_m_s = {wheel_m_s}\nwheel_m_s2 = 0.7\n"
        )
    };
    let found = |text: &str, rule: &str| -> Vec<Finding> {
        let all = of_machine(text, Path::new("")).unwrap_or_else(|bad| panic!("{text}{bad}")).findings;
        all.into_iter().filter(|finding| finding.rule == rule).collect()
    };
    let fast = found(&text("9", "", ""), "base-limits");
    assert_eq!(
        fast.iter().map(|one| (one.severity, one.node)).collect::<Vec<_>>(),
        [4, 5].map(|node| (Severity::Warning, Some(node)))
    );
    assert!(fast[0].what.contains("1000 r/min (8.796") && fast[0].next.contains("`wheel_m_s` to 8.796"), "{fast:?}");
    assert_eq!(found(&text("8.79", "", ""), "base-limits"), []);

    let finer = "start_up = { '202F:05' = 10 }\n";
    let coarse = found(&text("0.9", "", ""), "base-steps");
    assert_eq!(
        coarse.iter().map(|one| (one.severity, one.node)).collect::<Vec<_>>(),
        [4, 5].map(|node| (Severity::Note, Some(node)))
    );
    assert!(
        coarse[0].what.contains("0.004398")
            && coarse[0].what.contains("0.01759")
            && coarse[0].next.contains("write 10 to 202Fh:05"),
        "{coarse:?}"
    );
    assert_eq!(found(&text("0.9", finer, ""), "base-steps"), []);

    let body = |drives: &str, radius: &str, turns: &str| {
        format!(
            "[[body]]\nname = \"cart\"\nkind = \"differential-drive\"\ndrives = {drives}\nturns = {turns}\nmass_kg = 30\nwheel_base_m = 0.5\n\
             wheel_radius_m = {radius}\n"
        )
    };
    let said =
        |drives: &str, radius: &str, turns: &str| found(&text("0.9", "", &body(drives, radius, turns)), "base-body");
    assert_eq!(said("[4, 5]", "0.084", "[1, -1]"), []);
    for (drives, radius, turns, part) in [
        ("[4, 5]", "0.085", "[1, -1]", "`wheel_radius_m` is 0.084 in [base] and 0.085 in the body 'cart'"),
        ("[5, 4]", "0.084", "[-1, 1]", "the left wheel of [base] is the right one of the body 'cart'"),
        ("[4, 5]", "0.084", "[1, 1]", "a wheel that is to go 1 m goes -1 m"),
    ] {
        let all = said(drives, radius, turns);
        assert!(all.len() == 1 && all[0].severity == Severity::Warning && all[0].what.contains(part), "{all:?}");
    }
}

/// "M Robot Joint Motor CanOpen Manual", Parameters: the M8025E25B50 gives 51 N·m and 127 N·m for moments, the M4230E17B80 has a gear
/// of 80.
#[test]
fn an_arm_that_is_too_heavy_and_a_gear_that_is_another_are_said() {
    let arm = |payload_kg: f64, range: &str| {
        let joint =
            |node: u8| format!("[[drive]]\nmodel = 'm8025e25b50'\nnode = {node}\nunits = {{ gear_ratio = 50 }}\n");
        format!(
            "bitrate = '1M'\n{}{}[[body]]\nname = 'arm'\nkind = 'arm'\ndrives = [1, 2]\ntool_m = [0.2, 0, 0]\npayload_kg = {payload_kg}\n\
             gravity_m_s2 = [0, 0, -9.81]\n[[body.link]]\noffset_m = [0, 0, 0.2]\naxis = [0, -1, 0]\nmass_kg = 1.5\ncenter_m = [0.15, 0, 0]\n\
             first_deg = 90\n[[body.link]]\noffset_m = [0.3, 0, 0]\naxis = [0, -1, 0]\nmass_kg = 0.5\ncenter_m = [0.1, 0, 0]\nfirst_deg = -90\n{range}",
            joint(1),
            joint(2),
        )
    };
    let said = |text: &str, rule: &str| -> Vec<Finding> {
        let all = of_machine(text, Path::new("")).unwrap_or_else(|bad| panic!("{text}{bad}")).findings;
        all.into_iter().filter(|finding| finding.rule == rule).collect()
    };
    // Both links level: (1.5 kg 0.15 m + 0.5 kg 0.4 m + payload 0.5 m) 9.81 m/s² = 51 N·m with 9.55 kg.
    assert_eq!(said(&arm(9.5, ""), "arm-load"), []);
    let heavy = said(&arm(9.6, ""), "arm-load");
    assert_eq!((heavy.len(), heavy[0].node, heavy[0].severity), (1, Some(1), Severity::Warning), "{heavy:?}");
    assert!(heavy[0].what.contains("up to 51.3 N·m") && heavy[0].what.contains("51 N·m all the time"), "{heavy:?}");
    assert!(heavy[0].what.contains("gets too hot"), "{heavy:?}");
    // 127 N·m with 25.04 kg; the second joint has 49.6 N·m of it.
    for (payload_kg, holds) in [(25.0, true), (25.1, false)] {
        let heavy = said(&arm(payload_kg, ""), "arm-load");
        assert_eq!(heavy.len(), 1, "{heavy:?}");
        assert_eq!(heavy[0].what.contains("cannot hold"), !holds, "{heavy:?}");
    }
    // A group that keeps the upper arm within 30 degrees of upright: 35.3 N·m.
    let range = "[[group]]\nname = 'g'\nperiod = '4ms'\n[[group.axis]]\nnode = 1\nrange_deg = [-30, 30]\nvelocity_deg_s = 60\n\
                 acceleration_deg_s2 = 600\njerk_deg_s3 = 6000\nfollowing_error_deg = 20\n";
    assert_eq!(said(&arm(9.6, range), "arm-load"), []);

    assert_eq!(said(&arm(1.0, range), "gear-ratio"), []);
    let other = said(&arm(1.0, range).replacen("m8025e25b50", "m4230e17b80", 1), "gear-ratio");
    assert_eq!((other.len(), other[0].node, other[0].severity), (1, Some(1), Severity::Warning), "{other:?}");
    assert!(other[0].what.contains("`gear_ratio` is 50") && other[0].what.contains("56.25 deg"), "{other:?}");
    assert!(other[0].next.contains("gear_ratio = 80"), "{other:?}");
    let without = arm(1.0, range).replacen("units = { gear_ratio = 50 }\n", "", 1);
    let motor = said(&without, "gear-ratio");
    assert_eq!((motor.len(), motor[0].severity), (1, Severity::Note), "{motor:?}");
    assert!(motor[0].what.contains("those of its motor"), "{motor:?}");
}

//! Cycles of a group: `plan`, `check` and `group` say the same of the same file, before anything moves.

use processes::{Ended, Scratch, ferrodrive, scratch};

/// Six joints at 1 Mbit/s in a group with this period. Without SDO and EMCY a cycle has SYNC (55 bits), six set-points of 4 bytes (95) and
/// six answers of 6 bytes (115), the heartbeats of 0.2 s beside: 1315 us and more.
fn arm(folder: &Scratch, period: &str) -> String {
    let drive = |node: u8| {
        let model = if node < 4 { "m8025e25b50" } else { "m4230e17b50" };
        format!("[[drive]]\nmodel = '{model}'\nnode = {node}\nheartbeat = '200ms'\n")
    };
    let axis = |node: u8| {
        format!(
            "[[group.axis]]\nnode = {node}\nmode = 'ip'\nrange_deg = [-170, 170]\nvelocity_deg_s = 60\nacceleration_deg_s2 = 120\n\
             jerk_deg_s3 = 1200\nfollowing_error_deg = 5\n"
        )
    };
    let (drives, axes): (String, String) = ((1..=6).map(drive).collect(), (1..=6).map(axis).collect());
    let file = folder.join(format!("arm_{period}.toml"));
    let text = format!("bitrate = '1M'\n{drives}[[group]]\nname = 'arm'\nperiod = '{period}'\n{axes}");
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

fn next_of(ended: &Ended) -> String {
    ended.json()["error"]["next"].to_string()
}

#[test]
fn plan_check_and_group_say_the_same_of_a_cycle() {
    let folder = scratch("cycles");
    for (period, fits) in [("1ms", false), ("1200us", false), ("1500us", true), ("2ms", true), ("5ms", true)] {
        let file = arm(&folder, period);
        let status = Some(i32::from(!fits));
        let plan = ferrodrive(&["--json", "plan", &file]);
        assert_eq!(plan.status, status, "{period}: {}", plan.out);
        let check = ferrodrive(&["--json", "check", &file]);
        assert_eq!(check.status, status, "{period}: {}", check.out);
        let log = folder.join("frames.log");
        let moved =
            ferrodrive(&["--json", "--log", log.to_str().unwrap(), "group", "move", &file, "1=2deg", "6=-2deg"]);
        assert_eq!(moved.status, status, "{period}: {}", moved.out);
        let plan = plan.json();
        let load = plan["cycle_load"].as_f64().unwrap();
        assert_eq!(load < 1.0, fits, "{period}: {plan}");
        // Where a third of the time is left, everything has a bound, SDO and EMCY beside.
        let bounded = plan["frames"].as_array().unwrap().iter().all(|row| row["worst_us"].is_number());
        assert!(bounded || load > 0.67, "{period}: {plan}");
        // M Robot Joint Motor CanOpen Manual, 5.04: a joint has no 1014h, and sends no EMCY.
        assert!(plan["frames"].as_array().unwrap().iter().all(|row| row["frame"] != "EMCY"), "{period}: {plan}");
        let beats = plan["frames"].as_array().unwrap().iter().find(|row| row["frame"] == "heartbeat").unwrap();
        assert_eq!((beats["every_us"].as_f64(), &plan["moved"]), (Some(200_000.0), &"group 'arm'".into()));
        if fits {
            assert_ne!(
                ferrodrive(&["--json", "boot", &file, "--reset"]).json()["error"]["kind"],
                "bus_load",
                "{period}"
            );
            continue;
        }
        // The cause, the period that fits and nothing that only a programmer knows; and nothing was written or moved.
        let check = check.json();
        let mut findings = check["findings"].as_array().unwrap().iter();
        let finding = findings.find(|finding| finding["rule"] == "cycle-load").unwrap();
        assert!(finding["what"].as_str().unwrap().contains("does not fit the bus"), "{finding}");
        assert!(finding["next"].as_str().unwrap().contains("1.5 ms"), "{finding}");
        assert_eq!(moved.json()["error"]["kind"], "bus_load");
        assert!(next_of(&moved).contains("1.5 ms") && !moved.out.contains("::"), "{}", moved.out);
        // A boot-up of the machine is refused for the same reason.
        for command in [&["boot", &file][..], &["boot", &file, "--reset"], &["supervise", &file, "--for", "1s"]] {
            let booted = ferrodrive(&[&["--json", "--log", log.to_str().unwrap()], command].concat());
            let error = &booted.json()["error"];
            assert_eq!((booted.status, &error["kind"]), (Some(1), &"bus_load".into()), "{command:?}: {}", booted.out);
            let what = error["message"].as_str().unwrap();
            assert!(what.contains("group 'arm': a cycle of 1") && what.contains("does not fit the bus"), "{what}");
            assert!(next_of(&booted).contains("1.5 ms"), "{}", booted.out);
        }
        let log = std::fs::read_to_string(&log).unwrap();
        let data = |line: &str| line.split(' ').nth(2).map(str::to_owned).unwrap_or_default();
        let writes = |frame: &str| frame.starts_with('6') && frame.as_bytes().get(4) == Some(&b'2');
        let written: Vec<_> =
            log.lines().map(data).filter(|frame| frame.starts_with("000#") || writes(frame)).collect();
        assert!(!log.is_empty() && written.is_empty(), "{written:?}");
    }
}

#[test]
fn a_group_is_spoken_of_in_degrees() {
    let folder = scratch("degrees");
    let file = arm(&folder, "5ms");
    for words in [&["1=30"][..], &["1=-3000"], &["1=30deg", "--following-error", "5"]] {
        let ended = ferrodrive(&[&["group", "move", &file], words].concat());
        assert_eq!(ended.status, Some(2), "{words:?}: {}", ended.out);
        for said in ["has no unit", "deg", "turn", "counts"] {
            assert!(ended.err.contains(said), "{words:?}: {}", ended.err);
        }
    }
    let counts = ferrodrive(&["--json", "group", "move", &file, "1=100counts"]);
    assert_eq!(counts.status, Some(0), "{}", counts.out);
    let beyond = ferrodrive(&["group", "move", &file, "1=200deg"]);
    assert_eq!(beyond.status, Some(1));
    assert!(beyond.err.contains("at 200 deg") && beyond.err.contains("-170 to 170 deg"), "{}", beyond.err);
}

/// Joints are operational by themselves and left so: their heartbeats are not written, which is not a success.
#[test]
fn a_boot_up_that_leaves_the_configuration_of_the_file_unwritten_does_not_end_with_0() {
    let folder = scratch("unconfigured");
    let file = arm(&folder, "5ms");
    for command in [&["boot", &file][..], &["supervise", &file, "--for", "1s"]] {
        let ended = ferrodrive(&[&["--json"], command].concat());
        let node = &ended.json()["nodes"][0];
        let said = (ended.status, &node["letter"], &node["unconfigured"][0]);
        assert_eq!(said, (Some(1), &"L".into(), &"1017h:00".into()));
        let text = ferrodrive(command).out;
        assert!(text.contains("not configured: 1017h:00") && text.contains("--reset"), "{text}");
    }
    let reset = ferrodrive(&["--json", "boot", &file, "--reset"]);
    assert_eq!((reset.status, &reset.json()["ok"]), (Some(0), &true.into()), "{}", reset.out);
    let check = ferrodrive(&["--json", "check", &file]).json();
    let findings = check["findings"].as_array().unwrap().iter();
    let warned = findings.filter(|finding| finding["what"].as_str().unwrap().contains("are not written"));
    assert_eq!(warned.count(), 6, "{check}");
}

//! Logs: written by a command, converted, read back, replayed.

use std::path::Path;

use processes::{done, fed, ferrodrive, scratch};
use serde_json::Value;

/// The extensions of what can be written.
const WRITTEN: [&str; 4] = ["log", "asc", "blf", "pcapng"];

/// The frames of a log as `decode` prints them, with their direction.
fn frames(log: &Path) -> Vec<(String, Option<bool>)> {
    let ended = done(&["--json", "decode", log.to_str().unwrap()]);
    let lines = ended.out.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    lines.map(|line| (line["frame"].as_str().expect("a frame").to_owned(), line["sent"].as_bool())).collect()
}

/// A program whose files take no more than a few kilobytes, as on a disk that is full then.
#[cfg(unix)]
fn on_a_full_disk(input: &str, arguments: &str) -> processes::Ended {
    let program = processes::program();
    let limited = format!("trap '' XFSZ; ulimit -f 2; printf '{input}' | {program} {arguments}");
    let ended = std::process::Command::new("sh").args(["-c", &limited]).env_remove("FERRODRIVE_BUS").output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    processes::Ended { status: ended.status.code(), out: text(ended.stdout), err: text(ended.stderr) }
}

#[test]
fn a_command_logs_what_it_sends_and_hears_in_every_form() {
    let directory = scratch("logs");
    let mut logs = Vec::new();
    for extension in WRITTEN {
        let log = directory.join(format!("read.{extension}"));
        done(&["read", "4", "1018:01", "--log", log.to_str().unwrap()]);
        let frames = frames(&log);
        // CiA 301, 7.2.4.3: the request, and the answer of the one vendor-ID.
        let asked = frames.iter().position(|(frame, sent)| frame == "604#4018100100000000" && *sent == Some(true));
        let said = frames.iter().position(|(frame, sent)| frame.starts_with("584#43181001") && *sent == Some(false));
        assert!(asked.is_some() && asked < said, "{extension}: {frames:?}");
        logs.push(frames);
    }
    assert!(logs.iter().all(|log| *log == logs[0]), "the same command is the same log in every form");
}

#[test]
fn a_log_goes_through_every_form_and_comes_out_as_it_was() {
    let directory = scratch("convert");
    let path = |name: &str| directory.join(name).to_str().unwrap().to_owned();
    let first = path("first.log");
    let lines = "(1700000000.123456) can0 604#4041600000000000 T\n(1700000000.123999) can1 18EBFF00#0102 R\n\
                 (1700000001.000000) can0 184#R4 R\n(1700000002.500000) can0 080# T\n";
    std::fs::write(&first, lines).unwrap();
    let mut from = first;
    for (step, extension) in ["asc", "blf", "pcapng", "log"].iter().enumerate() {
        let to = path(&format!("{step}.{extension}"));
        let report = done(&["--json", "convert", &from, &to]).json();
        assert_eq!((&report["frames"], &report["passed_over"]), (&4.into(), &0.into()), "{report}");
        from = to;
    }
    assert_eq!(std::fs::read_to_string(&from).unwrap(), lines);
    // Without an extension nothing else shows the form.
    let bare = path("bare");
    assert!(done(&["convert", &from, &bare]).out.contains(&format!("written as {bare} (candump)")));

    let same = ferrodrive(&["convert", &from, &from]);
    assert_eq!(same.status, Some(2), "{}", same.err);
    let trc = ferrodrive(&["convert", &from, &path("out.trc")]);
    assert!(trc.status == Some(2) && trc.err.contains("TRC file is only read"), "{}", trc.err);
    std::fs::write(path("letter.blf"), "Dear Sir").unwrap();
    let letter = ferrodrive(&["convert", &from, &path("letter.blf")]);
    assert!(
        letter.status == Some(1) && letter.err.contains("it exists and is not a log of the format BLF"),
        "{}",
        letter.err
    );
}

#[test]
fn a_log_that_is_torn_is_told_and_read_as_far_as_it_goes() {
    let directory = scratch("torn_logs");
    for (extension, what) in [("asc", "passed over"), ("blf", "ends within"), ("pcapng", "ends within")] {
        let log = directory.join(format!("whole.{extension}"));
        done(&["read", "4", "1018:01", "--log", log.to_str().unwrap()]);
        let bytes = std::fs::read(&log).unwrap();
        let torn = directory.join(format!("torn.{extension}"));
        // In the middle of the last frame, container or line, behind the foot of an ASC file.
        let cut = if extension == "asc" { b"End TriggerBlock\n".len() + 5 } else { 9 };
        std::fs::write(&torn, &bytes[..bytes.len() - cut]).unwrap();
        let shown = ferrodrive(&["decode", torn.to_str().unwrap()]);
        assert!(shown.err.contains(what), "{extension}: {}{}", shown.out, shown.err);
        let none = directory.join(format!("none.{extension}"));
        std::fs::write(&none, "this is not a log\n").unwrap();
        let shown = ferrodrive(&["decode", none.to_str().unwrap()]);
        assert_eq!(shown.status, Some(1), "{extension}: {}", shown.out);
        assert!(shown.err.contains("no frame"), "{extension}: {}", shown.err);
    }
    let missing = ferrodrive(&["decode", "/no/such/trace.blf"]);
    assert!(
        missing.status == Some(1) && missing.err.contains("cannot open the log /no/such/trace.blf"),
        "{}",
        missing.err
    );
}

#[test]
fn a_replay_says_what_may_move_a_drive_before_it_sends_anything() {
    let directory = scratch("replay");
    let log = directory.join("trace.log");
    // A read, a controlword, an NMT start, a heartbeat of a node.
    let lines = "(1.0) can0 604#4041600000000000 T\n(1.1) can0 604#2B40600006000000 T\n(1.2) can0 000#0104 T\n\
                 (1.3) can0 704#05 R\n";
    std::fs::write(&log, lines).unwrap();
    let log = log.to_str().unwrap();
    let refused = ferrodrive(&["replay", log]);
    assert_eq!(refused.status, Some(1));
    for part in ["2 frames of", "1 x a controlword", "1 x NMT start", "604#2B40600006000000", "--allow-motion"] {
        assert!(refused.err.contains(part), "{part}: {}", refused.err);
    }
    let count = |arguments: &[&str], field: &str| {
        done(&[&["--json", "replay", log], arguments].concat()).json()[field].as_u64().expect("a number")
    };
    assert_eq!((count(&["--skip-motion"], "sent"), count(&["--skip-motion"], "motion_skipped")), (2, 2));
    assert_eq!(count(&["--only", "received"], "sent"), 1, "what is not chosen needs no leave");
    assert_eq!(count(&["--only", "604", "--skip-motion"], "not_chosen"), 2);
    assert_eq!(count(&["--allow-motion", "--only", "sent"], "motion_sent"), 2);
    // Node 4 is on this bus, and answers the read itself.
    let twice = done(&["replay", log, "--skip-motion"]).out;
    assert!(twice.contains("in the name of nodes that are on the bus themselves (4)"), "{twice}");
    let sent =
        |only: &str| done(&["--json", "replay", log, "--skip-motion", "--only", only]).json()["sent_for"].clone();
    assert_eq!(sent("604,704"), serde_json::json!([4]));
    assert_eq!(sent("master"), serde_json::json!([]));
}

#[test]
#[cfg(unix)]
fn a_log_that_the_disk_has_no_room_for_is_a_failure_of_the_command() {
    let folder = scratch("full-disk");
    let log = folder.join("scan.log");
    let ended = on_a_full_disk("", &format!("--log {} --bus sim scan", log.display()));
    assert_eq!(ended.status, Some(1), "{}", ended.err);
    // What was asked for was done, and is shown.
    assert!(ended.out.contains("zlac8030l") && ended.err.contains("is not complete"), "{}{}", ended.out, ended.err);
    for name in ["--log run.log", "--record run.csv"] {
        let (option, name) = name.split_once(' ').unwrap();
        let file = folder.join(name);
        let drive = "--drive m4230e17b50@1 --clock manual --serve socketcand://127.0.0.1:0";
        let options = format!("sim {drive} {option} {}", file.display());
        // Its heartbeat is sent each second (M joint manual, 5.11.1).
        let ended = on_a_full_disk("run 900s\\nquit\\n", &options);
        assert!(ended.status == Some(1) && ended.err.contains("is not complete"), "{option}: {}", ended.err);
    }
}

#[test]
fn a_log_is_read_from_standard_input() {
    for arguments in [&["decode", "-"][..], &["--bus", "log:-", "dump"]] {
        let ended = fed(arguments, "(1.5) can0 704#00\n(2.5) can0 704#05");
        assert_eq!(ended.status, Some(0), "{arguments:?}: {}", ended.err);
        let out = ended.out;
        assert_eq!(out.lines().count(), 2, "{out}");
        assert!(out.contains("boot-up node 4") && out.contains("heartbeat node 4: operational"), "{out}");
    }
}

/// What the same lines on standard input write where time is moved by hand, in bytes.
fn by_hand(folder: &Path, number: usize, record: &str) -> [Vec<u8>; 2] {
    let [log, record] = ["run.log", record].map(|name| folder.join(format!("{number}-{name}")));
    let drives = ["--drive", "zlac8030l@4", "--drive", "m4230e17b50@1", "--clock", "manual"];
    let files = ["--log", log.to_str().unwrap(), "--record", record.to_str().unwrap()];
    let lines = "run 2s\n4 load torque 0.5\n1 load torque 1\nrun 1s\n4 fault hall on\nrun 1500us\n4 fault hall off\nrun 1s\nquit\n";
    let ended = fed(&[&["sim"], &drives[..], &files].concat(), lines);
    assert_eq!(ended.status, Some(0), "{}", ended.err);
    [log, record].map(|path| std::fs::read(path).unwrap())
}

#[test]
fn moved_by_hand_a_simulator_writes_the_same_log_and_record_to_the_byte() {
    let folder = scratch("by-hand");
    for record in ["run.csv", "run.mcap"] {
        let first = by_hand(&folder, 0, record);
        let log = String::from_utf8_lossy(&first[0]);
        assert!(log.starts_with("(0000000000.") && log.lines().count() > 3, "{log}");
        for number in 1..4 {
            assert!(by_hand(&folder, number, record) == first, "{record}, run {number}");
        }
    }
}

#[test]
fn a_record_becomes_one_of_the_other_form_and_back() {
    let directory = scratch("convert-record");
    let path = |name: &str| directory.join(name).to_str().unwrap().to_owned();
    let (csv, mcap, back) = (path("run.csv"), path("run.mcap"), path("back.csv"));
    std::fs::write(&csv, "t_s,4.velocity_rpm,5.current_a,mark\n0,60,,\n0.001,,1.5,\n0.0025,61.25,,enabled\n").unwrap();
    done(&["convert", &csv, &mcap]);
    let report = done(&["--json", "convert", &mcap, &back]).json();
    let written = std::fs::read_to_string(&back).unwrap();
    assert_eq!(report["bytes"], written.len());
    let header = written.lines().next().unwrap();
    assert!(header.starts_with("t_s,4.velocity_rpm,5.current_a"), "{written}");
    assert!(written.contains("61.25") && written.contains("enabled") && written.contains("1.5"), "{written}");
    let again = ferrodrive(&["convert", &mcap, &back]);
    assert!(again.status == Some(1) && again.err.contains("back.csv"), "{}", again.err);
    let log = ferrodrive(&["convert", &path("a.log"), &path("a.csv")]);
    assert!(log.status == Some(2) && log.err.contains("a record is NAME.csv or NAME.mcap"), "{}", log.err);
}

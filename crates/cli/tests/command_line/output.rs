//! `-o`: a new file, by its ending; `-` is standard output, and no file is written over without --force.

use processes::{command, done, ferrodrive, scratch};

#[test]
fn what_goes_to_standard_output_goes_to_a_file_as_well() {
    let directory = scratch("output");
    for (words, name) in [(&["eds", "zlac8030l"][..], "a.eds"), (&["export", "dbc", "4"], "a.dbc")] {
        let file = directory.join(name);
        let path = file.to_str().unwrap();
        let with = |more: &[&str]| ferrodrive(&[words, more].concat());
        let said = done(&[words, &["-o", path]].concat()).out;
        assert!(said.starts_with(path), "{said}");
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(with(&[]).out.trim_end(), text.trim_end(), "{words:?}");
        assert_eq!(with(&["-o", "-"]).out, with(&[]).out, "{words:?}");
        let json = with(&["--json", "-o", path, "--force"]);
        assert_eq!((json.status, &json.json()["file"]), (Some(0), &path.into()), "{}", json.out);
        // What is there stays.
        std::fs::write(&file, "mine").unwrap();
        let there = with(&["--json", "-o", path]);
        assert_eq!((there.status, &there.json()["error"]["kind"]), (Some(1), &"file_exists".into()), "{}", there.out);
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
        let odd = with(&["-o", "a.txt"]);
        assert!(odd.status == Some(2) && odd.err.contains("or - for standard output"), "{}", odd.err);
    }
}

/// Neither is half a file left beside it, nor is something else than a file replaced.
#[test]
fn a_folder_in_place_of_the_output_is_refused_and_nothing_is_left_beside_it() {
    let directory = scratch("output_folder");
    for (words, name) in [
        (&["eds", "zlac8030l"][..], "a.eds"),
        (&["params", "backup", "4"], "a.toml"),
        (&["dcf", "4"], "a.dcf"),
        (&["export", "dbc", "4"], "a.dbc"),
        (&["read", "4", "1000"], "a.bin"),
    ] {
        let folder = directory.join(name);
        std::fs::create_dir(&folder).unwrap();
        let ended = ferrodrive(&[words, &["-o", folder.to_str().unwrap(), "--force", "--json"]].concat());
        assert_eq!(
            (ended.status, &ended.json()["error"]["kind"]),
            (Some(1), &"file".into()),
            "{words:?}: {}",
            ended.out
        );
        assert!(folder.is_dir());
    }
    assert_eq!(std::fs::read_dir(&directory).unwrap().count(), 5);
}

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/scenarios/homing_stuck_switch.toml");

/// The same as in a file, and what people read of it beside, on standard error.
#[test]
fn captures_pages_and_results_go_to_standard_output_alone() {
    let directory = scratch("output_results");
    let both = |words: &[&str], name: &str| {
        let file = directory.join(name);
        let summary = done(&[words, &["-o", file.to_str().unwrap()]].concat()).out;
        let (kept, shown) = (std::fs::read_to_string(&file).unwrap(), done(&[words, &["-o", "-"]].concat()));
        (kept, shown.out, shown.err, summary)
    };
    for (words, name) in [
        (&["capture", "4", "velocity", "--for", "20ms"][..], "a.csv"),
        (&["test-motion", "4", "steps", "--speed", "30rpm", "--travel", "10"], "b.csv"),
        (&["run", SCENARIO, "--seeds", "1..3"], "c.jsonl"),
    ] {
        let (kept, shown, beside, summary) = both(words, name);
        let data =
            |text: &str| text.lines().filter(|line| !line.contains("name")).map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(data(&kept), data(&shown), "{words:?}");
        assert!(data(&kept).len() > 2 && !summary.is_empty(), "{words:?}: {kept}");
        let last = summary.trim_end().lines().last().unwrap();
        assert!(beside.contains(last), "{words:?}: {last} in {beside}");
    }
    let page = done(&["report", "4", "-o", "-"]).out;
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"), "{page}");
    let several = ferrodrive(&["capture", "4", "velocity", "--count", "2", "-o", "-"]);
    assert!(several.status == Some(2) && several.out.is_empty(), "{}", several.err);
    assert_eq!(ferrodrive(&["run", SCENARIO, "--seeds", "1..2", "-o", "-", "--resume"]).status, Some(2));
    assert!(!std::path::Path::new("-").exists());
}

#[test]
fn pictures_records_and_bytes_go_to_standard_output_alone() {
    let directory = scratch("output_alone");
    let record = directory.join("a.csv");
    let path = record.to_str().unwrap();
    done(&["record", "4", "606C", "--for", "100ms", "-o", path]);
    let written = done(&["record", "4", "606C", "--for", "100ms", "-o", "-"]);
    assert_eq!(written.out, std::fs::read_to_string(&record).unwrap());
    assert!(written.err.contains("samples of node 4"), "{}", written.err);
    let captured = directory.join("b.csv");
    let steps = ["test-motion", "4", "prbs", "--speed", "60rpm", "--travel", "40"];
    done(&[&steps[..], &["--capture", "velocity,target_velocity,current", "-o", captured.to_str().unwrap()]].concat());
    let tune = ["tune", "4", "--capture", captured.to_str().unwrap()];
    for words in [&["plot", path][..], &tune, &["latency", "4", "--count", "20"], &["demo", "--drive", "zlim42c"]] {
        let drawn = done(&[words, &["-o", "-"]].concat()).out;
        assert!(drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>"), "{words:?}: {drawn}");
        assert_eq!(drawn.matches("<svg").count(), 1);
    }
    // CiA 301, 7.5.2.1: 1000h of a ZLAC8030L is 40192h, least significant byte first.
    let bytes = command(&["read", "4", "1000", "-o", "-"]).output().unwrap().stdout;
    assert_eq!(bytes, b"\x92\x01\x04\0");
    assert!(!std::path::Path::new("-").exists());
    let archive = command(&["fmu", "zlac8030l@4", "-o", "-"]).output().unwrap();
    // Where no library is built there is nothing to pack, and that is said.
    assert!(archive.stdout.starts_with(b"PK") || archive.status.code() == Some(1));
    assert!(!std::path::Path::new("-").exists());
    for words in [
        &["read", "4", "1000"][..],
        &["record", "4", "606C"],
        &["report", "4"],
        &["capture", "4", "velocity"],
        &["test-motion", "4", "steps"],
        &["run", SCENARIO, "--seeds", "1..2"],
        &["fmu", "zlac8030l@4"],
    ] {
        let both = ferrodrive(&[&["--json"], words, &["-o", "-"]].concat());
        assert_eq!(both.status, Some(2), "{}", both.out);
    }
}

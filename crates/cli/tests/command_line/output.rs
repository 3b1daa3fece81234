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

#[test]
fn pictures_records_and_bytes_go_to_standard_output_alone() {
    let directory = scratch("output_alone");
    let record = directory.join("a.csv");
    let path = record.to_str().unwrap();
    done(&["record", "4", "606C", "--for", "100ms", "-o", path]);
    let written = done(&["record", "4", "606C", "--for", "100ms", "-o", "-"]);
    assert_eq!(written.out, std::fs::read_to_string(&record).unwrap());
    assert!(written.err.contains("samples of node 4"), "{}", written.err);
    for words in [&["plot", path][..], &["latency", "4", "--count", "20"], &["demo", "--drive", "zlim42c"]] {
        let drawn = done(&[words, &["-o", "-"]].concat()).out;
        assert!(drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>"), "{words:?}: {drawn}");
        assert_eq!(drawn.matches("<svg").count(), 1);
    }
    // CiA 301, 7.5.2.1: 1000h of a ZLAC8030L is 40192h, least significant byte first.
    let bytes = command(&["read", "4", "1000", "-o", "-"]).output().unwrap().stdout;
    assert_eq!(bytes, b"\x92\x01\x04\0");
    assert!(!std::path::Path::new("-").exists());
    for words in [&["read", "4", "1000"][..], &["record", "4", "606C"]] {
        let both = ferrodrive(&[&["--json"], words, &["-o", "-"]].concat());
        assert_eq!(both.status, Some(2), "{}", both.out);
    }
}

//! Files of real makers, where there are some: `FERRODRIVE_EDS_FILES` names the folder. The project has none of them.

use std::fs;
use std::path::PathBuf;

use eds::document::Document;
use eds::{Eds, Severity, Unkept, diff, keep, write};

fn files() -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("FERRODRIVE_EDS_FILES") else {
        say("skipped: FERRODRIVE_EDS_FILES names no folder with EDS and DCF files");
        return Vec::new();
    };
    let entries = fs::read_dir(&folder).expect("the folder of FERRODRIVE_EDS_FILES");
    let paths = entries.map(|entry| entry.expect("a readable folder").path());
    let ends = |path: &PathBuf| {
        path.extension().is_some_and(|end| end.eq_ignore_ascii_case("eds") || end.eq_ignore_ascii_case("dcf"))
    };
    let mut files: Vec<PathBuf> = paths.filter(ends).collect();
    files.sort();
    assert!(!files.is_empty(), "no EDS or DCF in {}", folder.display());
    files
}

#[allow(clippy::print_stderr, reason = "a test that has nothing to do reports it")]
fn say(text: &str) {
    eprintln!("{text}");
}

#[test]
fn every_file_is_read_or_refused_with_what_to_do() {
    for path in files() {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match Eds::load(&fs::read(&path).expect("a readable file")) {
            Ok(reading) => {
                let variables = reading.eds.variables().count();
                let (errors, warnings) =
                    (reading.findings.count(Severity::Error), reading.findings.count(Severity::Warning));
                say(&format!(
                    "{name}: {} objects, {variables} values, {errors} errors, {warnings} warnings",
                    reading.eds.objects.len()
                ));
                if std::env::var_os("FERRODRIVE_EDS_FINDINGS").is_some() {
                    reading.findings.iter().for_each(|finding| say(&format!("    {finding}")));
                }
                assert!(!reading.eds.objects.is_empty(), "{name}");
                assert!(variables >= reading.eds.objects.len() / 2, "{name}");
            }
            Err(refusal) => {
                say(&format!("{name}: refused: {refusal}"));
                assert!(!refusal.reason.is_empty() && !refusal.next.is_empty(), "{name}");
            }
        }
    }
}

/// What is wrong in files that can be had, found by looking at the line of each error. All others of the list are right.
const KNOWN: &str = include_str!("makers.csv");

/// A file is known by the end of its name and its length.
#[test]
fn a_file_that_is_known_has_the_errors_that_were_seen_in_it_and_no_other() {
    let mut known = 0;
    for path in files() {
        let bytes = fs::read(&path).expect("a readable file");
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let is_it = |row: &[&str]| name.ends_with(row[0]) && row[1].parse() == Ok(bytes.len());
        let mut rows = KNOWN.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
        let Some(row) = rows.find(|row| is_it(row)) else { continue };
        let findings = Eds::load(&bytes).expect("none of them is refused").findings;
        let errors = findings.iter().filter(|finding| finding.severity() == Severity::Error);
        let mut rules: Vec<_> = errors.map(|finding| finding.rule.id()).collect();
        rules.sort_unstable();
        assert_eq!(rules.join(" "), row[2], "{name}");
        known += 1;
    }
    say(&format!("{known} of {} files that are known", KNOWN.lines().count() - 1));
}

#[test]
fn every_file_comes_back_byte_by_byte() {
    for path in files() {
        let bytes = fs::read(&path).expect("a readable file");
        let document = Document::parse(&bytes).expect("a file of a real size");
        assert!(document.to_bytes() == bytes, "{}", path.display());
    }
}

#[test]
fn every_file_reads_the_same_when_it_is_written_anew() {
    for path in files() {
        let eds = Eds::load(&fs::read(&path).expect("a readable file")).expect("a file that is read").eds;
        let again = Eds::load(write(&eds).as_bytes()).expect("what is written can be read").eds;
        assert_eq!(diff(&eds, &again), [], "{}", path.display());
        assert_eq!(eds.variables().count(), again.variables().count(), "{}", path.display());
    }
}

#[test]
fn every_file_makes_a_description_that_is_kept_once_or_says_that_it_is_too_large() {
    for path in files() {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let eds = Eds::load(&fs::read(&path).expect("a readable file")).expect("a file that is read").eds;
        match keep(&eds) {
            Ok(kept) => {
                let again = keep(&eds).expect("the same");
                assert!(std::ptr::eq(kept, again), "{name}");
                assert_eq!(kept.dictionary.rows().len(), eds.variables().count(), "{name}");
                let modes: Vec<_> =
                    kept.axes.iter().map(|axis| axis.modes.iter().map(|mode| mode.0).collect::<Vec<_>>()).collect();
                let title = kept.title;
                say(&format!(
                    "{name}: {title}, {:05X}h, {} axes {modes:?}",
                    kept.identity.device_type,
                    kept.axes.len()
                ));
            }
            Err(Unkept::TooManyRows { rows, most }) => {
                assert!(rows > most);
                say(&format!("{name}: {rows} rows are too many"));
            }
            Err(error) => panic!("{name}: {error}"),
        }
    }
}

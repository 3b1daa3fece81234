//! `cargo xtask defects [--only NUMBER]..`: do the tests notice what is wrong? Each defect of the list is put into a copy of the tree,
//! alone, and the tests that are to notice it are run there.
//!
//! The copy and what is built of it are below `target/defects`, and stay for the next time. Before the first defect of a test program
//! it runs without one: what fails by itself notices nothing.

mod defect;
mod list;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use crate::test_programs::{self, Program};
use crate::{libtest, process, workspace};
use defect::{Defect, Tests};
use list::defects;

/// What became of a defect.
#[derive(Debug, PartialEq, Eq)]
enum TrialResult {
    /// These tests failed.
    Noticed(Vec<String>),
    /// They did not end.
    Hung,
    Missed,
}

/// Tests that take longer do not end.
const LONGEST: Duration = Duration::from_secs(1800);

pub(crate) fn command(words: &[&str]) -> ExitCode {
    match chosen(words).and_then(|numbers| check(&numbers)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// The numbers that are asked for, from 1; without any, all.
fn chosen(words: &[&str]) -> Result<Vec<usize>, String> {
    let mut numbers = Vec::new();
    let all = 1..=defects().len();
    for pair in words.chunks(2) {
        let number = match pair {
            ["--only", number] => number.parse().ok().filter(|number| all.contains(number)),
            _ => None,
        };
        numbers.push(number.ok_or(format!(
            "expected --only NUMBER, 1 to {}, and not {}",
            all.end(),
            pair.join(" ")
        ))?);
    }
    Ok(if numbers.is_empty() { all.collect() } else { numbers })
}

/// True if each is noticed.
fn check(numbers: &[usize]) -> Result<bool, String> {
    let place = workspace::target().join("defects");
    let copy = copy_of_the_tree(&place)?;
    let mut sound = BTreeSet::new();
    let (list, mut missed) = (defects(), 0);
    for number in numbers {
        let defect = list[number - 1];
        if sound.insert(defect.noticed_by) && run(&copy, defect.noticed_by)? != TrialResult::Missed {
            return Err(format!("{:?} fails without a defect", defect.noticed_by));
        }
        let verdict = with(&copy, defect, || run(&copy, defect.noticed_by))?;
        missed += usize::from(verdict == TrialResult::Missed);
        let Tests { package, target, .. } = defect.noticed_by;
        println!("{number:3}  {}: {} | {package} {target}: {verdict}", defect.file, defect.instead.trim());
    }
    println!("{} noticed, {missed} not", numbers.len() - missed);
    Ok(missed == 0)
}

/// All files of the tree that git knows or would take, as they are now. What has not changed since is left as it is, so that little
/// is built again.
fn copy_of_the_tree(place: &Path) -> Result<PathBuf, String> {
    let copy = place.join("tree");
    let root = workspace::root();
    let words = ["ls-files", "--cached", "--others", "--exclude-standard"];
    let listed = process::output(Command::new("git").current_dir(&root).args(words))?;
    for name in listed.lines().filter(|name| root.join(name).is_file()) {
        let (from, to) = (root.join(name), copy.join(name));
        let failed = |error: std::io::Error| format!("{}: {error}", to.display());
        let bytes = fs::read(&from).map_err(|error| format!("{name}: {error}"))?;
        if fs::read(&to).is_ok_and(|there| there == bytes) {
            continue;
        }
        fs::create_dir_all(to.parent().unwrap_or(&copy)).map_err(failed)?;
        fs::write(&to, bytes).map_err(failed)?;
    }
    Ok(copy)
}

/// Does something while the defect is in the copy.
fn with<T>(copy: &Path, defect: &Defect, act: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let path = copy.join(defect.file);
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let before = fs::read_to_string(&path).map_err(failed)?;
    fs::write(&path, defect.written_into(&before)?).map_err(failed)?;
    let done = act();
    fs::write(&path, before).map_err(failed)?;
    done
}

impl Defect {
    /// The file's text with it.
    fn written_into(&self, text: &str) -> Result<String, String> {
        match text.matches(self.text).count() {
            1 => Ok(text.replace(self.text, self.instead)),
            count => Err(format!("{}: {:?} is there {count} times, expected once", self.file, self.text)),
        }
    }
}

fn run(copy: &Path, tests: Tests) -> Result<TrialResult, String> {
    let mut words = vec!["-p", tests.package];
    words.extend(if tests.target == "--lib" { vec!["--lib"] } else { vec!["--test", tests.target] });
    let mut cargo = workspace::cargo();
    cargo.current_dir(copy).env_remove("CARGO_MANIFEST_DIR");
    cargo.env("CARGO_TARGET_DIR", copy.with_file_name("built")).env("RUSTFLAGS", "--cap-lints=allow");
    let programs = test_programs::build_with(cargo, &words)?;
    let [program] = &programs[..] else { return Err(format!("{tests:?} is not one program")) };
    judge(program, tests.filter, &copy.with_file_name("said"))
}

/// What a program of tests says; `said` is a file for its output.
fn judge(program: &Program, filter: &str, said: &Path) -> Result<TrialResult, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", program.path.display());
    let file = fs::File::create(said).map_err(failed)?;
    let mut command = program.command();
    command.args((!filter.is_empty()).then_some(filter)).stdin(Stdio::null()).stdout(file).stderr(Stdio::null());
    let mut child = command.spawn().map_err(failed)?;
    let begin = Instant::now();
    let ended_well = loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            break status.success();
        }
        if begin.elapsed() > LONGEST {
            child.kill().and_then(|()| child.wait()).map_err(failed)?;
            return Ok(TrialResult::Hung);
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let text = fs::read_to_string(said).map_err(failed)?;
    if !text.contains("test result: ") || text.contains("running 0 tests") {
        return if ended_well {
            Err(format!("{}: no test ran", program.path.display()))
        } else {
            Ok(TrialResult::Hung)
        };
    }
    Ok(if ended_well {
        TrialResult::Missed
    } else {
        TrialResult::Noticed(text.lines().filter_map(libtest::failed_test).collect())
    })
}

impl std::fmt::Display for TrialResult {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Noticed(tests) => {
                write!(f, "noticed by {}", tests.first().map_or("a test", String::as_str))?;
                if tests.len() > 1 { write!(f, " and {} more", tests.len() - 1) } else { Ok(()) }
            }
            Self::Hung => f.write_str("noticed: the tests do not end, or crash"),
            Self::Missed => f.write_str("NOT NOTICED"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_defect_can_be_put_in_where_it_says() {
        let packages = workspace::packages().unwrap();
        for (place, defect) in defects().into_iter().enumerate() {
            let text = fs::read_to_string(workspace::root().join(defect.file)).unwrap_or_default();
            let written = defect.written_into(&text).unwrap_or_else(|error| panic!("defect {}: {error}", place + 1));
            assert_ne!(written, text, "defect {}", place + 1);
            let package = packages.iter().find(|package| package.name == defect.noticed_by.package).unwrap();
            let target = Path::new(&package.folder).join("tests").join(defect.noticed_by.target);
            assert!(
                defect.noticed_by.target == "--lib" || workspace::root().join(target).is_dir(),
                "defect {}",
                place + 1
            );
        }
    }

    #[test]
    fn a_text_that_is_there_twice_or_not_at_all_is_an_error_that_says_where() {
        let defect = Defect { file: "a.rs", text: "one", instead: "two", noticed_by: Tests::of("a", "--lib") };
        assert_eq!(defect.written_into("a one b").as_deref(), Ok("a two b"));
        for (text, count) in [("", "0 times"), ("one one", "2 times")] {
            let error = defect.written_into(text).unwrap_err();
            assert!(error.contains("a.rs") && error.contains(count), "{error}");
        }
    }

    #[test]
    fn numbers_are_those_of_the_list() {
        assert_eq!(chosen(&[]).unwrap().len(), defects().len());
        assert_eq!(chosen(&["--only", "3", "--only", "1"]), Ok(vec![3, 1]));
        for words in [&["--only"][..], &["--only", "0"], &["--only", "999"], &["3"]] {
            assert!(chosen(words).unwrap_err().contains("--only NUMBER, 1 to "), "{words:?}");
        }
    }
}

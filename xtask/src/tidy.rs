//! `cargo xtask tidy`: the house rules that a program can check.
//!
//! Each rule is a function from a source file (or the workspace) to findings, lives beside its neighbours in one file
//! per subject, and has a test that shows it a violation: a rule that cannot fail is worth nothing. What a rule may
//! overlook is named in `exceptions`, each with its reason.

mod banned;
mod circles;
mod conventions;
mod dependencies;
mod exceptions;
mod finding;
mod glossary;
mod manifests;
mod paths;
mod sizes;
mod source;
mod text;
mod unsafe_code;
mod wording;

use std::process::{Command, ExitCode};

pub(crate) use dependencies::NO_STD;
use finding::Finding;
use source::Source;

use crate::tally::Tally;
use crate::{process, workspace};

/// A rule about one Rust file.
type SourceRule = fn(&Source) -> Vec<Finding>;
/// A rule about one text file of any kind: its path and its contents.
type TextRule = fn(&str, &str) -> Vec<Finding>;

const SOURCE_RULES: &[SourceRule] = &[
    banned::in_code,
    banned::left_undone,
    banned::clocks_of_tests,
    banned::std_in_core,
    conventions::module_docs,
    conventions::test_names,
    conventions::reasons,
    conventions::field_words,
    conventions::banners,
    manifests::includes,
    sizes::files,
    sizes::functions,
    unsafe_code::in_code,
];

const TEXT_RULES: &[TextRule] =
    &[text::typography, text::machine_paths, text::line_ends, wording::habits, sizes::pages];

/// Runs `cargo xtask tidy`.
pub(crate) fn command() -> ExitCode {
    let tally = step();
    println!("{}", tally.summary());
    if tally.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The tidy step of `cargo xtask test`: prints the findings; each counts as one failure.
pub(crate) fn step() -> Tally {
    let findings = match findings() {
        Ok(findings) => findings,
        Err(error) => return Tally::failed(error),
    };
    findings.iter().for_each(|finding| println!("{finding}"));
    let failed = u32::try_from(findings.len()).unwrap_or(u32::MAX);
    if failed == 0 { Tally::passed() } else { Tally { failed, note: "findings above".into(), ..Tally::default() } }
}

fn findings() -> Result<Vec<Finding>, String> {
    let packages = workspace::packages()?;
    let mut found = dependencies::directions(&packages, |folder| {
        std::fs::read_to_string(workspace::root().join(folder).join("Cargo.toml")).unwrap_or_default()
    });
    found.extend(dependencies::allowances(&packages));
    let (mut sources, mut python) = (Vec::new(), Vec::new());
    // What a reader of the glossary may have read.
    let (mut glossary, mut read) = (String::new(), Vec::new());
    for path in tracked_files()? {
        // A file that is listed but deleted, or that is not text, has no style.
        let Ok(text) = std::fs::read_to_string(workspace::root().join(&path)) else { continue };
        TEXT_RULES.iter().for_each(|rule| found.extend(rule(&path, &text)));
        let exists = |path: &str| workspace::root().join(path).exists();
        found.extend(manifests::of_crates(&path, &text, exists));
        found.extend(paths::of_page(&path, &text, exists));
        found.extend(unsafe_code::of_manifest(&path, &text));
        if path == glossary::PAGE {
            glossary.clone_from(&text);
        } else if [".rs", ".md", ".js", ".py"].iter().any(|ending| path.ends_with(ending)) {
            read.push(text.to_lowercase());
        }
        if path.ends_with(".rs") {
            let source = Source::new(&path, &text);
            SOURCE_RULES.iter().for_each(|rule| found.extend(rule(&source)));
            sources.push(source);
        }
        if path.ends_with(".py") {
            python.push((path, text));
        }
    }
    let in_use = |word: &str| read.iter().any(|text| glossary::stands_in(word, text));
    // A type is written in one: `MovedAxis`.
    found.extend(glossary::of_page(&glossary, |word| in_use(word) || in_use(&word.replace(' ', ""))));
    found.extend(circles::in_crates(&sources));
    found.extend(circles::in_packages(&python));
    let mut found = exceptions::apply(found, exceptions::EXCEPTIONS);
    found.sort();
    Ok(found)
}

/// Every file that is, or would be, under version control.
fn tracked_files() -> Result<Vec<String>, String> {
    let mut git = Command::new("git");
    git.current_dir(workspace::root()).args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]);
    let list = process::output(&mut git)?;
    let mut paths: Vec<String> = list.split('\0').filter(|path| !path.is_empty()).map(str::to_owned).collect();
    paths.sort();
    paths.dedup();
    Ok(paths)
}

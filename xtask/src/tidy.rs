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
mod names;
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
    let paths = tracked_files()?;
    // Each core reads a part of the files.
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let parts = std::thread::scope(|scope| {
        let parts: Vec<_> = paths.chunks(paths.len().div_ceil(cores).max(1)).collect();
        let parts: Vec<_> =
            parts.into_iter().map(|part| scope.spawn(|| part.iter().filter_map(|path| read(path)).collect())).collect();
        parts.into_iter().map(std::thread::ScopedJoinHandle::join).collect::<Result<Vec<Vec<CheckedFile>>, _>>()
    });
    let (mut sources, mut python) = (Vec::new(), Vec::new());
    // What a reader of the glossary may have read.
    let (mut glossary, mut read) = (String::new(), Vec::new());
    for file in parts.map_err(|_| "a rule panicked")?.into_iter().flatten() {
        found.extend(file.found);
        sources.extend(file.source);
        if file.path == glossary::PAGE {
            glossary = file.text;
            continue;
        }
        if [".rs", ".md", ".js", ".py"].iter().any(|ending| file.path.ends_with(ending)) {
            read.push(file.text.to_lowercase());
        }
        if file.path.ends_with(".py") {
            python.push((file.path, file.text));
        }
    }
    let in_use = |word: &str| read.iter().any(|text| glossary::stands_in(word, text));
    // A type is written in one: `MovedAxis`.
    found.extend(glossary::of_page(&glossary, |word| in_use(word) || in_use(&word.replace(' ', ""))));
    found.extend(circles::in_crates(&sources));
    found.extend(names::repeated(&sources));
    found.extend(circles::in_packages(&python));
    let mut found = exceptions::apply(found, exceptions::EXCEPTIONS);
    found.sort();
    Ok(found)
}

/// A file, and what the rules about one file find in it.
struct CheckedFile {
    path: String,
    text: String,
    found: Vec<Finding>,
    source: Option<Source>,
}

/// `None` for a file that is listed but deleted, or that is not text: it has no style.
fn read(path: &str) -> Option<CheckedFile> {
    let text = std::fs::read_to_string(workspace::root().join(path)).ok()?;
    let exists = |path: &str| workspace::root().join(path).exists();
    let mut found: Vec<Finding> = TEXT_RULES.iter().flat_map(|rule| rule(path, &text)).collect();
    found.extend(manifests::of_crates(path, &text, exists));
    found.extend(paths::of_page(path, &text, exists));
    found.extend(unsafe_code::of_manifest(path, &text));
    let source = path.ends_with(".rs").then(|| Source::new(path, &text));
    found.extend(source.iter().flat_map(|source| SOURCE_RULES.iter().flat_map(|rule| rule(source))));
    Some(CheckedFile { path: path.to_owned(), text, found, source })
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

//! Rules for every text file: plain typography, no paths of anybody's machine, clean line ends.

use super::finding::Finding;

/// Files written by hand. Others (licences, lock files, pictures) are not checked.
const WRITTEN: &[&str] = &[".rs", ".md", ".toml", ".py", ".csv", ".can", ".yml", ".sh"];

/// The rules spell what they forbid.
pub(super) const THE_RULES: &str = "xtask/src/tidy/";

/// Characters that look like a keyboard's but are not, and what to type.
const LOOKALIKES: &[(char, &str, &str)] = &[
    ('\u{2014}', "an em dash", "use a comma, a colon, or a new sentence"),
    ('\u{2013}', "an en dash", "use a hyphen, or `to` in a range"),
    ('\u{2026}', "an ellipsis", "use three dots, or finish the sentence"),
    ('\u{2018}', "a curly quote", "use the keyboard's quote"),
    ('\u{2019}', "a curly quote", "use the keyboard's quote"),
    ('\u{201c}', "a curly quote", "use the keyboard's quote"),
    ('\u{201d}', "a curly quote", "use the keyboard's quote"),
    ('\u{a0}', "a hard space", "use a space"),
];

/// Typography that a search typed on a keyboard does not find.
pub(super) fn typography(path: &str, text: &str) -> Vec<Finding> {
    let why = "a search typed on a keyboard does not find it";
    each_line(path, text, |line| {
        let (_, name, remedy) = LOOKALIKES.iter().find(|(char, ..)| line.contains(*char))?;
        Some(("typography", (*name).to_owned(), why, *remedy))
    })
}

/// Folders that exist on one machine only.
const MACHINE_FOLDERS: &[&str] = &["/work/", "/home/", "/root/", "/Users/", "C:\\Users"];

/// A path that exists on one machine only.
pub(super) fn machine_paths(path: &str, text: &str) -> Vec<Finding> {
    let why = "it exists on one machine only";
    each_line(path, text, |line| {
        let folder = MACHINE_FOLDERS.iter().find(|folder| line.contains(**folder))?;
        Some(("machine_paths", format!("a path under {folder}"), why, "use a path relative to the project"))
    })
}

/// Spaces at line ends, tabs, and a missing line break at the end.
pub(super) fn line_ends(path: &str, text: &str) -> Vec<Finding> {
    let why = "it shows up as a change that was not intended";
    let mut found = each_line(path, text, |line| {
        if line.ends_with([' ', '\t', '\r']) {
            return Some(("line_ends", "space at the end of the line".to_owned(), why, "remove it"));
        }
        line.contains('\t').then(|| ("line_ends", "a tab".to_owned(), why, "use spaces"))
    });
    if is_written(path) && !text.is_empty() && !text.ends_with('\n') {
        let line = text.lines().count();
        let what = "no line break at the end of the file".to_owned();
        found.push(Finding { path: path.to_owned(), line, rule: "line_ends", what, why, remedy: "add one" });
    }
    found
}

type LineFinding = (&'static str, String, &'static str, &'static str);

fn each_line(path: &str, text: &str, rule: impl Fn(&str) -> Option<LineFinding>) -> Vec<Finding> {
    if !is_written(path) {
        return Vec::new();
    }
    let numbered = text.split('\n').enumerate();
    numbered
        .filter_map(|(at, line)| {
            let (rule, what, why, remedy) = rule(line)?;
            Some(Finding { path: path.to_owned(), line: at + 1, rule, what, why, remedy })
        })
        .collect()
}

fn is_written(path: &str) -> bool {
    WRITTEN.iter().any(|ending| path.ends_with(ending)) && !path.starts_with(THE_RULES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lookalike_is_found_with_its_line() {
        for (char, ..) in LOOKALIKES {
            let found = typography("README.md", &format!("a\nb {char} c\n"));
            assert_eq!(found.iter().map(|finding| finding.line).collect::<Vec<_>>(), [2], "{char:?}");
        }
        assert_eq!(typography("README.md", "a - b\n"), []);
    }

    #[test]
    fn every_machine_folder_is_found_and_a_relative_path_is_not() {
        for folder in MACHINE_FOLDERS {
            assert_eq!(machine_paths("docs/a.md", &format!("see {folder}x\n")).len(), 1, "{folder}");
        }
        assert_eq!(machine_paths("docs/a.md", "see docs/a.md\n"), []);
    }

    #[test]
    fn untidy_line_ends_are_found() {
        assert_eq!(line_ends("a.rs", "a \n").len(), 1);
        assert_eq!(line_ends("a.rs", "\ta\n").len(), 1);
        assert_eq!(line_ends("a.rs", "a").len(), 1);
        assert_eq!(line_ends("a.rs", "a\n"), []);
    }

    #[test]
    fn licences_are_left_as_they_come() {
        assert_eq!(typography("LICENSE-APACHE", "a \u{2013} b"), []);
    }
}

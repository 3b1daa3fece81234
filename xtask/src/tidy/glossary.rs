//! `docs/glossary.md`: each row says what its words mean and what they are near to, and the words are in use: one that is gone from
//! code and pages is gone from the glossary.

use super::finding::Finding;

/// The page.
pub(super) const PAGE: &str = "docs/glossary.md";

/// Rows that lack a cell, and words that `is_used` finds nowhere else.
pub(super) fn of_page(text: &str, is_used: impl Fn(&str) -> bool) -> Vec<Finding> {
    let finding = |line: usize, what: String, remedy: &'static str| Finding {
        path: PAGE.to_owned(),
        line,
        rule: "glossary",
        what,
        why: "a reader looks a word up because it stands somewhere, and wants a word that is known",
        remedy,
    };
    let mut found = Vec::new();
    for (line, cells) in rows(text) {
        if cells.len() != 3 || cells.iter().any(|cell| cell.is_empty()) {
            let what = format!("\"{}\" lacks a cell", cells.first().copied().unwrap_or_default());
            found.push(finding(line, what, "give the word, what it is, and the term that it is near to, or \"none\""));
        }
        let words = cells.first().into_iter().flat_map(|cell| cell.split(", "));
        let unused = words.filter(|word| !word.is_empty() && !is_used(word));
        found.extend(unused.map(|word| finding(line, format!("\"{word}\" is not in use"), "remove it from its row")));
    }
    found
}

/// The rows of the tables with their lines, without heads.
fn rows(text: &str) -> Vec<(usize, Vec<&str>)> {
    let lines: Vec<_> = text.lines().collect();
    let is_rule = |line: usize| lines.get(line).is_some_and(|text| text.starts_with("|---"));
    let rows = lines.iter().enumerate().filter(|(at, line)| line.starts_with('|') && !is_rule(*at) && !is_rule(at + 1));
    rows.map(|(at, line)| (at + 1, line.trim_matches('|').split('|').map(str::trim).collect())).collect()
}

/// Whether a word stands in a text, alone or with an ending of the plural, in any case; a name in snake case is one word of its own.
pub(super) fn stands_in(word: &str, text: &str) -> bool {
    let is_letter = |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
    let bytes = text.as_bytes();
    text.match_indices(word).any(|(at, _)| {
        let behind = at + word.len();
        let ends =
            !is_letter(bytes.get(behind)) || bytes.get(behind) == Some(&b's') && !is_letter(bytes.get(behind + 1));
        ends && !is_letter(at.checked_sub(1).and_then(|before| bytes.get(before)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "# Glossary\n\n| word | what it is | near to |\n|---|---|---|\n";

    fn found(row: &str) -> Vec<(usize, String)> {
        let found = of_page(&format!("{HEAD}{row}\n"), |word| stands_in(word, "a drive, two worlds and desk_top"));
        found.into_iter().map(|finding| (finding.line, finding.what)).collect()
    }

    #[test]
    fn a_word_that_stands_nowhere_else_is_found() {
        assert_eq!(found("| drive, world | a | b |"), []);
        assert_eq!(found("| drive, desk | a | b |"), [(5, "\"desk\" is not in use".to_owned())]);
    }

    #[test]
    fn a_row_without_a_nearest_term_is_found() {
        assert_eq!(found("| drive | a | |"), [(5, "\"drive\" lacks a cell".to_owned())]);
        assert_eq!(found("| drive | a |"), [(5, "\"drive\" lacks a cell".to_owned())]);
    }
}

//! What a page says of where things are: each path in it has to exist.

use super::finding::Finding;

/// The folders that paths begin with.
const ROOTS: &[&str] = &["benches/", "crates/", "docs/", "examples/", "fuzz/", "tests/", "xtask/"];

/// A page of history names what was there then.
const HISTORY: &str = "CHANGELOG.md";

/// Paths in backticks of a page that are not there. `a/{b,c}.rs` is two; one with a word in capitals (`DRIVE`), a `*` or a
/// blank stands for others and is passed over. `exists` is asked for each.
pub(super) fn of_page(path: &str, text: &str, exists: impl Fn(&str) -> bool) -> Vec<Finding> {
    if !path.ends_with(".md") || path == HISTORY {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let quoted = line.split('`').skip(1).step_by(2);
        let paths = quoted.filter(|quoted| ROOTS.iter().any(|root| quoted.starts_with(root)) && !is_pattern(quoted));
        let missing = paths.flat_map(alternatives).filter(|path| !exists(path));
        found.extend(missing.map(|missing| Finding {
            path: path.to_owned(),
            line: at + 1,
            rule: "paths",
            what: format!("there is no {missing}"),
            why: "who follows the page stands before nothing",
            remedy: "name the place where it is now",
        }));
    }
    found
}

fn is_pattern(path: &str) -> bool {
    let stands_for_others = |part: &str| part.len() > 1 && part.bytes().all(|byte| byte.is_ascii_uppercase());
    path.contains(['*', ' ', '#', '<']) || path.split(['/', '.', '_', '-']).any(stands_for_others)
}

/// `a/{b,c}.rs`: `a/b.rs` and `a/c.rs`.
fn alternatives(path: &str) -> Vec<String> {
    match path.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?))) {
        Some((before, (names, after))) => {
            names.split(',').flat_map(|name| alternatives(&format!("{before}{}{after}", name.trim()))).collect()
        }
        None => vec![path.to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn missing(text: &str) -> Vec<String> {
        let there = ["crates/a/src", "crates/a/src/b.rs", "docs/c.md"];
        of_page("docs/page.md", text, |path| there.contains(&path)).into_iter().map(|finding| finding.what).collect()
    }

    #[test]
    fn a_path_that_is_not_there_is_found_at_its_line() {
        let found = of_page("README.md", "a\n`crates/a/src/c.rs` and `crates/a/src`\n", |path| path == "crates/a/src");
        let found: Vec<_> = found.iter().map(|finding| (finding.line, finding.what.as_str())).collect();
        assert_eq!(found, [(2, "there is no crates/a/src/c.rs")]);
        assert_eq!(of_page(HISTORY, "`crates/gone`\n", |_| false), []);
    }

    #[test]
    fn each_name_in_braces_is_a_path() {
        assert_eq!(missing("`crates/a/src/{b,d}.rs`"), ["there is no crates/a/src/d.rs"]);
    }

    #[test]
    fn what_stands_for_others_is_not_a_path() {
        let text =
            "`crates/devices/src/MAKER/` `tests/data/DRIVE/objects.csv` `crates/*/src` `examples/a.py --help` `b.rs`";
        assert_eq!(missing(text), [""; 0]);
    }
}

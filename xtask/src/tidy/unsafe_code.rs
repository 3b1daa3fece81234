//! Where `unsafe` may stand: a closed list of packages, and within them of files.
//!
//! The workspace forbids it. Of what ships, the C interface of the FMUs alone has unsafe blocks, and the module of a page has symbols
//! that JavaScript finds by name. A program without an operating system has both. Packages outside of the workspace (fuzz targets,
//! nodes of other stacks) do not ship.

use super::finding::Finding;
use super::source::{Source, occurrences};

/// Packages with lints of their own, and what these say of `unsafe_code`.
const DEVIATING: &[(&str, &str)] = &[("crates/fmu", "deny"), ("crates/web", "deny"), ("benches/bare_metal", "allow")];

/// Files with the word, by the begin of their paths, and whether it may be more than the attribute of a symbol.
const FILES: &[(&str, bool)] = &[
    ("crates/fmu/src/abi.rs", true),
    ("crates/fmu/src/abi/", true),
    ("crates/web/src/abi.rs", false),
    ("benches/bare_metal/src/entry.rs", true),
    ("tests/peers/stacks/rust/", true),
];

/// The attribute of a symbol.
const SYMBOL: &str = "unsafe(no_mangle)";

const WHY: &str = "the list of what may deviate from forbidding `unsafe` is closed";

/// What a manifest says of it: the workspace's lints, or those of the list.
pub(super) fn of_manifest(path: &str, text: &str) -> Vec<Finding> {
    let Some(folder) = path.strip_suffix("Cargo.toml").map(|folder| folder.trim_end_matches('/')) else {
        return Vec::new();
    };
    let has = |wanted: &str| text.lines().any(|line| line == wanted);
    let said = |word: &str| has(&format!("unsafe_code = \"{word}\""));
    let is_own = has("[workspace]") && !folder.starts_with("crates/");
    let (holds, remedy) = match DEVIATING.iter().find(|(deviating, _)| *deviating == folder) {
        _ if folder.is_empty() => (said("forbid"), "say unsafe_code = \"forbid\" in [workspace.lints.rust]"),
        _ if is_own => return Vec::new(),
        Some((_, word)) => (said(word), "leave its unsafe_code as xtask/src/tidy/unsafe_code.rs has it"),
        None => (text.contains("[lints]\nworkspace = true\n"), "say workspace = true in [lints]"),
    };
    let what = || "lints that do not forbid `unsafe`".to_owned();
    let finding = || Finding { path: path.to_owned(), line: 1, rule: "unsafe", what: what(), why: WHY, remedy };
    (!holds).then(finding).into_iter().collect()
}

/// The word in a file that is not on the list.
pub(super) fn in_code(source: &Source) -> Vec<Finding> {
    let listed = FILES.iter().find(|(path, _)| source.path.starts_with(path));
    if let Some((_, true)) = listed {
        return Vec::new();
    }
    let found = occurrences(&source.code, "unsafe").into_iter();
    let found = found.filter(|at| listed.is_none() || !source.code[*at..].starts_with(SYMBOL));
    let finding = |at| Finding {
        path: source.path.clone(),
        line: source.line_of(at),
        rule: "unsafe",
        what: "`unsafe`".to_owned(),
        why: WHY,
        remedy: "write it without, or, for the C interface of an FMU, in crates/fmu/src/abi",
    };
    found.map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_package_that_does_not_forbid_it_is_found_unless_the_list_has_it() {
        let count = |path: &str, text: &str| of_manifest(path, text).len();
        let plain = "[package]\nname = \"a\"\n\n[lints]\nworkspace = true\n";
        let own = |word: &str| format!("[package]\n\n[lints.rust]\nunsafe_code = \"{word}\"\n");
        assert_eq!(count("crates/a/Cargo.toml", plain), 0);
        assert_eq!(count("crates/a/Cargo.toml", "[package]\n"), 1);
        for word in ["allow", "deny", "forbid"] {
            assert_eq!(count("crates/a/Cargo.toml", &own(word)), 1, "{word}");
        }
        assert_eq!(count("crates/a/Cargo.toml", &format!("[workspace]\n{}", own("allow"))), 1);
        assert_eq!(count("fuzz/Cargo.toml", "[package]\n\n[workspace]\n"), 0);
        assert_eq!(count("crates/fmu/Cargo.toml", &own("deny")), 0);
        assert_eq!(count("crates/fmu/Cargo.toml", &own("allow")), 1);
        assert_eq!(count("Cargo.toml", &own("forbid")), 0);
        assert_eq!(count("Cargo.toml", &own("deny")), 1);
    }

    #[test]
    fn the_word_is_found_in_code_outside_of_the_listed_files() {
        let count = |path: &str, text: &str| in_code(&Source::new(path, text)).len();
        let (block, symbol) = ("fn f() { unsafe { g() } }", "#[unsafe(no_mangle)]\nfn f() {}");
        assert_eq!(count("crates/fmu/src/abi/held.rs", block), 0);
        assert_eq!(count("crates/fmu/src/states.rs", block), 1);
        assert_eq!(count("crates/fmu/src/abi_of.rs", block), 1);
        assert_eq!((count("crates/web/src/abi.rs", symbol), count("crates/web/src/abi.rs", block)), (0, 1));
        assert_eq!((count("crates/web/src/call.rs", symbol), count("crates/sim/src/lib.rs", symbol)), (1, 1));
        assert_eq!(
            count("crates/sim/src/lib.rs", "// unsafe\nconst A: &str = \"unsafe\";\n#![forbid(unsafe_code)]"),
            0
        );
    }
}

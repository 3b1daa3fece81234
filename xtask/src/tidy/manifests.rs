//! What each crate's manifest and folder need to be packed, benched and found by others.

use super::finding::Finding;
use super::source::Source;

/// What a manifest says, and why.
const SAID: &[(&str, &str, &str)] = &[
    ("description = ", "a registry shows it first", "say in a line what the crate is"),
    ("license.workspace = true", "without it nothing may be used", "take the workspace's"),
    ("repository.workspace = true", "it leads back here", "take the workspace's"),
    ("keywords = ", "others find it by them", "name up to five"),
    ("categories = ", "others find it by them", "name up to five of crates.io's"),
];

/// Licences that go with each package, by a symbolic link or a copy.
const LICENCES: &[&str] = &["LICENSE-MIT", "LICENSE-APACHE"];

/// What the manifests of `crates` lack. `exists` is asked for files by their paths.
pub(super) fn of_crates(path: &str, text: &str, exists: impl Fn(&str) -> bool) -> Vec<Finding> {
    let Some(folder) = path.strip_suffix("/Cargo.toml").filter(|folder| folder.starts_with("crates/")) else {
        return Vec::new();
    };
    if text.lines().any(|line| line == "publish = false") {
        return Vec::new();
    }
    let finding =
        |what: String, why, remedy| Finding { path: path.to_owned(), line: 1, rule: "manifests", what, why, remedy };
    let mut found = Vec::new();
    for &(said, why, remedy) in SAID.iter().filter(|(said, ..)| !text.lines().any(|line| line.starts_with(said))) {
        found.push(finding(format!("no `{}`", said.trim_end_matches(" = ")), why, remedy));
    }
    for licence in LICENCES.iter().filter(|licence| !exists(&format!("{folder}/{licence}"))) {
        let why = "a package holds only what is in its folder";
        found.push(finding(format!("no {licence}"), why, "ln -s ../../LICENSE-MIT ../../LICENSE-APACHE ."));
    }
    for section in text.split("\n[").filter(|section| section.starts_with("lib]") || section.starts_with("[bin]")) {
        if !section.lines().any(|line| line == "bench = false") {
            let name = section.lines().next().unwrap_or_default();
            let why = "the harness of unit tests refuses the options of criterion: cargo bench -- --noplot";
            found.push(finding(format!("[{name} without bench = false"), why, "add it; benches are in benches/"));
        }
    }
    found
}

/// `include_str!` of a file that is not in the package.
pub(super) fn includes(source: &Source) -> Vec<Finding> {
    // The depth of the file in its package: `crates/NAME/src/a/b.rs` may go up three times.
    let Some(inside) = source.path.strip_prefix("crates/").and_then(|path| path.split_once('/')) else {
        return Vec::new();
    };
    let depth = inside.1.matches('/').count();
    let mut found = Vec::new();
    for at in ["include_str!(\"", "include_bytes!(\"", "include!(\""].iter().flat_map(|word| {
        let inside = source.text.match_indices(word).filter(|(at, _)| source.code.as_bytes()[*at] != b' ');
        inside.map(|(at, _)| at + word.len()).collect::<Vec<_>>()
    }) {
        let path = source.text[at..].split('"').next().unwrap_or_default();
        if path.split('/').take_while(|part| *part == "..").count() > depth {
            found.push(Finding {
                path: source.path.clone(),
                line: source.line_of(at),
                rule: "manifests",
                what: format!("the included {path} is outside the package"),
                why: "a package holds only what is in its folder",
                remedy: "move it here, or lead to it by a symbolic link",
            });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: &str = "[package]\ndescription = \"A\"\nlicense.workspace = true\nrepository.workspace = true\n\
                         keywords = [\"a\"]\ncategories = [\"b\"]\n\n[lib]\nbench = false\n";

    fn whats(text: &str, licences: bool) -> Vec<String> {
        of_crates("crates/a/Cargo.toml", text, |_| licences).into_iter().map(|finding| finding.what).collect()
    }

    #[test]
    fn each_line_that_a_manifest_lacks_is_found() {
        assert_eq!(whats(WHOLE, true), [""; 0]);
        for (said, ..) in SAID {
            let without: Vec<&str> = WHOLE.lines().filter(|line| !line.starts_with(said)).collect();
            assert_eq!(whats(&without.join("\n"), true), [format!("no `{}`", said.trim_end_matches(" = "))]);
        }
        assert_eq!(whats(WHOLE, false), ["no LICENSE-MIT", "no LICENSE-APACHE"]);
        assert_eq!(of_crates("tests/Cargo.toml", "", |_| false), []);
    }

    #[test]
    fn a_target_that_cargo_bench_would_run_is_found() {
        assert_eq!(whats(&WHOLE.replace("bench = false\n", ""), true), ["[lib] without bench = false"]);
        let binary = format!("{WHOLE}\n[[bin]]\nname = \"a\"\n");
        assert_eq!(whats(&binary, true), ["[[bin]] without bench = false"]);
    }

    #[test]
    fn a_file_outside_the_package_is_found() {
        let count = |path: &str, text: &str| includes(&Source::new(path, text)).len();
        assert_eq!(count("crates/a/src/b.rs", "const A: &str = include_str!(\"../../../docs/a.md\");"), 1);
        assert_eq!(count("crates/a/src/b.rs", "const A: &str = include_str!(\"../data/a.md\");"), 0);
        assert_eq!(count("crates/a/src/c/b.rs", "const A: &str = include_str!(\"../../data/a.md\");"), 0);
        assert_eq!(count("tests/src/b.rs", "const A: &str = include_str!(\"../../docs/a.md\");"), 0);
        assert_eq!(count("crates/a/src/b.rs", "// include_str!(\"../../../a\")"), 0);
    }
}

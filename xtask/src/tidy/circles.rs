//! Import circles between the modules of one crate, or of the Python package.
//!
//! A module that needs itself by way of others cannot be read, tested or moved alone. The graph has a node for each file
//! and an edge from a file to the file that defines what it names: in `use`, or as a path in its code. A strongly connected
//! part of more than one file is a circle. The law, where it is not obvious:
//!
//! - The file that *defines* a thing counts, not the one that passes it on: a parent may re-export its children, and a
//!   child may use its sibling by the parent's name for it.
//! - A child may extend its parent (`impl Parent`, which the parent need not name) or serve it (the parent names what the
//!   child defines), not both. What both need belongs into a sibling.
//! - Methods are not followed: who calls them does not name them. `mod child;` alone names nothing.
//! - Code under `#[cfg(test)]` may name what it likes.

mod graph;
mod modules;
mod python;
mod resolve;
mod tokens;

use std::collections::BTreeMap;

use self::graph::Graph;
use self::modules::Tree;
use super::exceptions::STILL_IN_CIRCLES;
use super::finding::Finding;
use super::source::Source;

/// The circles of all crates.
pub(super) fn in_crates(sources: &[Source]) -> Vec<Finding> {
    let mut crates: BTreeMap<&str, Vec<&Source>> = BTreeMap::new();
    for source in sources {
        if let Some((folder, _)) = source.path.split_once("/src/") {
            crates.entry(folder).or_default().push(source);
        }
    }
    let of_crate = |(folder, sources): (&str, Vec<&Source>)| {
        let name = folder.rsplit('/').next().unwrap_or(folder);
        let allowed = STILL_IN_CIRCLES.iter().find(|(known, _)| *known == name).map_or(0, |(_, files)| *files);
        within(circles(folder, &sources), folder, allowed)
    };
    crates.into_iter().flat_map(of_crate).collect()
}

/// The circles of each Python package: the files of a folder, with their texts.
pub(super) fn in_packages(files: &[(String, String)]) -> Vec<Finding> {
    let mut packages: BTreeMap<&str, Vec<(&str, &str)>> = BTreeMap::new();
    for (path, text) in files {
        packages.entry(path.rsplit_once('/').map_or("", |(folder, _)| folder)).or_default().push((path, text));
    }
    let graphs = packages.values().map(|files| python::graph(files));
    graphs.flat_map(|graph| found(&graph)).map(|circle| circle.finding).collect()
}

/// The findings beyond what is allowed: all of them if there are more files in circles than that.
fn within(found: Vec<Circle>, folder: &str, allowed: usize) -> Vec<Finding> {
    let files: usize = found.iter().map(|circle| circle.files).sum();
    if allowed > 0 && files == 0 {
        return vec![Finding {
            path: "xtask/src/tidy/exceptions.rs".to_owned(),
            line: 1,
            rule: "circles",
            what: format!("{folder} has no import circle any more"),
            why: "an exception that nothing needs hides the next circle",
            remedy: "remove it from STILL_IN_CIRCLES",
        }];
    }
    if files <= allowed {
        return Vec::new();
    }
    found.into_iter().map(|circle| circle.finding).collect()
}

struct Circle {
    /// How many files need each other.
    files: usize,
    finding: Finding,
}

fn circles(folder: &str, sources: &[&Source]) -> Vec<Circle> {
    found(&Graph::of(&Tree::of(folder, sources)))
}

fn found(graph: &Graph) -> Vec<Circle> {
    graph.circles().into_iter().map(|members| circle(graph, &members)).collect()
}

/// Shows the shortest way round, and how many files are in it together.
fn circle(graph: &Graph, members: &[usize]) -> Circle {
    let way = graph.shortest_way_round(members);
    let steps: Vec<String> = way
        .iter()
        .map(|edge| format!("{}:{} names {} of {}", graph.file(edge.from), edge.line, edge.name, graph.file(edge.to)))
        .collect();
    let first = &way[0];
    let finding = Finding {
        path: graph.file(first.from).to_owned(),
        line: first.line,
        rule: "circles",
        what: format!("an import circle, {} files in all: {}", members.len(), steps.join("; ")),
        why: "none of these files can be read, tested or moved without the others",
        remedy: "move what they share into a file below them",
    };
    Circle { files: members.len(), finding }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let sources: Vec<Source> =
            files.iter().map(|(path, text)| Source::new(&format!("crates/a/src/{path}"), text)).collect();
        in_crates(&sources).into_iter().map(|finding| finding.what.replace("crates/a/src/", "")).collect()
    }

    #[test]
    fn two_modules_that_name_each_other_are_a_circle() {
        let root = ("lib.rs", "mod b;\nmod c;");
        let circle =
            found(&[root, ("b.rs", "\nuse crate::c::C;\npub struct B(C);"), ("c.rs", "pub struct C(super::b::B);")]);
        assert_eq!(circle, ["an import circle, 2 files in all: b.rs:2 names C of c.rs; c.rs:1 names B of b.rs"]);
        assert_eq!(found(&[root, ("b.rs", "use crate::c::C;"), ("c.rs", "pub struct C;")]), [""; 0]);
    }

    #[test]
    fn the_shortest_way_round_is_shown_and_all_files_are_counted() {
        let files = [
            ("lib.rs", "mod b;\nmod c;\nmod d;"),
            ("b.rs", "fn b() { crate::c::c(); }"),
            ("c.rs", "pub fn c() { crate::d::d(); }"),
            ("d.rs", "pub fn d() { crate::b::b(); crate::c::c(); }"),
        ];
        let circle = found(&files);
        assert_eq!(circle, ["an import circle, 3 files in all: c.rs:1 names d of d.rs; d.rs:1 names c of c.rs"]);
    }

    #[test]
    fn a_parent_may_pass_on_what_its_children_define_and_siblings_may_use_that_name() {
        let root = ("lib.rs", "mod b;\nmod c;\npub use b::B;\npub use c::{C, give};\npub use b::*;");
        assert_eq!(found(&[root, ("b.rs", "pub struct B;"), ("c.rs", "use crate::B;\npub struct C(B);")]), [""; 0]);
    }

    #[test]
    fn a_child_may_extend_its_parent_or_serve_it_and_not_both() {
        let parent = "mod c;\npub struct A;";
        let child = "use super::A;\nimpl A { fn f() {} }\npub struct C;";
        assert_eq!(found(&[("lib.rs", parent), ("c.rs", child)]), [""; 0]);
        let parent = "mod c;\npub struct A(c::C);";
        let circle = found(&[("lib.rs", parent), ("c.rs", child)]);
        assert_eq!(circle, ["an import circle, 2 files in all: c.rs:1 names A of lib.rs; lib.rs:2 names C of c.rs"]);
    }

    #[test]
    fn modules_that_were_imported_whole_are_followed() {
        let root = ("lib.rs", "mod b;\nmod c;");
        let circle = found(&[
            root,
            ("b.rs", "use crate::c::{self, deep};\nfn b() { c::f(); }"),
            ("c.rs", "pub mod deep;\npub fn f() {}"),
            ("c/deep.rs", "use crate::b::b;"),
        ]);
        assert_eq!(circle, [""; 0]);
        let circle = found(&[
            root,
            ("b.rs", "use crate::c::deep;\nfn b() { deep::f(); }"),
            ("c.rs", "pub mod deep;"),
            ("c/deep.rs", "use crate::b::b;\npub fn f() {}"),
        ]);
        assert_eq!(circle.len(), 1);
    }

    #[test]
    fn what_a_glob_brings_counts_where_it_is_defined() {
        let files = |c: &'static str| {
            [("lib.rs", "mod b;\nmod c;"), ("b.rs", "use crate::c::*;\npub struct B(C);"), ("c.rs", c)]
        };
        assert_eq!(found(&files("pub struct C(crate::b::B);")).len(), 1);
        assert_eq!(found(&files("pub struct D(crate::b::B);")), [""; 0]);
    }

    #[test]
    fn tests_comments_and_other_crates_are_no_part_of_it() {
        let root = ("lib.rs", "mod b;\nmod c;\n#[cfg(test)]\nmod t;");
        let b = (
            "b.rs",
            "use crate::c::C;\n// crate::t::T\n#[cfg(test)]\nmod tests { use crate::t::T; }\npub struct B(std::fmt::Error);",
        );
        let c = ("c.rs", "pub struct C(b::B);\n#[cfg(test)]\nmod tests { use crate::b::B; }");
        assert_eq!(found(&[root, b, c, ("t.rs", "use crate::b::B; pub struct T;")]), [""; 0]);
    }

    #[test]
    fn a_macro_counts_where_it_is_written() {
        let files = [
            ("lib.rs", "#[macro_use]\nmod b;\nmod c;"),
            ("b.rs", "macro_rules! row { () => { $crate::c::C } }"),
            ("c.rs", "pub struct C;\nfn f() { row!(); }"),
        ];
        assert_eq!(found(&files).len(), 1);
    }

    #[test]
    fn an_allowance_covers_as_many_files_and_is_found_when_nothing_needs_it() {
        let pair = || {
            let texts = [("lib.rs", "mod b;\nmod c;"), ("b.rs", "use crate::c::C;"), ("c.rs", "use crate::b::B;")];
            let sources = texts.map(|(path, text)| Source::new(&format!("crates/a/src/{path}"), text));
            circles("crates/a", &sources.iter().collect::<Vec<_>>())
        };
        assert_eq!(within(pair(), "crates/a", 2), []);
        assert_eq!(within(pair(), "crates/a", 1).len(), 1);
        assert_eq!(within(Vec::new(), "crates/a", 1)[0].what, "crates/a has no import circle any more");
    }
}

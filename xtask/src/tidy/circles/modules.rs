//! The modules of a crate: which file each is, what it defines, imports and names.

use std::collections::{BTreeMap, BTreeSet};

use super::tokens::{Token, tokens};
use crate::tidy::source::Source;

/// The modules that ship, the crate's root first. Modules with a body in their parent's file are modules too.
pub(super) struct Tree {
    pub(super) modules: Vec<Module>,
    /// The paths of the files.
    pub(super) files: Vec<String>,
    /// Where each `macro_rules!` is written.
    pub(super) macros: BTreeMap<String, usize>,
}

/// A module.
#[derive(Default)]
pub(super) struct Module {
    pub(super) parent: Option<usize>,
    pub(super) children: BTreeMap<String, usize>,
    /// Place in [`Tree::files`].
    pub(super) file: usize,
    pub(super) imports: Vec<Import>,
    /// Items of the module itself.
    pub(super) defined: BTreeSet<String>,
    /// Every name that stands outside `use`.
    pub(super) names: BTreeSet<String>,
    /// Paths of more than one name in code, with their lines.
    pub(super) paths: Vec<(Vec<String>, usize)>,
    /// Macros that are called, with the lines.
    pub(super) calls: Vec<(String, usize)>,
}

/// One name that `use` brings, or a glob.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Import {
    pub(super) path: Vec<String>,
    /// What it is called here; `None` for a glob.
    pub(super) alias: Option<String>,
    pub(super) line: usize,
    /// Whether others may name it from here.
    pub(super) passed_on: bool,
}

impl Tree {
    /// Reads the modules of the crate in `folder` from its root file on, by their `mod` lines.
    pub(super) fn of(folder: &str, sources: &[&Source]) -> Self {
        let mut tree = Self { modules: Vec::new(), files: Vec::new(), macros: BTreeMap::new() };
        for root in ["lib.rs", "main.rs"] {
            let path = format!("{folder}/src/{root}");
            // A package's binary names its library as another crate does: two trees, which share no module.
            if let Some(source) = sources.iter().find(|source| source.path == path) {
                let module = tree.add(None, &source.path);
                tree.read(module, source, &format!("{folder}/src"), sources);
            }
        }
        tree
    }

    fn add(&mut self, parent: Option<usize>, path: &str) -> usize {
        let known = self.files.iter().position(|file| file == path);
        let file = known.unwrap_or_else(|| {
            self.files.push(path.to_owned());
            self.files.len() - 1
        });
        self.modules.push(Module { parent, file, ..Module::default() });
        self.modules.len() - 1
    }

    /// Reads a file and, by its `mod` lines, those below it. `folder` is where the children of `module` lie.
    fn read(&mut self, module: usize, source: &Source, folder: &str, sources: &[&Source]) {
        let below = Reader { tree: self, source, tokens: tokens(&source.shipped), at: 0 }.read(module);
        for (parent, name, inside) in below {
            let folder = inside.iter().fold(folder.to_owned(), |folder, name| format!("{folder}/{name}"));
            let paths = [format!("{folder}/{name}.rs"), format!("{folder}/{name}/mod.rs")];
            if let Some(source) = sources.iter().find(|source| paths.contains(&source.path)) {
                let child = self.add(Some(parent), &source.path);
                self.modules[parent].children.insert(name.clone(), child);
                self.read(child, source, &format!("{folder}/{name}"), sources);
            }
        }
    }
}

/// A `mod name;` line: its module, the name, and the modules with bodies around it.
type Below = (usize, String, Vec<String>);

struct Reader<'a> {
    tree: &'a mut Tree,
    source: &'a Source,
    tokens: Vec<Token<'a>>,
    at: usize,
}

impl<'a> Reader<'a> {
    fn read(mut self, root: usize) -> Vec<Below> {
        let mut below = Vec::new();
        // The module that each open brace belongs to, and its name if the brace opened it.
        let mut braces: Vec<(usize, Option<String>)> = Vec::new();
        while let Some(token) = self.peek(0) {
            let module = braces.last().map_or(root, |(module, _)| *module);
            let at_module_level = braces.last().is_none_or(|(_, opens)| opens.is_some());
            match token.text {
                "mod" if self.peek(1).is_some_and(|name| name.is_name()) => {
                    let name = self.peek(1).map_or("", |name| name.text).to_owned();
                    if self.text(2) == "{" {
                        let path = self.source.path.clone();
                        let child = self.tree.add(Some(module), &path);
                        self.tree.modules[module].children.insert(name.clone(), child);
                        braces.push((child, Some(name)));
                    } else {
                        below.push((module, name, braces.iter().filter_map(|(_, name)| name.clone()).collect()));
                    }
                    self.at += 3;
                }
                "use" if self.text(1) != "<" => self.import(module),
                "{" => {
                    braces.push((module, None));
                    self.at += 1;
                }
                "}" => {
                    braces.pop();
                    self.at += 1;
                }
                _ if token.is_name() => self.name(module, at_module_level),
                _ => self.at += 1,
            }
        }
        below
    }

    fn peek(&self, ahead: usize) -> Option<Token<'a>> {
        self.tokens.get(self.at + ahead).copied()
    }

    fn text(&self, ahead: usize) -> &'a str {
        self.peek(ahead).map_or("", |token| token.text)
    }

    fn before(&self) -> &'a str {
        self.at.checked_sub(1).and_then(|at| self.tokens.get(at)).map_or("", |token| token.text)
    }

    fn line(&self) -> usize {
        self.peek(0).map_or(1, |token| self.source.line_of(token.at))
    }

    /// `use a::{b, c as d, e::*};`
    fn import(&mut self, module: usize) {
        let passed_on = matches!(self.before(), "pub" | ")");
        self.at += 1;
        let mut found = Vec::new();
        self.import_tree(&[], passed_on, &mut found);
        self.at += 1;
        self.tree.modules[module].imports.append(&mut found);
    }

    fn import_tree(&mut self, prefix: &[String], passed_on: bool, found: &mut Vec<Import>) {
        let mut path = prefix.to_vec();
        loop {
            let (token, line) = (self.text(0), self.line());
            self.at += 1;
            match token {
                "::" | "r#" => {}
                "*" => found.push(Import { path: path.clone(), alias: None, line, passed_on }),
                "{" => {
                    while !matches!(self.text(0), "}" | "") {
                        self.import_tree(&path, passed_on, found);
                        if self.text(0) == "," {
                            self.at += 1;
                        }
                    }
                    self.at += 1;
                }
                name => {
                    if name != "self" || path.is_empty() {
                        path.push(name.to_owned());
                    }
                    if self.text(0) != "::" {
                        let renamed = self.text(0) == "as";
                        let alias = if renamed { self.text(1) } else { path.last().map_or("", String::as_str) };
                        found.push(Import { path: path.clone(), alias: Some(alias.to_owned()), line, passed_on });
                        self.at += if renamed { 2 } else { 0 };
                    }
                }
            }
            if matches!(self.text(0), "," | "}" | ";" | "") {
                return;
            }
        }
    }

    /// A name in code: a definition, a macro's call, or the begin of a path.
    fn name(&mut self, module: usize, at_module_level: bool) {
        let (token, line) = (self.text(0), self.line());
        let next = self.peek(1).filter(Token::is_name);
        match (token, next) {
            ("fn" | "struct" | "enum" | "union" | "trait" | "type" | "const" | "static", Some(next))
                if at_module_level =>
            {
                self.tree.modules[module].defined.insert(next.text.to_owned());
            }
            ("macro_rules", _) => {
                let name = self.text(2).to_owned();
                self.tree.macros.insert(name, module);
            }
            _ => {}
        }
        let begins = !matches!(self.before(), "::" | ".");
        let mut path = vec![token.to_owned()];
        while self.text(1) == "::" && self.peek(2).is_some_and(|name| name.is_name()) {
            self.at += 2;
            path.push(self.text(0).to_owned());
        }
        self.at += 1;
        let module = &mut self.tree.modules[module];
        if self.tokens.get(self.at).is_some_and(|mark| mark.text == "!") && path != ["macro_rules"] {
            module.calls.push((path.last().cloned().unwrap_or_default(), line));
        }
        module.names.insert(path[0].clone());
        if begins && path.len() > 1 {
            module.paths.push((path, line));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(text: &str) -> Tree {
        Tree::of("a", &[&Source::new("a/src/lib.rs", text)])
    }

    #[test]
    fn nested_imports_are_taken_apart() {
        let tree = tree("pub use a::{self, b::{C, D as E}, f::*};\nuse g as _;");
        let imports = tree.modules[0].imports.iter();
        let seen: Vec<_> = imports
            .map(|import| (import.path.join("::"), import.alias.clone().unwrap_or("*".into()), import.passed_on))
            .collect();
        let expected =
            [("a", "a", true), ("a::b::C", "C", true), ("a::b::D", "E", true), ("a::f", "*", true), ("g", "_", false)];
        assert_eq!(seen, expected.map(|(path, alias, on)| (path.to_owned(), alias.to_owned(), on)));
    }

    #[test]
    fn items_of_a_module_are_distinguished_from_those_within_items() {
        let tree =
            tree("struct A;\nimpl A { const B: u8 = 1; fn c() {} }\nmod d { pub const E: u8 = 1; }\nconst fn f() {}");
        let names = |module: usize| tree.modules[module].defined.iter().map(String::as_str).collect::<Vec<_>>();
        assert_eq!((names(0), names(1)), (vec!["A", "f", "fn"], vec!["E"]));
        assert_eq!(tree.modules[0].children["d"], 1);
    }

    #[test]
    fn paths_and_macro_calls_are_seen_with_their_lines() {
        let tree = tree("fn a() {\n    crate::b::C::new();\n    x.y::<u8>();\n    row!(d::E);\n}");
        let paths = [("crate::b::C::new", 2), ("d::E", 4)];
        let seen: Vec<_> = tree.modules[0].paths.iter().map(|(path, line)| (path.join("::"), *line)).collect();
        assert_eq!(seen, paths.map(|(path, line)| (path.to_owned(), line)));
        assert_eq!(tree.modules[0].calls, [("row".to_owned(), 4)]);
    }
}

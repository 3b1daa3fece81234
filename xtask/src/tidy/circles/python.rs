//! Which Python module imports which of its package, when it is run: at its top, or later inside a function.
//!
//! What stands under `if TYPE_CHECKING:` is for the type checker, and is not run.

use std::collections::BTreeMap;

use super::graph::{Edge, Graph};

/// The import graph of one package, of its files with their texts.
pub(super) fn graph(files: &[(&str, &str)]) -> Graph {
    let modules: BTreeMap<&str, usize> =
        files.iter().enumerate().filter_map(|(place, (path, _))| Some((module(path)?, place))).collect();
    let edges = files.iter().enumerate().flat_map(|(from, (_, text))| {
        let known = imports(text).into_iter().filter_map(|(line, name)| Some((line, *modules.get(name)?, name)));
        known.filter(move |(_, to, _)| *to != from).map(move |(line, to, name)| Edge {
            from,
            to,
            line,
            name: name.to_owned(),
        })
    });
    Graph::new(files.iter().map(|(path, _)| (*path).to_owned()).collect(), edges)
}

/// `turns` of `python/ferrodrive/turns.py`.
fn module(path: &str) -> Option<&str> {
    path.rsplit('/').next()?.strip_suffix(".py")
}

/// The modules that a text imports from its own package, with their lines.
fn imports(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    // Lines that are further in than this belong to a block that is not run.
    let mut unrun: Option<usize> = None;
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let indent = line.len() - line.trim_start().len();
        if unrun.is_some_and(|block| indent <= block) {
            unrun = None;
        }
        let line = line.trim_start();
        if line.starts_with("if TYPE_CHECKING:") {
            unrun = Some(indent);
        }
        let Some(rest) = line.strip_prefix("from .").filter(|_| unrun.is_none()) else { continue };
        match rest.split_once(" import ") {
            // `from . import turns, words as w`.
            Some(("", names)) => found.extend(names.split(',').filter_map(|name| {
                let name = name.trim().trim_matches(['(', ')']);
                Some((number + 1, name.split_whitespace().next()?))
            })),
            Some((module, _)) => found.push((number + 1, module)),
            None => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circles(files: &[(&str, &str)]) -> usize {
        graph(files).circles().len()
    }

    #[test]
    fn imports_of_both_forms_and_inside_functions_make_a_circle() {
        let back = "\"\"\"Doc.\"\"\"\nfrom .a import A\n";
        assert_eq!(circles(&[("p/a.py", "from . import b, c as d\n"), ("p/b.py", back)]), 1);
        assert_eq!(circles(&[("p/a.py", "def f():\n    from . import x, b\n"), ("p/b.py", back)]), 1);
        assert_eq!(circles(&[("p/a.py", "from .b import (\n    B,\n)\n"), ("p/b.py", back)]), 1);
        assert_eq!(circles(&[("p/a.py", "from .c import C\n"), ("p/b.py", back)]), 0);
    }

    #[test]
    fn what_only_the_type_checker_reads_counts_no_more_than_other_packages() {
        let back = "from .a import A\n";
        let types = "if TYPE_CHECKING:\n    import x\n\n    from .b import B\n";
        assert_eq!(circles(&[("p/a.py", types), ("p/b.py", back)]), 0);
        let after = format!("{types}\nfrom .b import B\n");
        assert_eq!(circles(&[("p/a.py", &after), ("p/b.py", back)]), 1);
        assert_eq!(circles(&[("p/a.py", "from b import B\nimport b\n# from .b import B\n"), ("p/b.py", back)]), 0);
    }
}

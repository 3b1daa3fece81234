//! How long a file and a function may be. Every feared giant was once a small state machine that was not split in time.

use super::finding::Finding;
use super::source::{Source, closing_brace, occurrences};

const FILE_LINES: usize = 600;
const FUNCTION_LINES: usize = 70;

/// A file that is longer than a person reads in one go.
pub(super) fn files(source: &Source) -> Vec<Finding> {
    let lines = source.text.lines().count();
    if lines <= FILE_LINES {
        return Vec::new();
    }
    vec![Finding {
        path: source.path.clone(),
        line: 1,
        rule: "file_size",
        what: format!("{lines} lines (more than {FILE_LINES})"),
        why: "a file is one thing that fits into a head",
        remedy: "split it by subject, or name the exception and its reason in xtask/src/tidy/exceptions.rs",
    }]
}

/// Pages that a person reads before anything else, and how long they may be.
const PAGES: [(&str, usize); 2] = [("README.md", 120), ("CHANGELOG.md", 149)];

/// A first page that has grown.
pub(super) fn pages(path: &str, text: &str) -> Vec<Finding> {
    let lines = text.lines().count();
    let Some((_, most)) = PAGES.into_iter().find(|(page, most)| *page == path && lines > *most) else {
        return Vec::new();
    };
    vec![Finding {
        path: path.to_owned(),
        line: most + 1,
        rule: "page_size",
        what: format!("{lines} lines (more than {most})"),
        why: "who meets the project reads it whole",
        remedy: "move what is for a later day to docs, or shorten it",
    }]
}

/// Functions that are longer than a screen, tests included.
pub(super) fn functions(source: &Source) -> Vec<Finding> {
    let too_long = |function: &Function| function.lines > FUNCTION_LINES;
    let finding = |function: Function| Finding {
        path: source.path.clone(),
        line: function.line,
        rule: "function_size",
        what: format!("fn {} has {} lines (more than {FUNCTION_LINES})", function.name, function.lines),
        why: "a function is one step that reads in one look",
        remedy: "name its parts and move them below it, or name the exception and its reason in xtask/src/tidy/exceptions.rs",
    };
    list(source).into_iter().filter(too_long).map(finding).collect()
}

struct Function {
    name: String,
    line: usize,
    lines: usize,
}

fn list(source: &Source) -> Vec<Function> {
    occurrences(&source.code, "fn").into_iter().filter_map(|at| function_at(source, at)).collect()
}

/// The function whose `fn` stands at `at`; `None` for a function pointer type or a function without a body.
fn function_at(source: &Source, at: usize) -> Option<Function> {
    let code = &source.code;
    let after = code[at + 2..].trim_start();
    let name: String = after.chars().take_while(|char| char.is_alphanumeric() || *char == '_').collect();
    if name.is_empty() {
        return None;
    }
    let open = body_start(code, at)?;
    let (line, last) = (source.line_of(at), source.line_of(closing_brace(code, open)));
    Some(Function { name, line, lines: last - line + 1 })
}

/// The first brace after the signature, unless a semicolon ends it. Types such as `[u8; 4]` have semicolons of their own.
fn body_start(code: &str, from: usize) -> Option<usize> {
    let mut depth = 0_i32;
    for (at, byte) in code.bytes().enumerate().skip(from) {
        match byte {
            b'(' | b'[' => depth += 1,
            b')' | b']' => depth -= 1,
            b';' if depth == 0 => return None,
            b'{' if depth == 0 => return Some(at),
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_file_is_found() {
        assert_eq!(files(&Source::new("a.rs", &"\n".repeat(600))), []);
        assert_eq!(files(&Source::new("a.rs", &"\n".repeat(601))).len(), 1);
    }

    #[test]
    fn a_first_page_that_has_grown_is_found() {
        for (page, most) in PAGES {
            assert_eq!(pages(page, &"x\n".repeat(most)), []);
            let found = pages(page, &"x\n".repeat(most + 1));
            assert_eq!((found.len(), found[0].line), (1, most + 1));
        }
        assert_eq!(pages("docs/README.md", &"x\n".repeat(1000)), []);
    }

    #[test]
    fn a_long_function_is_found_with_its_name_and_line() {
        let text =
            format!("struct A;\nimpl A {{\n    fn long(x: [u8; 4]) -> [u8; 4] {{\n{}    }}\n}}\n", "f();\n".repeat(69));
        let found = functions(&Source::new("a.rs", &text));
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].line, found[0].what.as_str()), (3, "fn long has 71 lines (more than 70)"));
    }

    #[test]
    fn function_pointers_and_signatures_without_a_body_have_no_size() {
        let text = format!("struct A {{ f: fn(u8) -> u8 }}\ntrait B {{ fn f(&self);\n{}}}\n", "\n".repeat(80));
        assert_eq!(functions(&Source::new("a.rs", &text)), []);
    }

    #[test]
    fn braces_in_strings_do_not_count() {
        let text = format!("fn short() {{ f(\"{{\"); }}\n{}", "const A: u8 = 1;\n".repeat(80));
        assert_eq!(functions(&Source::new("a.rs", &text)), []);
    }
}

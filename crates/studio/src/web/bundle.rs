//! The modules of the page as two scripts, the second for what the first picture does not need: a browser on a slow line fetches two
//! files instead of some sixty, one import after the other.
//!
//! In: modules in the form that the page keeps to (an `import { a, b } from "./x.js";` is a line of its own, and every export is a
//! declaration). Out: each module as a function, called once, after those that it imports; lines that are only a comment are left
//! out. Both scripts export all of them as `modules`, by file name. They are made by the server, so that a build needs no bundler.

use std::fmt::Write;

/// A file of the page: its name and its text.
pub(super) type Module<'a> = (&'a str, &'a str);

/// One script that has `entry` and all that it imports; and a second one of the module that it imports later, `await import("./x.js")`,
/// with what only that one needs. The second one is called `later`, the first one `first`.
///
/// # Panics
/// If an import is not among `files`, or modules import each other in a circle: the page's own tests would not pass either.
pub(super) fn bundles(files: &[Module<'_>], entry: &str, first: &str, later: &str) -> [String; 2] {
    let mut done = Vec::new();
    let mut script = String::from("const modules = {};\n");
    append(&mut script, files, entry, &mut done, &mut Vec::new());
    let mut second = format!("import {{ modules }} from \"./{first}\";\n");
    if let Some((before, name, after)) = imported_later(&script) {
        append(&mut second, files, name, &mut done, &mut Vec::new());
        let by_name = format!("{before}(await import(\"./{later}\")).modules[\"{name}\"]{after}");
        script = by_name;
    }
    [script, second].map(|script| script + "export { modules };\n")
}

/// What stands before and after `await import("./x.js")`, and the name of the file.
fn imported_later(script: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = script.split_once("await import(\"./")?;
    let (name, after) = rest.split_once("\")")?;
    Some((before, name, after))
}

fn append<'a>(
    script: &mut String,
    files: &[Module<'a>],
    name: &str,
    done: &mut Vec<&'a str>,
    under_way: &mut Vec<&'a str>,
) {
    let found = files.iter().find(|(of, _)| *of == name);
    let &(name, text) = found.unwrap_or_else(|| panic!("{name} is imported and not a file of the page"));
    if done.contains(&name) {
        return;
    }
    assert!(!under_way.contains(&name), "{name} imports itself by way of {under_way:?}");
    under_way.push(name);
    let mut body = String::new();
    let mut exported = Vec::new();
    for line in code(text) {
        if let Some((names, from)) = imported(line) {
            append(script, files, from, done, under_way);
            // Renamed in an import by `as`, in a pattern by a colon.
            let _ = writeln!(body, "const {{ {} }} = modules[\"{from}\"];", names.replace(" as ", ": "));
        } else if let Some(declaration) = line.strip_prefix("export ") {
            exported.push(declared(declaration));
            let _ = writeln!(body, "{declaration}");
        } else {
            let _ = writeln!(body, "{line}");
        }
    }
    let _ = writeln!(script, "modules[\"{name}\"] = (() => {{\n{body}return {{ {} }};\n}})();", exported.join(", "));
    under_way.pop();
    done.push(name);
}

/// The lines that are not only a comment, without their indentation.
fn code(text: &str) -> impl Iterator<Item = &str> {
    let mut in_comment = false;
    text.lines().map(str::trim).filter(move |line| {
        let begins = line.starts_with("/*");
        let is_comment = in_comment || begins || line.starts_with("//");
        in_comment = (in_comment || begins) && !line.ends_with("*/");
        !is_comment && !line.is_empty()
    })
}

/// The names, and the file, of `import { a, b as c } from "./x.js";`.
fn imported(line: &str) -> Option<(&str, &str)> {
    let (names, from) = line.strip_prefix("import {")?.split_once("} from \"./")?;
    Some((names.trim(), from.strip_suffix("\";")?))
}

/// The name of `async function name(..) {`, `const name = ..` and `class Name {`.
fn declared(declaration: &str) -> &str {
    let words = ["async ", "function ", "const ", "class "];
    let rest = words.iter().fold(declaration, |rest, word| rest.strip_prefix(word).unwrap_or(rest));
    rest.split(|sign: char| !sign.is_alphanumeric() && sign != '_').next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_stands_once_and_after_those_that_it_imports() {
        let files = [
            (
                "main.js",
                "// Title.\nimport { a } from \"./a.js\";\nimport { b as c } from \"./b.js\";\n\nexport async function go() {\n  return [a(c), await import(\"./views.js\")];\n}\n",
            ),
            (
                "a.js",
                "import { b } from \"./b.js\";\n/**\n * Doubles.\n */\nexport async function a(x) {\n  return x * b;\n}\n",
            ),
            ("b.js", "/** Two. */\nexport const b = 2;\nexport class D {}\n"),
            ("views.js", "import { b } from \"./b.js\";\nimport { c } from \"./c.js\";\nexport const views = b + c;\n"),
            ("c.js", "export const c = 3;\n"),
            ("unused.js", "export const unused = 1;\n"),
        ];
        let expected = "const modules = {};\n\
            modules[\"b.js\"] = (() => {\nconst b = 2;\nclass D {}\nreturn { b, D };\n})();\n\
            modules[\"a.js\"] = (() => {\nconst { b } = modules[\"b.js\"];\nasync function a(x) {\nreturn x * b;\n}\nreturn { a };\n})();\n\
            modules[\"main.js\"] = (() => {\nconst { a } = modules[\"a.js\"];\nconst { b: c } = modules[\"b.js\"];\nasync function go() {\nreturn [a(c), (await import(\"./later.js\")).modules[\"views.js\"]];\n}\nreturn { go };\n})();\n\
            export { modules };\n";
        let second = "import { modules } from \"./first.js\";\n\
            modules[\"c.js\"] = (() => {\nconst c = 3;\nreturn { c };\n})();\n\
            modules[\"views.js\"] = (() => {\nconst { b } = modules[\"b.js\"];\nconst { c } = modules[\"c.js\"];\nconst views = b + c;\nreturn { views };\n})();\n\
            export { modules };\n";
        assert_eq!(bundles(&files, "main.js", "first.js", "later.js"), [expected, second]);
    }

    #[test]
    #[should_panic(expected = "a.js imports itself")]
    fn a_circle_is_found() {
        let files = [("a.js", "import { b } from \"./b.js\";\n"), ("b.js", "import { a } from \"./a.js\";\n")];
        bundles(&files, "a.js", "first.js", "later.js");
    }
}

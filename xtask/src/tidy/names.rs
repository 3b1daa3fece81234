//! Names of types that stand in many places: a reader who meets one cannot tell which is meant.

use std::collections::BTreeMap;

use super::finding::Finding;
use super::source::Source;

/// From how many definitions on a name counts.
const MANY: usize = 4;
/// How many such names there may be: the drives' own (`Sensors`, `PowerStage`) and those that every protocol has (`Request`).
const MOST: usize = 20;

/// Too many names of types that stand four times or more.
pub(super) fn repeated(sources: &[Source]) -> Vec<Finding> {
    let mut named: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for source in sources.iter().filter(|source| is_counted(&source.path)) {
        source.code.lines().filter_map(defined).for_each(|name| named.entry(name).or_default().push(&source.path));
    }
    named.retain(|_, paths| paths.len() >= MANY);
    if named.len() <= MOST {
        return Vec::new();
    }
    let mut fewest: Vec<_> = named.iter().collect();
    fewest.sort_by_key(|(_, paths)| paths.len());
    let finding = |(name, paths): (&&str, &Vec<&str>)| Finding {
        path: (*paths.last().expect("four or more")).to_owned(),
        line: 1,
        rule: "names",
        what: format!(
            "`{name}` is defined {} times, one of {} such names; {MOST} are the most",
            paths.len(),
            named.len()
        ),
        why: "a reader who meets it cannot tell which is meant",
        remedy: "call the type by what it is: `ServerReply`, not `Reply`",
    };
    fewest.into_iter().take(named.len() - MOST).map(finding).collect()
}

fn is_counted(path: &str) -> bool {
    path.contains("/src/") && !path.starts_with("fuzz/") && !path.contains("/tests/") && !path.ends_with("tests.rs")
}

/// The type that a line at the outermost level defines: its keyword follows the visibility.
fn defined(line: &str) -> Option<&str> {
    let mut words = line.split(' ').skip_while(|word| word.starts_with("pub"));
    let is_type = ["struct", "enum", "trait", "type", "union"].contains(&words.next()?);
    words.next().filter(|_| is_type)?.split(|letter: char| !letter.is_alphanumeric()).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many names, each defined four times.
    fn found(names: usize) -> Vec<String> {
        let text: String = (0..names).map(|number| format!("pub(crate) struct Name{number}<'a> {{\n}}\n")).collect();
        let sources: Vec<_> = (0..MANY).map(|file| Source::new(&format!("crates/a/src/{file}.rs"), &text)).collect();
        repeated(&sources).into_iter().map(|finding| finding.what).collect()
    }

    #[test]
    fn a_name_beyond_the_most_is_found() {
        assert_eq!(found(MOST), [""; 0]);
        assert_eq!(found(MOST + 1).len(), 1);
        assert!(found(MOST + 1)[0].starts_with("`Name0` is defined 4 times, one of 21 such names"));
    }

    #[test]
    fn what_is_inside_a_function_or_a_test_is_not_counted() {
        assert_eq!(defined("pub enum Kind {"), Some("Kind"));
        assert_eq!(defined("type Row = u8;"), Some("Row"));
        assert_eq!(defined("    struct Inner;"), None);
        assert!(
            is_counted("tests/src/a.rs")
                && !is_counted("crates/a/src/tests/b.rs")
                && !is_counted("tests/tests/it/a.rs")
        );
    }
}

//! What the rules overlook, each with its reason. An exception that matches nothing is itself a finding.

use super::finding::Finding;

/// One finding that stands.
pub(super) struct Exception {
    /// The rule's name.
    rule: &'static str,
    path: &'static str,
    /// A part of the finding's first words, to tell two findings of one file apart; empty for all of that rule.
    what: &'static str,
    /// Why it stands.
    #[allow(dead_code, reason = "it is for the reader of this list")]
    reason: &'static str,
}

/// The list.
pub(super) const EXCEPTIONS: &[Exception] = &[];

/// Crates whose import circles are not all mended yet, and how many of their files still lie in one. The numbers only
/// fall.
pub(super) const STILL_IN_CIRCLES: &[(&str, usize)] = &[];

/// The findings without those that an exception names, and a finding for each exception that names none.
pub(super) fn apply(mut found: Vec<Finding>, exceptions: &[Exception]) -> Vec<Finding> {
    for exception in exceptions {
        let before = found.len();
        found.retain(|finding| !covers(exception, finding));
        if found.len() == before {
            found.push(Finding {
                path: "xtask/src/tidy/exceptions.rs".to_owned(),
                line: 1,
                rule: "exceptions",
                what: format!("the exception for {} in {}", exception.rule, exception.path),
                why: "nothing needs it any more",
                remedy: "remove it from the list",
            });
        }
    }
    found
}

fn covers(exception: &Exception, finding: &Finding) -> bool {
    exception.rule == finding.rule && exception.path == finding.path && finding.what.contains(exception.what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(path: &str, what: &str) -> Finding {
        Finding { path: path.into(), line: 1, rule: "sample", what: what.into(), why: "", remedy: "" }
    }

    const ONE: Exception = Exception { rule: "sample", path: "a.rs", what: "long", reason: "a table" };

    #[test]
    fn an_exception_covers_its_finding_and_no_other() {
        let found =
            apply(vec![finding("a.rs", "fn long"), finding("a.rs", "fn other"), finding("b.rs", "fn long")], &[ONE]);
        assert_eq!(found, [finding("a.rs", "fn other"), finding("b.rs", "fn long")]);
    }

    #[test]
    fn an_exception_that_nothing_needs_is_found() {
        let found = apply(Vec::new(), &[ONE]);
        assert_eq!(found[0].what, "the exception for sample in a.rs");
    }
}

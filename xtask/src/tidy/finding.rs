//! What a rule says of the place where it is broken.

use std::fmt;

/// Something that a rule found. Printed as `path:line: what: why: what to do`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Finding {
    pub(super) path: String,
    pub(super) line: usize,
    /// The rule's name, which an exception refers to.
    pub(super) rule: &'static str,
    pub(super) what: String,
    pub(super) why: &'static str,
    pub(super) remedy: &'static str,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}: {}: {}", self.path, self.line, self.what, self.why, self.remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_says_where_what_why_and_what_to_do() {
        let finding = Finding {
            path: "a.rs".into(),
            line: 3,
            rule: "sample",
            what: "a thing".into(),
            why: "it is bad",
            remedy: "do another",
        };
        assert_eq!(finding.to_string(), "a.rs:3: a thing: it is bad: do another");
    }
}

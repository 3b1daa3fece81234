use crate::{Finding, Rule};

/// A finding about an object or sub-object, with nothing taken instead.
pub(super) fn finding(rule: Rule, line: u32, index: u16, sub_index: Option<u8>, what: String) -> Finding {
    let section = match sub_index {
        Some(sub_index) => format!("{index:04X}sub{sub_index:X}"),
        None => format!("{index:04X}"),
    };
    Finding { line, section, key: None, rule, what, taken_instead: None }
}

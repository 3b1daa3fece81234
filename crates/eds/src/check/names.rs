//! Names and letters that other tools stumble over.

use super::at::finding;
use crate::document::{Document, Encoding};
use crate::{Finding, Findings, Object, Rule};

/// Letters beyond ASCII, reported once a file.
pub(super) fn letters(document: &Document, findings: &mut Findings) {
    if document.encoding() == Encoding::Ascii {
        return;
    }
    let first = document.lines().find(|(_, _, text)| !text.is_ascii()).map_or(1, |(line, ..)| line);
    findings.push(Finding {
        line: first,
        section: String::new(),
        key: None,
        rule: Rule::Letters,
        what: "letters beyond ASCII, which CiA 306 does not have".into(),
        taken_instead: Some(document.encoding().name().into()),
    });
}

/// Characters at which common readers of such files cut a line.
pub(super) fn object(object: &Object, findings: &mut Findings) {
    if object.name.contains(CUTTING) {
        findings.push(finding(Rule::CutName, object.line, object.index, None, text(&object.name)));
    }
    for variable in object.variables.iter().filter(|variable| variable.line != object.line) {
        if variable.name.contains(CUTTING) {
            let (line, sub_index) = (variable.line, variable.sub_index);
            findings.push(finding(Rule::CutName, line, object.index, Some(sub_index), text(&variable.name)));
        }
    }
}

/// What begins a comment or a value for one reader or another.
pub(crate) const CUTTING: [char; 3] = ['#', ';', '='];

fn text(name: &str) -> String {
    let cut = name.chars().find(|letter| CUTTING.contains(letter)).unwrap_or('#');
    format!("some tools cut a name at {cut:?}")
}

//! What only shows when a file is looked at as a whole: traps for tools that work with it.

mod at;
pub(crate) mod names;
mod pdo;
mod records;

use crate::document::Document;
use crate::{Eds, Finding, Findings, Severity};

/// All checks.
pub(crate) fn all(document: &Document, eds: &Eds, findings: &mut Findings) {
    mandatory(eds, findings);
    names::letters(document, findings);
    for object in &eds.objects {
        names::object(object, findings);
        records::object(object, findings);
    }
    pdo::identifiers(eds, findings);
    pdo::mappings(eds, findings);
}

/// Every device has 1000h, 1001h and 1018h (CiA 301, 7.5.2).
fn mandatory(eds: &Eds, findings: &mut Findings) {
    for index in [0x1000, 0x1001, 0x1018] {
        if eds.object(index).is_none() {
            findings.push(Finding {
                line: 0,
                section: String::new(),
                key: None,
                severity: Severity::Error,
                what: format!("the mandatory object {index:04X}h is missing"),
                taken_instead: Some("a device without it".into()),
            });
        }
    }
}

#[cfg(test)]
mod tests;

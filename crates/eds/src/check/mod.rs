//! What only shows when a file is looked at as a whole: traps for tools that work with it.

mod at;
mod device;
pub(crate) mod names;
mod pdo;
mod records;

use crate::document::Document;
use crate::{Eds, Finding, Findings, Rule, Value};

/// All checks.
pub(crate) fn all(document: &Document, eds: &Eds, findings: &mut Findings) {
    mandatory(eds, findings);
    names::letters(document, findings);
    for object in &eds.objects {
        names::object(object, findings);
        records::object(object, findings);
    }
    device::info(document, eds, findings);
    modes(eds, findings);
    pdo::identifiers(eds, findings);
    pdo::shared_identifiers(eds, findings);
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
                rule: Rule::Mandatory,
                what: format!("the mandatory object {index:04X}h is missing"),
                taken_instead: Some("a device without it".into()),
            });
        }
    }
}

/// Which modes a drive has (6502h; CiA 402-2): a file that leaves it to the device leaves it to each reader of the file.
fn modes(eds: &Eds, findings: &mut Findings) {
    // Each axis in a block of 800h (CiA 402-1).
    for offset in (0..8).map(|axis| axis * 0x800) {
        let is_drive = [0x6040, 0x6041].iter().all(|index| eds.variable(index + offset, 0).is_some());
        let Some(said) = eds.variable(0x6502 + offset, 0).filter(|_| is_drive) else { continue };
        let is_open = match said.value_or_default() {
            None => true,
            Some(Value::Number(number)) => number.base == 0,
            Some(_) => false,
        };
        if is_open {
            let what = "says no mode of operation: tools that take the modes from it have none".to_owned();
            let mut found = at::finding(Rule::Modes, said.line, 0x6502 + offset, None, what);
            found.taken_instead = Some("the modes whose objects are there".into());
            findings.push(found);
        }
    }
}

#[cfg(test)]
mod tests;

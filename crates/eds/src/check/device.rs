//! `[DeviceInfo]` against the objects: who the device is, how many PDOs it has. Source: CiA 306-1, general device information.

use crate::document::Document;
use crate::value::Number;
use crate::{Eds, Finding, Findings, Rule, Value};

pub(super) fn info(document: &Document, eds: &Eds, findings: &mut Findings) {
    let device = &eds.device;
    let numbers = [
        ("VendorNumber", device.vendor_number, 1),
        ("ProductNumber", device.product_number, 2),
        ("RevisionNumber", device.revision_number, 3),
    ];
    for (key, said, sub_index) in numbers {
        let (Some(said), Some(variable)) = (said, eds.variable(0x1018, sub_index)) else { continue };
        let Some(Value::Number(Number { base, plus_node_id: false })) = variable.value_or_default() else { continue };
        if *base != i128::from(said) {
            let what = format!("{said:#X}, but 1018h:{sub_index:02X} is {base:#X}");
            findings.push(finding(document, key, Rule::DeviceIdentity, what));
        }
    }
    for (key, said, first) in [("NrOfRXPDO", device.rpdos, 0x1400), ("NrOfTXPDO", device.tpdos, 0x1800)] {
        let last = first + 0x1FF;
        let there = eds.objects.iter().filter(|object| (first..=last).contains(&object.index)).count();
        if let Some(said) = said.filter(|said| usize::from(*said) != there) {
            let what = format!("{said}, but {there} of {first:04X}h to {last:04X}h are described");
            findings.push(finding(document, key, Rule::PdoCount, what));
        }
    }
}

fn finding(document: &Document, key: &str, rule: Rule, what: String) -> Finding {
    let entry = document.section("DeviceInfo").and_then(|section| section.entry(key));
    let (line, key) = (entry.map_or(0, |entry| entry.line), Some(key.to_owned()));
    Finding { line, section: "DeviceInfo".to_owned(), key, rule, what, taken_instead: None }
}

//! PDOs as delivered: what is mapped, and under which identifiers. Source: CiA 301, 7.5.2.33 to 7.5.2.38.

use std::collections::BTreeMap;

use canopen::{CobId, Mux};

use super::at::finding;
use crate::value::Number;
use crate::{Eds, Findings, Rule, TypeCode, Value};

/// Identifiers that depend on the node-ID (the pre-defined connection set) and are written without it.
pub(super) fn identifiers(eds: &Eds, findings: &mut Findings) {
    for (index, sub_index, base) in predefined() {
        let Some(variable) = eds.variable(index, sub_index) else { continue };
        let Some(Value::Number(Number { base: value, plus_node_id: false })) = variable.default else { continue };
        // Bits 29 to 31 are not part of the identifier.
        if value & 0x1FFF_FFFF == i128::from(base) {
            let what = format!("{base:X}h without $NODEID: every node would have the same identifier");
            let sub_index = (index != 0x1014).then_some(sub_index);
            findings.push(finding(Rule::Identifier, variable.line, index, sub_index, what));
        }
    }
}

/// Two things that the device sends, or two that it takes, under one identifier as delivered.
pub(super) fn shared_identifiers(eds: &Eds, findings: &mut Findings) {
    let of_pdos = |first: u16| move |index: &u16| (first..=first + 0x1FF).contains(index);
    let pdos = |first| eds.objects.iter().map(|object| object.index).filter(of_pdos(first)).map(|index| (index, 1));
    let sent = [(0x1014, 0), (0x1200, 2)].into_iter().chain(pdos(0x1800)).collect::<Vec<_>>();
    let taken = [(0x1200, 1)].into_iter().chain(pdos(0x1400)).collect::<Vec<_>>();
    for places in [sent, taken] {
        let mut seen = BTreeMap::new();
        for (index, sub_index) in places {
            let Some(variable) = eds.variable(index, sub_index) else { continue };
            let Some(Value::Number(number)) = variable.value_or_default() else { continue };
            if number.base & i128::from(CobId::INVALID) != 0 {
                continue;
            }
            let node_id = eds.commissioning.as_ref().and_then(|device| device.node_id);
            let plus_node_id = number.plus_node_id && node_id.is_none();
            let identifier = node_id.map_or(number.base, |node_id| number.at_node(node_id)) & 0x1FFF_FFFF;
            if let Some(first) = seen.insert((identifier, plus_node_id), index) {
                let what =
                    format!("{} is the identifier of {first:04X}h, too", Number { base: identifier, plus_node_id });
                let sub_index = (index != 0x1014).then_some(sub_index);
                findings.push(finding(Rule::SharedIdentifier, variable.line, index, sub_index, what));
            }
        }
    }
}

/// Where identifiers of the pre-defined connection set stand, and what they are without the node-ID.
fn predefined() -> impl Iterator<Item = (u16, u8, u32)> {
    let of_pdos = (0..4_u16).flat_map(|pdo| {
        [(0x1400 + pdo, 1, 0x200 + 0x100 * u32::from(pdo)), (0x1800 + pdo, 1, 0x180 + 0x100 * u32::from(pdo))]
    });
    [(0x1014, 0, 0x80), (0x1200, 1, 0x600), (0x1200, 2, 0x580)].into_iter().chain(of_pdos)
}

/// Each object that is mapped as delivered: it is there, it may be mapped, its length is that.
pub(super) fn mappings(eds: &Eds, findings: &mut Findings) {
    let of_pdos = eds.objects.iter().filter(|object| matches!(object.index, 0x1600..=0x17FF | 0x1A00..=0x1BFF));
    for object in of_pdos {
        let is_rpdo = object.index < 0x1800;
        let count = match object.variable(0).and_then(|variable| variable.default.as_ref()) {
            Some(Value::Number(number)) => number.base.clamp(0, 64) as u8,
            _ => 0,
        };
        let mut bits = 0;
        for variable in object.variables.iter().filter(|variable| (1..=count).contains(&variable.sub_index)) {
            let Some(Value::Number(Number { base, plus_node_id: false })) = variable.default else { continue };
            let Ok(mapped) = u32::try_from(base) else { continue };
            bits += mapped & 0xFF;
            if let Some(what) = wrong(eds, mapped, is_rpdo) {
                let sub_index = Some(variable.sub_index);
                findings.push(finding(Rule::Mapping, variable.line, object.index, sub_index, what));
            }
        }
        if bits > 64 {
            let what = format!("{bits} bits are mapped as delivered; a PDO has 64");
            findings.push(finding(Rule::MappingLength, object.line, object.index, None, what));
        }
    }
}

/// What is wrong with a mapping record.
fn wrong(eds: &Eds, mapped: u32, is_rpdo: bool) -> Option<String> {
    let (name, bits) = (Mux::from_key(mapped >> 8), mapped as u8);
    let Mux { index, sub_index } = name;
    if mapped == 0 {
        return Some("counted, but nothing is mapped".into());
    }
    if index < 0x20 {
        let length = TypeCode(index).bits();
        let allowed = eds.dummies.iter().any(|(code, allowed)| code.0 == index && *allowed);
        return match length {
            Some(length) if length == bits && allowed => None,
            Some(length) if length == bits => {
                Some(format!("{} is mapped, but [DummyUsage] does not allow it", TypeCode(index)))
            }
            _ => Some(format!("the placeholder {name} does not have {bits} bits")),
        };
    }
    let Some(variable) = eds.variable(index, sub_index) else {
        return Some(format!("{name} is mapped, but there is no such object"));
    };
    if variable.data_type.bits().is_some_and(|length| length != bits) {
        return Some(format!("{name} is mapped with {bits} bits, but is {}", variable.data_type));
    }
    let fits = if is_rpdo { variable.access.fits_rpdo() } else { variable.access.fits_tpdo() };
    match (variable.pdo_mapping, fits) {
        (false, _) => Some(format!("{name} is mapped, but its PDOMapping is 0")),
        (true, false) => Some(format!("{name} is mapped, but its access is {}", variable.access.name())),
        (true, true) => None,
    }
}

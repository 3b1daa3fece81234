//! The tables of the M joint's firmware and the data read from its manual, laid side by side. Two people made the two.

use canopen::NodeId;
use canopen::od::{Access, Default, Dictionary, Entry, PdoMapping};
use cia402::Controlword;
use drives::mjoint::objects::modbus::REGISTERS;
use drives::mjoint::objects::{ROW_COUNT, TABLE};
use drives::mjoint::statusword::{Condition, statusword};
use drives::profile::model;
use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::mjoint::{MODELS, Situation, figures, objects, situations};

#[test]
fn the_joint_has_exactly_the_objects_of_the_manual() {
    let ours: Vec<_> = TABLE.rows().iter().map(|row| (row.index, row.sub_index)).collect();
    let manual: Vec<_> = objects().iter().map(|joint| (joint.row.index, joint.row.sub)).collect();
    assert_eq!(ours, manual);
}

#[test]
fn every_object_agrees_with_the_manual_in_every_column() {
    let rows = objects();
    let differences: Vec<String> =
        TABLE.rows().iter().zip(&rows).flat_map(|(ours, joint)| differences(ours, &joint.row)).collect();
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}

fn differences(ours: &Entry, row: &ObjectRow) -> Vec<String> {
    let default = match ours.default {
        Default::Value(value) => Some(value),
        Default::NodeIdPlus(base) => Some(i64::from(base) + 1),
        Default::Text(_) => None,
    };
    let shown = |default: Option<i64>| if row.live || row.default.is_none() { None } else { default };
    let pairs = [
        ("size", ours.data_type.size().to_string(), row.size.to_string()),
        ("signed", ours.data_type.is_signed().to_string(), row.signed.to_string()),
        ("writable", ours.access.is_writable().to_string(), row.writable.to_string()),
        ("readable", (ours.access != Access::WriteOnly).to_string(), true.to_string()),
        ("stored", ours.stored.to_string(), row.stored.to_string()),
        ("mappable", (ours.pdo == PdoMapping::Yes).to_string(), row.pdo_mappable.to_string()),
        ("default", format!("{:?}", shown(default)), format!("{:?}", shown(row.default))),
    ];
    let at = format!("{:04X}h:{:02X} {}", row.index, row.sub, row.name);
    let differs = pairs.iter().filter(|(_, ours, manual)| ours != manual);
    let mut found: Vec<String> = differs.map(|(what, a, b)| format!("{at}: {what}: drive {a}, manual {b}")).collect();
    found.extend(limit_differences(ours, row).iter().map(|text| format!("{at}: {text}")));
    found
}

/// The bounds are taken and what lies beyond is refused.
fn limit_differences(ours: &Entry, row: &ObjectRow) -> Vec<String> {
    if !row.writable {
        return Vec::new();
    }
    let dictionary: Dictionary<ROW_COUNT> = Dictionary::new(&TABLE, NodeId::MIN);
    let slot = TABLE.find(ours.mux()).expect("a row of the table");
    let (least, most) = ours.data_type.range();
    let (low, high) = row.limits.unwrap_or((least, most));
    let cases = [(low, true), (high, true), (low - 1, false), (high + 1, false)];
    let possible = cases.into_iter().filter(|(value, _)| (least..=most).contains(value));
    let differs =
        |&(value, taken): &(i64, bool)| dictionary.check_write(slot, ours.data_type.raw(value)).is_ok() != taken;
    possible.filter(differs).map(|(value, taken)| format!("{value}: taken should be {taken}")).collect()
}

#[test]
fn the_modbus_addresses_are_the_manuals() {
    let mut manual: Vec<_> = objects()
        .iter()
        .filter_map(|joint| joint.registers.map(|(address, words)| (address, joint.row.index, joint.row.sub, words)))
        .collect();
    manual.sort_unstable();
    let ours: Vec<_> = REGISTERS
        .iter()
        .map(|register| (register.address, register.object.index, register.object.sub_index, u16::from(register.words)))
        .collect();
    assert_eq!(ours, manual);
}

#[test]
fn the_statusword_mirrors_the_controlword_in_every_situation() {
    for situation in situations() {
        assert_eq!(statusword(&condition(&situation)).0, situation.statusword, "{}", situation.event);
    }
}

fn condition(situation: &Situation) -> Condition {
    Condition {
        controlword: Controlword(situation.controlword),
        output_enabled: situation.output_enabled,
        alarm: situation.alarm != 0,
        live: situation.live,
        reached: situation.reached,
        homing_attained: situation.homing == "attained",
        homing_error: situation.homing == "failed",
    }
}

#[test]
fn the_four_models_have_the_ratio_and_highest_speed_of_the_manual() {
    use drives::mjoint::Model;
    let ours = [Model::M4230E17B50, Model::M4230E17B80, Model::M8025E25B50, Model::M8025E25B80];
    let figure = |parameter: &str| {
        figures().into_iter().find(|figure| figure.parameter == parameter).expect("a figure of the table").values
    };
    assert_eq!(ours.map(|model| model.name), MODELS);
    assert_eq!(ours.map(|model| model.ratio), figure("Reduction ratio"));
    assert_eq!(ours.map(|model| model.max_rpm), figure("Maximum rotational speed"));
    assert!(MODELS.iter().all(|name| model(name).is_some_and(|profile| profile.model == *name)));
}

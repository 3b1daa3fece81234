//! What only the M joint has of tables, beside the data read from its manual.

use cia402::Controlword;
use devices::model;
use drives::mjoint::objects::TABLE;
use drives::mjoint::objects::modbus::REGISTERS;
use drives::mjoint::statusword::{StatusCondition, statusword};
use ferrodrive_tests::bench::mjoint::figure;
use ferrodrive_tests::mjoint::{MODELS, Situation, objects, situations};

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

fn condition(situation: &Situation) -> StatusCondition {
    StatusCondition {
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
    let ours = ferrodrive_tests::bench::mjoint::MODELS;
    assert_eq!(ours.map(|model| model.name), MODELS);
    assert_eq!(ours.map(|model| model.ratio), figure("Reduction ratio"));
    assert_eq!(ours.map(|model| model.max_rpm), figure("Maximum rotational speed"));
    assert!(MODELS.iter().all(|name| model(name).is_some_and(|profile| profile.name == *name)));
}

#[test]
fn the_words_of_2609h_say_at_which_level_of_dir_the_motor_turns_clockwise() {
    // 5.04: 0, it does so while DIR does not conduct; 1, while it conducts.
    let row = TABLE.row(TABLE.slot(0x2609, 0));
    let words: Vec<_> = row.values.iter().map(|(value, word)| (*value, *word)).collect();
    assert_eq!(words.len(), 2);
    assert!(words[0].0 == 0 && words[0].1.contains("does not conduct"), "{words:?}");
    assert!(words[1].0 == 1 && words[1].1.ends_with("while DIR conducts"), "{words:?}");
}

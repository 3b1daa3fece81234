//! The tables of the ZLIM42-C's firmware and the data read from its manual, laid side by side.

use canopen::NodeId;
use drives::zlim42c::objects::{ROW_COUNT, TABLE};
use ferrodrive_tests::manual::PowerCell;
use ferrodrive_tests::side_by_side;
use ferrodrive_tests::zlim42c::{objects, power_states};

#[test]
fn the_drive_has_exactly_the_objects_of_the_manual() {
    side_by_side::objects_are_the_manuals(&TABLE, &objects());
}

#[test]
fn every_object_agrees_with_the_manual_in_every_column() {
    side_by_side::columns_are_the_manuals::<ROW_COUNT>(&TABLE, &objects(), NodeId::MIN);
}

#[test]
fn the_power_state_machine_agrees_with_the_table_of_states_and_events() {
    side_by_side::transitions_are_the_manuals(&power_cells());
}

#[test]
fn the_statusword_bits_of_each_state_are_those_of_the_table() {
    side_by_side::state_bits_are_the_manuals(&power_cells());
}

fn power_cells() -> Vec<PowerCell> {
    power_states().into_iter().map(|energised| energised.cell).collect()
}

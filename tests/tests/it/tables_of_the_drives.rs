//! The tables that the drives are built from and the data read from their manuals, laid side by side. Two people made the two.

use canopen::NodeId;
use drives::{mjoint, zlac8030l, zlim42c};
use ferrodrive_tests::bench::BenchSubject;
use ferrodrive_tests::bench::cia402::Cia402;
use ferrodrive_tests::bench::mjoint::MJoint;
use ferrodrive_tests::bench::zlac8030l::Zlac8030l;
use ferrodrive_tests::bench::zlim42c::Zlim42c;
use ferrodrive_tests::manual::PowerCell;
use ferrodrive_tests::power_states::PowerSubject;
use ferrodrive_tests::side_by_side;

#[test]
fn each_drive_has_exactly_the_objects_of_its_manual() {
    side_by_side::objects_are_the_manuals(&zlac8030l::objects::TABLE, Zlac8030l::rows().all());
    side_by_side::objects_are_the_manuals(&zlim42c::objects::TABLE, Zlim42c::rows().all());
    side_by_side::objects_are_the_manuals(&mjoint::objects::TABLE, MJoint::rows().all());
}

#[test]
fn every_object_agrees_with_the_manual_in_every_column() {
    use side_by_side::columns_are_the_manuals;
    let node = NodeId::new(Zlac8030l::NODE).expect("a node-ID");
    columns_are_the_manuals::<{ zlac8030l::objects::ROW_COUNT }>(
        &zlac8030l::objects::TABLE,
        Zlac8030l::rows().all(),
        node,
    );
    columns_are_the_manuals::<{ zlim42c::objects::ROW_COUNT }>(
        &zlim42c::objects::TABLE,
        Zlim42c::rows().all(),
        NodeId::MIN,
    );
    columns_are_the_manuals::<{ mjoint::objects::ROW_COUNT }>(
        &mjoint::objects::TABLE,
        MJoint::rows().all(),
        NodeId::MIN,
    );
}

#[test]
fn every_object_is_said_to_stand_where_the_manual_has_it() {
    let of = |name: &str| devices::model(name).expect("a model");
    side_by_side::sections_are_the_manuals(of("zlac8030l"), Zlac8030l::rows().all());
    side_by_side::sections_are_the_manuals(of("zlim42c"), Zlim42c::rows().all());
    side_by_side::sections_are_the_manuals(of("m4230e17b50"), MJoint::rows().all());
}

fn power_tables() -> [Vec<PowerCell>; 3] {
    [Zlac8030l::power_states(), Zlim42c::power_states(), Cia402::power_states()]
        .map(|cells| cells.into_iter().map(|(cell, _)| cell).collect())
}

#[test]
fn the_power_state_machine_agrees_with_the_tables_of_states_and_events() {
    power_tables().iter().for_each(|cells| side_by_side::transitions_are_the_manuals(cells));
}

#[test]
fn the_statusword_bits_of_each_state_are_those_of_the_tables() {
    power_tables().iter().for_each(|cells| side_by_side::state_bits_are_the_manuals(cells));
}

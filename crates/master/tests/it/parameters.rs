//! Parameters as a transaction, against every model: written in a legal order, read back, put back on a refusal.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::support::{mux, node};
use can::{Bitrate, Instant};
use canopen::Mux;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use devices::Description;
use devices::variant::Variant;
use master::core::PdoMap;
use master::drive::MotionOptions;
use master::parameters::{Left, Parameters, Plan, PlanError, PlanOptions, Purpose, Unfit, diff, roll_back, verify};
use master::pdo::{PdoConfig, PdoError, TimerUnits};
use master::units::Rpm;
use master::{Drive, Network};
use sim::machine::{Order, order};
use sim::{World, block_on};

const NODE: u8 = 4;
const HEARTBEAT: Mux = mux(0x1017, 0);

fn bench(model: &'static Description) -> (World, Drive) {
    let mut world = World::new(Bitrate::K500, 5);
    let network = Network::new();
    world.add_station(network.clone());
    let variant = Variant::first_of(model.variations);
    let ordered = Order { variant, ..Order::new(model, node(NODE), Bitrate::K500) };
    world.add_drive(NODE, order(model, &ordered).expect("a machine")).expect("a free node-ID");
    world.run_until(Instant::from_secs(2));
    (world, Drive::new(network.node(node(NODE)), model))
}

fn zlac8030l() -> (World, Drive) {
    bench(devices::model("zlac8030l").expect("a model"))
}

/// A model whose mapping is fixed refuses to clear it, when its COB-ID is invalid already; and again when all is put back.
#[test]
fn a_pdo_whose_mapping_is_fixed_is_as_it_was_when_another_one_was_refused() {
    let tpdo1 = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };
    for name in ["m4230e17b50", "m4230e17b80"] {
        let (mut world, drive) = bench(devices::model(name).expect("a model"));
        let before = backed_up(&mut world, &drive);
        let config = PdoConfig::new(tpdo1, PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]));
        let refused = block_on(&mut world, drive.node().configure_pdo(&config, TimerUnits::of(model_of(&drive))))
            .expect("it goes on");
        let refused = refused.expect_err(name);
        assert!(matches!(refused, PdoError::Step { step: "clear the mapping", restored: true, .. }), "{refused}");
        assert_eq!(backed_up(&mut world, &drive), before, "{name}");
    }
}

fn backed_up(world: &mut World, drive: &Drive) -> Parameters {
    let backup = block_on(world, drive.back_up(|_, _, _| {})).expect("the world goes on").expect("it answers");
    assert!(backup.refused.is_empty(), "{:?}", backup.refused);
    backup.parameters
}

fn planned(world: &mut World, drive: &Drive, wanted: &Parameters) -> Result<Plan, PlanError> {
    block_on(world, drive.plan_parameters(wanted, PlanOptions::default())).expect("the world goes on")
}

fn model_of(drive: &Drive) -> &'static Description {
    drive.description().expect("a model")
}

/// What the parameters are with other values in them.
fn with(parameters: &Parameters, values: &[(Mux, &[u8])]) -> Parameters {
    let mut changed = parameters.clone();
    changed.values.extend(values.iter().map(|(object, value)| (*object, value.to_vec())));
    changed
}

/// Other values for what the model has and takes of these: ramps, a heartbeat, TPDO 1 by SYNC with an inhibit time and
/// another mapping.
fn changed(model: &Description, parameters: &Parameters) -> Parameters {
    let mut changed = parameters.clone();
    let mut wanted = |object: Mux, value: &[u8]| {
        let number = value.iter().rev().fold(0, |number, byte| number << 8 | i64::from(*byte));
        let takes = model.row(object).is_some_and(|row| row.check_value(number).is_ok());
        if let Some(bytes) = changed.values.get_mut(&object).filter(|bytes| takes && bytes.len() == value.len()) {
            *bytes = value.to_vec();
        }
    };
    for ramp in [0x6083, 0x6084, 0x6085] {
        wanted(mux(ramp, 0), &321_u32.to_le_bytes());
    }
    wanted(HEARTBEAT, &[0xC8, 0]);
    wanted(mux(0x1800, 2), &[1]);
    wanted(mux(0x1800, 3), &[10, 0]);
    wanted(mux(0x1A00, 0), &[1]);
    wanted(mux(0x1A00, 1), &0x6041_0010_u32.to_le_bytes());
    changed
}

#[test]
fn what_was_read_from_any_model_is_there_already() {
    let mut all = 0;
    for model in devices::all().iter() {
        let (mut world, drive) = bench(model);
        let parameters = backed_up(&mut world, &drive);
        assert!(!parameters.values.is_empty(), "{}", model.name);
        all += parameters.values.len();
        let plan = planned(&mut world, &drive, &parameters).unwrap_or_else(|error| panic!("{}: {error}", model.name));
        assert_eq!(plan.steps, [], "{}", model.name);
        assert_eq!(plan.left, [], "{}", model.name);
    }
    assert!(all > 10 * devices::all().iter().count(), "{all}");
}

#[test]
fn every_model_takes_what_is_planned_in_that_order_and_reads_back_so() {
    let mut writes = 0;
    for model in devices::all().iter() {
        let (mut world, drive) = bench(model);
        let before = backed_up(&mut world, &drive);
        let wanted = changed(model_of(&drive), &before);
        let plan = planned(&mut world, &drive, &wanted).unwrap_or_else(|error| panic!("{}: {error}", model.name));
        let applied = block_on(&mut world, drive.apply_parameters(&plan, |_, _| {})).expect("goes on");
        let applied = applied.expect("at rest").unwrap_or_else(|error| panic!("{}: {error}", model.name));
        assert!(applied.writes >= 1, "{} has nothing to change", model.name);
        writes += applied.writes;
        assert_eq!(applied.writes, plan.steps.len(), "{}", model.name);
        assert!(applied.rounded.is_empty() && applied.displaced.is_empty(), "{}: {applied:?}", model.name);
        assert_eq!(diff(&backed_up(&mut world, &drive).values, &wanted.values), [], "{}", model.name);
        let deviations = block_on(&mut world, verify(drive.node(), &before.values)).expect("goes on").expect("answers");
        assert_eq!(deviations.is_empty(), plan.steps.is_empty(), "{}", model.name);
    }
    assert!(writes >= 3 * devices::all().iter().count(), "{writes}");
}

/// A program may die between any two writes; what it kept of its plan leads back from there.
#[test]
fn wherever_a_transaction_was_broken_off_its_undo_leads_back() {
    for model in devices::all().iter() {
        let (mut world, drive) = bench(model);
        let before = backed_up(&mut world, &drive);
        let plan = planned(&mut world, &drive, &changed(model_of(&drive), &before)).expect("a plan");
        for broken_off in 0..=plan.steps.len() {
            block_on(&mut world, async {
                for step in &plan.steps[..broken_off] {
                    let written = drive.node().download(step.object, &step.value).await;
                    assert!(written.is_ok() || step.purpose == Purpose::SwitchOff, "{}: {written:?}", model.name);
                }
                let undone = roll_back(drive.node(), &plan.undo(), |_| None).await;
                assert!(undone.not_put_back.is_empty(), "{} at {broken_off}: {undone}", model.name);
            })
            .expect("the world goes on");
            assert_eq!(diff(&backed_up(&mut world, &drive).values, &before.values), [], "{} {broken_off}", model.name);
        }
    }
}

#[test]
fn a_refused_mapping_puts_everything_back_and_says_what_stands() {
    let (mut world, drive) = zlac8030l();
    let before = backed_up(&mut world, &drive);
    // 1017h is in no table of what may be mapped (CiA 301, table 41, and the manual's).
    let count = mux(0x1A00, 0);
    let wanted =
        with(&changed(model_of(&drive), &before), &[(mux(0x1A00, 1), &0x1017_0010_u32.to_le_bytes()), (count, &[1])]);
    let plan = planned(&mut world, &drive, &wanted).expect("nothing speaks against it before");
    let refused = block_on(&mut world, drive.apply_parameters(&plan, |_, _| {})).expect("goes on").expect("at rest");
    let error = refused.expect_err("it cannot be mapped");
    assert_eq!(error.object.index, 0x1A00, "{error}");
    let text = error.to_string();
    assert!(text.contains("0604 0041h") && text.contains("read as before"), "{text}");
    assert!(error.undone.not_put_back.is_empty(), "{text}");
    assert_eq!(diff(&backed_up(&mut world, &drive).values, &before.values), []);
}

#[test]
fn what_cannot_be_written_is_reported_all_at_once_and_nothing_is_written() {
    let (mut world, drive) = zlac8030l();
    let before = backed_up(&mut world, &drive);
    let wrong = with(
        &before,
        &[
            (HEARTBEAT, &[0xC8, 0]),
            (mux(0x6081, 0), &0x7FFF_FFFF_u32.to_le_bytes()),
            (mux(0x6083, 0), &[1]),
            (mux(0x5555, 0), &[1]),
            (mux(0x1000, 0), &[1, 0, 0, 0]),
        ],
    );
    let Err(PlanError::Unfit { unfit, .. }) = planned(&mut world, &drive, &wrong) else { panic!("it cannot be") };
    let objects: Vec<u16> = unfit.iter().map(|unfit| unfit.object().index).collect();
    assert_eq!(objects, [0x1000, 0x5555, 0x6081, 0x6083]);
    assert!(unfit[0].to_string().contains("only be read"), "{}", unfit[0]);
    assert!(
        matches!(unfit[0], Unfit::ReadOnly { .. }) && matches!(unfit[3], Unfit::Length { expected: 4, given: 1, .. }),
        "{unfit:?}"
    );
    assert!(unfit[2].to_string().contains("beyond its limits"), "{}", unfit[2]);
    assert_eq!(diff(&backed_up(&mut world, &drive).values, &before.values), []);
}

#[test]
fn commands_and_the_address_are_left_out_and_reported() {
    let (mut world, drive) = zlac8030l();
    let wanted = [(mux(0x6040, 0), vec![0x0F, 0]), (mux(0x60FF, 0), vec![60, 0, 0, 0]), (mux(0x200D, 0), vec![5, 0])];
    let wanted = Parameters { values: BTreeMap::from(wanted), ..Parameters::default() };
    let plan = planned(&mut world, &drive, &wanted).expect("a plan");
    assert_eq!(plan.steps, []);
    let left: Vec<_> = plan.left.iter().map(|(object, left)| (object.index, *left)).collect();
    assert_eq!(left, [(0x200D, Left::Address), (0x6040, Left::Command), (0x60FF, Left::Command)]);
    let options = PlanOptions { address: true };
    let plan = block_on(&mut world, drive.plan_parameters(&wanted, options)).expect("goes on").expect("a plan");
    assert_eq!(plan.steps.last().map(|step| (step.object.index, step.purpose)), Some((0x200D, Purpose::Address)));
}

#[test]
fn another_device_is_refused_with_both_identities() {
    let (mut world, drive) = zlac8030l();
    let mut wanted = backed_up(&mut world, &drive);
    wanted.identity.product_code = Some(0xABC);
    let text = planned(&mut world, &drive, &wanted).expect_err("another product").to_string();
    assert!(text.contains("product ABCh") && text.matches("vendor").count() == 2, "{text}");
    // The lower half of the revision says nothing about behaviour on the bus (CiA 301, 7.5.2.21).
    wanted.identity.product_code = None;
    let revision = wanted.identity.revision_number.expect("it says one");
    wanted.identity.revision_number = Some(revision ^ 1);
    assert_eq!(planned(&mut world, &drive, &wanted).expect("the same").other_revision, Some(revision ^ 1));
    wanted.identity.revision_number = Some(revision ^ 1 << 16);
    assert!(matches!(planned(&mut world, &drive, &wanted), Err(PlanError::OtherDevice { .. })));
}

#[test]
fn a_drive_at_work_is_left_alone() {
    for name in ["zlac8030l", "zlim42c", "m4230e17b50"] {
        let (mut world, drive) = bench(devices::model(name).expect("a model"));
        let wanted = changed(model_of(&drive), &backed_up(&mut world, &drive));
        let plan = planned(&mut world, &drive, &wanted).expect("a plan");
        let moving = drive.velocity(Rpm(30.0), MotionOptions::default());
        block_on(&mut world, moving).expect("goes on").expect("it turns");
        let refused = block_on(&mut world, drive.apply_parameters(&plan, |_, _| {})).expect("goes on");
        assert!(matches!(refused, Err(PlanError::AtWork { .. })), "{name}: {refused:?}");
        block_on(&mut world, drive.disable()).expect("goes on").expect("disabled");
        let applied = block_on(&mut world, drive.apply_parameters(&plan, |_, _| {})).expect("goes on");
        assert!(applied.is_ok_and(|applied| applied.is_ok()), "{name}");
    }
}

#[test]
fn a_drive_that_falls_silent_is_reported_with_what_is_left() {
    let (mut world, drive) = zlac8030l();
    let before = backed_up(&mut world, &drive);
    let plan = planned(&mut world, &drive, &changed(model_of(&drive), &before)).expect("a plan");
    world
        .apply(sim::Place::node(NODE), &"power cut".parse::<sim::Stimulus>().expect("a stimulus"))
        .expect("there")
        .expect("done");
    world.run_for(Duration::from_millis(10));
    let refused = block_on(&mut world, drive.apply_parameters(&plan, |_, _| {})).expect("the world goes on");
    assert!(matches!(refused, Err(PlanError::Node(_))), "asked for its state first: {refused:?}");
    let undone = block_on(&mut world, roll_back(drive.node(), &plan.undo(), |_| None)).expect("goes on");
    assert!(undone.put_back == 0 && !undone.not_put_back.is_empty(), "{undone}");
    assert!(undone.to_string().contains("Not everything could be put back"), "{undone}");
}

//! Groups of axes in virtual time: the standard's servo by cyclic synchronous positions, the joint by interpolated ones, and a
//! hub motor by speeds. What is true is asked of the simulated shafts, not of the drives.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::support::node;
use can::{Bitrate, Instant};
use canopen::Mux;
use canopen::pdo::{Direction, MappingRecord, PdoId, PdoNumber};
use cia402::ModeOfOperation;
use cia402::object::MODES_OF_OPERATION_DISPLAY;
use devices::Description;
use devices::servo::CIA402;
use master::core::PdoMap;
use master::cyclic::{CyclicOptions, Refusal};
use master::drive::HomingOptions;
use master::group::{
    AxisHoming, AxisLimits, AxisSetup, Group, GroupError, HomingOrder, PathError, Phase, StopCause, StreamOptions, home,
};
use master::pdo::{PdoConfig, TimerUnits, TransmissionType};
use master::units::Turns;
use master::{Drive, Gear, Network, Node};
use sim::machine::{Order, order};
use sim::{Place, Stimulus, SwitchRange, World, block_on};

const CSP: ModeOfOperation = ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION;
const IP: ModeOfOperation = ModeOfOperation::INTERPOLATED_POSITION;
const PV: ModeOfOperation = ModeOfOperation::PROFILE_VELOCITY;
const MS: Duration = Duration::from_millis(1);

fn limits() -> AxisLimits {
    AxisLimits {
        range_turns: Some(-3.0..=3.0),
        velocity_turns_s: 1.0,
        acceleration_turns_s2: 5.0,
        jerk_turns_s3: 50.0,
        following_error_turns: 0.02,
    }
}

struct Bench {
    world: World,
    network: Network,
    setups: Vec<AxisSetup>,
}

impl Bench {
    /// Node-IDs from 1 on.
    fn new(axes: &[(&'static Description, ModeOfOperation)]) -> Self {
        let mut world = World::new(Bitrate::M1, 7);
        let network = Network::new();
        world.add_station(network.clone());
        let mut setups = Vec::new();
        for (number, (model, mode)) in (1..).zip(axes) {
            let id = node(number);
            world.add_drive(number, order(model, &Order::new(model, id, Bitrate::M1)).unwrap()).unwrap();
            let drive = Drive::new(network.node(id), model);
            setups.push(AxisSetup { drive, mode: *mode, limits: limits() });
        }
        world.run_until(Instant::from_secs(1));
        Self { world, network, setups }
    }

    fn servos(count: usize) -> Self {
        Self::new(&vec![(&CIA402, CSP); count])
    }

    fn try_open(&mut self) -> Result<Group, GroupError> {
        let open = Group::open(&self.setups, MS, CyclicOptions::default());
        block_on(&mut self.world, open).unwrap()
    }

    fn open(&mut self) -> Group {
        let mut group = self.try_open().unwrap();
        block_on(&mut self.world, group.enable()).unwrap().unwrap();
        group
    }

    fn cycle(&mut self, group: &mut Group) -> Phase {
        block_on(&mut self.world, group.cycle()).unwrap().unwrap().phase
    }

    fn rpm(&mut self, number: u8) -> f64 {
        self.world.report(number).unwrap().velocity_rpm
    }

    /// Cycles until the group rests; the error that it then gives.
    fn rest(&mut self, group: &mut Group) -> Result<(), GroupError> {
        block_on(&mut self.world, group.rest()).unwrap()
    }
}

fn turns(values: &[f64]) -> Vec<Turns> {
    values.iter().map(|value| Turns(*value)).collect()
}

/// The M joint's TPDOs are answers (its page, 6), and its fixed mapping has the position in none that answers the RPDO with 60FFh.
#[test]
fn a_joint_is_not_led_by_speeds_since_its_position_would_not_come() {
    let mut bench = Bench::new(&[(devices::model("m4230e17b50").unwrap(), PV)]);
    let refused = bench.try_open().unwrap_err();
    assert!(matches!(refused, GroupError::NoPosition { axis: 1, mode: PV, .. }), "{refused}");
    bench.setups[0].mode = IP;
    assert!(bench.try_open().is_ok());
}

/// The M joint has no power state machine: its statusword shows by bit 4 whether its motor has power (M joint manual, 5.04).
#[test]
fn joints_have_lost_their_power_once_their_group_is_closed() {
    let joint = devices::model("m4230e17b50").unwrap();
    let mut bench = Bench::new(&[(joint, IP); 6]);
    for setup in &mut bench.setups {
        setup.limits.following_error_turns = 0.2;
    }
    let open = Group::open(&bench.setups, 2 * MS, CyclicOptions::default());
    let mut group = block_on(&mut bench.world, open).unwrap().unwrap();
    block_on(&mut bench.world, group.enable()).unwrap().unwrap();
    let live = |bench: &mut Bench, id| bench.world.report(id).unwrap().statusword.unwrap() & 1 << 4 != 0;
    assert!((1..=6).all(|id| live(&mut bench, id)));
    let to: Vec<_> = places(&group).iter().map(|from| from + 0.2).collect();
    block_on(&mut bench.world, group.move_to(&turns(&to), None)).unwrap().unwrap();
    block_on(&mut bench.world, group.close()).unwrap().unwrap();
    for id in 1..=6 {
        assert!(!live(&mut bench, id), "node {id}");
    }
}

/// Where the drives say that they are.
fn places(group: &Group) -> Vec<f64> {
    group.axes().iter().map(|state| state.position.unwrap().0).collect()
}

#[test]
fn three_axes_begin_with_one_sync_and_end_together_where_they_were_sent() {
    let mut bench = Bench::servos(3);
    let mut group = bench.open();
    let from = places(&group);
    let to: Vec<_> = from.iter().zip([1.0, -0.5, 0.25]).map(|(from, by)| from + by).collect();
    let time = group.start_move(&turns(&to), None).unwrap();
    // The longest way alone: 1 turn at 1 turn/s, 5 turns/s^2 and 50 turns/s^3 is L/V + V/A + A/J.
    assert!((time.as_secs_f64() - 1.3).abs() < 1e-6, "{time:?}");
    let (mut began, mut ended) = ([None; 3], [0; 3]);
    let mut cycle = 0;
    while bench.cycle(&mut group) == Phase::Moving {
        cycle += 1;
        for axis in 0..3 {
            // A hundredth of each axis's highest speed: all ways have one shape.
            let moves = bench.rpm(axis as u8 + 1).abs() > 0.6 * [1.0, 0.5, 0.25][axis];
            if moves {
                began[axis].get_or_insert(cycle);
                ended[axis] = cycle;
            }
        }
    }
    for _ in 0..100 {
        bench.cycle(&mut group);
    }
    let began = began.map(Option::unwrap);
    assert!(began.iter().max().unwrap() - began.iter().min().unwrap() <= 2, "{began:?}");
    for (at, to) in places(&group).iter().zip(&to) {
        assert!((at - to).abs() < 0.002, "{at} of {to}");
    }
    assert!(ended.iter().max().unwrap() - ended.iter().min().unwrap() <= 20, "{ended:?}");
    assert_eq!(group.state().missed_cycles, 0);
    block_on(&mut bench.world, group.close()).unwrap().unwrap();
    bench.world.run_for(Duration::from_secs(1));
    assert!(bench.rpm(1).abs() < 0.1);
}

#[test]
fn a_group_of_a_joint_a_servo_and_a_hub_motor_keeps_together_as_well_as_each_can() {
    let [joint, hub] = ["m4230e17b50", "zlac8030l"].map(|name| devices::model(name).unwrap());
    let mut bench = Bench::new(&[(&CIA402, CSP), (joint, IP), (hub, PV)]);
    bench.setups[1].limits.velocity_turns_s = 0.2;
    // A hub motor that is moved by speeds has whole r/min and ramps of its own.
    bench.setups[2].limits.following_error_turns = 0.2;
    let mut group = bench.open();
    let from = places(&group);
    let to: Vec<_> = from.iter().zip([0.5, 0.1, 0.5]).map(|(from, by)| from + by).collect();
    block_on(&mut bench.world, group.move_to(&turns(&to), Some(Duration::from_secs(2)))).unwrap().unwrap();
    for _ in 0..1000 {
        bench.cycle(&mut group);
    }
    let off: Vec<_> = places(&group).iter().zip(&to).map(|(at, to)| (at - to).abs()).collect();
    assert!(off[0] < 0.002 && off[1] < 0.002 && off[2] < 0.01, "{off:?}");
}

#[test]
fn a_second_move_leads_on_from_the_first_without_a_leap() {
    let mut bench = Bench::servos(1);
    let mut group = bench.open();
    let from = places(&group)[0];
    group.start_move(&turns(&[from + 1.0]), None).unwrap();
    for _ in 0..500 {
        bench.cycle(&mut group);
    }
    let before = group.points()[0];
    group.start_move(&turns(&[from]), None).unwrap();
    bench.cycle(&mut group);
    let after = group.points()[0];
    let jerk = (after.acceleration_turns_s2 - before.acceleration_turns_s2) / 0.001;
    assert!(jerk.abs() <= 50.0 + 1e-6, "{jerk}");
    bench.rest(&mut group).unwrap();
    assert!((group.points()[0].position_turns - from).abs() < 1e-9);
}

#[test]
fn a_drive_that_goes_stops_the_others_within_their_limits_and_is_named() {
    let mut bench = Bench::servos(3);
    let mut group = bench.open();
    let to: Vec<_> = places(&group).iter().map(|from| from + 2.0).collect();
    group.start_move(&turns(&to), None).unwrap();
    for _ in 0..800 {
        bench.cycle(&mut group);
    }
    bench.world.cut_power(2).unwrap();
    let error = bench.rest(&mut group).unwrap_err();
    assert!(
        matches!(error, GroupError::Stopped(StopCause::Axis { axis: 2, refusal: Refusal::Stopped(_), .. })),
        "{error}"
    );
    assert!(
        error.to_string().starts_with("the group was stopped by axis 2, node 2: it was stopped, since "),
        "{error}"
    );
    for _ in 0..100 {
        bench.cycle(&mut group);
    }
    assert!(bench.rpm(1).abs() < 0.5 && bench.rpm(3).abs() < 0.5);
    // Cut off near 0.7 of 2 turns; the stop takes v/2 (v/a + a/j) = 0.15 turns.
    assert!(places_of(&group, [0, 2]).into_iter().zip([to[0], to[2]]).all(|(at, to)| at < to - 0.3));
    // A stopped group refuses a move.
    let refused = group.start_move(&turns(&to), None).unwrap_err();
    assert!(matches!(refused, GroupError::Stopped(_)), "{refused}");
}

fn places_of(group: &Group, axes: [usize; 2]) -> Vec<f64> {
    axes.map(|axis| group.axes()[axis].position.unwrap().0).to_vec()
}

#[test]
fn a_blocked_shaft_stops_the_group_and_its_lag_is_reported() {
    let mut bench = Bench::servos(2);
    let mut group = bench.open();
    let to: Vec<_> = places(&group).iter().map(|from| from + 2.0).collect();
    group.start_move(&turns(&to), None).unwrap();
    for _ in 0..500 {
        bench.cycle(&mut group);
    }
    bench.world.apply(Place::node(2), &Stimulus::RotorLock(true)).unwrap().unwrap();
    let error = bench.rest(&mut group).unwrap_err();
    let GroupError::Stopped(StopCause::FollowingError { axis: 2, error_turns, limit_turns, .. }) = error else {
        panic!("{error}");
    };
    // At 1 turn/s it is noticed within some cycles.
    assert!(limit_turns == 0.02 && (0.02..0.03).contains(&error_turns), "{error_turns}");
    assert!(error.to_string().contains("look whether it is blocked or overloaded"), "{error}");
    for _ in 0..100 {
        bench.cycle(&mut group);
    }
    assert!(bench.rpm(1).abs() < 0.5);
}

#[test]
fn a_stream_is_followed_and_a_late_producer_is_a_controlled_stop() {
    let mut bench = Bench::servos(2);
    let mut group = bench.open();
    let from = places(&group);
    group.start_stream(StreamOptions { prefill: 5, ..StreamOptions::default() }).unwrap();
    // 0.2 turns from end to end, a swing a second: at most 0.2 pi turns/s and 0.4 pi^2 turns/s^2.
    let point = |cycle: u32| {
        let share = 0.1 * (1.0 - (core::f64::consts::TAU * f64::from(cycle) * 0.001).cos());
        turns(&[from[0] + share, from[1] - share])
    };
    let mut given = 0;
    for _ in 0..1200 {
        while given < 700 && group.stream().is_some_and(|stream| stream.queued() < 20) {
            given += 1;
            group.push(&point(given)).unwrap();
        }
        let phase = bench.cycle(&mut group);
        if phase == Phase::Streaming {
            assert!(group.following_errors().all(|error| error.unwrap() < 0.02));
        }
    }
    assert_eq!(group.state().phase, Phase::Holding);
    let Some(cause @ StopCause::Underrun { cycles: 2 }) = group.state().cause else { panic!("{:?}", group.state()) };
    assert!(cause.to_string().contains("Give points earlier"), "{cause}");
    assert!(matches!(group.push(&point(701)), Err(GroupError::Stopped(_))));
    assert!(bench.rpm(1).abs() < 0.5);
    // It can go on once it has been switched off and on.
    block_on(&mut bench.world, async {
        group.disable().await?;
        group.enable().await?;
        group.move_to(&turns(&from), None).await
    })
    .unwrap()
    .unwrap();
    assert!((group.points()[0].position_turns - from[0]).abs() < 1e-9);
}

#[test]
fn a_stop_leaves_the_group_ready() {
    let mut bench = Bench::servos(2);
    let mut group = bench.open();
    let from = places(&group);
    let to: Vec<_> = from.iter().map(|from| from + 2.0).collect();
    group.start_move(&turns(&to), None).unwrap();
    for _ in 0..500 {
        bench.cycle(&mut group);
    }
    block_on(&mut bench.world, group.stop()).unwrap().unwrap();
    assert_eq!(group.state().phase, Phase::Holding);
    block_on(&mut bench.world, group.move_to(&turns(&from), None)).unwrap().unwrap();
}

#[test]
fn an_axis_that_is_lost_while_the_group_stops_by_request_is_reported() {
    for disabled in [false, true] {
        let mut bench = Bench::servos(2);
        let mut group = bench.open();
        let to: Vec<_> = places(&group).iter().map(|from| from + 2.0).collect();
        group.start_move(&turns(&to), None).unwrap();
        for _ in 0..800 {
            bench.cycle(&mut group);
        }
        group.start_stop();
        bench.cycle(&mut group);
        assert_eq!(group.state().cause, Some(StopCause::Asked));
        bench.world.cut_power(2).unwrap();
        let stopped =
            block_on(&mut bench.world, async { if disabled { group.disable().await } else { group.stop().await } });
        let error = stopped.unwrap().unwrap_err();
        assert!(matches!(error, GroupError::Stopped(StopCause::Axis { axis: 2, .. })), "{error}");
        // It is on its way to rest, along its path, whatever became of the other one.
        assert!(bench.rpm(1).abs() < 2.0);
    }
}

/// Its PDOs carry no speed, and behind a gear of 50 an r/min of the output is 50 of the motor.
#[test]
fn an_axis_that_its_load_turns_once_its_power_is_off_is_not_closed_as_one_that_stands() {
    let mut bench = Bench::servos(1);
    bench.setups[0].drive = bench.setups[0].drive.clone().behind(Gear::new(50.0).unwrap());
    bench.setups[0].limits.velocity_turns_s = 0.1;
    let mut group = bench.open();
    // Less than the motor holds.
    bench.world.apply(Place::node(1), &Stimulus::LoadTorque(0.5)).unwrap().unwrap();
    bench.world.run_for(Duration::from_millis(1));
    block_on(&mut bench.world, group.disable()).unwrap().unwrap();
    for _ in 0..100 {
        bench.cycle(&mut group);
    }
    assert!(bench.rpm(1).abs() > 5.0, "the load turns it, at {} r/min", bench.rpm(1));
    let closed = block_on(&mut bench.world, group.close()).unwrap();
    assert!(closed.is_err(), "said to be closed at {} r/min", bench.rpm(1));
}

#[test]
fn options_of_a_stream_that_bound_nothing_are_refused_and_the_group_holds() {
    let mut bench = Bench::servos(1);
    let mut group = bench.open();
    let endless = StreamOptions { grace: u32::MAX, ..StreamOptions::default() };
    let error = group.start_stream(endless).unwrap_err();
    assert!(matches!(error, GroupError::StreamOption { option: "grace", most: 100, .. }), "{error}");
    assert_eq!(bench.cycle(&mut group), Phase::Holding);
}

#[test]
fn drives_that_have_power_already_are_taken_over_without_a_jump() {
    let mut bench = Bench::servos(2);
    for setup in &bench.setups {
        block_on(&mut bench.world, setup.drive.enable()).unwrap().unwrap();
    }
    let before = [1, 2].map(|number| bench.world.report(number).unwrap().shaft_angle_rad);
    let mut group = bench.open();
    assert_eq!((group.state().phase, group.state().cause), (Phase::Holding, None));
    let after = [1, 2].map(|number| bench.world.report(number).unwrap().shaft_angle_rad);
    assert!(before.iter().zip(after).all(|(before, after)| (before - after).abs() < 0.01), "{before:?} {after:?}");
    // Off and on again.
    block_on(&mut bench.world, async {
        group.disable().await?;
        group.enable().await
    })
    .unwrap()
    .unwrap();
}

#[test]
fn a_drive_belongs_to_one_group_until_that_is_gone() {
    let mut bench = Bench::servos(2);
    let group = bench.open();
    let error = bench.try_open().unwrap_err();
    assert_eq!(
        error.to_string(),
        "node 1 (6040h:00) already belongs to a group: an axis follows one at a time. Close the other one first"
    );
    block_on(&mut bench.world, group.close()).unwrap().unwrap();
    bench.open();
    let twice = bench.setups[0].clone();
    bench.setups.push(twice);
    assert!(matches!(bench.try_open(), Err(GroupError::Taken { .. })));
}

#[test]
fn a_group_that_is_given_up_leaves_the_ramps_of_its_drives_as_they_were() {
    let mut bench = Bench::new(&[(devices::model("zlac8030l").unwrap(), ModeOfOperation::PROFILE_VELOCITY)]);
    let node = bench.network.node(node(1));
    let ramps =
        async || [node.read::<u32>(Mux::new(0x6083, 0)).await.unwrap(), node.read(Mux::new(0x6084, 0)).await.unwrap()];
    let before = block_on(&mut bench.world, ramps()).unwrap();
    let mut group = bench.open();
    group.start_move(&turns(&[2.5]), None).unwrap();
    for _ in 0..100 {
        bench.cycle(&mut group);
    }
    assert_ne!(block_on(&mut bench.world, ramps()).unwrap(), before, "each cycle is a new speed");
    drop(group);
    block_on(&mut bench.world, bench.network.stop_and_release()).unwrap();
    assert_eq!(block_on(&mut bench.world, ramps()).unwrap(), before);
}

/// CiA 301, 7.5.2.35 to 7.5.2.38: every value of every PDO, as far as the device has it.
async fn pdo_values(node: &Node) -> BTreeMap<Mux, u32> {
    let mut values = BTreeMap::new();
    for first in [0x1400, 0x1600, 0x1800, 0x1A00] {
        for (index, sub_index) in (first..first + 8).flat_map(|index| (0..=8).map(move |sub_index| (index, sub_index)))
        {
            if let Ok(payload) = node.upload(Mux::new(index, sub_index)).await {
                values.insert(Mux::new(index, sub_index), payload.raw());
            }
        }
    }
    values
}

/// However it ends, and whatever its drives had (the mapping of a joint is fixed, and no group changes it): here the first TPDO is as delivered, the second is another one that is read meanwhile, and
/// the last is off.
#[test]
fn what_a_group_maps_for_its_cycles_is_put_back_at_its_end() {
    for model in ["zlac8030l", "zlim42c", "cia402"].map(|name| devices::model(name).unwrap()) {
        for is_closed in [true, false] {
            let said = format!("{} {is_closed}", model.name);
            let mut bench = Bench::new(&[(model, ModeOfOperation::default())]);
            bench.setups[0].mode = AxisSetup::best_mode(&bench.setups[0].drive).unwrap();
            let node = bench.network.node(node(1));
            let pdo = |number| PdoId { direction: Direction::Tpdo, number: PdoNumber::at(number).unwrap() };
            let record = MappingRecord { mux: MODES_OF_OPERATION_DISPLAY, bits: 8 };
            let own = PdoConfig::new(pdo(1), PdoMap(vec![record])).transmission(TransmissionType::EVERY_SYNC);
            let units = TimerUnits::of(model);
            block_on(&mut bench.world, node.configure_pdo(&own, units)).unwrap().unwrap();
            block_on(&mut bench.world, node.switch_pdo_off(pdo(2))).unwrap().unwrap();
            let before = block_on(&mut bench.world, pdo_values(&node)).unwrap();
            let mut group = bench.open();
            group.start_move(&turns(&[0.5]), None).unwrap();
            for _ in 0..100 {
                bench.cycle(&mut group);
            }
            let meanwhile = block_on(&mut bench.world, group.beside(pdo_values(&node))).unwrap();
            assert_ne!(meanwhile, before, "{said}");
            if is_closed {
                block_on(&mut bench.world, group.close()).unwrap().unwrap();
            } else {
                drop(group);
                block_on(&mut bench.world, bench.network.stop_and_release()).unwrap();
            }
            assert_eq!(block_on(&mut bench.world, pdo_values(&node)).unwrap(), before, "{said}");
            // What this program read before, it reads again.
            assert_eq!([0, 1, 2].map(|at| node.uses_pdo(pdo(at))), [false, true, false], "{said}");
            bench.network.sync(Some(10 * MS));
            block_on(&mut bench.world, bench.network.sleep(50 * MS)).unwrap();
            let mode = node.signal::<i8>(MODES_OF_OPERATION_DISPLAY).unwrap();
            assert!(bench.network.exchange(|io| io.read(mode)).is_some(), "{said}");
        }
    }
}

/// The second axis is refused when the first is mapped for the cycles already.
#[test]
fn a_group_that_cannot_be_opened_leaves_its_drives_as_they_were() {
    let mut bench = Bench::servos(2);
    let node = bench.network.node(node(1));
    let before = block_on(&mut bench.world, pdo_values(&node)).unwrap();
    // Faster than its drive follows.
    bench.setups[1].limits.velocity_turns_s = 1e6;
    assert!(matches!(bench.try_open(), Err(GroupError::BeyondDrive { axis: 2, .. })));
    assert_eq!(block_on(&mut bench.world, pdo_values(&node)).unwrap(), before);
}

#[test]
fn bad_input_is_refused_before_anything_moves() {
    let mut bench = Bench::servos(2);
    let mut group = bench.open();
    let from = places(&group);
    let refused = |group: &mut Group, to: &[f64]| group.start_move(&turns(to), None).unwrap_err();
    assert!(matches!(
        refused(&mut group, &[0.0]),
        GroupError::Path { error: PathError::Count { given: 1, axes: 2 }, .. }
    ));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(matches!(
            refused(&mut group, &[0.0, bad]),
            GroupError::Path { error: PathError::NoNumber { axis: 2, .. }, .. }
        ));
    }
    let far = refused(&mut group, &[0.0, 3.5]);
    assert!(matches!(far, GroupError::Path { error: PathError::OutOfRange { axis: 2, .. }, .. }));
    // The node, too: axes are counted in the order of the group, and people know their nodes.
    let node = group.drives()[1].node().id();
    assert!(far.to_string().starts_with(&format!("node {node}: axis 2 would be at 1260 deg")), "{far}");
    assert!(matches!(group.push(&turns(&from)), Err(GroupError::Phase { phase: Phase::Holding, .. })));
    let far = [from[0] + 0.5, from[1]];
    for (last, is_refused) in [(&from[..], false), (&from[..1], true), (&far, true)] {
        let path = [turns(&from), turns(&from), turns(last)];
        assert_eq!(group.check_path(&path).is_err(), is_refused, "{last:?}");
    }
    bench.cycle(&mut group);
    assert_eq!((group.state().phase, group.state().cause), (Phase::Holding, None));
    drop(group);
    bench.setups[1].limits.velocity_turns_s = 1e6;
    let error = bench.try_open().unwrap_err();
    assert!(matches!(error, GroupError::BeyondDrive { axis: 2, .. }), "{error}");
    bench.setups[1].limits.velocity_turns_s = f64::NAN;
    assert!(matches!(bench.try_open(), Err(GroupError::Path { error: PathError::BadLimit { axis: 2, .. }, .. })));
    bench.setups.clear();
    assert!(matches!(bench.try_open(), Err(GroupError::NoAxis)));
    assert!(bench.network.cycle().is_some());
}

#[test]
fn axes_home_together_or_in_sequence_and_one_that_fails_stops_the_others() {
    let stepper = devices::model("zlim42c").unwrap();
    let mut bench = Bench::new(&[(stepper, PV), (stepper, PV)]);
    // X0 is the negative limit (ZLIM42-C user manual V1.03, 5.4), half a turn below for one, a whole turn for the other.
    for (number, low) in [(1, -2000), (2, -4000)] {
        let drive = bench.setups[usize::from(number) - 1].drive.clone();
        block_on(&mut bench.world, drive.node().write(crate::support::mux(0x2030, 2), 3_u16)).unwrap().unwrap();
        let range = SwitchRange { low: None, high: Some(low) };
        let switch = Stimulus::Switch { name: "X0".to_owned(), range };
        bench.world.apply(Place::node(number), &switch).unwrap().unwrap();
    }
    let options = HomingOptions { limit: Duration::from_secs(5), ..HomingOptions::default() };
    let search = |setup: &AxisSetup| AxisHoming { drive: setup.drive.clone(), method: 17, options };
    let searches: Vec<_> = bench.setups.iter().map(search).collect();
    let began = bench.world.now();
    let reports = block_on(&mut bench.world, home(&searches, HomingOrder::Together)).unwrap().unwrap();
    let together = bench.world.now() - began;
    let times: Vec<_> = reports.iter().map(|report| report.reached_after.unwrap()).collect();
    // Both began at once: the longer way ends the search.
    assert!(times[1] > times[0] && together < times[0] + times[1], "{times:?} {together:?}");
    block_on(&mut bench.world, home(&searches, HomingOrder::InSequence)).unwrap().unwrap();

    // The first one's switch never comes: the second is stopped on its way, wherever it is.
    let never = Stimulus::Input { name: "X0".to_owned(), level: false };
    for number in [1, 2] {
        bench.world.apply(Place::node(number), &never).unwrap().unwrap();
    }
    let mut hopeless = searches.clone();
    hopeless[0].options.limit = Duration::from_secs(1);
    let error = block_on(&mut bench.world, home(&hopeless, HomingOrder::Together)).unwrap().unwrap_err();
    assert!(matches!(error, GroupError::Homing { axis: 1, .. }), "{error}");
    assert!(error.to_string().starts_with("axis 1 did not find its reference: node 1: "), "{error}");
    bench.world.run_for(Duration::from_secs(1));
    assert!(bench.rpm(1).abs() < 2.0 && bench.rpm(2).abs() < 2.0, "{} {}", bench.rpm(1), bench.rpm(2));

    // Axes of an open group are not homed behind its back.
    let group = bench.try_open().unwrap();
    let taken = block_on(&mut bench.world, home(&searches, HomingOrder::Together)).unwrap().unwrap_err();
    assert!(matches!(taken, GroupError::Taken { .. }), "{taken}");
    drop(group);
}

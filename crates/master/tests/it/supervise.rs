//! The watch over a booted network in virtual time: cables cut and joined, supplies taken away, drives replaced. What counts is
//! that nothing turns unasked when it is back.
//!
//! The joint goes on with its old motion at the first heartbeat after it had lost its host (M joint manual, 5.11.2).

use std::time::Duration;

use crate::support::{StoppedTwin, node};
use can::Bitrate;
use canopen::{NmtState, NodeId};
use devices::model;
use drives::mjoint::Model;
use master::boot::{BootPlan, Expectation};
use master::drive::SwitchedOff;
use master::supervise::{Foreign, Supervisor, SupervisorEvent};
use master::units::Rpm;
use master::{Drive, MotionOptions, Network};
use sim::machine::{Order, mjoint, order, zlac8030l};
use sim::{Place, World, block_on};

const JOINT: u8 = 1;
const SERVO: u8 = 4;
const DESCRIBED: u8 = 5;
const MODELS: [(u8, &str); 3] = [(JOINT, "m4230e17b50"), (SERVO, "zlac8030l"), (DESCRIBED, "cia402")];

struct Bench {
    world: World,
    network: Network,
    supervisor: Supervisor,
    reported: Vec<SupervisorEvent>,
}

impl Bench {
    /// A joint, a ZLAC8030L and a servo of CiA 402, booted and watched.
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        let kind = Model::named("m4230e17b50").unwrap();
        world.add_drive(JOINT, Box::new(mjoint(kind, JOINT, Bitrate::K500))).unwrap();
        world.add_drive(SERVO, Box::new(zlac8030l(SERVO, 1))).unwrap();
        let servo = model("cia402").unwrap();
        let wanted = Order::new(servo, node(DESCRIBED), Bitrate::K500);
        world.add_drive(DESCRIBED, order(servo, &wanted).unwrap()).unwrap();
        world.run_for(Duration::from_secs(3));
        let plan = BootPlan::new(MODELS.map(|(id, name)| (node(id), Expectation::of(model(name).unwrap()))));
        let report = block_on(&mut world, network.boot(&plan)).unwrap();
        assert!(report.is_whole(), "{:?}", report.nodes);
        while network.poll_event().is_some() {}
        let supervisor = Supervisor::new(network.clone(), plan);
        Self { world, network, supervisor, reported: Vec::new() }
    }

    fn drive(&self, id: u8) -> Drive {
        let name = MODELS.iter().find(|(known, _)| *known == id).unwrap().1;
        Drive::new(self.network.node(node(id)), model(name).unwrap())
    }

    fn turn(&mut self, id: u8) {
        let drive = self.drive(id);
        // A drive that stopped for want of a heartbeat has a fault.
        block_on(&mut self.world, drive.reset_fault()).unwrap().unwrap();
        block_on(&mut self.world, drive.velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
        self.watch(Duration::from_secs(2));
        assert!(self.speed(id) > 50.0, "node {id}: {}", self.speed(id));
    }

    fn speed(&mut self, id: u8) -> f64 {
        self.world.report(id).unwrap().velocity_rpm.abs()
    }

    fn apply(&mut self, id: u8, words: &str) {
        self.world.apply(Place::node(id), &words.parse().unwrap()).unwrap().unwrap();
    }

    /// For 3 s: long enough for every watch to notice.
    fn supply_away(&mut self, id: u8) {
        self.apply(id, "power off");
        self.watch(Duration::from_secs(3));
        self.apply(id, "power on");
    }

    /// Lets the supervisor work for this long; what it reported.
    fn watch(&mut self, time: Duration) -> Vec<String> {
        let end = self.world.now() + time;
        let mut said = Vec::new();
        while self.world.now() < end {
            if let Some((_, happening)) = block_on(&mut self.world, self.supervisor.next()).unwrap() {
                said.push(happening.to_string());
                self.reported.push(happening);
            }
        }
        said
    }

    fn kinds(&self) -> Vec<(&'static str, Option<u8>)> {
        self.reported.iter().map(|happening| (happening.kind(), happening.node().map(NodeId::raw))).collect()
    }

    fn resume(&mut self, id: u8) {
        block_on(&mut self.world, self.supervisor.resume(node(id))).unwrap().unwrap();
    }
}

/// Neither the one that was cut off, at the first heartbeat that it hears, nor the other that stopped for want of one.
#[test]
fn a_joint_whose_cable_is_joined_again_stands_until_it_is_moved() {
    let mut bench = Bench::new();
    bench.turn(JOINT);
    bench.turn(DESCRIBED);
    bench.reported.clear();
    bench.apply(JOINT, "cable cut");
    bench.watch(Duration::from_secs(6));
    assert_eq!(bench.kinds()[..2], [("heartbeat_lost", Some(JOINT)), ("heartbeat_held", None)]);
    let held = bench.reported[1].to_string();
    assert!(held.contains("without it stops: node 1, 5"), "{held}");
    assert!(bench.speed(JOINT) < 1.0 && bench.speed(DESCRIBED) < 1.0);

    bench.apply(JOINT, "cable join");
    let mut fastest: f64 = 0.0;
    let mut said = Vec::new();
    for _ in 0..400 {
        said.extend(bench.watch(Duration::from_millis(20)));
        fastest = fastest.max(bench.speed(JOINT)).max(bench.speed(DESCRIBED));
    }
    assert!(fastest < 1.0, "{fastest} r/min: {said:?}");
    for (kind, id) in [("heartbeat_back", Some(JOINT)), ("recovered", Some(JOINT)), ("heartbeat_released", None)] {
        assert!(bench.kinds().contains(&(kind, id)), "{kind}: {said:#?}");
    }
    // M Robot Joint Motor CanOpen Manual, 5.11.1: 04h is an alarm.
    let words = "node 1 is in alarm (heartbeat 04h; it does not mean stopped)";
    assert!(said.iter().any(|line| line == words), "{said:#?}");
    assert!(!said.iter().any(|line| line.ends_with("is stopped")), "{said:#?}");
    bench.resume(JOINT);
    bench.watch(Duration::from_secs(5));
    assert!(bench.speed(JOINT) < 1.0, "what it did before does not come back");
    bench.turn(JOINT);
}

/// However long the cut: a joint that has once stopped for it stands afterwards, and one that was not missed turns on
/// as if nothing had been.
#[test]
fn no_length_of_a_cut_lets_a_joint_go_on_after_it_has_stopped() {
    // In steps that come at every phase of the two heartbeats.
    for ms in (200..1400).step_by(400).chain((1400..3000).step_by(70)) {
        let mut bench = Bench::new();
        bench.turn(JOINT);
        bench.reported.clear();
        bench.apply(JOINT, "cable cut");
        let mut stood = false;
        for _ in 0..ms / 10 {
            bench.watch(Duration::from_millis(10));
            stood |= bench.speed(JOINT) < 1.0;
        }
        bench.apply(JOINT, "cable join");
        for _ in 0..300 {
            bench.watch(Duration::from_millis(10));
            let speed = bench.speed(JOINT);
            assert!(!stood || speed < 1.0, "cut for {ms} ms: {speed} r/min; {:?}", bench.kinds());
            stood |= speed < 1.0;
        }
        let missed = bench.kinds().contains(&("heartbeat_lost", Some(JOINT)));
        assert_eq!(stood, missed, "cut for {ms} ms: {:?}", bench.kinds());
    }
}

/// A supply that comes back leaves a drive with nothing to do; it is configured and armed again, and waits.
#[test]
fn a_drive_that_lost_its_supply_is_booted_again_and_started_by_resume() {
    let mut bench = Bench::new();
    for id in [SERVO, DESCRIBED, JOINT] {
        bench.turn(id);
        bench.reported.clear();
        bench.supply_away(id);
        let said = bench.watch(Duration::from_secs(15));
        assert!(bench.kinds().contains(&("boot_up", Some(id))), "{said:#?}");
        assert!(bench.kinds().contains(&("recovered", Some(id))), "{said:#?}");
        assert!(bench.speed(id) < 1.0);
        // The joint starts operational by itself (M joint manual, 4.2).
        let state = bench.network.facts(node(id)).nmt_state;
        assert_ne!(state.is_some_and(|state| state == NmtState::Operational), id != JOINT, "node {id}: {state:?}");
        bench.resume(id);
        bench.watch(Duration::from_secs(2));
        assert!(bench.network.guarded(node(id)).is_some_and(|loss| loss.stops_after().is_some()), "node {id}");
        bench.turn(id);
        let drive = bench.drive(id);
        block_on(&mut bench.world, drive.stop()).unwrap().unwrap();
    }
}

/// What was armed on it is armed again: without the master each of them stops.
#[test]
fn drives_that_came_back_stop_again_when_the_master_dies() {
    let mut bench = Bench::new();
    for id in [SERVO, DESCRIBED, JOINT] {
        bench.supply_away(id);
        bench.watch(Duration::from_secs(10));
        bench.resume(id);
    }
    for id in [SERVO, DESCRIBED, JOINT] {
        bench.turn(id);
    }
    bench.network.heartbeat(NodeId::MAX, None);
    bench.network.node(node(SERVO)).keep_fed(None);
    // 2000 ms of 1016h, 1000 ms of 2000h, and the ramps.
    bench.world.run_for(Duration::from_secs(5));
    for id in [SERVO, DESCRIBED, JOINT] {
        assert!(bench.speed(id) < 1.0, "node {id} turns at {}", bench.speed(id));
    }
}

#[test]
fn another_device_in_the_place_of_a_drive_is_reported_with_what_differs_and_not_started() {
    let mut bench = Bench::new();
    let old = bench.world.drive_id(SERVO).unwrap();
    bench.world.remove(old);
    bench.watch(Duration::from_secs(3));
    bench.reported.clear();
    let kind = Model::named("m4230e17b50").unwrap();
    bench.world.add_drive(SERVO + 10, Box::new(mjoint(kind, SERVO, Bitrate::K500))).unwrap();
    let said = bench.watch(Duration::from_secs(10)).join("\n");
    // Letter C: another device type (CiA 302-2). 40192h is the ZLAC8030L's, 20192h the joint's.
    assert!(said.contains("1000h:00 expected 40192h, got 20192h"), "{said}");
    assert!(!said.contains("resume 4"), "{said}");
}

#[test]
fn emergencies_are_reported_with_fault_and_remedy_and_kept_until_they_are_gone() {
    let mut bench = Bench::new();
    bench.turn(SERVO);
    bench.reported.clear();
    bench.apply(SERVO, "fault hall on");
    let said = bench.watch(Duration::from_secs(1)).join("\n");
    assert!(bench.kinds().contains(&("emcy", Some(SERVO))), "{said}");
    let records: Vec<_> = bench.supervisor.emcys().records().copied().collect();
    assert_eq!((records.len(), records[0].gone), (1, None));
    let fault = records[0].fault.expect("the model knows it");
    assert!(said.contains(fault.name) && said.contains(fault.remedy), "{said}");
    bench.apply(SERVO, "fault hall off");
    let drive = bench.drive(SERVO);
    block_on(&mut bench.world, drive.reset_fault()).unwrap().unwrap();
    bench.watch(Duration::from_secs(1));
    assert!(bench.supervisor.emcys().records().all(|record| record.gone.is_some()));
}

/// Its answers would mix with ours; it is reported once.
#[test]
fn a_second_master_is_reported_once_with_what_it_does() {
    let mut bench = Bench::new();
    for frame in ["604#4000100000000000", "604#4000100000000000", "000#0104", "000#0105"] {
        bench.supervisor.hear(bench.world.now(), &frame.parse().unwrap());
    }
    bench.watch(Duration::from_millis(100));
    let foreign: Vec<_> = bench
        .reported
        .iter()
        .filter_map(|happening| if let SupervisorEvent::Foreign(foreign) = happening { Some(*foreign) } else { None })
        .collect();
    assert_eq!(foreign, [Foreign::SdoRequest(node(SERVO)), Foreign::Nmt]);
}

/// Guards of a program that moves one of the drives on its own stay its own.
#[test]
fn a_guard_of_a_program_that_moves_a_drive_is_left_as_it_is() {
    let mut bench = Bench::new();
    let drive = bench.drive(SERVO);
    let loss = block_on(&mut bench.world, drive.guard(SwitchedOff::Leave)).unwrap().unwrap();
    bench.watch(Duration::from_secs(3));
    assert_eq!(bench.network.guarded(node(SERVO)), Some(loss));
    assert!(bench.reported.is_empty(), "{:?}", bench.reported);
}

#[test]
fn a_second_device_with_a_node_id_is_reported_once_by_its_heartbeats() {
    let mut bench = Bench::new();
    bench.watch(Duration::from_secs(20));
    assert!(!bench.kinds().contains(&("node_twice", Some(SERVO))), "{:?}", bench.reported);
    let from = bench.world.now() + Duration::from_millis(1);
    bench.world.add_station(StoppedTwin::of(SERVO.into(), from));
    let said = bench.watch(Duration::from_secs(20));
    assert_eq!(bench.kinds().iter().filter(|kind| **kind == ("node_twice", Some(SERVO))).count(), 1, "{said:?}");
    assert!(
        said.iter().any(|said| said.contains("in turn, without a command: two devices have this node-ID")),
        "{said:?}"
    );
    let of_others = bench.kinds().iter().filter(|(kind, _)| *kind == "node_twice").count();
    assert_eq!(of_others, 1, "{:?}", bench.kinds());
}

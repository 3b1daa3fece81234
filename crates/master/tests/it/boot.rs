//! The boot-up of a network in virtual time: letters, findings and states, against the virtual drives and hand-written nodes.
//!
//! Identities are the manuals': device type 00040192h of the ZLAC8030L (quick start guide, object list). Bits and letters are those
//! of CiA 302-2 (1F80h, 1F81h, error status).

use std::collections::BTreeMap;
use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use can::Bitrate;
use canopen::concise::{Entry, emit};
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::{Mux, NmtState, NodeId};
use devices::model;
use drives::mjoint::Model;
use master::Network;
use master::boot::{
    Assignment, BootPlan, BootReport, ErrorStatus, Expectation, NodeReport, StepKind, Unconfigured, Verdict,
};
use sim::machine::{mjoint, zlac8030l, zlim42c};
use sim::{Place, World, block_on, block_on_for};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const SERVO: u8 = 4;

struct Bench {
    world: World,
    network: Network,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        let kind = Model::named("m4230e17b50").unwrap();
        world.add_drive(JOINT, Box::new(mjoint(kind, JOINT, Bitrate::K500))).unwrap();
        world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, 1))).unwrap();
        world.add_drive(SERVO, Box::new(zlac8030l(SERVO, 1))).unwrap();
        world.run_for(Duration::from_secs(3));
        Self { world, network }
    }

    fn boot(&mut self, plan: &BootPlan) -> BootReport {
        block_on(&mut self.world, self.network.boot(plan)).unwrap()
    }

    fn unconfigured(&mut self, plan: &BootPlan, report: &BootReport) -> Vec<Unconfigured> {
        block_on(&mut self.world, self.network.unconfigured(plan, report)).unwrap()
    }

    fn one(&mut self, id: u8, expectation: Expectation) -> NodeReport {
        self.boot(&BootPlan::new([(node(id), expectation)])).nodes.remove(0)
    }

    fn apply(&mut self, id: u8, words: &str) {
        self.world.apply(Place::node(id), &words.parse().unwrap()).unwrap().unwrap();
    }
}

fn expected(name: &str) -> Expectation {
    Expectation::of(model(name).unwrap())
}

fn all() -> [(NodeId, Expectation); 3] {
    [(node(JOINT), expected("m4230e17b50")), (node(STEPPER), expected("zlim42c")), (node(SERVO), expected("zlac8030l"))]
}

fn letter(report: &NodeReport) -> Option<char> {
    report.status.map(ErrorStatus::letter)
}

fn last(report: &NodeReport) -> String {
    report.steps.last().map(ToString::to_string).unwrap_or_default()
}

#[test]
fn all_three_drives_boot_at_once_and_each_says_what_stops_it() {
    let mut bench = Bench::new();
    let report = bench.boot(&BootPlan::new(all()));
    assert!(report.is_whole());
    let states: Vec<_> = report.nodes.iter().map(|node| (node.node.raw(), letter(node), node.state)).collect();
    let operational = Some(NmtState::Operational);
    // The joint starts operational by itself (M joint manual, 4.2): it is left so, which is L.
    assert_eq!(states, [(JOINT, Some('L'), operational), (STEPPER, None, operational), (SERVO, None, operational)]);
    // Nothing is to be configured, so nothing is advised.
    assert_eq!(report.nodes[0].remarks().map(ToString::to_string).collect::<Vec<_>>(), [""; 0]);
    let watch = |at: usize| {
        let step = report.nodes[at].steps.iter().find(|step| step.kind == StepKind::HostWatch).unwrap();
        (step.verdict, step.to_string())
    };
    assert!(
        matches!(watch(0), (Verdict::Passed, text) if text.contains("2000 ms after the last heartbeat of node 127"))
    );
    assert!(matches!(watch(1), (Verdict::Noted, text) if text.contains("no watch over its host")));
    assert!(matches!(watch(2), (Verdict::Passed, text) if text.contains("1000 ms after the last frame")));
}

#[test]
fn a_node_that_is_not_there_is_reported_with_what_was_tried_and_others_boot() {
    let mut bench = Bench::new();
    let nodes = [(node(SERVO), expected("zlac8030l")), (node(9), expected("zlim42c"))];
    let began = bench.world.now();
    let report = bench.boot(&BootPlan::new(nodes));
    assert!(!report.is_whole());
    assert_eq!((letter(&report.nodes[0]), letter(&report.nodes[1])), (None, Some('B')));
    let text = last(&report.nodes[1]);
    assert!(text.starts_with("1000h:00 expected 40192h, got no answer within 200 ms after "), "{text}");
    assert!(text.contains("; it has never been heard; check its node-ID and its supply"), "{text}");
    assert!(bench.world.now() - began < Duration::from_secs(10));
}

#[test]
fn a_drive_without_its_cable_is_reported_with_when_it_was_last_heard() {
    let mut bench = Bench::new();
    bench.apply(SERVO, "cable cut");
    bench.world.run_for(Duration::from_secs(12));
    let report = bench.one(SERVO, expected("zlac8030l"));
    assert_eq!(letter(&report), Some('B'));
    let text = last(&report);
    let heard = text.split("last heard: boot-up ").nth(1).and_then(|rest| rest.split(" s ago").next());
    // It booted within its first 1.2 s, and has been asked for the 3 s that a node may take to boot.
    let age: f64 = heard.unwrap_or_else(|| panic!("{text}")).parse().unwrap();
    assert!((16.0..19.0).contains(&age), "{text}");
    assert!(
        text.ends_with("check whether it has lost its supply or its cable, or is too busy to answer in time"),
        "{text}"
    );
}

#[test]
fn another_device_ends_with_the_letter_of_what_differs_and_is_not_touched() {
    let right = expected("zlac8030l");
    let differing = [
        ('C', 0, Expectation { device_type: Some(0x0002_0192), ..right.clone() }),
        ('D', 1, Expectation { vendor_id: Some(0x0000_1111), ..right.clone() }),
        ('M', 2, Expectation { product_code: Some(0x0000_1111), ..right.clone() }),
        ('N', 3, Expectation { revision_number: Some(0x0000_1111), ..right.clone() }),
        ('O', 4, Expectation { serial_number: Some(0x0000_1111), ..right.clone() }),
    ];
    for (expected, sub_index, mut expectation) in differing {
        let mut bench = Bench::new();
        expectation.configuration = vec![(mux(0x6083, 0), 777_u32.to_le_bytes().to_vec())];
        let report = bench.one(SERVO, expectation);
        assert_eq!(letter(&report), Some(expected));
        let object = if sub_index == 0 { "1000h:00".to_owned() } else { format!("1018h:{sub_index:02}") };
        let text = last(&report);
        assert!(text.starts_with(&object) && text.contains(", got "), "{text}");
        assert_eq!(report.state, Some(NmtState::PreOperational));
        let acceleration = bench.network.node(node(SERVO));
        assert_ne!(block_on(&mut bench.world, acceleration.read::<u32>(mux(0x6083, 0))).unwrap().unwrap(), 777);
    }
}

#[test]
fn a_configuration_is_written_in_order_and_the_first_refusal_ends_the_boot_up() {
    let mut bench = Bench::new();
    let good = (mux(0x6083, 0), 777_u32.to_le_bytes().to_vec());
    let report = bench.one(SERVO, Expectation { configuration: vec![good.clone()], ..expected("zlac8030l") });
    assert_eq!(letter(&report), None);
    let handle = bench.network.node(node(SERVO));
    assert_eq!(block_on(&mut bench.world, handle.read::<u32>(mux(0x6083, 0))).unwrap().unwrap(), 777);

    let mut bench = Bench::new();
    let never = (mux(0x6084, 0), 778_u32.to_le_bytes().to_vec());
    let configuration = vec![good, (mux(0x6064, 0), vec![1, 0, 0, 0]), never];
    let report = bench.one(SERVO, Expectation { configuration, ..expected("zlac8030l") });
    assert_eq!(letter(&report), Some('J'));
    let text = last(&report);
    assert!(text.starts_with("6064h:00 expected to take 1h, got refused: "), "{text}");
    let handle = bench.network.node(node(SERVO));
    assert_ne!(block_on(&mut bench.world, handle.read::<u32>(mux(0x6084, 0))).unwrap().unwrap(), 778);
}

#[test]
fn an_operational_node_is_left_so_with_the_bit_and_reset_without_it() {
    let mut bench = Bench::new();
    assert_eq!(letter(&bench.one(SERVO, expected("zlac8030l"))), None);
    let boots = |bench: &Bench| bench.network.facts(node(SERVO)).boot_up.map(|(_, count)| count);
    let before = boots(&bench);
    assert_eq!(letter(&bench.one(SERVO, expected("zlac8030l"))), Some('L'));
    assert_eq!(boots(&bench), before);
    let disturbed =
        Expectation { assignment: Assignment::CAREFUL.without(Assignment::KEEP_ALIVE), ..expected("zlac8030l") };
    let report = bench.one(SERVO, disturbed);
    assert_eq!((letter(&report), report.state), (None, Some(NmtState::Operational)));
    assert_eq!(boots(&bench), before.map(|count| count + 1));
}

#[test]
fn a_manager_s_dictionary_is_a_plan() {
    let mut stream = Vec::new();
    emit([Entry { mux: mux(0x1017, 0), data: &[0xC8, 0] }], |bytes| stream.extend_from_slice(bytes));
    let mut objects = BTreeMap::from([
        ((0x1F80, 0), 0x03_u32.to_le_bytes().to_vec()),
        // A slave, booted, mandatory; its state is not asked for.
        ((0x1F81, SERVO), 0x0D_u32.to_le_bytes().to_vec()),
        ((0x1F84, SERVO), 0x0004_0192_u32.to_le_bytes().to_vec()),
        ((0x1F89, 0), 4000_u32.to_le_bytes().to_vec()),
        ((0x1016, 1), 0x0004_0190_u32.to_le_bytes().to_vec()),
        ((0x1F22, SERVO), stream),
    ]);
    let plan = |objects: &BTreeMap<_, Vec<u8>>| {
        BootPlan::from_objects(|mux: Mux| objects.get(&(mux.index, mux.sub_index)).cloned())
    };
    let made = plan(&objects).unwrap();
    assert_eq!(made.nodes.keys().map(|node| node.raw()).collect::<Vec<_>>(), [SERVO]);
    assert_eq!(made.boot_time, Some(Duration::from_secs(4)));
    assert_eq!(made.nodes[&node(SERVO)].heartbeat, Some(Duration::from_millis(400)));
    let mut bench = Bench::new();
    let report = bench.boot(&made);
    let servo = &report.nodes[0];
    assert_eq!((letter(servo), servo.state), (None, Some(NmtState::Operational)), "{servo}");
    // Started together with all others, which is the joint's and the stepper's start too.
    bench.world.run_for(Duration::from_secs(1));
    let handle = bench.network.node(node(SERVO));
    assert_eq!(block_on(&mut bench.world, handle.read::<u16>(mux(0x1017, 0))).unwrap().unwrap(), 200);
    // 1F80h, bit 0: the dictionary of a device that is not a master is not a plan.
    objects.insert((0x1F80, 0), 0x02_u32.to_le_bytes().to_vec());
    let refused = plan(&objects).unwrap_err().to_string();
    assert!(refused.starts_with("1F80h is 2h: without its bit 0 the device is not the NMT master"), "{refused}");
    objects.insert((0x1F80, 0), 0x03_u32.to_le_bytes().to_vec());
    // Half a configuration does not count.
    objects.get_mut(&(0x1F22, SERVO)).unwrap().pop();
    let refused = plan(&objects).unwrap_err().to_string();
    assert!(refused.starts_with("1F22h:04, the concise DCF of node 4, is not whole: "), "{refused}");
}

#[test]
fn a_mandatory_node_that_fails_stops_the_others_with_bit_6_of_1f80h() {
    let mut bench = Bench::new();
    let mut plan = BootPlan::new([(node(SERVO), expected("zlac8030l")), (node(9), expected("zlim42c"))]);
    // CiA 302-2, 1F80h: bit 6 stops all nodes.
    plan.startup.0 = 1 << 6;
    let report = bench.boot(&plan);
    assert_eq!(report.notes.len(), 1);
    bench.world.run_for(Duration::from_secs(1));
    assert_eq!(bench.network.facts(node(SERVO)).nmt_state, Some(NmtState::Stopped));
}

#[test]
fn a_node_whose_heartbeat_never_comes_ends_with_its_letter() {
    // It takes a heartbeat time, and sends none.
    let silent = || Toy::new(7).u32(0x1000, 0, 0x0001_0191).u16(0x1017, 0, 0);
    let mut bus = Bus::new(vec![silent()]);
    let plan = BootPlan::new([(node(7), Expectation::of_unknown())]);
    let network = bus.network.clone();
    let report = bus.block_on(network.boot(&plan)).nodes.remove(0);
    assert_eq!(letter(&report), Some('E'));
    assert!(last(&report).starts_with("state expected a heartbeat, got none within 850 ms"), "{}", last(&report));
    let mut plan = plan;
    plan.nodes.get_mut(&node(7)).unwrap().assignment = Assignment(Assignment::SLAVE | Assignment::BOOT);
    let mut bus = Bus::new(vec![silent()]);
    let network = bus.network.clone();
    let report = bus.block_on(network.boot(&plan)).nodes.remove(0);
    assert_eq!(letter(&report), Some('K'));
}

#[test]
fn a_node_that_is_no_slave_is_not_asked_anything() {
    let mut bus = Bus::new(vec![Toy::new(7).u32(0x1000, 0, 0)]);
    let plan = BootPlan::new([(node(7), Expectation::default())]);
    let network = bus.network.clone();
    let report = bus.block_on(network.boot(&plan));
    assert_eq!((letter(&report.nodes[0]), report.is_whole()), (Some('A'), true));
    assert!(bus.frames().is_empty());
}

#[test]
fn an_empty_bus_is_reported_within_the_time_of_the_plan() {
    let mut bus = Bus::new(Vec::new());
    let plan = BootPlan::new([(node(7), Expectation::of_unknown())]);
    let (network, began) = (bus.network.clone(), bus.now);
    let report = bus.block_on(network.boot(&plan)).nodes.remove(0);
    assert_eq!(letter(&report), Some('B'));
    assert!(last(&report).contains("check supply, cable, termination and bit rate"), "{}", last(&report));
    assert!(bus.now - began <= plan.boot_time.unwrap() + plan.timeout * 2);
}

/// CiA 302-2, 1F89h: 0 means without limit, for the slaves that 1F81h (bit 3) makes mandatory.
#[test]
fn a_mandatory_node_is_waited_for_without_limit_where_1f89h_is_0() {
    let assignment = |mandatory: u32| (Assignment::SLAVE | Assignment::BOOT | mandatory).to_le_bytes().to_vec();
    let plan = |boot_time: Option<u32>, mandatory: u32| {
        let time = boot_time.map(|ms| ((0x1F89, 0), ms.to_le_bytes().to_vec()));
        let slave = [((0x1F80, 0), 1_u32.to_le_bytes().to_vec()), ((0x1F81, SERVO), assignment(mandatory))];
        let objects: BTreeMap<_, _> = slave.into_iter().chain(time).collect();
        BootPlan::from_objects(|mux: Mux| objects.get(&(mux.index, mux.sub_index)).cloned()).unwrap()
    };
    // Its supply is switched on a minute later.
    let booted = |plan: BootPlan| {
        let mut bench = Bench::new();
        bench.apply(SERVO, "power off");
        bench.world.run_for(Duration::from_secs(3));
        let (network, minute) = (bench.network.clone(), Duration::from_secs(60));
        let mut boot = std::pin::pin!(network.boot(&plan));
        let gave_up = block_on_for(&mut bench.world, minute, boot.as_mut()).ok();
        bench.apply(SERVO, "power on");
        let report = gave_up.unwrap_or_else(|| block_on(&mut bench.world, boot).unwrap());
        letter(&report.nodes[0])
    };
    assert_eq!(booted(plan(None, Assignment::MANDATORY)), Some('B'));
    assert_eq!(booted(plan(Some(5000), Assignment::MANDATORY)), Some('B'));
    assert_eq!(booted(plan(Some(0), Assignment::MANDATORY)), None);
    // One that may be missing is not waited for without end.
    assert_eq!(booted(plan(Some(0), 0)), Some('B'));
}

/// A joint starts operational by itself (M joint manual, 4.2), and is left so (CiA 302-2, 1F81h bit 4): its configuration is not
/// written. That is reported as long as it is so, and no longer.
#[test]
fn a_node_that_was_left_operational_without_its_configuration_is_reported() {
    let mut bench = Bench::new();
    let heartbeat = PRODUCER_HEARTBEAT_TIME;
    let of_joint = Expectation { configuration: vec![(heartbeat, vec![200, 0])], ..expected("m4230e17b50") };
    let others = all().into_iter().filter(|(id, _)| *id != node(JOINT));
    let plan = BootPlan::new(others.chain([(node(JOINT), of_joint)]));
    let report = bench.boot(&plan);
    assert!(report.is_whole());
    assert!(report.nodes[0].to_string().contains("to configure it, stop it and reset it"), "{}", report.nodes[0]);
    let missing = bench.unconfigured(&plan, &report);
    assert_eq!(missing, [Unconfigured { node: node(JOINT), objects: vec![heartbeat] }]);
    // Reset and booted it is configured; and left so the next time, nothing is missing.
    let mut reset = plan.clone();
    for expectation in reset.nodes.values_mut() {
        expectation.assignment = expectation.assignment.without(Assignment::KEEP_ALIVE);
    }
    let report = bench.boot(&reset);
    assert_eq!(bench.unconfigured(&reset, &report), []);
    let report = bench.boot(&plan);
    assert_eq!(letter(&report.nodes[0]), Some('L'));
    assert_eq!(bench.unconfigured(&plan, &report), []);
}

//! Node guarding by the master (CiA 301, 7.2.8.2.1) in virtual time: nodes without a heartbeat are watched by remote frames, and
//! what is lost is stopped and booted anew as with heartbeats.

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, node};
use can::{Bitrate, Instant, Station};
use canopen::NmtState;
use devices::model;
use master::boot::{Assignment, BootPlan, ErrorStatus, Expectation, StepKind};
use master::core::{Command, Core, Event, Silence};
use master::supervise::{Supervisor, SupervisorEvent};
use master::units::Rpm;
use master::{Drive, MotionOptions, Network};
use sim::machine::{Order, order};
use sim::{Place, World, block_on};

const NODE: u8 = 5;
/// Guard time 100 ms, retry factor 3 (CiA 302-2, 1F81h, bits 16 to 31 and 8 to 15).
const GUARDED: u32 = 100 << 16 | 3 << 8;
const PERIOD: Duration = Duration::from_millis(100);

fn ms(at: u64) -> Instant {
    Instant::from_millis(at)
}

/// What a core sends until then.
fn run(core: &mut Core, until: Instant) -> Vec<String> {
    let mut sent = Vec::new();
    loop {
        let frames = std::iter::from_fn(|| core.poll_transmit()).map(|frame| frame.to_string()).collect::<Vec<_>>();
        sent.extend(frames.iter().map(|frame| format!("{} {frame}", core.now().as_nanos() / 1_000_000)));
        match core.poll_timeout().filter(|due| *due <= until) {
            Some(due) => core.handle_timeout(due),
            None => return sent,
        }
    }
}

fn events(core: &mut Core) -> Vec<Event> {
    std::iter::from_fn(|| core.poll_event()).map(|(_, event)| event).collect()
}

#[test]
fn a_node_is_asked_each_guard_time_and_lost_after_the_life_time() {
    let mut core = Core::new();
    core.execute(Command::WatchByGuarding(node(NODE), PERIOD, 3), ms(1000));
    assert_eq!(run(&mut core, ms(1250)), ["1000 705#R1", "1100 705#R1", "1200 705#R1"]);
    assert_eq!(events(&mut core), []);
    run(&mut core, ms(1300));
    let lost = Event::HeartbeatLost(node(NODE), Silence { time: PERIOD * 3, asked: true });
    assert_eq!(events(&mut core), [lost], "it never answered");
    assert_eq!(lost.to_string(), "node 5: no answer to node guarding for 300 ms");
    // It is asked on, and heard when it is back.
    assert_eq!(run(&mut core, ms(1450)), ["1400 705#R1"]);
    core.handle_frame(&"705#7F".parse().unwrap(), ms(1450));
    assert_eq!(
        events(&mut core),
        [Event::NmtState(node(NODE), NmtState::PreOperational), Event::HeartbeatBack(node(NODE))]
    );
}

#[test]
fn an_answer_whose_toggle_bit_does_not_alternate_counts_as_none() {
    let mut core = Core::new();
    core.execute(Command::WatchByGuarding(node(NODE), PERIOD, 2), ms(0));
    for (at, answer) in [(1, "705#85"), (101, "705#05"), (201, "705#85")] {
        run(&mut core, ms(at));
        core.handle_frame(&answer.parse().unwrap(), ms(at));
    }
    assert_eq!(events(&mut core), [Event::NmtState(node(NODE), NmtState::Operational)]);
    // The same bit again, with another state: neither is taken.
    run(&mut core, ms(301));
    core.handle_frame(&"705#84".parse().unwrap(), ms(301));
    run(&mut core, ms(400));
    assert_eq!((events(&mut core), core.facts(node(NODE)).nmt_state), (vec![], Some(NmtState::Operational)));
    run(&mut core, ms(401));
    assert!(matches!(events(&mut core)[..], [Event::HeartbeatLost(..)]));
    // After a boot-up message the next answer has 0.
    core.handle_frame(&"705#00".parse().unwrap(), ms(450));
    core.handle_frame(&"705#FF".parse().unwrap(), ms(460));
    assert_eq!(core.facts(node(NODE)).nmt_state, Some(NmtState::Initialising));
    core.handle_frame(&"705#7F".parse().unwrap(), ms(470));
    assert_eq!(core.facts(node(NODE)).nmt_state, Some(NmtState::PreOperational));
}

#[test]
fn a_watch_over_the_heartbeat_ends_the_guarding() {
    let mut core = Core::new();
    core.execute(Command::WatchByGuarding(node(NODE), PERIOD, 2), ms(0));
    run(&mut core, ms(50));
    core.execute(Command::WatchHeartbeat(node(NODE), Some(PERIOD)), ms(60));
    assert_eq!(run(&mut core, ms(5000)), [""; 0]);
    assert_eq!(events(&mut core), [], "armed by the first heartbeat");
}

struct Bench {
    world: World,
    network: Network,
    plan: BootPlan,
}

impl Bench {
    /// A servo of CiA 402, which has both and sends no heartbeat as delivered.
    fn new(assignment: u32) -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        world.add_station(network.clone());
        let servo = model("cia402").unwrap();
        world.add_drive(NODE, order(servo, &Order::new(servo, node(NODE), Bitrate::K500)).unwrap()).unwrap();
        world.run_for(Duration::from_secs(1));
        let expectation = Expectation { assignment: Assignment(assignment), ..Expectation::of(servo) };
        Self { world, network, plan: BootPlan::new([(node(NODE), expectation)]) }
    }

    fn apply(&mut self, words: &str) {
        self.world.apply(Place::node(NODE), &words.parse().unwrap()).unwrap().unwrap();
    }
}

/// CiA 302-2, 1F81h: bits 8 to 31.
#[test]
fn a_slave_with_a_guard_time_in_1f81h_is_guarded_and_gets_no_heartbeat_time() {
    for bits in [Assignment::CAREFUL.0, Assignment::SLAVE | Assignment::BOOT | Assignment::MANDATORY] {
        let mut bench = Bench::new(bits | GUARDED);
        let report = block_on(&mut bench.world, bench.network.boot(&bench.plan)).unwrap().nodes.remove(0);
        assert!(!report.has_failed() && report.state == Some(NmtState::Operational), "{report}");
        assert!(report.steps.iter().any(|step| step.kind == StepKind::Guarding), "{report}");
        let guarded = bench.network.node(node(NODE));
        let watch = guarded.facts().heartbeat_watch.expect("it is watched");
        assert_eq!((watch.time, watch.asked), (Duration::from_millis(300), true));
        let beat: u16 =
            block_on(&mut bench.world, guarded.read(canopen::object::PRODUCER_HEARTBEAT_TIME)).unwrap().unwrap();
        assert_eq!(beat, 0);
        bench.world.run_for(Duration::from_secs(5));
        assert!(!guarded.facts().heartbeat_watch.unwrap().lost);
    }
}

/// CiA 302-2, error status F. The toy answers SDO only; of one without 1017h the 100Ch and 100Dh that it has are enough.
#[test]
fn a_slave_that_does_not_answer_node_guarding_ends_with_f() {
    for (toy, bits) in [(Toy::new(NODE), GUARDED), (Toy::new(NODE).u16(0x100C, 0, 100).u8(0x100D, 0, 0), 0)] {
        let mut bus = Bus::new(vec![toy.u32(0x1000, 0, 0x0001_0191)]);
        let assignment = Assignment(Assignment::SLAVE | Assignment::BOOT | bits);
        let plan = BootPlan::new([(node(NODE), Expectation { assignment, ..Expectation::default() })]);
        let network = bus.network.clone();
        let report = bus.block_on(network.boot(&plan)).nodes.remove(0);
        assert_eq!(report.status.map(ErrorStatus::letter), Some('F'), "{report}");
        let said = report.to_string();
        assert!(said.contains("100Ch:00 expected an answer to node guarding, got none within 300 ms"), "{said}");
    }
}

#[test]
fn a_guarded_drive_that_was_away_is_booted_stands_and_is_guarded_again() {
    let mut bench = Bench::new(Assignment::CAREFUL.0 | GUARDED);
    let report = block_on(&mut bench.world, bench.network.boot(&bench.plan)).unwrap();
    assert!(report.is_whole(), "{:?}", report.nodes);
    while bench.network.poll_event().is_some() {}
    let drive = Drive::new(bench.network.node(node(NODE)), model("cia402").unwrap());
    block_on(&mut bench.world, drive.velocity(Rpm(60.0), MotionOptions::default())).unwrap().unwrap();
    let mut supervisor = Supervisor::new(bench.network.clone(), bench.plan.clone());
    let mut said = Vec::new();
    let mut watch = |bench: &mut Bench, time| {
        let end = bench.world.now() + time;
        while bench.world.now() < end {
            said.extend(block_on(&mut bench.world, supervisor.next()).unwrap().map(|(_, happening)| happening));
        }
        said.split_off(0)
    };
    watch(&mut bench, Duration::from_secs(2));
    assert!(bench.world.report(NODE).unwrap().velocity_rpm > 50.0);
    bench.apply("power off");
    // Its motor turns on for a while, and feeds it.
    let said_away = watch(&mut bench, Duration::from_secs(20));
    assert!(
        said_away
            .iter()
            .any(|happening| happening.to_string().contains("node 5: no answer to node guarding for 300 ms")),
        "{said_away:?}"
    );
    bench.apply("power on");
    let said_back = watch(&mut bench, Duration::from_secs(5));
    assert!(
        said_back.iter().any(|it| matches!(it, SupervisorEvent::Recovered(report) if !report.has_failed())),
        "{said_back:?}"
    );
    assert!(bench.world.report(NODE).unwrap().velocity_rpm.abs() < 0.5, "it stands");
    let watch = bench.network.node(node(NODE)).facts().heartbeat_watch.unwrap();
    assert!(watch.asked && !watch.lost);
}

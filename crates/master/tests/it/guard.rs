//! What each drive does when the program that moves it dies, guarded and not. Times are the manuals': 2000h of the
//! ZLAC8030L is 1000 ms as delivered (quick start guide, chapter 9), 1016h:01 of the joint 2000 ms of node 7Fh (M joint
//! manual, 5.11.2); the ZLIM42-C has nothing of the kind (user manual, 5.4).

use std::time::Duration;

use crate::support::toy::Toy;
use crate::support::{Bus, mux, node};
use can::{Bitrate, Frame, Instant, Station};
use devices::model;
use drives::mjoint::Model;
use master::core::NodeSet;
use master::drive::{HostLoss, MotionOptions, SwitchedOff};
use master::units::{Ramp, Rpm, Turns};
use master::{Drive, Network};
use sim::machine::{Order, mjoint, order, zlac8030l, zlim42c};
use sim::{StationId, World, block_on};

const JOINT: u8 = 1;
const STEPPER: u8 = 2;
const OTHER_JOINT: u8 = 3;
const SERVO: u8 = 4;

const LOST_HEARTBEAT: i64 = 0x20;

/// A master's process: it runs its network until it is killed.
#[derive(Clone)]
struct Process {
    network: Network,
    killed: bool,
}

impl Station for Process {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if !self.killed {
            self.network.handle_frame(frame, now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if !self.killed {
            self.network.handle_timeout(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.killed { None } else { self.network.poll_transmit() }
    }

    fn poll_timeout(&self) -> Option<Instant> {
        if self.killed { None } else { self.network.poll_timeout() }
    }
}

struct Bench {
    world: World,
    network: Network,
    process: StationId,
}

impl Bench {
    fn new() -> Self {
        let mut world = World::new(Bitrate::K500, 5);
        let network = Network::new();
        let process = world.add_station(Process { network: network.clone(), killed: false });
        let kind = Model::named("m4230e17b50").unwrap();
        for joint in [JOINT, OTHER_JOINT] {
            world.add_drive(joint, Box::new(mjoint(kind, joint, Bitrate::K500))).unwrap();
        }
        world.add_drive(STEPPER, Box::new(zlim42c(STEPPER, 1))).unwrap();
        world.add_drive(SERVO, Box::new(zlac8030l(SERVO, 1))).unwrap();
        world.run_until(Instant::from_secs(2));
        Self { world, network, process }
    }

    fn drive(&self, id: u8) -> Drive {
        let name = match id {
            SERVO => "zlac8030l",
            STEPPER => "zlim42c",
            _ => "m4230e17b50",
        };
        Drive::new(self.network.node(node(id)), model(name).unwrap())
    }

    fn run<T>(&mut self, what: impl Future<Output = T>) -> T {
        block_on(&mut self.world, what).unwrap()
    }

    fn wait(&mut self, ms: u64) {
        self.world.run_for(Duration::from_millis(ms));
    }

    fn guard(&mut self, id: u8) -> HostLoss {
        let drive = self.drive(id);
        let predicted = self.run(drive.host_loss_if_guarded()).unwrap();
        let loss = self.run(drive.guard(SwitchedOff::Leave)).unwrap();
        assert_eq!(predicted, loss, "what a guard would report is what it reports");
        loss
    }

    fn turn(&mut self, id: u8) {
        let ramp = Some(Ramp::Time(Duration::from_millis(300)));
        let options = MotionOptions { acceleration: ramp, deceleration: ramp, ..MotionOptions::default() };
        let drive = self.drive(id);
        self.run(drive.velocity(Rpm(60.0), options)).unwrap();
    }

    fn kill(&mut self) {
        self.world.station_mut::<Process>(self.process).unwrap().killed = true;
    }

    /// Another program, after the first one is gone.
    fn start_another(&mut self) {
        self.network = Network::new();
        self.process = self.world.add_station(Process { network: self.network.clone(), killed: false });
    }

    fn turns(&mut self, id: u8) -> bool {
        let speed = self.world.report(id).unwrap().velocity_rpm;
        assert!(speed.abs() < 2.0 || (speed - 60.0).abs() < 12.0, "node {id} is at {speed} r/min");
        speed > 30.0
    }

    /// Whether it shows an alarm, where no program is there to ask it.
    fn alarm_shown(&mut self, id: u8) -> bool {
        self.world.report(id).unwrap().error_code != 0
    }

    fn alarm(&mut self, id: u8) -> i64 {
        let drive = self.network.node(node(id));
        i64::from(self.run(drive.read::<u16>(mux(0x260E, 0))).unwrap())
    }
}

#[test]
fn a_guarded_joint_stops_two_seconds_after_the_last_heartbeat() {
    let mut bench = Bench::new();
    let loss = bench.guard(JOINT);
    let time = Duration::from_secs(2);
    assert_eq!(loss, HostLoss::StopsWithoutHeartbeat { object: mux(0x1016, 1), host: node(127), time });
    bench.turn(JOINT);
    // No request is sent to it: the core's heartbeats are enough.
    bench.wait(10_000);
    assert!(bench.turns(JOINT));
    bench.kill();
    // The last heartbeat is at most a quarter of the time ago.
    bench.wait(1_400);
    assert!(bench.turns(JOINT));
    bench.wait(1_600);
    assert!(!bench.turns(JOINT));
}

#[test]
fn a_guarded_servo_is_kept_content_and_stops_a_second_after_the_last_frame() {
    let mut bench = Bench::new();
    let loss = bench.guard(SERVO);
    assert_eq!(loss, HostLoss::StopsInSilence { object: mux(0x2000, 0), time: Duration::from_secs(1) });
    bench.turn(SERVO);
    bench.wait(10_000);
    assert!(bench.turns(SERVO));
    bench.kill();
    bench.wait(700);
    assert!(bench.turns(SERVO));
    bench.wait(1_000);
    assert!(!bench.turns(SERVO));
}

#[test]
fn a_stepper_turns_on_and_the_guard_reports_it() {
    let mut bench = Bench::new();
    assert_eq!(bench.guard(STEPPER), HostLoss::GoesOn);
    bench.turn(STEPPER);
    bench.kill();
    bench.wait(20_000);
    assert!(bench.turns(STEPPER));
}

/// It has no watch (ZLIM42-C user manual, 5.4): a position move ends where it was to end.
#[test]
fn a_stepper_finishes_its_move_without_its_program() {
    let mut bench = Bench::new();
    bench.guard(STEPPER);
    let drive = bench.drive(STEPPER);
    let options = MotionOptions { speed: Some(Rpm(60.0)), wait: false, ..MotionOptions::default() };
    let before = bench.world.report(STEPPER).unwrap().position;
    bench.run(drive.move_relative(Turns(4.0), options)).unwrap();
    bench.wait(500);
    assert!(bench.turns(STEPPER));
    bench.kill();
    // 4 turns of 60 r/min take 4 s and the ramps.
    bench.wait(6_000);
    assert!(!bench.turns(STEPPER));
    let moved = bench.world.report(STEPPER).unwrap().position - before;
    // 4000 steps a turn as delivered; an open-loop rotor stands within a fraction of a step of its field.
    assert!((moved - 16_000).abs() <= 160, "{moved}");
}

#[test]
fn an_unguarded_joint_turns_on() {
    let mut bench = Bench::new();
    bench.turn(JOINT);
    bench.kill();
    bench.wait(20_000);
    assert!(bench.turns(JOINT));
}

#[test]
fn a_released_joint_goes_on_alone_and_no_other_joint_misses_the_heartbeat() {
    let mut bench = Bench::new();
    bench.guard(JOINT);
    bench.turn(JOINT);
    bench.turn(OTHER_JOINT);
    bench.wait(3_000);
    let drive = bench.drive(JOINT);
    bench.run(drive.release_guard()).unwrap();
    bench.wait(10_000);
    assert!(bench.turns(JOINT) && bench.turns(OTHER_JOINT));
    for id in [JOINT, OTHER_JOINT] {
        assert_eq!(bench.alarm(id), 0, "node {id}");
        let entry = bench.network.node(node(id));
        // As delivered (5.11.2).
        assert_eq!(bench.run(entry.read::<u32>(mux(0x1016, 1))).unwrap(), 0x007F_07D0, "node {id}");
    }
    assert_eq!(bench.network.guarded(node(JOINT)), None);
}

#[test]
fn the_heartbeat_goes_on_until_the_last_guard_is_released() {
    let mut bench = Bench::new();
    let joints = [JOINT, OTHER_JOINT];
    for id in joints {
        bench.guard(id);
        bench.turn(id);
    }
    let first = bench.drive(JOINT);
    bench.run(first.release_guard()).unwrap();
    bench.wait(5_000);
    assert!(joints.iter().all(|id| bench.turns(*id)));
    let last = bench.drive(OTHER_JOINT);
    bench.run(last.release_guard()).unwrap();
    bench.wait(5_000);
    assert!(joints.iter().all(|id| bench.turns(*id)));
}

#[test]
fn a_watch_that_was_off_is_off_again_when_its_guard_ends_though_the_heartbeat_goes_on_for_another() {
    let mut bench = Bench::new();
    let watch = mux(0x1016, 1);
    let own = bench.network.node(node(JOINT));
    bench.run(own.write(watch, 0_u32)).unwrap();
    bench.guard(OTHER_JOINT);
    let drive = bench.drive(JOINT);
    bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
    assert_ne!(bench.run(own.read::<u32>(watch)).unwrap(), 0);
    bench.run(drive.release_guard()).unwrap();
    assert_eq!(bench.run(own.read::<u32>(watch)).unwrap(), 0);
    let network = bench.network.clone();
    bench.run(network.release_guards(NodeSet::ALL)).unwrap();
    assert_eq!(bench.run(own.read::<u32>(watch)).unwrap(), 0);
}

const GENERIC: u8 = 5;

/// The bench with a servo of CiA 402, as delivered.
fn with_servo() -> (Bench, Drive) {
    let mut bench = Bench::new();
    let description = model("cia402").unwrap();
    let servo = order(description, &Order::new(description, node(GENERIC), Bitrate::K500)).unwrap();
    bench.world.add_drive(GENERIC, servo).unwrap();
    bench.wait(500);
    let drive = Drive::new(bench.network.node(node(GENERIC)), description);
    (bench, drive)
}

/// A watch that is delivered switched off was not switched off on purpose (CiA 301, 7.5.2.19: 0 is the default of
/// 1016h).
#[test]
fn a_servo_with_a_heartbeat_consumer_is_guarded_without_being_asked() {
    let (mut bench, drive) = with_servo();
    let loss = bench.run(drive.guard(SwitchedOff::Leave)).unwrap();
    assert_eq!(loss.stops_after(), Some(Duration::from_secs(2)));
    bench.run(drive.release_guard()).unwrap();
    assert_eq!(bench.run(drive.node().read::<u32>(mux(0x1016, 1))).unwrap(), 0, "as it was before");
}

/// CiA 402 has 6007h for it, and a servo is delivered with 1016h:01 = 0: it would watch no node.
#[test]
fn a_servo_that_is_delivered_without_a_watch_is_given_one_and_stops_when_the_program_dies() {
    let (mut bench, drive) = with_servo();
    let loss = bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
    assert_eq!(loss.stops_after(), Some(Duration::from_secs(2)));
    bench.run(drive.velocity(Rpm(60.0), MotionOptions::default())).unwrap();
    bench.wait(5_000);
    assert!(bench.turns(GENERIC), "a program that lives is heard");
    bench.kill();
    bench.wait(4_000);
    assert!(!bench.turns(GENERIC));
}

/// J112: the next heartbeat lets the joint go on with what it was commanded.
#[test]
fn the_motion_of_a_dead_program_does_not_come_back_with_the_next_one() {
    let mut bench = Bench::new();
    bench.guard(JOINT);
    bench.turn(JOINT);
    bench.kill();
    bench.wait(4_000);
    bench.start_another();
    assert_eq!(bench.alarm(JOINT), LOST_HEARTBEAT);
    bench.guard(JOINT);
    bench.wait(5_000);
    assert_eq!((bench.alarm(JOINT), bench.turns(JOINT)), (0, false));
    bench.turn(JOINT);
    assert!(bench.turns(JOINT));
}

/// The other joint watches the same node-ID as the one that is moved next, and is not heard before the first heartbeat.
#[test]
fn the_motion_of_a_dead_program_does_not_come_back_when_another_drive_is_moved() {
    let mut bench = Bench::new();
    bench.guard(JOINT);
    bench.turn(JOINT);
    bench.kill();
    bench.wait(3000);
    assert_eq!((bench.turns(JOINT), bench.alarm_shown(JOINT)), (false, true));
    bench.start_another();
    bench.guard(OTHER_JOINT);
    bench.turn(OTHER_JOINT);
    for _ in 0..30 {
        bench.wait(100);
        assert!(!bench.turns(JOINT) && bench.turns(OTHER_JOINT));
    }
}

#[test]
fn a_reset_ends_the_alarm_of_a_lost_host_at_standstill() {
    let mut bench = Bench::new();
    bench.guard(JOINT);
    bench.turn(JOINT);
    bench.kill();
    bench.wait(4_000);
    bench.start_another();
    let drive = bench.drive(JOINT);
    bench.run(drive.reset_fault()).unwrap();
    bench.wait(5_000);
    assert_eq!((bench.alarm(JOINT), bench.turns(JOINT)), (0, false));
}

#[test]
fn a_watch_that_was_switched_off_stays_so_unless_asked_for() {
    let mut bench = Bench::new();
    let (drive, object) = (bench.drive(SERVO), mux(0x2000, 0));
    let time = |bench: &mut Bench| bench.run(drive.node().read::<u16>(object)).unwrap();
    bench.run(drive.node().write(object, 0u16)).unwrap();
    assert_eq!(bench.guard(SERVO), HostLoss::SwitchedOff { object });
    assert_eq!(time(&mut bench), 0);
    let loss = bench.run(drive.guard(SwitchedOff::SwitchOn)).unwrap();
    assert_eq!((loss.stops_after(), time(&mut bench)), (Some(Duration::from_secs(1)), 1000));
    bench.run(drive.release_guard()).unwrap();
    assert_eq!(time(&mut bench), 0);
}

/// Two devices must not send the same heartbeat.
#[test]
fn the_heartbeat_of_another_device_is_left_to_it() {
    let mut bench = Bench::new();
    let probe = bench.world.add_probe();
    bench.world.send(probe, "77F#05".parse().unwrap()).unwrap();
    bench.wait(10);
    let loss = bench.guard(JOINT);
    assert_eq!(loss, HostLoss::WatchesAnother { object: mux(0x1016, 1), host: node(127) });
    assert!(loss.to_string().contains("node 127, which is another device"));
}

#[test]
fn a_network_asks_to_be_called_when_a_heartbeat_is_due() {
    let mut bus = Bus::new(vec![Toy::new(4)]);
    let (begin, period) = (bus.now, Duration::from_millis(250));
    bus.network.handle_timeout(begin);
    bus.network.heartbeat(node(127), Some(period));
    assert_eq!(bus.network.poll_timeout(), Some(begin));
    bus.block_on(bus.network.clone().sleep(Duration::from_millis(1_100)));
    let beats: Vec<_> = bus.log.iter().filter(|(_, frame)| frame.to_string() == "77F#05").collect();
    let since: Vec<_> = beats.iter().map(|(at, _)| at.nanos_since(begin) / 1_000_000).collect();
    assert_eq!(since, [0, 250, 500, 750, 1000]);
    bus.network.heartbeat(node(127), None);
    bus.network.handle_timeout(bus.now);
    assert_eq!(bus.network.poll_timeout(), None);
}

//! The host against virtual drives, in virtual time: permission to move, and stops.

mod capture;
mod faults;
mod group;
mod guarding;
mod homing;
mod parameters;
mod pdo;
mod series;
mod speed_limit;
mod test_motion;
mod trace;
mod tune;
mod world;

use std::collections::{BTreeMap, VecDeque};
use std::pin::{Pin, pin};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use can::{Bitrate, BusFrame, Instant, Listen, Tap};
use canopen::NodeId;
use cia402::object::{CONTROLWORD, MODES_OF_OPERATION, POSITION_ACTUAL_VALUE, STATUSWORD, TARGET_VELOCITY};
use master::Network;
use master::drive::{self, Manner, Motion};
use master::units::{Along, Amperes, Angle, Rpm};
use serde_json::Value;
use sim::World;
use sim::machine::{TimingMode, zlac8030l, zlim42c};

use super::{Host, JOG_SPAN, Journals, PRESENCE_SPAN, Setting};
use crate::answer::Answer;
use crate::capture::WaysBack;
use crate::command::{Command, NodeCommand, SessionCommand};
use crate::session::handle::{HostHandle, Session};
use crate::state::TICK;
use crate::wire::Wire;

const WHEEL: NodeId = node(4);
const ARM: NodeId = node(2);

/// How long a quick stop from 60 r/min may take with the default ramp, until its end is seen.
const STOPPED_WITHIN: Duration = Duration::from_millis(600);

const fn node(raw: u8) -> NodeId {
    match NodeId::new(raw) {
        Some(node) => node,
        None => panic!("a node-ID"),
    }
}

fn to(node: NodeId, command: drive::Command) -> Command {
    NodeCommand::Drive(command).to(node)
}

fn velocity(node: NodeId, rpm: f64) -> Command {
    to(node, Motion::Velocity(Rpm(rpm).into(), Manner::default()).into())
}

fn at(rpm: Option<f64>) -> Option<Along<Rpm>> {
    rpm.map(|rpm| Rpm(rpm).into())
}

fn move_by(node: NodeId, degrees: f64, rpm: Option<f64>) -> Command {
    let by = Angle::Turns(degrees / 360.0).into();
    to(node, Motion::Move { to: by, relative: true, speed: at(rpm), manner: Manner::default() }.into())
}

fn torque(node: NodeId, amperes: f64) -> Command {
    to(node, Motion::Torque(Amperes(amperes)).into())
}

fn home(node: NodeId, method: i8, rpm: Option<f64>) -> Command {
    to(node, Motion::Home { method, speed: at(rpm), wait: true, within: None }.into())
}

/// A studio on a bus with two drives, for pages.
struct Stage {
    network: Network,
    handle: HostHandle,
}

/// A page that numbers its messages.
struct Page {
    session: Session,
    seq: u64,
}

impl Page {
    async fn ask(&mut self, command: impl Into<Command>) -> Answer {
        self.seq += 1;
        let answered = self.session.ask(self.seq, command.into()).expect("there is room");
        answered.await.expect("every message is answered")
    }

    /// Takes control, and accepts that nothing stops the stepper when the program dies.
    async fn take_control_of_all(&mut self) {
        self.must(SessionCommand::TakeControl {}).await;
        self.must(NodeCommand::AcceptUnguarded.to(ARM)).await;
    }

    async fn must(&mut self, command: impl Into<Command>) {
        let command = command.into();
        let answer = self.ask(command.clone()).await;
        assert!(answer.is_ok(), "{command:?}: {}", answer.json());
    }
}

impl Stage {
    async fn page(&self) -> Page {
        Page { session: self.handle.join().await.expect("there is room"), seq: 0 }
    }

    async fn sleep(&self, ms: u64) {
        self.network.sleep(Duration::from_millis(ms)).await;
    }

    fn state(&self) -> Value {
        serde_json::from_str(&self.handle.states().borrow().json()).expect("JSON")
    }

    /// The speed of a shaft by its 606Ch, in r/min of the motor.
    async fn speed(&self, id: NodeId) -> f64 {
        let model = if id == WHEEL { "zlac8030l" } else { "zlim42c" };
        let drive = master::Drive::new(self.network.node(id), devices::model(model).expect("a model"));
        drive.state().await.expect("it answers").velocity.expect("it has one").0.abs()
    }

    /// Waits until a shaft turns at about this speed.
    async fn turns(&self, id: NodeId, rpm: f64) {
        for _ in 0..200 {
            if (self.speed(id).await - rpm).abs() < rpm * 0.2 {
                return;
            }
            self.sleep(10).await;
        }
        panic!("node {id} turns at {} r/min, not {rpm}", self.speed(id).await);
    }

    /// Waits until a shaft rests, and returns how long that took.
    async fn rests(&self, id: NodeId) -> Duration {
        let from = self.network.now();
        while self.speed(id).await > 2.0 {
            assert!(self.network.now() - from < Duration::from_secs(5), "node {id} still turns");
            self.sleep(5).await;
        }
        self.network.now() - from
    }

    /// The power state: a stop leaves Operation enabled at once, however long the ramp takes.
    async fn power_state(&self, id: NodeId) -> cia402::PowerState {
        let word: u16 = self.network.node(id).read(STATUSWORD).await.expect("it answers");
        cia402::Statusword(word).state().expect("a state of CiA 402")
    }

    async fn scanned(&self) {
        while self.state()["nodes"].as_array().is_none_or(|nodes| nodes.len() < 2) || self.state()["scanning"] == true {
            self.sleep(50).await;
        }
    }
}

/// The frames that have passed a network.
#[derive(Clone, Default)]
struct Passed(Arc<Mutex<VecDeque<BusFrame>>>);

impl Passed {
    fn take(&self) -> Option<BusFrame> {
        self.0.lock().expect("not poisoned").pop_front()
    }
}

impl Listen for Passed {
    fn hear(&mut self, passed: BusFrame) {
        self.0.lock().expect("not poisoned").push_back(passed);
    }
}

fn setting() -> Setting {
    Setting {
        bus: "sim".into(),
        bitrate: None,
        timeout: Duration::from_millis(100),
        models: BTreeMap::new(),
        gears: BTreeMap::new(),
        groups: Vec::new(),
        interface: "can0".into(),
        unix_zero: Duration::from_secs(1_700_000_000),
        journals: None,
        world: None,
        ways_back: WaysBack::default(),
        console: None,
        wire: Wire::default(),
        allow_motion: false,
    }
}

/// Runs a scene with a running studio.
fn play(scene: impl AsyncFnOnce(&Stage)) {
    play_acts(scene, |_| {}, async |_| {}, |_| {}, async |_| {});
}

/// The same with journals.
fn play_with(journals: Arc<dyn Journals>, scene: impl AsyncFnOnce(&Stage)) {
    let setting = Setting { journals: Some(journals), ..setting() };
    play_in(setting, scene, |_| {}, async |_| {}, |_| {}, async |_| {});
}

/// Runs three scenes with one studio; between them the world changes.
fn play_acts(
    first: impl AsyncFnOnce(&Stage),
    then: impl FnOnce(&mut World),
    second: impl AsyncFnOnce(&Stage),
    at_last: impl FnOnce(&mut World),
    third: impl AsyncFnOnce(&Stage),
) {
    play_in(setting(), first, then, second, at_last, third);
}

fn play_in(
    setting: Setting,
    first: impl AsyncFnOnce(&Stage),
    then: impl FnOnce(&mut World),
    second: impl AsyncFnOnce(&Stage),
    at_last: impl FnOnce(&mut World),
    third: impl AsyncFnOnce(&Stage),
) {
    let network = Network::new();
    let passed = Passed::default();
    let mut world = World::new(Bitrate::K500, 1);
    world.add_station(Tap::new(network.clone(), passed.clone()));
    world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the first");
    world.add_drive(2, Box::new(zlim42c(2, 1))).expect("the second");
    world.run_for(Duration::from_secs(1));
    let models = [(WHEEL, "zlac8030l"), (ARM, "zlim42c")];
    let models: BTreeMap<_, _> =
        models.into_iter().map(|(node, name)| (node, devices::model(name).expect("a model"))).collect();
    let setting = Setting { bitrate: Some(Bitrate::K500), models, ..setting };
    let (host, handle) = Host::new(network.clone(), setting);
    let stage = Stage { network, handle };
    let mut serving = pin!(host.run(|| passed.take()));
    act(&mut world, serving.as_mut(), async {
        stage.scanned().await;
        first(&stage).await;
    });
    then(&mut world);
    act(&mut world, serving.as_mut(), second(&stage));
    at_last(&mut world);
    act(&mut world, serving.as_mut(), third(&stage));
}

fn act(world: &mut World, serving: Pin<&mut impl Future<Output = ()>>, scene: impl Future<Output = ()>) {
    let playing = async {
        tokio::select! {
            () = serving => panic!("the host ended although there is a handle"),
            () = scene => {}
        }
    };
    sim::block_on_for(world, Duration::from_secs(120), playing).expect("the scene ends");
}

fn jog(rpm: f64) -> Command {
    NodeCommand::Jog { rpm }.to(WHEEL)
}

#[test]
fn a_session_without_control_moves_nothing_and_can_stop_everything() {
    play(async |stage| {
        let (mut first, mut second) = (stage.page().await, stage.page().await);
        assert_eq!(first.ask(jog(60.0)).await.error_kind(), "not_in_control");
        first.must(SessionCommand::TakeControl {}).await;
        assert_eq!(second.ask(SessionCommand::TakeControl {}).await.error_kind(), "not_in_control");
        assert_eq!(second.ask(to(WHEEL, drive::Command::Enable)).await.error_kind(), "not_in_control");
        first.must(velocity(WHEEL, 60.0)).await;
        stage.turns(WHEEL, 60.0).await;
        second.must(SessionCommand::StopAll {}).await;
        assert!(stage.rests(WHEEL).await < STOPPED_WITHIN);
        assert_ne!(stage.power_state(WHEEL).await, cia402::PowerState::OperationEnabled);
    });
}

#[test]
fn a_jog_that_is_held_goes_on_and_one_that_is_not_stops() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(jog(60.0)).await;
        for _ in 0..30 {
            stage.sleep(100).await;
            page.must(NodeCommand::JogHold.to(WHEEL)).await;
        }
        assert!((stage.speed(WHEEL).await - 60.0).abs() < 5.0, "held for 3 s it turns");
        let released = stage.network.now();
        while stage.power_state(WHEEL).await == cia402::PowerState::OperationEnabled {
            stage.sleep(1).await;
        }
        let shown = stage.network.now() - released;
        let limit = Duration::from_millis(200);
        assert!(shown > JOG_SPAN - TICK && shown < limit + Duration::from_millis(5), "quick stop after {shown:?}");
        stage.rests(WHEEL).await;
        assert_eq!(page.ask(NodeCommand::JogHold.to(WHEEL)).await.error_kind(), "not_held", "too late");
        stage.sleep(500).await;
        assert!(stage.speed(WHEEL).await < 2.0, "a late renewal moves nothing");
    });
}

/// A person may press `e` with the arrow key held: the dead man stays.
#[test]
fn a_jog_stays_held_whatever_else_is_asked_of_the_drive() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        for other in [to(WHEEL, drive::Command::Enable), to(WHEEL, drive::Command::ResetFault)] {
            page.must(jog(60.0)).await;
            for _ in 0..10 {
                stage.sleep(60).await;
                page.must(NodeCommand::JogHold.to(WHEEL)).await;
            }
            assert!(stage.speed(WHEEL).await > 50.0);
            // Whether a reset without a fault is answered with success is not tested here.
            page.ask(other).await;
            stage.sleep(200).await;
            assert!(stage.rests(WHEEL).await < STOPPED_WITHIN);
        }
    });
}

#[test]
fn a_jog_that_is_let_go_stops_by_its_ramp_and_stays_enabled() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(jog(-60.0)).await;
        for _ in 0..10 {
            stage.sleep(60).await;
            page.must(NodeCommand::JogHold.to(WHEEL)).await;
        }
        page.must(NodeCommand::JogEnd.to(WHEEL)).await;
        assert!(stage.speed(WHEEL).await < 2.0, "answered at standstill");
        assert_eq!(stage.power_state(WHEEL).await, cia402::PowerState::OperationEnabled);
        assert_eq!(page.ask(NodeCommand::JogEnd.to(WHEEL)).await.error_kind(), "not_held");
    });
}

#[test]
fn a_page_that_goes_stops_all_that_it_moved_and_gives_control_up() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        page.must(velocity(WHEEL, 60.0)).await;
        page.must(velocity(ARM, 30.0)).await;
        stage.turns(ARM, 30.0).await;
        drop(page);
        assert!(stage.rests(WHEEL).await < STOPPED_WITHIN);
        assert!(stage.rests(ARM).await < STOPPED_WITHIN);
        stage.page().await.must(SessionCommand::TakeControl {}).await;
    });
}

#[test]
fn the_motions_of_a_page_that_falls_silent_are_stopped() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        for _ in 0..8 {
            stage.sleep(500).await;
            page.must(SessionCommand::Alive {}).await;
        }
        stage.turns(WHEEL, 60.0).await;
        stage.sleep((PRESENCE_SPAN + STOPPED_WITHIN).as_millis() as u64).await;
        assert!(stage.speed(WHEEL).await < 2.0);
    });
}

#[test]
fn a_handover_of_control_stops_the_motions_of_the_previous_session() {
    play(async |stage| {
        let (mut first, mut second) = (stage.page().await, stage.page().await);
        first.must(SessionCommand::TakeControl {}).await;
        first.must(velocity(WHEEL, 60.0)).await;
        second.must(SessionCommand::AskControl {}).await;
        first.must(SessionCommand::HandOver { to: second.session.id().0 }).await;
        stage.rests(WHEEL).await;
        assert_eq!(first.ask(jog(60.0)).await.error_kind(), "not_in_control");
        second.must(move_by(WHEEL, 90.0, None)).await;
    });
}

#[test]
fn a_message_that_is_sent_again_moves_nothing() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(move_by(WHEEL, 90.0, None)).await;
        let before: i32 = stage.network.node(WHEEL).read(POSITION_ACTUAL_VALUE).await.expect("it answers");
        page.seq -= 1;
        let again = page.ask(move_by(WHEEL, 90.0, None)).await;
        assert_eq!(again.error_kind(), "replayed");
        stage.sleep(1000).await;
        let after: i32 = stage.network.node(WHEEL).read(POSITION_ACTUAL_VALUE).await.expect("it answers");
        // 4096 counts are a turn (ZLAC8030L).
        assert!(after.abs_diff(before) < 20 && before.abs_diff(1024) < 40, "{before} {after}");
    });
}

#[test]
fn a_stop_during_the_start_of_a_motion_keeps_it_from_beginning() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        // At any time between the first request and the target written.
        for delay_ms in [0, 5, 10, 20, 30, 40, 60, 80] {
            page.seq += 1;
            let begun = page.session.ask(page.seq, jog(60.0)).expect("there is room");
            stage.sleep(delay_ms).await;
            page.must(SessionCommand::StopAll {}).await;
            begun.await.expect("answered");
            stage.sleep(700).await;
            assert!(stage.speed(WHEEL).await < 2.0, "stopped {delay_ms} ms after the start");
            page.must(SessionCommand::Alive {}).await;
        }
    });
}

#[test]
fn every_powered_drive_is_stopped_even_if_another_program_moves_it() {
    play(async |stage| {
        // As another program on the bus does it: not a motion of this studio.
        let arm = stage.network.node(ARM);
        arm.write(MODES_OF_OPERATION, 3_i8).await.expect("profile velocity");
        for controlword in [0x06_u16, 0x07, 0x0F] {
            arm.write(CONTROLWORD, controlword).await.expect("it follows");
            stage.sleep(50).await;
        }
        arm.write(TARGET_VELOCITY, 30_i32).await.expect("r/min");
        stage.turns(ARM, 30.0).await;
        assert!(stage.network.moved().is_empty());
        let mut page = stage.page().await;
        page.must(SessionCommand::StopAll {}).await;
        assert!(stage.rests(ARM).await < STOPPED_WITHIN);
    });
}

#[test]
fn the_state_has_the_values_of_the_drive() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.sleep(300).await;
        let state = stage.state();
        let shown = &state["nodes"].as_array().expect("nodes")[1];
        assert_eq!((&shown["node"], &shown["model"]), (&4.into(), &"zlac8030l".into()), "{shown}");
        assert_eq!(shown["drive"]["state"], "Operation enabled");
        assert_eq!(shown["drive"]["mode"], 3);
        assert_eq!(shown["moving"], true);
        let speed = shown["drive"]["velocity_rpm"].as_f64().expect("a speed");
        assert!((speed - 60.0).abs() < 5.0, "{speed}");
        assert_eq!((&state["controller"], &state["sessions"]), (&page.session.id().0.into(), &1.into()));
        assert_eq!(shown["drive"]["way"], serde_json::json!([]));
    });
}

#[test]
fn a_drive_that_does_not_move_is_explained() {
    play(async |stage| {
        let mut page = stage.page().await;
        let before = stage.network.now();
        let answer: Value = serde_json::from_str(&page.ask(NodeCommand::Explain.to(WHEEL)).await.json()).expect("JSON");
        assert!(stage.network.now() - before >= Duration::from_millis(1500), "others are listened to first");
        let findings = answer["result"]["findings"].as_array().expect("findings");
        let not_enabled = findings.iter().find(|finding| finding["rule"] == "not_enabled").expect("it is not enabled");
        assert_eq!((&not_enabled["cause"], &not_enabled["topic"]), (&true.into(), &"power".into()));
    });
}

#[test]
fn loss_and_return_of_a_drive_are_reported() {
    play(async |stage| {
        let mut page = stage.page().await;
        let mut news = stage.handle.news();
        assert_eq!(page.ask(to(ARM, drive::Command::Enable)).await.error_kind(), "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        assert_eq!(page.ask(to(node(9), drive::Command::Enable)).await.error_kind(), "no_such_drive");
        stage.network.node(ARM).nmt(canopen::NmtCommand::ResetNode);
        stage.sleep(1500).await;
        let heard: Vec<String> = std::iter::from_fn(|| news.try_recv().ok()).map(|news| news.text).collect();
        assert!(heard.iter().any(|news| news.contains("node 2 booted")), "{heard:?}");
    });
}

#[test]
fn a_node_that_boots_during_the_scan_is_found() {
    let network = Network::new();
    let mut world = World::new(Bitrate::K500, 1);
    world.add_station(network.clone());
    // One is present, so that frames are acknowledged; the other gets its power now, and boots during the scan.
    world.add_drive(2, Box::new(zlim42c(2, 1))).expect("the first");
    world.run_for(Duration::from_secs(1));
    // As long as the real one takes: after it has been asked, before the scan has ended.
    world.set_timing(TimingMode::Device);
    world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the second");
    let timeout = Duration::from_millis(300);
    let setting = Setting { timeout, ..setting() };
    let (host, handle) = Host::new(network.clone(), setting);
    let stage = Stage { network, handle };
    let playing = async {
        tokio::select! {
            () = host.run(|| None) => panic!("the host ended although there is a handle"),
            () = async {
                while stage.state()["nodes"][1]["drive"].is_null() {
                    stage.sleep(100).await;
                }
            } => {}
        }
    };
    sim::block_on_for(&mut world, Duration::from_secs(30), playing).expect("it is found");
    assert_eq!(stage.state()["nodes"][1]["node"], 4);
}

#[test]
fn time_is_that_of_the_bus() {
    play(async |stage| {
        let _page = stage.page().await;
        stage.sleep(1000).await;
        let shown = stage.state()["time_s"].as_f64().expect("a time");
        let now = (stage.network.now() - Instant::ZERO).as_secs_f64();
        assert!((0.0..0.1).contains(&(now - shown)), "{shown} of {now}");
    });
}

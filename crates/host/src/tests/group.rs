//! Several virtual drives as one motion: they end together, and whatever stops one stops all.

use std::time::Duration;

use can::Instant;
use serde_json::Value;
use sim::{Place, World};

use master::drive;

use super::{ARM, Page, STOPPED_WITHIN, Stage, TICK, WHEEL, move_by, node, play, play_acts, to, velocity};
use crate::answer::Answer;
use crate::command::{AxisSpeed, AxisTarget, BaseJog, Command, GroupCommand, GroupMove, NodeCommand, SessionCommand};

pub(super) fn move_to(wheel: f64, arm: f64) -> Command {
    let axes = vec![AxisTarget { node: WHEEL, degrees: wheel }, AxisTarget { node: ARM, degrees: arm }];
    GroupCommand::GroupMove(GroupMove { axes, relative: false, rpm: None, rpm_per_s: None, within_s: None }).into()
}

fn jog(wheel: f64, arm: f64) -> Command {
    let axes = vec![AxisSpeed { node: WHEEL, rpm: wheel }, AxisSpeed { node: ARM, rpm: arm }];
    GroupCommand::GroupJog { axes, rpm_per_s: Some(120.0) }.into()
}

fn base() -> BaseJog {
    BaseJog {
        wheels: [WHEEL, ARM],
        turns: [1.0, -1.0],
        wheel_base_m: 0.5,
        wheel_radius_m: 0.1,
        most_m_s: 0.5,
        m_per_s2: 1.0,
        linear_m_s: 0.2,
        angular_rad_s: 0.0,
    }
}

pub(super) type Answered = tokio::sync::oneshot::Receiver<Answer>;

impl Page {
    /// Sends a command without waiting for its answer.
    pub(super) fn begin(&mut self, command: Command) -> Answered {
        self.seq += 1;
        self.session.ask(self.seq, command).expect("there is room")
    }

    /// Holds a group with a command every 100 ms.
    async fn hold(&mut self, stage: &Stage, command: &Command, times: u32) {
        for _ in 0..times {
            stage.sleep(100).await;
            self.must(command.clone()).await;
        }
    }
}

impl Stage {
    fn velocity(&self, of: canopen::NodeId) -> f64 {
        let state = self.state();
        let nodes = state["nodes"].as_array().expect("nodes");
        let node = nodes.iter().find(|node| node["node"] == of.raw()).expect("it is there");
        node["drive"]["velocity_rpm"].as_f64().expect("a speed")
    }

    fn angle(&self, of: canopen::NodeId) -> f64 {
        let state = self.state();
        let nodes = state["nodes"].as_array().expect("nodes");
        let node = nodes.iter().find(|node| node["node"] == of.raw()).expect("it is there");
        node["drive"]["angle_degrees"].as_f64().expect("an angle")
    }
}

#[test]
fn drives_move_together_to_their_positions_and_are_disabled_then() {
    play(async |stage| {
        let mut page = stage.page().await;
        assert_eq!(page.ask(move_to(90.0, -45.0)).await.error_kind(), "not_in_control");
        page.take_control_of_all().await;
        let mut moved = page.begin(move_to(180.0, -90.0));
        // 30 r/min are 180 degrees a second: the wheel takes more than a second, and the arm, with half the way, as long.
        stage.sleep(800).await;
        let (wheel, arm) = (stage.velocity(WHEEL), stage.velocity(ARM));
        assert!(wheel > 5.0 && (wheel / 2.0 + arm).abs() < 4.0, "half as fast: {wheel} and {arm}");
        let answer = loop {
            tokio::select! {
                answer = &mut moved => break answer.expect("answered"),
                () = stage.network.sleep(Duration::from_millis(500)) => page.must(SessionCommand::Alive {}).await,
            }
        };
        assert!(answer.is_ok() && answer.json().contains("2 drives moved together in"), "{}", answer.json());
        stage.sleep(300).await;
        assert!((stage.angle(WHEEL) - 180.0).abs() < 3.0, "{}", stage.angle(WHEEL));
        assert!((stage.angle(ARM) + 90.0).abs() < 3.0, "{}", stage.angle(ARM));
        for id in [WHEEL, ARM] {
            assert_ne!(stage.power_state(id).await, cia402::PowerState::OperationEnabled);
        }
        assert_eq!(stage.state()["nodes"][0]["doing"], Value::Null);
        // And alone again.
        page.must(move_by(WHEEL, 10.0, None)).await;
    });
}

#[test]
fn an_invalid_group_is_refused() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let of = |nodes: &[u8]| {
            let axes = nodes.iter().map(|raw| AxisTarget { node: node(*raw), degrees: 1.0 }).collect();
            GroupCommand::GroupMove(GroupMove { axes, relative: true, rpm: None, rpm_per_s: None, within_s: None })
        };
        for (nodes, kind) in
            [(&[][..], "malformed"), (&[4], "malformed"), (&[4, 4], "malformed"), (&[4, 9], "no_such_drive")]
        {
            assert_eq!(page.ask(of(nodes)).await.error_kind(), kind, "{nodes:?}");
        }
        let mut fast = base();
        fast.wheel_radius_m = 0.0;
        assert_eq!(page.ask(GroupCommand::BaseJog(fast)).await.error_kind(), "group");
        assert_eq!(page.ask(GroupCommand::GroupHold {}).await.error_kind(), "not_held");
        let Command::Group(GroupCommand::GroupMove(mut soon)) = move_to(3600.0, 0.0) else {
            unreachable!("it is a group move")
        };
        soon.within_s = Some(-1.0);
        assert_eq!(page.ask(GroupCommand::GroupMove(soon.clone())).await.error_kind(), "malformed");
        soon.within_s = Some(0.5);
        let answer = page.ask(GroupCommand::GroupMove(soon)).await;
        assert!(answer.json().contains("were given: give more time"), "{}", answer.json());
        page.must(move_to(5.0, 5.0)).await;
    });
}

#[test]
fn held_speeds_continue_together_and_end_with_their_ramps() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let turned = page.begin(jog(60.0, -30.0));
        page.hold(stage, &GroupCommand::GroupHold {}.into(), 30).await;
        let (wheel, arm) = (stage.velocity(WHEEL), stage.velocity(ARM));
        assert!((wheel - 60.0).abs() < 5.0 && (arm + 30.0).abs() < 3.0, "{wheel} and {arm}");
        page.must(GroupCommand::GroupEnd {}).await;
        let answer = turned.await.expect("answered");
        assert!(answer.is_ok(), "{}", answer.json());
        assert!(stage.speed(WHEEL).await < 2.0 && stage.speed(ARM).await < 2.0);
    });
}

/// The dead man as for one drive: 200 ms, and all axes.
#[test]
fn a_group_that_is_not_held_stops_within_200_ms() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        for command in [jog(60.0, 30.0), GroupCommand::BaseJog(base()).into()] {
            let begun = page.begin(command);
            page.hold(stage, &GroupCommand::GroupHold {}.into(), 30).await;
            assert!(stage.velocity(WHEEL).abs() > 15.0 && stage.velocity(ARM).abs() > 15.0);
            let shown = stop_of_both(stage, stage.network.now()).await;
            assert!(shown < Duration::from_millis(200) + TICK, "stopped after {shown:?}");
            assert_eq!(begun.await.expect("answered").error_kind(), "stopped");
            assert_eq!(page.ask(GroupCommand::GroupHold {}).await.error_kind(), "not_held", "too late");
        }
    });
}

/// Until neither is in Operation enabled, and then at rest.
async fn stop_of_both(stage: &Stage, from: Instant) -> Duration {
    let mut shown = Duration::ZERO;
    for id in [WHEEL, ARM] {
        while stage.power_state(id).await == cia402::PowerState::OperationEnabled {
            stage.sleep(1).await;
        }
        shown = stage.network.now() - from;
    }
    for id in [WHEEL, ARM] {
        assert!(stage.rests(id).await < STOPPED_WITHIN, "node {id}");
    }
    shown
}

#[test]
fn a_page_that_disconnects_and_a_press_of_stop_end_a_group() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let _begun = page.begin(move_to(3600.0, 3600.0));
        stage.sleep(1500).await;
        assert!(stage.velocity(WHEEL) > 20.0 && stage.velocity(ARM) > 20.0);
        drop(page);
        let shown = stop_of_both(stage, stage.network.now()).await;
        assert!(shown < Duration::from_millis(200), "{shown:?}");

        let (mut page, mut other) = (stage.page().await, stage.page().await);
        page.take_control_of_all().await;
        let begun = page.begin(move_to(-3600.0, -3600.0));
        stage.sleep(1500).await;
        assert!(stage.velocity(WHEEL) < -20.0);
        other.must(SessionCommand::StopAll {}).await;
        stop_of_both(stage, stage.network.now()).await;
        assert_eq!(begun.await.expect("answered").error_kind(), "stopped");
    });
}

#[test]
fn stopping_one_drive_of_a_group_stops_all() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        for command in [to(ARM, drive::Command::QuickStop), to(ARM, drive::Command::Disable)] {
            let begun = page.begin(move_to(7200.0, 7200.0));
            stage.sleep(1500).await;
            assert!(stage.velocity(WHEEL) > 20.0);
            page.must(command).await;
            stop_of_both(stage, stage.network.now()).await;
            assert!(!begun.await.expect("answered").is_ok());
        }
    });
}

#[test]
fn a_drive_of_a_group_takes_no_other_command_meanwhile() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let _begun = page.begin(move_to(7200.0, 7200.0));
        stage.sleep(1500).await;
        for command in [to(ARM, drive::Command::Enable), NodeCommand::Jog { rpm: 10.0 }.to(ARM), velocity(WHEEL, 10.0)]
        {
            assert_eq!(page.ask(command).await.error_kind(), "busy");
        }
        assert_eq!(page.ask(move_to(1.0, 1.0)).await.error_kind(), "busy", "there is one group at a time");
        stage.sleep(500).await;
        assert!(stage.velocity(WHEEL) > 20.0 && stage.velocity(ARM) > 20.0, "it goes on");
    });
}

fn change(world: &mut World, words: &str) {
    let stimulus = words.parse().expect("a stimulus");
    world.apply(Place::node(WHEEL.raw()), &stimulus).expect("it is there").expect("it has that");
}

/// A wheel that is held back by less than its limit of the following error (0.2 turns) is not where it was to go.
#[test]
fn a_shaft_that_does_not_come_to_the_end_of_its_path_is_named() {
    play_acts(
        async |stage| stage.sleep(1).await,
        |world| change(world, "rotor lock"),
        async |stage| {
            let mut page = stage.page().await;
            page.take_control_of_all().await;
            let mut moved = page.begin(move_to(20.0, 20.0));
            let answer = loop {
                tokio::select! {
                    answer = &mut moved => break answer.expect("answered"),
                    () = stage.network.sleep(Duration::from_millis(500)) => page.must(SessionCommand::Alive {}).await,
                }
            };
            assert_eq!(answer.error_kind(), "group");
            let text = answer.json();
            assert!(text.contains("axis 1, node 4, is 2") && text.contains("deg from its set-point"), "{text}");
            assert_ne!(stage.power_state(WHEEL).await, cia402::PowerState::OperationEnabled);
        },
        |_| {},
        async |_| {},
    );
}

#[test]
fn a_fault_of_one_stops_the_others_and_names_it() {
    let begun = std::rc::Rc::new(std::cell::RefCell::new(None::<(Page, Answered)>));
    play_acts(
        async |stage| {
            let mut page = stage.page().await;
            page.take_control_of_all().await;
            let answered = page.begin(move_to(3600.0, 3600.0));
            stage.sleep(1500).await;
            *begun.borrow_mut() = Some((page, answered));
        },
        |world| change(world, "supply 80"),
        async |stage| {
            let (_page, answered) = begun.borrow_mut().take().expect("it was begun");
            let answer = answered.await.expect("answered");
            assert_eq!(answer.error_kind(), "group");
            // ZLAC8030L quick start guide V1.00, chapter 8: 0001h is over-voltage.
            assert!(
                answer.json().contains("axis 1, node 4") && answer.json().contains("over-voltage"),
                "{}",
                answer.json()
            );
            assert!(stage.rests(ARM).await < STOPPED_WITHIN);
        },
        |_| {},
        async |_| {},
    );
}

/// On a base the right motor sits the other way round: forward is negative.
#[test]
fn a_base_is_driven_by_its_twist() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let driven = page.begin(GroupCommand::BaseJog(base()).into());
        page.hold(stage, &GroupCommand::GroupHold {}.into(), 20).await;
        // 0.2 m/s on a wheel of 0.1 m: 0.2 / (2 pi 0.1) turns a second.
        let rpm = 0.2 / (core::f64::consts::TAU * 0.1) * 60.0;
        let (wheel, arm) = (stage.velocity(WHEEL), stage.velocity(ARM));
        assert!((wheel - rpm).abs() < 2.0 && (arm + rpm).abs() < 2.0, "{wheel} and {arm}, not {rpm}");
        page.hold(stage, &GroupCommand::BaseTwist { linear_m_s: 0.0, angular_rad_s: 0.8 }.into(), 20).await;
        // To the left: the left wheel goes back.
        let (wheel, arm) = (stage.velocity(WHEEL), stage.velocity(ARM));
        assert!((wheel + rpm).abs() < 2.0 && (arm + rpm).abs() < 2.0, "{wheel} and {arm}, not {rpm}");
        page.must(GroupCommand::GroupEnd {}).await;
        let answer = driven.await.expect("answered");
        assert!(answer.is_ok() && answer.json().contains("m forward"), "{}", answer.json());
        assert!(stage.speed(WHEEL).await < 2.0);
    });
}

/// Limits of the machine file are those of a page too: a joint is not driven over its range because it was asked for by a browser.
#[test]
fn a_group_of_the_machine_file_moves_within_its_limits() {
    let axis = |node: u8| {
        format!(
            "{{ node = {node}, range_deg = [-170, 170], velocity_deg_s = 60, acceleration_deg_s2 = 120, jerk_deg_s3 = 1200, following_error_deg = 20 }}"
        )
    };
    let text = format!(
        "[[drive]]\nmodel = 'zlac8030l'\nnode = 4\n[[drive]]\nmodel = 'zlim42c'\nnode = 2\n\
         [[group]]\nname = 'arm'\nperiod = '20ms'\naxis = [{}, {}]\n",
        axis(4),
        axis(2)
    );
    let groups = machine::file::Machine::parse(&text).unwrap_or_else(|bad| panic!("{bad}")).groups;
    let scene = async |stage: &Stage| {
        let mut page = stage.page().await;
        stage.scanned().await;
        page.take_control_of_all().await;
        let beyond = page.ask(move_to(200.0, 0.0)).await;
        assert!(beyond.json().to_string().contains("outside its software limits"), "{beyond:?}");
        // 61 deg/s.
        let fast = page.ask(jog(61.0 / 6.0, 1.0)).await;
        assert!(fast.json().to_string().contains("its limit in the group 'arm'"), "{fast:?}");
        // 60 degrees at 60 deg/s.
        let began = stage.network.now();
        page.must(move_to(60.0, -30.0)).await;
        assert!(stage.network.now() - began > Duration::from_secs(1));
    };
    let setting = super::Setting { groups, ..super::setting() };
    super::play_in(setting, scene, |_| {}, async |_| {}, |_| {}, async |_| {});
}

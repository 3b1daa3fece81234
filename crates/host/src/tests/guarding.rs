//! Drives that nothing stops when the program dies: shown before, refused until accepted.

use std::cell::RefCell;

use cia402::PowerState;
use master::drive;
use serde_json::Value;

use super::faults::change;
use super::{ARM, Page, Stage, WHEEL, home, move_by, play, play_acts, to, velocity};
use crate::command::{AxisSpeed, AxisTarget, Command, GroupCommand, GroupMove, NodeCommand, SessionCommand};

impl Stage {
    fn shown(&self, at: usize) -> Value {
        self.state()["nodes"][at].clone()
    }
}

/// All commands that move the stepper.
fn motions() -> Vec<Command> {
    let both = |rpm| [WHEEL, ARM].map(|node| AxisSpeed { node, rpm }).to_vec();
    let axes = [WHEEL, ARM].map(|node| AxisTarget { node, degrees: 90.0 }).to_vec();
    vec![
        NodeCommand::Jog { rpm: 30.0 }.to(ARM),
        velocity(ARM, 30.0),
        move_by(ARM, 90.0, None),
        home(ARM, 17, None),
        GroupCommand::GroupMove(GroupMove { axes, relative: true, rpm: None, rpm_per_s: None, within_s: None }).into(),
        GroupCommand::GroupJog { axes: both(30.0), rpm_per_s: None }.into(),
    ]
}

async fn is_refused(stage: &Stage, page: &mut Page, command: Command) {
    let answer = page.ask(command.clone()).await;
    assert_eq!(answer.error_kind(), "unguarded", "{command:?}: {}", answer.json());
    assert!(answer.json().contains("node 2 was not moved") && answer.json().contains("nothing stops it"));
    for node in [WHEEL, ARM] {
        assert_eq!(
            stage.power_state(node).await,
            PowerState::SwitchOnDisabled,
            "{command:?} has not even enabled {node}"
        );
    }
    assert!(stage.network.moved().is_empty());
}

/// ZLIM42-C user manual V1.03 has no watch over the host; of the ZLAC8030L 2000h is one, with 1000 ms as delivered.
#[test]
fn a_drive_that_nothing_stops_is_shown_before_it_moves_and_refused_until_that_is_accepted() {
    play(async |stage| {
        let mut page = stage.page().await;
        stage.sleep(500).await;
        let [arm, wheel] = [stage.shown(0), stage.shown(1)];
        assert_eq!((&arm["goes_on"], &arm["accepted"]), (&true.into(), &false.into()), "{arm}");
        assert!(arm["without_us"].as_str().is_some_and(|shown| shown.contains("nothing stops it")), "{arm}");
        assert_eq!(wheel["goes_on"], false, "{wheel}");
        assert!(wheel["without_us"].as_str().is_some_and(|shown| shown.contains("1000 ms")), "{wheel}");
        assert_eq!(page.ask(NodeCommand::AcceptUnguarded.to(ARM)).await.error_kind(), "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        let mut news = stage.handle.news();
        for command in motions() {
            is_refused(stage, &mut page, command).await;
        }
        assert!(news.try_recv().is_err(), "a request for acceptance is not news to all");
        page.must(NodeCommand::AcceptUnguarded.to(ARM)).await;
        for command in motions() {
            page.seq += 1;
            let begun = page.session.ask(page.seq, command.clone()).expect("there is room");
            stage.sleep(300).await;
            page.must(SessionCommand::StopAll {}).await;
            let answer = begun.await.expect("answered");
            assert_ne!(answer.error_kind(), "unguarded", "{command:?}: asked once");
            stage.sleep(700).await;
        }
    });
}

/// A session that gets control has accepted nothing, and a drive whose watch is switched off keeps moving.
#[test]
fn a_new_session_has_to_accept_again_and_so_it_is_when_a_watch_is_switched_off() {
    play(async |stage| {
        let (mut first, mut second) = (stage.page().await, stage.page().await);
        first.take_control_of_all().await;
        first.must(SessionCommand::HandOver { to: second.session.id().0 }).await;
        is_refused(stage, &mut second, NodeCommand::Jog { rpm: 30.0 }.to(ARM)).await;
        second.must(NodeCommand::AcceptUnguarded.to(ARM)).await;
        drop(second);
        stage.sleep(100).await;
        first.must(SessionCommand::TakeControl {}).await;
        is_refused(stage, &mut first, NodeCommand::Jog { rpm: 30.0 }.to(ARM)).await;
        // ZLAC8030L, 2000h: 0 is off.
        let wheel = stage.network.node(WHEEL);
        wheel.write(canopen::Mux::new(0x2000, 0), 0_u16).await.expect("it takes it");
        assert_eq!(first.ask(NodeCommand::Jog { rpm: 30.0 }.to(WHEEL)).await.error_kind(), "unguarded");
        // Read every two seconds.
        stage.sleep(2500).await;
        assert_eq!(stage.shown(1)["goes_on"], true);
        wheel.write(canopen::Mux::new(0x2000, 0), 1000_u16).await.expect("it takes it");
        first.must(NodeCommand::Jog { rpm: 30.0 }.to(WHEEL)).await;
    });
}

/// A press comes over the socket and as a separate request.
#[test]
fn a_stop_that_comes_by_two_channels_is_reported_once() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        let mut news = stage.handle.news();
        let mut shown = || {
            let heard: Vec<String> = std::iter::from_fn(|| news.try_recv().ok()).map(|news| news.text).collect();
            heard.iter().filter(|news| news.contains("a press of stop")).count()
        };
        let stops = |stage: &Stage| stage.happened().iter().filter(|entry| entry["kind"] == "stop").count();
        page.must(SessionCommand::StopAll {}).await;
        stage.sleep(5).await;
        stage.handle.stop_all();
        stage.sleep(600).await;
        assert_eq!((shown(), stops(stage)), (1, 1));
        // A later press is reported again.
        page.must(velocity(WHEEL, 60.0)).await;
        page.must(SessionCommand::StopAll {}).await;
        stage.sleep(600).await;
        assert_eq!((shown(), stops(stage)), (1, 2));
    });
}

/// What a page sends on its own (a sequence, a cyclic frame) ends with a stop from elsewhere: it sees that there was one.
#[test]
fn a_stop_of_everything_is_counted_whoever_caused_it() {
    play(async |stage| {
        let count = |stage: &Stage| stage.state()["stops"].as_u64().expect("a number");
        let (mut page, mut other) = (stage.page().await, stage.page().await);
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.sleep(200).await;
        let before = count(stage);
        other.must(SessionCommand::StopAll {}).await;
        stage.sleep(200).await;
        assert_eq!(count(stage), before + 1, "a press on another page");
        page.must(velocity(WHEEL, 60.0)).await;
        // The page is silent for longer than its presence lasts.
        stage.sleep(4000).await;
        assert_eq!(count(stage), before + 2, "a silent page");
    });
}

/// The stepper has no watch over its host, so it keeps turning when its cable is cut.
#[test]
fn a_drive_that_a_stop_does_not_reach_is_shown_until_it_is_seen_at_rest() {
    let page = RefCell::new(None);
    let unseen = |stage: &Stage| [0, 1].map(|at| stage.shown(at)["stop_unseen"] == true);
    play_acts(
        async |stage| {
            let mut mine = stage.page().await;
            mine.take_control_of_all().await;
            mine.must(velocity(ARM, 30.0)).await;
            stage.turns(ARM, 30.0).await;
            stage.sleep(100).await;
            assert_eq!(unseen(stage), [false, false]);
            page.replace(Some(mine));
        },
        |world| change(world, ARM, "cable cut"),
        async |stage| {
            let mut mine = page.take().expect("it stays open");
            // The stop is confirmed, which is all that is known.
            mine.must(SessionCommand::StopAll {}).await;
            for _ in 0..6 {
                stage.sleep(500).await;
                mine.must(SessionCommand::Alive {}).await;
            }
            assert_eq!(unseen(stage), [true, false], "{}", stage.state());
            page.replace(Some(mine));
        },
        |world| {
            change(world, ARM, "cable join");
        },
        async |stage| {
            let mut mine = page.take().expect("it stays open");
            // There is nothing to be reset, and that it was reset does not show it at rest.
            let reset = mine.ask(to(ARM, drive::Command::ResetFault)).await;
            assert!(!reset.is_ok() || unseen(stage)[0], "{}", stage.state());
            // It still turns, and is stopped as soon as it answers, without another press.
            let mut turned = 0.0_f64;
            for _ in 0..30 {
                turned = turned.max(stage.shown(0)["drive"]["velocity_rpm"].as_f64().unwrap_or(0.0));
                stage.sleep(100).await;
                mine.must(SessionCommand::Alive {}).await;
            }
            assert!((turned - 30.0).abs() < 3.0, "{turned}: {}", stage.state());
            assert!(stage.speed(ARM).await < 1.0);
            assert_eq!(unseen(stage), [false, false], "{}", stage.state());
        },
    );
}

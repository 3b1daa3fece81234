//! The world around virtual drives: changes, their effect on the drives, and undo.

use std::pin::pin;
use std::task::{Context, Poll, Waker};

use super::*;
use crate::command::WorldCommand;
use crate::world::door::{WorldAsks, world_door};

/// Runs a scene with a studio that has a world.
fn play_around(scene: impl AsyncFnOnce(&Stage)) {
    let network = Network::new();
    let mut world = World::new(Bitrate::K500, 1);
    world.add_station(network.clone());
    world.add_drive(4, Box::new(zlac8030l(4, 1))).expect("the first");
    world.add_drive(2, Box::new(zlim42c(2, 1))).expect("the second");
    world.run_for(Duration::from_secs(1));
    let models = [(WHEEL, "zlac8030l"), (ARM, "zlim42c")];
    let models = models.into_iter().map(|(node, name)| (node, devices::model(name).expect("a model"))).collect();
    let (door, mut asks) = world_door(None);
    let (host, handle) = Host::new(network.clone(), Setting { models, world: Some(door), ..setting() });
    let stage = Stage { network, handle };
    let whole = async {
        tokio::select! {
            () = host.run(|| None) => panic!("the host ended although there is a handle"),
            () = async { stage.scanned().await; scene(&stage).await } => {}
        }
    };
    run(&mut world, &mut asks, whole);
}

/// Steps the world by milliseconds, as the bus of a program does, and answers its requests between the steps.
fn run(world: &mut World, asks: &mut WorldAsks, whole: impl Future<Output = ()>) {
    let mut whole = pin!(whole);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..120_000 {
        if let Poll::Ready(()) = whole.as_mut().poll(&mut context) {
            return;
        }
        asks.answer(world);
        world.refresh();
        world.run_for(Duration::from_millis(1));
    }
    panic!("the scene does not end");
}

fn doing(line: &str) -> Command {
    WorldCommand::ChangeWorld { line: line.into() }.into()
}

async fn seen(page: &mut Page, after: Option<u64>) -> Value {
    let answer = page.ask(WorldCommand::LookAround { after }).await.json();
    let answer: Value = serde_json::from_str(&answer).expect("JSON");
    assert_eq!(answer["ok"], true, "{answer}");
    answer["result"].clone()
}

fn node_seen(seen: &Value, place: &str) -> Value {
    let nodes = seen["nodes"].as_array().expect("nodes");
    nodes.iter().find(|node| node["place"] == place).cloned().unwrap_or_else(|| panic!("{place}: {seen}"))
}

#[test]
fn a_load_is_measured_by_the_drive_and_undone() {
    play_around(async |stage| {
        let mut page = stage.page().await;
        assert_eq!(page.ask(doing("4 load torque 2")).await.error_kind(), "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.turns(WHEEL, 60.0).await;
        stage.sleep(500).await;
        let light = node_seen(&seen(&mut page, None).await, "4")["current_a"].as_f64().expect("a current");
        page.must(doing("4  load torque 2.0")).await;
        stage.sleep(1_000).await;
        let after = seen(&mut page, None).await;
        let wheel = node_seen(&after, "4");
        // ZLAC8030L, motor of the kit: about 1 N·m for an ampere or more; 2 N·m are far above what it took alone.
        assert!(wheel["current_a"].as_f64().expect("a current") > light + 0.5, "{wheel}");
        assert_eq!(wheel["load_torque_nm"], 2.0);
        let change = &after["changes"][0];
        assert_eq!((&change["number"], &change["line"]), (&0.into(), &"4 load torque 2".into()));
        assert_eq!(change["back"], "4 load torque 0");
        assert!(change["time_s"].as_f64().expect("a time") > 1.0, "{change}");
        page.must(doing(change["back"].as_str().expect("words"))).await;
        let after = seen(&mut page, Some(0)).await;
        assert_eq!(after["changes"].as_array().map(Vec::len), Some(1), "only what is new: {after}");
        assert_eq!((&after["changes"][0]["number"], &after["changes"][0]["back"]), (&1.into(), &Value::Null));
        assert_eq!(node_seen(&after, "4")["load_torque_nm"], 0.0);
    });
}

#[test]
fn changes_of_the_world_are_seen_on_the_bus_and_in_the_news() {
    play_around(async |stage| {
        let mut news = stage.handle.news();
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        assert_eq!(node_seen(&seen(&mut page, None).await, "2")["inputs"]["X0"], 0);
        page.must(doing("2 input x0 1")).await;
        assert_eq!(node_seen(&seen(&mut page, None).await, "2")["inputs"]["X0"], 1);
        page.must(doing("4 cable cut")).await;
        assert_eq!(node_seen(&seen(&mut page, None).await, "4")["bus"], "cut");
        stage.sleep(1_500).await;
        let wheel = stage.state()["nodes"][1].clone();
        assert!(wheel["drive"].is_null() && !wheel["trouble"].is_null(), "{wheel}");
        page.must(doing("4 cable join")).await;
        stage.sleep(1_500).await;
        assert!(!stage.state()["nodes"][1]["drive"].is_null());
        page.must(doing("4 power off")).await;
        stage.sleep(3_000).await;
        assert_eq!(node_seen(&seen(&mut page, None).await, "4")["power"], "off");
        let mut shown = Vec::new();
        while let Ok(heard) = news.try_recv() {
            shown.push(heard.text);
        }
        for line in ["world: 2 input x0 1", "world: 4 cable cut", "world: 4 cable join", "world: 4 power off"] {
            assert!(shown.iter().any(|news| news.contains(line)), "{line}: {shown:?}");
        }
    });
}

#[test]
fn an_invalid_line_is_refused_with_what_was_expected_and_changes_nothing() {
    play_around(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        for (line, kind, part) in [
            ("4 supply much", "usage", "NODE supply VOLTS"),
            ("quit", "usage", "changes nothing in the world"),
            ("run 5s", "usage", "changes nothing in the world"),
            ("4 get", "usage", "changes nothing in the world"),
            ("9 cable cut", "no_such_node", "running: 4, 2"),
            ("4 input X9 1", "refused", "X9"),
            ("4 supply 1000000", "refused", "supply"),
        ] {
            let answer = page.ask(doing(line)).await;
            assert_eq!(answer.error_kind(), kind, "{line}: {}", answer.json());
            assert!(answer.json().contains(part), "{line}: {}", answer.json());
        }
        let long = page.ask(doing(&"4 ".repeat(4_000))).await;
        assert_eq!(long.error_kind(), "usage");
        assert_eq!(seen(&mut page, None).await["changes"], serde_json::json!([]));
    });
}

/// Only the newest changes are kept, with their numbers.
#[test]
fn the_list_of_changes_is_bounded() {
    play_around(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        for tenths in 0..250 {
            page.must(doing(&format!("4 temperature motor {}", f64::from(tenths) / 10.0))).await;
        }
        let changes = seen(&mut page, None).await["changes"].clone();
        let numbers: Vec<u64> =
            changes.as_array().expect("a list").iter().filter_map(|change| change["number"].as_u64()).collect();
        assert_eq!(numbers, (50..250).collect::<Vec<_>>());
    });
}

#[test]
fn without_a_world_commands_to_it_are_refused() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        assert_eq!(page.ask(doing("4 cable cut")).await.error_kind(), "no_world");
        assert_eq!(page.ask(WorldCommand::LookAround { after: None }).await.error_kind(), "no_world");
        let forms: Value = serde_json::from_str(&page.ask(WorldCommand::WorldForms {}).await.json()).expect("JSON");
        assert_eq!(forms["result"]["is_virtual"], false);
    });
}

#[test]
fn the_health_of_the_bus_is_in_the_state_and_its_notes_are_news() {
    let wire = Wire::default();
    let shown = wire.clone();
    let setting = Setting { wire, ..setting() };
    play_in(
        setting,
        async |stage| {
            let mut news = stage.handle.news();
            let _page = stage.page().await;
            assert_eq!(stage.state()["bus"]["health"]["state"], Value::Null);
            shown.update(|health| (health.state, health.transmit_errors) = (Some("error-passive"), Some(136)));
            shown.tell("no node acknowledges what is sent");
            stage.sleep(200).await;
            let health = stage.state()["bus"]["health"].clone();
            assert_eq!((&health["state"], &health["transmit_errors"]), (&"error-passive".into(), &136.into()));
            assert!(news.try_recv().expect("it is shown").text.contains("no node acknowledges"));
        },
        |_| {},
        async |_| {},
        |_| {},
        async |_| {},
    );
}

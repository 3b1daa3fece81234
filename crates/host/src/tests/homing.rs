//! The homing wizard's data, and a run, against virtual drives with switches.

use canopen::{Mux, NodeId};
use serde_json::{Value, json};
use sim::{Place, World};

use super::{ARM, Page, Stage, WHEEL, home, play_acts};
use crate::command::{NewValue, NodeCommand, ParameterChange, SessionCommand};

impl Page {
    async fn homing(&mut self, node: NodeId) -> Value {
        let answer = self.ask(NodeCommand::Homing.to(node)).await.json();
        serde_json::from_str::<Value>(&answer).expect("JSON")["result"].clone()
    }
}

fn change(world: &mut World, node: NodeId, words: &str) {
    let stimulus = words.parse().expect("a stimulus");
    world.apply(Place::node(node.raw()), &stimulus).expect("it is there").expect("it has that");
}

fn method(shown: &Value, number: i64) -> &Value {
    let methods = shown["methods"].as_array().expect("methods");
    methods.iter().find(|method| method["method"] == number).unwrap_or_else(|| panic!("no {number}: {shown}"))
}

async fn set_input(stage: &Stage, sub_index: u8, function: u16) {
    stage.network.node(ARM).write(Mux::new(0x2030, sub_index), function).await.expect("it takes it");
}

/// ZLIM42-C user manual V1.03: 5.3.6 has methods 17, 18, 24 and 29; 2030h:02 of 1 makes X0 the home switch.
#[test]
fn the_wizard_shows_methods_switches_and_settings() {
    play_acts(
        async |stage| {
            let mut page = stage.page().await;
            let shown = page.homing(ARM).await;
            let numbers: Vec<_> =
                shown["methods"].as_array().expect("methods").iter().map(|method| method["method"].clone()).collect();
            assert_eq!(numbers, [json!(17), json!(18), json!(24), json!(29)], "0 is not a method: {shown}");
            assert_eq!(method(&shown, 24)["missing"], json!(["home switch"]), "no input is one by default");
            assert_eq!(method(&shown, 24)["no_turn"], json!(["negative limit", "positive limit"]));
            // By the labels of the manual it stops on the negative limit switch; CiA 402-2 leaves it again.
            let seventeen = method(&shown, 17);
            assert_eq!((&seventeen["switch"], &seventeen["edge"]), (&json!("negative limit"), &json!("on")));
            let speed = &shown["settings"][0];
            assert_eq!(
                (&speed["object"], &speed["value"], &speed["unit"]),
                (&"6099h:01".into(), &"120".into(), &"r/min".into())
            );
            assert!(speed["takes"].as_str().expect("limits").starts_with("5 to 3000"), "{speed}");
            set_input(stage, 2, 1).await;
            let shown = page.homing(ARM).await;
            assert_eq!(method(&shown, 24)["missing"], json!([]));
            assert_eq!(shown["inputs"][0], json!({ "name": "X0", "signal": "home switch", "active": false }));
            assert_eq!(page.ask(NodeCommand::Homing.to(WHEEL)).await.error_kind(), "no_such_mode");
        },
        |world| change(world, ARM, "input X0 1"),
        async |stage| {
            stage.sleep(100).await;
            assert_eq!(stage.page().await.homing(ARM).await["inputs"][0]["active"], true);
        },
        |_| {},
        async |_| {},
    );
}

#[test]
fn a_run_is_reported_while_it_runs_and_at_its_end() {
    play_acts(
        async |stage| {
            // X0 is the negative limit.
            set_input(stage, 2, 3).await;
        },
        |world| change(world, ARM, "switch X0 min -20000"),
        async |stage| {
            let mut page = stage.page().await;
            page.take_control_of_all().await;
            let speed = NewValue { object: "6099:01".into(), value: "60".into() };
            page.must(
                NodeCommand::Change(ParameterChange::WriteParameters { values: vec![speed], file: None }).to(ARM),
            )
            .await;
            page.seq += 1;
            let homed = page.session.ask(page.seq, home(ARM, 17, None)).expect("room");
            stage.sleep(1000).await;
            let shown = page.homing(ARM).await;
            assert_eq!(shown["running"], true, "{shown}");
            assert_eq!(shown["phase"], "moving negatively, searching for the negative limit");
            assert_eq!(shown["ended"], Value::Null);
            let mut homed = homed;
            loop {
                tokio::select! {
                    biased;
                    answer = &mut homed => {
                        let answer = answer.expect("answered");
                        assert!(answer.is_ok(), "{}", answer.json());
                        break;
                    }
                    () = stage.network.sleep(std::time::Duration::from_millis(500)) => page.must(SessionCommand::Alive {}).await,
                }
            }
            let shown = page.homing(ARM).await;
            assert_eq!((&shown["running"], &shown["ended"]), (&false.into(), &"attained".into()), "{shown}");
        },
        |_| {},
        async |_| {},
    );
}

/// A search that is no longer held ends like any other motion.
#[test]
fn a_page_that_disconnects_ends_a_search() {
    play_acts(
        async |stage| {
            let mut page = stage.page().await;
            page.take_control_of_all().await;
            page.seq += 1;
            let _homed = page.session.ask(page.seq, home(ARM, 17, None)).expect("room");
            stage.sleep(1000).await;
            assert!(stage.speed(ARM).await > 50.0, "it searches for a missing switch");
            drop(page);
            stage.rests(ARM).await;
        },
        |_| {},
        async |_| {},
        |_| {},
        async |_| {},
    );
}

//! The timeline of virtual drives.

use std::cell::RefCell;

use canopen::NmtCommand;
use serde_json::Value;
use sim::{Place, World};

use master::drive;

use super::{ARM, Stage, WHEEL, play, play_acts, to, velocity};
use crate::command::SessionCommand;

impl Stage {
    /// The whole timeline, oldest first.
    pub(super) fn happened(&self) -> Vec<Value> {
        let news = serde_json::to_value(self.handle.timeline().since(0)).expect("JSON");
        news["entries"].as_array().expect("entries").clone()
    }

    fn find(&self, node: canopen::NodeId, kind: &str) -> Value {
        let all = self.happened();
        let found = all.iter().rfind(|entry| entry["node"] == node.raw() && entry["kind"] == kind);
        found.unwrap_or_else(|| panic!("no {kind} of node {node}: {all:?}")).clone()
    }
}

pub(super) fn change(world: &mut World, node: canopen::NodeId, words: &str) {
    let stimulus = words.parse().expect("a stimulus");
    world.apply(Place::node(node.raw()), &stimulus).expect("it is there").expect("it has that");
}

/// ZLAC8030L quick start guide V1.00, chapters 8 and 9: 0001h is over-voltage.
#[test]
fn a_fault_is_reported_with_its_remedy_and_its_source_until_it_ends() {
    let news = RefCell::new(None);
    play_acts(
        async |stage| {
            stage.sleep(200).await;
            news.replace(Some(stage.handle.news()));
        },
        |world| change(world, WHEEL, "supply 80"),
        async |stage| {
            stage.sleep(1000).await;
            let mut news = news.take().expect("a listener");
            let heard: Vec<String> = std::iter::from_fn(|| news.try_recv().ok()).map(|news| news.text).collect();
            assert!(heard.iter().any(|news| news.contains("node 4: emergency 0001h (over-voltage)")), "{heard:?}");
            for kind in ["emcy", "fault"] {
                let shown = stage.find(WHEEL, kind);
                assert_eq!((&shown["code"], &shown["gone_s"]), (&1.into(), &Value::Null), "{shown}");
                assert!(shown["what"].as_str().expect("text").starts_with("over-voltage"), "{shown}");
                assert!(shown["remedy"].as_str().expect("text").contains("bleeder"), "{shown}");
                assert_eq!(shown["source"], "ZLAC8030L quick start guide V1.00, chapters 8 and 9");
            }
            assert_eq!(stage.find(WHEEL, "state")["what"], "Switch on disabled → Fault");
            // Their times are those of the answers that reported them, which the page marks.
            for (kind, object) in [("fault", "603Fh"), ("state", "6041h")] {
                let at_s = stage.find(WHEEL, kind)["at_s"].as_f64().expect("a time");
                let around =
                    serde_json::json!({ "from_s": at_s - 0.05, "until_s": at_s + 1e-6, "node": WHEEL.to_string() });
                let lines = stage.lines(around);
                let marked = lines.last().expect("a frame")["text"].as_str().expect("text").to_owned();
                assert!(marked.contains(object), "{kind}: {marked}");
            }
            let emcy = stage.find(WHEEL, "emcy");
            let at_s = emcy["at_s"].as_f64().expect("a time");
            let around = serde_json::json!({ "from_s": at_s - 0.05, "until_s": at_s + 0.05, "kind": "emcy" });
            let lines = stage.lines(around);
            assert!(lines[0]["text"].as_str().expect("text").contains("0001h (over-voltage)"), "{lines:?}");
        },
        |world| change(world, WHEEL, "supply 48"),
        async |stage| {
            stage.sleep(500).await;
            let mut page = stage.page().await;
            page.must(SessionCommand::TakeControl {}).await;
            page.must(to(WHEEL, drive::Command::ResetFault)).await;
            stage.sleep(500).await;
            for kind in ["emcy", "fault"] {
                let shown = stage.find(WHEEL, kind);
                assert!(shown["gone_s"].as_f64().expect("it is over") > shown["at_s"].as_f64().expect("a time"));
            }
            assert_eq!(stage.find(WHEEL, "state")["what"], "Fault → Switch on disabled");
        },
    );
}

#[test]
fn a_drive_that_is_cut_off_is_silent_until_it_answers_again() {
    play_acts(
        async |stage| stage.sleep(200).await,
        |world| change(world, ARM, "cable cut"),
        async |stage| {
            stage.sleep(2000).await;
            let shown = stage.find(ARM, "silent");
            assert_eq!(shown["gone_s"], Value::Null);
            assert!(shown["remedy"].as_str().expect("text").contains("cable"), "{shown}");
            let silent = stage.happened().into_iter().filter(|entry| entry["kind"] == "silent").count();
            assert_eq!(silent, 1, "shown once, however often it is asked");
        },
        |world| change(world, ARM, "cable join"),
        async |stage| {
            stage.sleep(2500).await;
            assert!(stage.find(ARM, "silent")["gone_s"].is_f64());
        },
    );
}

#[test]
fn faults_from_before_a_page_connected_are_known_and_so_are_stops_and_boot_ups() {
    play(async |stage| {
        stage.network.node(ARM).nmt(NmtCommand::ResetNode);
        stage.sleep(1500).await;
        let before = stage.state()["happenings"].as_u64().expect("a number");
        let mut page = stage.page().await;
        assert!(stage.happened().iter().any(|entry| entry["node"] == 2 && entry["what"] == "booted"));
        page.must(SessionCommand::TakeControl {}).await;
        page.must(velocity(WHEEL, 60.0)).await;
        page.must(SessionCommand::StopAll {}).await;
        stage.rests(WHEEL).await;
        assert_eq!(stage.find(WHEEL, "stop")["what"], "stopped by a press of stop");
        stage.sleep(500).await;
        assert!(
            stage.state()["happenings"].as_u64().expect("a number") > before,
            "pages are shown that there is something"
        );
    });
}

//! Captures and reports that a page commands: what comes is what was asked for, and however its session ends, everything is put back.

use std::time::Duration;

use canopen::{Mux, NmtState};
use serde_json::{Value, json};

use super::{Stage, WHEEL, play, velocity};
use crate::command::{CaptureCommand, CaptureOrder, Command, NewValue, NodeCommand, ParameterChange, SessionCommand};

const COUNT: Mux = Mux::new(0x1A00, 0);
const EVENT_TIMER: Mux = Mux::new(0x1800, 5);

fn order(quantities: &[&str], duration_ms: f64, trigger: Option<&str>) -> CaptureOrder {
    let quantities = quantities.iter().map(|name| (*name).to_owned()).collect();
    let trigger = trigger.map(str::to_owned);
    CaptureOrder { quantities, period_ms: 2.0, duration_ms, trigger, pre_ms: 0.0, take: Vec::new(), sdo: false }
}

fn captured(order: CaptureOrder) -> Command {
    NodeCommand::Capture(CaptureCommand::Capture(order)).to(WHEEL)
}

impl Stage {
    /// How the wheel's first TPDO is set up: objects and event timer.
    pub(super) async fn tpdo(&self) -> (u32, u32) {
        (self.cell(COUNT).await, self.cell(EVENT_TIMER).await)
    }

    fn wheel_nmt(&self) -> Option<NmtState> {
        self.network.facts(WHEEL).probable_state(devices::model("zlac8030l"))
    }

    /// Waits until the wheel's TPDO is set up for a capture.
    pub(super) async fn is_capturing(&self) {
        for _ in 0..500 {
            if self.cell(COUNT).await != 0 && self.cell(EVENT_TIMER).await != 0 {
                return;
            }
            self.sleep(10).await;
        }
        panic!("the capture did not begin");
    }

    pub(super) async fn is_put_back(&self, before: (u32, u32)) {
        for _ in 0..300 {
            if self.tpdo().await == before && self.wheel_nmt() != Some(NmtState::Operational) {
                return;
            }
            self.sleep(10).await;
        }
        panic!("not put back: {:?}, {:?}", self.tpdo().await, self.wheel_nmt());
    }
}

#[test]
fn a_page_captures_with_the_rate_that_was_had_and_its_report_has_the_capture() {
    play(async |stage| {
        let mut page = stage.page().await;
        let listed = page.knows(NodeCommand::Capture(CaptureCommand::CaptureQuantities {}).to(WHEEL)).await;
        let names = listed["quantities"].as_array().expect("a list");
        assert!(names.contains(&json!("velocity")) && names.contains(&json!("target_velocity")), "{listed}");
        // This studio has no world of its own.
        assert_eq!(listed["true_values"], json!([]));
        let wanted = order(&["velocity", "target_velocity"], 300.0, None);
        assert_eq!(page.refused(captured(wanted.clone())).await.0, "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        let before = stage.tpdo().await;
        page.must(velocity(WHEEL, 60.0)).await;
        stage.turns(WHEEL, 60.0).await;
        let taking = |pdo: &str| captured(CaptureOrder { take: vec![pdo.to_owned()], ..wanted.clone() });
        assert_eq!(page.refused(taking("rpdo1")).await.0, "usage");
        page.knows(taking("tpdo1")).await;
        assert_eq!(stage.tpdo().await, before);
        let came = page.knows(captured(wanted)).await;
        assert_eq!(stage.tpdo().await, before);
        let traces = came["traces"].as_array().expect("a list");
        assert_eq!(
            traces.iter().map(|trace| &trace["quantity"]).collect::<Vec<_>>(),
            ["velocity_rpm", "target_velocity_rpm"]
        );
        for trace in traces {
            let (period_s, jitter_s) = (trace["period_s"].as_f64(), trace["jitter_s"].as_f64());
            assert!((period_s.expect("known") - 2e-3).abs() < 2e-5 && jitter_s.expect("known") < 5e-4, "{trace}");
            assert!((149..=152).contains(&trace["values"].as_array().expect("a list").len()), "{trace}");
            assert!(trace["by"].as_str().expect("a text").starts_with("TPDO"), "{trace}");
        }
        let speeds = traces[0]["values"].as_array().expect("a list").iter().filter_map(Value::as_f64);
        assert!(speeds.clone().all(|speed| (speed - 60.0).abs() < 3.0), "it turns");
        // Its time is that of the states that a page is shown.
        let (begun_s, now_s) = (came["begun_s"].as_f64().expect("known"), stage.state()["time_s"].as_f64());
        assert!(now_s.expect("known") - begun_s < 2.5 && begun_s < now_s.expect("known"), "{begun_s}, {now_s:?}");
        assert_eq!(came["lacks"], json!([]));
        let asked = CaptureCommand::Report { at: "2026-11-28 12:00 UTC".into(), by: Some("A. <Fitter>".into()) };
        let report = page.knows(NodeCommand::Capture(asked).to(WHEEL)).await;
        let html = report["html"].as_str().expect("a page");
        assert_eq!(report["file"], "node4.html");
        assert!(html.contains("2026-11-28 12:00 UTC") && html.contains("A. &lt;Fitter&gt;"), "who and when");
        assert!(
            html.contains("capture of velocity_rpm, target_velocity_rpm") && html.contains("<figure><svg"),
            "captures"
        );
        assert_eq!(page.refused(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await.0, "no_capture");
    });
}

#[test]
fn whoever_began_a_capture_goes_and_everything_is_as_it_was() {
    play(async |stage| {
        let before = stage.tpdo().await;
        let waits = || captured(order(&["velocity"], 300.0, Some("velocity > 500")));
        // The tab is closed.
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let _waiting = page.begin(waits());
        stage.is_capturing().await;
        drop(page);
        stage.is_put_back(before).await;
        // Control is released.
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let waiting = page.begin(waits());
        stage.is_capturing().await;
        page.must(SessionCommand::ReleaseControl {}).await;
        let answer = waiting.await.expect("it is answered");
        assert_eq!(answer.error_kind(), "stopped", "{}", answer.json());
        stage.is_put_back(before).await;
        // The page is frozen: it does not say any more that it is there.
        page.must(SessionCommand::TakeControl {}).await;
        let _waiting = page.begin(waits());
        stage.is_capturing().await;
        stage.sleep(3000).await;
        stage.is_put_back(before).await;
    });
}

#[test]
fn a_capture_is_ended_by_hand_and_nothing_else_writes_to_the_node_meanwhile() {
    play(async |stage| {
        let before = stage.tpdo().await;
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let waiting = page.begin(captured(order(&["velocity"], 60_000.0, None)));
        stage.is_capturing().await;
        assert_eq!(page.refused(captured(order(&["velocity"], 100.0, None))).await.0, "busy");
        let values = vec![NewValue { object: "6083h".into(), value: "500".into() }];
        let write = ParameterChange::WriteParameters { values, file: None };
        assert_eq!(page.refused(NodeCommand::Change(write).to(WHEEL)).await.0, "busy");
        // It may be moved: that is what is captured.
        page.must(velocity(WHEEL, 30.0)).await;
        stage.turns(WHEEL, 30.0).await;
        page.must(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await;
        let answer: Value = serde_json::from_str(&waiting.await.expect("answered").json()).expect("JSON");
        let times = answer["result"]["time_s"].as_array().expect("what came until then");
        assert!(times.len() > 50 && times.len() < 20_000, "{}", times.len());
        assert_eq!(stage.tpdo().await, before);
    });
}

#[test]
fn what_was_kept_for_a_trigger_that_did_not_come_is_no_capture() {
    play(async |stage| {
        let before = stage.tpdo().await;
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let mut wanted = order(&["velocity"], 300.0, Some("velocity > 500"));
        wanted.pre_ms = 100.0;
        let waiting = page.begin(captured(wanted));
        stage.is_capturing().await;
        stage.sleep(500).await;
        page.must(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await;
        let answer = waiting.await.expect("it is answered").json();
        assert!(answer.contains("ended before anything was captured"), "{answer}");
        assert_eq!(stage.tpdo().await, before);
    });
}

/// A capture ends with SYNC, TPDOs and the NMT state as they were before it, and a group needs its own.
#[test]
fn a_group_does_not_begin_beside_a_capture_nor_a_capture_while_the_drive_stores() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let waiting = page.begin(captured(order(&["velocity"], 60_000.0, None)));
        stage.is_capturing().await;
        let (kind, text) = page.refused(super::group::move_to(90.0, 90.0)).await;
        assert_eq!(kind, "busy");
        assert!(text.contains("node 4 is being captured: end the capture first"), "{text}");
        page.must(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await;
        waiting.await.expect("it is answered");
        // What it says then is of the drives themselves.
        assert_eq!(page.refused(super::group::move_to(90.0, 90.0)).await.0, "unguarded");
        let stored = page.begin(NodeCommand::Change(ParameterChange::Store {}).to(WHEEL));
        assert_eq!(page.refused(captured(order(&["velocity"], 100.0, None))).await.0, "busy");
        stored.await.expect("it is answered");
    });
}

#[test]
fn an_order_that_cannot_be_carried_out_is_refused_with_what_is_possible_and_changes_nothing() {
    play(async |stage| {
        let before = stage.tpdo().await;
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let of = |change: fn(&mut CaptureOrder)| {
            let mut wanted = order(&["velocity"], 100.0, None);
            change(&mut wanted);
            captured(wanted)
        };
        for (wanted, kind, says) in [
            (of(|order| order.period_ms = f64::NAN), "usage", "expected a time between two readings from 50µs"),
            (of(|order| order.duration_ms = -1.0), "usage", "expected a length of the capture from 1ms"),
            (of(|order| order.period_ms = 200.0), "usage", "at most the length, 100ms, got 200ms"),
            (of(|order| order.pre_ms = 1e300), "usage", "expected a time before the trigger"),
            (of(|order| order.trigger = Some("velocity".into())), "usage", "as in: velocity > 10"),
            (of(|order| order.trigger = Some("current > 1".into())), "usage", "name one of: velocity_rpm"),
            (of(|order| order.quantities.clear()), "usage", "expected at least one quantity"),
            (of(|order| order.quantities = vec!["velocity".into(); 33]), "usage", "expected at most 32 quantities"),
            (of(|order| order.quantities = vec!["speeed".into()]), "usage", "quantities: target_position"),
            (of(|order| order.quantities = vec!["true_velocity".into()]), "no_true_values", "of a virtual drive alone"),
            (of(|order| (order.period_ms, order.duration_ms) = (0.1, 60_000.0)), "usage", "at most 400000"),
            (of(|order| order.period_ms = 0.1), "bus_too_slow", "is possible with all of them"),
        ] {
            let (found, text) = page.refused(wanted).await;
            assert_eq!(found, kind, "{text}");
            assert!(text.contains(says), "{text}");
        }
        assert_eq!(stage.tpdo().await, before);
        let long = CaptureCommand::Report { at: "x".repeat(101), by: None };
        assert_eq!(page.refused(NodeCommand::Capture(long).to(WHEEL)).await.0, "malformed");
        stage.network.sleep(Duration::from_millis(10)).await;
    });
}

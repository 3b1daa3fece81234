//! Test motions that a page commands: figures and traces of each run, and whatever ends one, a shaft at rest and everything put back.

use std::time::Duration;

use canopen::{Mux, NodeId};
use serde_json::{Value, json};

use super::group::Answered;
use super::{ARM, Page, STOPPED_WITHIN, Stage, WHEEL, move_by, play, to, velocity};
use crate::command::{CaptureCommand, CaptureOrder, Command, NodeCommand, SessionCommand, TestMotionOrder};
use crate::test_motion::{Order, ShapeName};
use master::drive;

/// How many objects the second TPDO has: those of a capture beside the TPDO of a group.
const SECOND_COUNT: Mux = Mux::new(0x1A01, 0);

/// Four seconds of either shape, within usual limits.
fn order(shape: ShapeName) -> Order {
    Order {
        shape,
        by_deg: 20.0,
        speed_rpm: 60.0,
        frequency_hz: 1.0,
        to_frequency_hz: 2.0,
        periods: 4,
        time_s: 2.0,
        path: Vec::new(),
        count: 1,
        velocity_rpm: 60.0,
        acceleration_rpm_s: None,
        travel_turns: None,
        following_error_deg: 72.0,
        period_ms: 5.0,
    }
}

fn test_of(node: NodeId, motion: Order) -> Command {
    let quantities = Vec::new();
    NodeCommand::Capture(CaptureCommand::TestMotion(TestMotionOrder {
        motion,
        quantities,
        capture_ms: None,
        sdo: false,
    }))
    .to(node)
}

fn capture() -> Command {
    let quantities = vec!["velocity".to_owned()];
    let order = CaptureOrder {
        quantities,
        period_ms: 2.0,
        duration_ms: 60_000.0,
        trigger: None,
        pre_ms: 0.0,
        take: Vec::new(),
        sdo: false,
    };
    NodeCommand::Capture(CaptureCommand::Capture(order)).to(WHEEL)
}

fn figure(step: &Value, name: &str) -> f64 {
    step[name]["value"].as_f64().unwrap_or_else(|| panic!("{name}: {step}"))
}

impl Stage {
    /// SYNC has ended, the shaft was seen to stand without power, and the TPDOs are as they were. Points are sent by a group, which
    /// leaves its node operational; steps leave nothing.
    async fn is_as_it_was(&self, shape: ShapeName, before: (u32, u32)) {
        for _ in 0..300 {
            let has_ended = self.network.with_core(|core| core.sync_period()).is_none();
            let is_mapped = self.cell(SECOND_COUNT).await != 0 || self.tpdo().await != before;
            if has_ended && !is_mapped && !self.network.moved().contains(WHEEL) {
                break;
            }
            self.sleep(10).await;
        }
        assert_eq!(self.network.with_core(|core| core.sync_period()), None, "SYNC ends");
        assert_eq!((self.cell(SECOND_COUNT).await, self.tpdo().await), (0, before), "the spare TPDO is empty");
        assert!(!self.network.moved().contains(WHEEL), "it was seen to stand");
        assert_ne!(self.power_state(WHEEL).await, cia402::PowerState::OperationEnabled);
        if shape == ShapeName::Steps {
            self.is_put_back(before).await;
        }
    }
}

/// ZLAC8030L: a ramp of 500 (r/min)/s is two joined parabolas, 10 % of which lie at sqrt(0.05) and 90 % at 1 - sqrt(0.05).
#[test]
fn a_page_has_figures_and_traces_of_each_run_of_a_test_motion() {
    play(async |stage| {
        let mut page = stage.page().await;
        let mut steps = order(ShapeName::Steps);
        (steps.time_s, steps.count, steps.acceleration_rpm_s) = (0.5, 2, Some(500.0));
        assert_eq!(page.refused(test_of(WHEEL, steps.clone())).await.0, "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        let before = stage.tpdo().await;
        let came = page.comes(stage, test_of(WHEEL, steps)).await;
        assert_eq!((came["lacks"].clone(), came["shape"].clone()), (json!([]), json!("steps")));
        assert_eq!(came["limits"]["acceleration_rpm_s"], 500.0, "{}", came["limits"]);
        let runs = came["runs"].as_array().expect("a list");
        assert_eq!(runs.iter().map(|run| run["run"].clone()).collect::<Vec<_>>(), [1, 2]);
        let mut begins = Vec::new();
        for run in runs {
            let steps = run["steps"].as_array().expect("a list");
            assert_eq!(
                steps.iter().map(|step| (step["from"].as_f64(), step["to"].as_f64())).collect::<Vec<_>>(),
                [(Some(0.0), Some(60.0)), (Some(60.0), Some(0.0))]
            );
            let truth_s = (1.0 - 2.0 * 0.05_f64.sqrt()) * 60.0 / 500.0;
            assert!((figure(&steps[0], "rise_s") - truth_s).abs() < 0.008, "{}, not {truth_s}", steps[0]);
            assert!(figure(&steps[0], "settling_s") < 0.4, "{}", steps[0]);
            let traces = run["capture"]["traces"].as_array().expect("a list");
            let speeds = traces.iter().find(|trace| trace["quantity"] == "velocity_rpm").expect("captured");
            let speeds = speeds["values"].as_array().expect("a list").iter().filter_map(Value::as_f64);
            assert!((speeds.fold(0.0, f64::max) - 60.0).abs() < 6.0, "it turns, and does not run away");
            begins.push(run["capture"]["begun_s"].as_f64().expect("a time"));
        }
        assert!(begins[1] - begins[0] > 1.0, "one after the other: {begins:?}");
        stage.is_as_it_was(ShapeName::Steps, before).await;
        // A cosine from rest to rest takes its periods, and the shaft keeps up with it.
        let came = page.comes(stage, test_of(WHEEL, order(ShapeName::Sine))).await;
        let followed = &came["runs"][0]["followed"];
        let (took_s, most_deg) = (followed["took_s"].as_f64(), followed["most_deg"].as_f64());
        assert!((took_s.expect("a time") - 4.0).abs() < 0.1 && most_deg.expect("a distance") < 30.0, "{followed}");
        assert_eq!(came["lacks"], json!([]));
        let traces = came["runs"][0]["capture"]["traces"].as_array().expect("a list");
        assert!(traces.iter().any(|trace| trace["by"] == "TPDO2"), "beside the TPDO of the group: {traces:?}");
        stage.is_as_it_was(ShapeName::Sine, before).await;
        let asked = CaptureCommand::Report { at: "2026-11-28".into(), by: None };
        let report = page.knows(NodeCommand::Capture(asked).to(WHEEL)).await;
        let html = report["html"].as_str().expect("a page");
        assert!(html.contains("test motion steps, run 2") && html.contains("test motion sine, run 1"), "in the report");
    });
}

/// A press of stop by another page, a stop by the ramp, a closed tab, control that is given back, a page that is frozen.
#[test]
fn whatever_ends_a_test_motion_the_shaft_rests_without_power_and_everything_is_put_back() {
    play(async |stage| {
        let before = stage.tpdo().await;
        for shape in [ShapeName::Steps, ShapeName::Sine] {
            for end in ["stop", "ramp", "quick stop", "closed", "released", "frozen"] {
                let mut page = stage.page().await;
                page.must(SessionCommand::TakeControl {}).await;
                let waiting = page.begin(test_of(WHEEL, order(shape)));
                stage.is_moving().await;
                let mut other = stage.page().await;
                let mut page = Some(page);
                match end {
                    "stop" => other.must(SessionCommand::StopAll {}).await,
                    "ramp" => page.as_mut().expect("there").must(to(WHEEL, drive::Command::Stop)).await,
                    "quick stop" => other.must(to(WHEEL, drive::Command::QuickStop)).await,
                    "closed" => drop(page.take()),
                    "released" => page.as_mut().expect("there").must(SessionCommand::ReleaseControl {}).await,
                    _ => stage.sleep(super::PRESENCE_SPAN.as_millis() as u64 - 500).await,
                }
                let within = if end == "frozen" { Duration::from_secs(2) } else { STOPPED_WITHIN };
                assert!(stage.rests(WHEEL).await < within, "{shape:?} {end}");
                stage.is_as_it_was(shape, before).await;
                if page.is_some() {
                    let answer = waiting.await.expect("it is answered").json();
                    assert!(answer.contains("stopped"), "{shape:?} {end}: {answer}");
                }
                stage.sleep(1000).await;
                assert!(stage.speed(WHEEL).await < 2.0, "{shape:?} {end}: it stays at rest");
            }
        }
    });
}

#[test]
fn runs_that_were_made_before_a_stop_are_there() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let mut back_and_forth = order(ShapeName::BackAndForth);
        back_and_forth.count = 100;
        let waiting = page.begin(test_of(WHEEL, back_and_forth));
        stage.is_moving().await;
        for _ in 0..25 {
            page.must(SessionCommand::Alive {}).await;
            stage.sleep(100).await;
        }
        page.must(to(WHEEL, drive::Command::QuickStop)).await;
        let answer: Value = serde_json::from_str(&waiting.await.expect("answered").json()).expect("JSON");
        let runs = answer["result"]["runs"].as_array().expect("what was made").len();
        assert!((1..20).contains(&runs), "{runs}");
        assert_eq!(answer["result"]["lacks"], json!(["it was stopped"]));
    });
}

#[test]
fn nothing_else_takes_the_drive_or_sync_while_a_test_motion_is_under_way() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let waiting = page.begin(test_of(WHEEL, order(ShapeName::Sine)));
        stage.is_moving().await;
        for (command, says) in [
            (velocity(WHEEL, 30.0), "it makes a test motion"),
            (NodeCommand::Jog { rpm: 30.0 }.to(WHEEL), "it makes a test motion"),
            (to(WHEEL, drive::Command::Enable), "it makes a test motion"),
            (super::group::move_to(90.0, 90.0), "node 4 is being captured"),
            (capture(), "it is being captured already"),
            (test_of(ARM, order(ShapeName::Steps)), "node 4 is being captured"),
        ] {
            let (kind, text) = page.refused(command).await;
            assert!(kind == "busy" && text.contains(says), "{kind}: {text}");
        }
        let ended = page.refused(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await;
        assert_eq!(ended.0, "no_capture", "a stop ends it");
        let answer = page.stays(stage, waiting).await;
        assert_eq!(answer["result"]["lacks"], json!([]), "it was not disturbed");
        // Nor does one begin on what moves or is captured.
        page.must(velocity(WHEEL, 30.0)).await;
        let (kind, text) = page.refused(test_of(WHEEL, order(ShapeName::Steps))).await;
        assert!(kind == "busy" && text.contains("stop it first"), "{text}");
        stage.turns(WHEEL, 30.0).await;
        page.must(to(WHEEL, drive::Command::Stop)).await;
        let capturing = page.begin(capture());
        stage.is_capturing().await;
        assert_eq!(page.refused(test_of(WHEEL, order(ShapeName::Steps))).await.0, "busy");
        page.must(NodeCommand::Capture(CaptureCommand::EndCapture {}).to(WHEEL)).await;
        capturing.await.expect("answered");
        // And one that has ended leaves the drive free.
        page.must(move_by(WHEEL, 10.0, None)).await;
    });
}

#[test]
fn a_test_motion_beyond_a_limit_or_of_a_drive_that_nothing_stops_moves_nothing() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let of = |shape, change: fn(&mut Order)| {
            let mut wanted = order(shape);
            change(&mut wanted);
            test_of(WHEEL, wanted)
        };
        for (wanted, says) in [
            (of(ShapeName::Steps, |order| order.velocity_rpm = 30.0), "60 r/min, and 30 r/min are allowed"),
            (of(ShapeName::Steps, |order| order.speed_rpm = f64::NAN), "expected a speed that is not 0"),
            (of(ShapeName::Steps, |order| order.time_s = -1.0), "expected a time of 0 s or more"),
            (of(ShapeName::Steps, |order| order.time_s = 1e19), "more than a page is sent"),
            (of(ShapeName::Steps, |order| order.count = 0), "expected 1 to 999 runs"),
            (of(ShapeName::Steps, |order| order.travel_turns = Some(0.0)), "expected a travel above 0"),
            (
                of(ShapeName::Sine, |order| order.by_deg = 360.0),
                "a velocity of 376.9 r/min, and 60.0 r/min are allowed",
            ),
            (of(ShapeName::Sine, |order| order.period_ms = 0.0), "expected a period above 0 ms"),
            (of(ShapeName::Sine, |order| order.travel_turns = Some(0.1)), "0.111 turns"),
            (of(ShapeName::Path, |_| {}), "leads nowhere"),
            (of(ShapeName::Sine, |order| order.count = 999), "more than a page is sent"),
        ] {
            let (kind, text) = page.refused(wanted).await;
            assert!(kind == "usage" && text.contains(says), "{kind}: {text}");
        }
        // ZLIM42-C: its manual has no watch over the host.
        assert_eq!(page.refused(test_of(ARM, order(ShapeName::Steps))).await.0, "unguarded");
        assert_eq!(page.refused(test_of(ARM, order(ShapeName::Sine))).await.0, "unguarded");
        page.must(SessionCommand::LimitSpeed { rpm: Some(50.0) }).await;
        let (kind, text) = page.refused(test_of(WHEEL, order(ShapeName::Steps))).await;
        assert!(kind == "speed_limit" && text.contains("60.0 r/min is beyond"), "{text}");
        assert!(stage.network.moved().is_empty());
    });
}

impl Stage {
    /// Waits until the wheel turns.
    pub(super) async fn is_moving(&self) {
        for _ in 0..1000 {
            if self.speed(WHEEL).await > 10.0 {
                return;
            }
            self.sleep(5).await;
        }
        panic!("it does not move");
    }
}

impl Page {
    /// The result of a command, for which the page stays.
    pub(super) async fn comes(&mut self, stage: &Stage, command: Command) -> Value {
        let waiting = self.begin(command);
        let answer = self.stays(stage, waiting).await;
        assert_eq!(answer["ok"], true, "{answer}");
        answer["result"].clone()
    }

    /// Says that it is there until the answer comes.
    pub(super) async fn stays(&mut self, stage: &Stage, mut waiting: Answered) -> Value {
        loop {
            tokio::select! {
                answer = &mut waiting => {
                    return serde_json::from_str(&answer.expect("it is answered").json()).expect("JSON");
                }
                () = stage.sleep(500) => self.must(SessionCommand::Alive {}).await,
            }
        }
    }
}

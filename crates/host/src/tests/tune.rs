//! Gains that a page has found, and tried: with what the plant has, and whatever ends it, a shaft at rest and everything put back.

use std::time::Duration;

use canopen::{Mux, NodeId};
use serde_json::{Value, json};

use super::{ARM, PRESENCE_SPAN, STOPPED_WITHIN, Stage, WHEEL, play, play_acts, to, velocity};
use crate::command::{CaptureCommand, Command, NodeCommand, ParameterChange, SessionCommand, TuneCommand};
use crate::tune::{LoadOrder, Order};
use master::drive;
use sim::{Place, World};

/// ZLAC8030L: proportional and integral gain of the velocity loop, and its filter.
const GAINS: [Mux; 3] = [Mux::new(0x201D, 0), Mux::new(0x201E, 0), Mux::new(0x2018, 0)];

/// What is hung on the wheel.
const LOAD_KG_M2: f64 = 0.05;

fn load_the_wheel(world: &mut World) {
    let load = format!("load inertia {LOAD_KG_M2}").parse().expect("a stimulus");
    world.apply(Place::node(4), &load).expect("there").expect("taken");
}

fn order() -> Order {
    Order {
        bandwidth_hz: None,
        phase_margin_deg: 40.0,
        position: false,
        speed_rpm: Some(120.0),
        current_a: 15.0,
        travel_turns: 40.0,
        // A bus of 500 kbit/s has no room for more.
        period_ms: Some(2.0),
        torque_constant_nm_a: None,
    }
}

fn tune(node: NodeId, order: Order) -> Command {
    of(node, TuneCommand::Tune(order))
}

fn of(node: NodeId, command: TuneCommand) -> Command {
    NodeCommand::Tune(command).to(node)
}

impl Stage {
    async fn gains(&self) -> Vec<u64> {
        let mut values = Vec::new();
        for object in GAINS {
            values.push(self.raw(object).await);
        }
        values
    }

    /// SYNC has ended, the shaft was seen to stand without power, and the PDOs are as they were.
    async fn has_come_back(&self, tpdo: (u32, u32)) {
        for _ in 0..300 {
            let has_ended = self.network.with_core(|core| core.sync_period()).is_none();
            if has_ended && !self.network.moved().contains(WHEEL) && self.tpdo().await == tpdo {
                break;
            }
            self.sleep(10).await;
        }
        assert_eq!(self.network.with_core(|core| core.sync_period()), None, "SYNC ends");
        assert_eq!(self.tpdo().await, tpdo, "PDOs as they were");
        assert!(!self.network.moved().contains(WHEEL), "it was seen to stand");
        assert_ne!(self.power_state(WHEEL).await, cia402::PowerState::OperationEnabled);
    }

    async fn raw(&self, object: Mux) -> u64 {
        let value = self.network.node(WHEEL).upload(object).await.expect("it answers");
        let mut raw = [0; 8];
        raw[..value.as_bytes().len()].copy_from_slice(value.as_bytes());
        u64::from_le_bytes(raw)
    }
}

/// A wheel with a load on its shaft: what is found is its rotor and that.
#[test]
fn a_page_has_gains_found_and_tried_and_goes_back_with_one_command() {
    play_acts(
        async |_| {},
        load_the_wheel,
        async |stage| {
            let mut page = stage.page().await;
            let form = page.knows(of(WHEEL, TuneCommand::TuneForm {})).await;
            assert_eq!(
                form,
                json!({ "node": 4, "finds": "gains", "usual_rpm": 120.0, "usual_a": 15.0, "in_cycles": true })
            );
            assert_eq!(page.refused(tune(WHEEL, order())).await.0, "not_in_control");
            page.must(SessionCommand::TakeControl {}).await;
            assert_eq!(page.refused(of(WHEEL, TuneCommand::TryGains {})).await.0, "nothing_proposed");
            let (tpdo, had) = (stage.tpdo().await, stage.gains().await);
            let found = page.comes(stage, tune(WHEEL, order())).await;
            let motor = crate::tune::motor_of(devices::model("zlac8030l").expect("a model")).expect("its motor");
            let (inertia, truth) = (figure(&found, "inertia_kg_m2"), motor.rotor.inertia_kg_m2 + LOAD_KG_M2);
            assert!((inertia / truth - 1.0).abs() < 0.1, "{inertia} kg m², not {truth}");
            assert!(figure(&found, "twin_off") < 0.2 && figure(&found, "model_off") < 0.2, "{found}");
            let response = found["curves"]["response"].as_array().expect("rows");
            assert!(response.len() > 12 && figure(&found, "coherent") > 12.0, "{} rows", response.len());
            for name in ["drive", "model", "twin"] {
                assert!(
                    response.iter().all(|row| row[name]["db"].is_number() && row[name]["deg"].is_number()),
                    "{name}"
                );
            }
            assert_eq!((found["applied"].clone(), found["lacks"].clone()), (json!(false), json!([])));
            assert_eq!(stage.gains().await, had, "nothing is written yet");
            stage.has_come_back(tpdo).await;
            // Tried, and kept: better on the drive, by a step.
            let tried = page.comes(stage, of(WHEEL, TuneCommand::TryGains {})).await;
            assert_eq!(tried["applied"], true, "{}", tried["notes"]);
            let errors: Vec<f64> =
                tried["drive_error"].as_array().expect("two").iter().filter_map(Value::as_f64).collect();
            assert!(errors[1] <= errors[0], "{errors:?}");
            assert_eq!(tried["curves"]["drive"].as_array().expect("before and after").len(), 2);
            for gain in tried["gains"].as_array().expect("rows") {
                let at = GAINS.iter().position(|object| object.to_string() == gain["object"].as_str().expect("text"));
                let now = stage.gains().await[at.unwrap_or_else(|| panic!("{gain} is not one of {GAINS:?}"))];
                assert_eq!(json!(now), gain["after"], "{gain}");
            }
            assert_ne!(stage.gains().await, had);
            // The report has both, and what the drive made of them.
            let asked = CaptureCommand::Report { at: "2026-11-30".into(), by: None };
            let report = page.knows(NodeCommand::Capture(asked).to(WHEEL)).await;
            let html = report["html"].as_str().expect("a page");
            assert!(html.contains("Error after a step, on the drive"), "{html}");
            for gain in tried["gains"].as_array().expect("rows") {
                for value in [&gain["before"], &gain["after"]] {
                    assert!(html.contains(&format!(">{value}<")), "{gain}");
                }
            }
            stage.has_come_back(tpdo).await;
            assert_eq!(page.refused(of(WHEEL, TuneCommand::TryGains {})).await.0, "nothing_proposed", "once");
            page.must(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await;
            assert_eq!(stage.gains().await, had);
        },
        |_| {},
        async |_| {},
    );
}

/// A press of stop by another page, a stop by the ramp, a closed tab, control that is given back, a page that is frozen; in the
/// measurement, and in the trial once the gains are written.
#[test]
fn whatever_ends_a_tuning_the_shaft_rests_without_power_and_the_drive_has_its_parameters() {
    let scene = async |stage: &Stage| {
        let (tpdo, had) = (stage.tpdo().await, stage.gains().await);
        for end in ["stop", "ramp", "closed", "released", "frozen"] {
            let mut page = stage.page().await;
            page.must(SessionCommand::TakeControl {}).await;
            let mut waiting = page.begin(tune(WHEEL, order()));
            tokio::select! {
                () = stage.is_moving() => {}
                answer = &mut waiting => panic!("{end}: {}", answer.expect("answered").json()),
            }
            let mut page = Some(page);
            match end {
                "stop" => stage.page().await.must(SessionCommand::StopAll {}).await,
                "ramp" => page.as_mut().expect("there").must(to(WHEEL, drive::Command::Stop)).await,
                "closed" => drop(page.take()),
                "released" => page.as_mut().expect("there").must(SessionCommand::ReleaseControl {}).await,
                _ => stage.sleep(PRESENCE_SPAN.as_millis() as u64 - 500).await,
            }
            let within = if end == "frozen" { Duration::from_secs(2) } else { STOPPED_WITHIN };
            assert!(stage.rests(WHEEL).await < within, "{end}");
            stage.has_come_back(tpdo).await;
            if page.is_some() {
                let answer = waiting.await.expect("it is answered").json();
                assert!(answer.contains("it was stopped"), "{end}: {answer}");
            }
            stage.sleep(1000).await;
            assert!(stage.speed(WHEEL).await < 2.0, "{end}: it stays at rest");
            assert_eq!(stage.gains().await, had, "{end}");
        }
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.comes(stage, tune(WHEEL, order())).await;
        let waiting = page.begin(of(WHEEL, TuneCommand::TryGains {}));
        // The step with the gains that it has, and then that with the new ones.
        for _ in 0..2000 {
            page.must(SessionCommand::Alive {}).await;
            if stage.gains().await != had && stage.speed(WHEEL).await > 10.0 {
                break;
            }
            stage.sleep(5).await;
        }
        assert_ne!(stage.gains().await, had, "the new ones are written");
        page.must(SessionCommand::StopAll {}).await;
        // With these gains its speed shows counts of its encoder as long as it is held: at rest once it has no power.
        assert!(stage.rests(WHEEL).await < Duration::from_secs(3));
        let answer = waiting.await.expect("it is answered").json();
        assert!(answer.contains("it was stopped"), "{answer}");
        assert_eq!(stage.gains().await, had, "with its former gains");
        stage.has_come_back(tpdo).await;
    };
    play_acts(async |_| {}, load_the_wheel, scene, |_| {}, async |_| {});
}

#[test]
fn a_tuning_beyond_a_limit_or_beside_other_motion_moves_nothing() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.take_control_of_all().await;
        let with = |change: fn(&mut Order)| {
            let mut wanted = order();
            change(&mut wanted);
            tune(WHEEL, wanted)
        };
        for (wanted, says) in [
            (with(|order| order.phase_margin_deg = 90.0), "expected a phase margin from 10 to 80 degrees, got 90"),
            (with(|order| order.bandwidth_hz = Some(f64::NAN)), "expected a bandwidth from 0.1 to 500 Hz"),
            (with(|order| order.travel_turns = 0.0), "expected a travel from 0.1"),
            (with(|order| order.current_a = 0.0), "expected a current from 0.01"),
            (with(|order| order.period_ms = Some(-1.0)), "expected a period of 0 ms or more"),
            (with(|order| order.period_ms = Some(100.0)), "expected a period from"),
        ] {
            let (kind, text) = page.refused(wanted).await;
            assert!(kind == "usage" && text.contains(says), "{kind}: {text}");
        }
        // A stepper without an encoder has no loops.
        assert_eq!(page.refused(tune(ARM, order())).await.0, "no_gains");
        page.must(SessionCommand::LimitSpeed { rpm: Some(100.0) }).await;
        for wanted in [order(), Order { speed_rpm: None, ..order() }] {
            assert_eq!(page.refused(tune(WHEEL, wanted)).await.0, "speed_limit");
        }
        page.must(SessionCommand::LimitSpeed { rpm: None }).await;
        assert!(stage.network.moved().is_empty());
        // It stops at a bound, and is put back.
        let (tpdo, had) = (stage.tpdo().await, stage.gains().await);
        let waiting = page.begin(tune(WHEEL, Order { travel_turns: 0.5, ..order() }));
        let answer = page.stays(stage, waiting).await;
        assert_eq!(answer["error"]["kind"], "travel_bound", "{answer}");
        assert_eq!(stage.gains().await, had);
        stage.has_come_back(tpdo).await;
        let waiting = page.begin(tune(WHEEL, order()));
        stage.is_moving().await;
        assert_eq!(page.refused(velocity(WHEEL, 30.0)).await.0, "busy");
        assert_eq!(page.refused(tune(WHEEL, order())).await.0, "busy");
        assert_eq!(
            page.refused(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await.0,
            "nothing_to_roll_back"
        );
        page.must(to(WHEEL, drive::Command::QuickStop)).await;
        waiting.await.expect("answered");
    });
}

/// `crates/host/tests/it/tune_ramps.rs` holds what is computed.
#[test]
fn ramps_of_a_stepper_are_computed_for_a_page_without_control_and_nothing_moves() {
    play(async |stage| {
        let mut page = stage.page().await;
        assert_eq!(page.knows(of(ARM, TuneCommand::TuneForm {})).await, json!({ "node": 2, "finds": "ramps" }));
        let load = LoadOrder {
            inertia_kg_m2: 3e-5,
            friction_nm: 0.05,
            load_nm: 0.0,
            speed_rpm: 600.0,
            margin: 1.5,
            ramp_ms: None,
        };
        let report = page.knows(of(ARM, TuneCommand::TuneRamps(load.clone()))).await;
        assert!(figure(&report, "margin_after") >= 1.5, "{report}");
        assert!(report["twin"].as_array().expect("rows")[..2].iter().all(|row| row["lost_steps"] == 0), "{report}");
        assert_eq!(report["applied"], false);
        let (kind, _) = page.refused(of(ARM, TuneCommand::TuneRamps(LoadOrder { margin: 0.5, ..load.clone() }))).await;
        assert_eq!(kind, "usage");
        assert_ne!(page.refused(of(WHEEL, TuneCommand::TuneRamps(load))).await.1, "");
        assert!(stage.network.moved().is_empty());
    });
}

fn figure(report: &Value, name: &str) -> f64 {
    report[name].as_f64().unwrap_or_else(|| panic!("{name}: {report}"))
}

//! PDOs of virtual drives: shown, planned, written, refused half-way and undone.
//!
//! The ZLAC8030L counts PDOs from 0, in 0.5 ms, and comes with nothing in its TPDOs (quick start guide V1.00, chapters 6 and 9).

use canopen::{Mux, NmtState};
use serde_json::{Value, json};

use master::drive;

use super::{Stage, WHEEL, play, to, velocity};
use crate::command::{Command, NewEntry, NewPdo, NmtChange, NodeCommand, ParameterChange, PdoCommand, SessionCommand};

const COUNT: Mux = Mux::new(0x1A00, 0);
const FIRST: Mux = Mux::new(0x1A00, 1);
const COB_ID: Mux = Mux::new(0x1800, 1);

fn pdo(name: &str, objects: &[(&str, u8)]) -> NewPdo {
    let entry = |(object, bits): &(&str, u8)| NewEntry { object: (*object).to_owned(), bits: *bits };
    NewPdo {
        pdo: name.into(),
        valid: true,
        objects: Some(objects.iter().map(entry).collect()),
        transmission: Some(1),
        inhibit_ms: None,
        event_ms: None,
        id: None,
    }
}

fn state_and_position() -> NewPdo {
    pdo("TPDO1", &[("6041h:00", 16), ("6064h:00", 32)])
}

fn planned(pdos: Vec<NewPdo>) -> Command {
    NodeCommand::Pdos(PdoCommand::PlanPdos { pdos, cycle_ms: 10.0, bitrate: None }).to(WHEEL)
}

fn written(pdos: Vec<NewPdo>) -> Command {
    NodeCommand::Pdos(PdoCommand::WritePdos { pdos }).to(WHEEL)
}

impl Stage {
    /// An object of the wheel, of whatever length.
    pub(super) async fn cell(&self, object: Mux) -> u32 {
        self.network.node(WHEEL).upload(object).await.expect("it answers").raw()
    }
}

fn named<'a>(shown: &'a Value, name: &str) -> &'a Value {
    let pdos = shown["pdos"].as_array().expect("a list");
    pdos.iter().find(|pdo| pdo["pdo"] == name).unwrap_or_else(|| panic!("{name} in {shown}"))
}

#[test]
fn every_pdo_is_shown_with_why_it_is_not_sent_and_what_may_be_changed() {
    play(async |stage| {
        let mut page = stage.page().await;
        stage.sleep(1100).await;
        let shown = page.knows(NodeCommand::Pdos(PdoCommand::Pdos {}).to(WHEEL)).await;
        let names: Vec<&str> =
            shown["pdos"].as_array().expect("a list").iter().filter_map(|pdo| pdo["pdo"].as_str()).collect();
        assert_eq!(names, ["TPDO1", "TPDO2", "TPDO3", "TPDO4", "RPDO1", "RPDO2", "RPDO3", "RPDO4"]);
        let tpdo = named(&shown, "TPDO1");
        assert_eq!((&tpdo["manual"], &tpdo["id"], &tpdo["valid"]), (&json!("TPDO0"), &json!(0x184), &json!(true)));
        assert_eq!((&tpdo["when"], &tpdo["silent"]), (&json!("on events"), &json!(["nothing is mapped into it"])));
        let rpdo = named(&shown, "RPDO1");
        assert_eq!(rpdo["objects"], json!([{ "object": "6040h:00", "name": "controlword", "bits": 16 }]));
        let silent = json!([
            "the node is pre-operational, and PDOs are sent and taken in operational only",
            "no node was heard sending it"
        ]);
        assert_eq!(rpdo["silent"], silent);
        let takes = &tpdo["takes"];
        assert_eq!((&takes["objects"], &takes["mapping"], &takes["id"]), (&json!(4), &Value::Null, &Value::Null));
        assert_eq!((&takes["event"]["step_ms"], &takes["event"]["most_ms"]), (&json!(0.5), &json!(32767.5)));
        assert_eq!((&shown["can_undo"], &shown["sync_heard"]), (&json!(false), &json!(false)));
    });
}

#[test]
fn a_change_is_planned_with_its_writes_and_its_effect_on_the_bus() {
    play(async |stage| {
        let mut page = stage.page().await;
        let shown = page.knows(planned(vec![state_and_position()])).await;
        let steps: Vec<_> =
            shown["steps"].as_array().expect("a list").iter().map(|step| (&step["object"], &step["purpose"])).collect();
        let expected = [
            ("1800h:01", "off while it is changed"),
            ("1A00h:01", "map an object"),
            ("1A00h:02", "map an object"),
            ("1A00h:00", "number of mapped objects"),
            ("1800h:02", "value"),
            ("1800h:01", "identifier"),
        ];
        let expected: Vec<(Value, Value)> = expected.map(|(object, purpose)| (json!(object), json!(purpose))).into();
        assert_eq!(
            steps,
            expected.iter().map(|(object, purpose)| (object, purpose)).collect::<Vec<_>>(),
            "CiA 301, 7.5.2.38"
        );
        let tpdo = named(&shown, "TPDO1");
        assert_eq!((&tpdo["bits"], &tpdo["when"]), (&json!(48), &json!("after every SYNC")));
        // The longest frame of 6 bytes has 55 + 10 * 6 bits (Davis et al., equation 1): 115 of 5000 in 10 ms at 500 kbit/s.
        let load = |when: &str| shown["bus"]["cycle_load_percent"][when].as_f64().expect("a number");
        assert!((load("after") - load("before") - 2.3).abs() < 0.02, "{}", shown["bus"]);
        let frames = shown["bus"]["frames"].as_array().expect("a list");
        let of =
            |name: &str| frames.iter().find(|frame| frame["frame"] == name && frame["node"] == 4).expect("it is there");
        assert_eq!((&of("TPDO1")["before"], &of("TPDO1")["after"]["bytes"]), (&Value::Null, &json!(6)));
        assert!(of("TPDO1")["after"]["worst_ms"].as_f64().expect("a bound") > 0.0);
        // Frames of lower priority wait for it too.
        let answer = frames.iter().find(|frame| frame["frame"] == "SDO answer").expect("it is there");
        let worst = |when: &str| answer[when]["worst_ms"].as_f64().expect("a bound");
        assert!(worst("after") > worst("before"), "{answer}");
        assert_eq!(stage.cell(COUNT).await, 0, "nothing was written");
    });
}

#[test]
fn a_mapping_is_written_seen_in_the_trace_by_name_and_undone() {
    play(async |stage| {
        let mut page = stage.page().await;
        assert_eq!(page.refused(written(vec![state_and_position()])).await.0, "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        page.knows(written(vec![state_and_position()])).await;
        assert_eq!((stage.cell(COUNT).await, stage.cell(FIRST).await), (2, 0x6041_0010));
        assert_eq!(stage.cell(COB_ID).await & 0xBFFF_FFFF, 0x184);
        page.must(NodeCommand::Pdos(PdoCommand::Nmt { command: NmtChange::Start }).to(WHEEL)).await;
        stage.sleep(600).await;
        assert_eq!(stage.network.facts(WHEEL).probable_state(devices::model("zlac8030l")), Some(NmtState::Operational));
        stage.network.transmit(can::Frame::new(canopen::connection_set::SYNC, &[]));
        stage.sleep(300).await;
        let lines = stage.lines(json!({ "kind": "pdo", "text": "position_actual_value" }));
        let text = lines.last().and_then(|line| line["text"].as_str()).unwrap_or_default();
        assert!(text.contains("TPDO1") && text.contains("statusword"), "{lines:?}");
        let shown = page.knows(NodeCommand::Pdos(PdoCommand::Pdos {}).to(WHEEL)).await;
        assert_eq!((&shown["can_undo"], &named(&shown, "TPDO1")["silent"]), (&json!(true), &json!([])));
        assert_eq!(stage.state()["nodes"][1]["mapped"], 1);
        page.knows(NodeCommand::Change(ParameterChange::RollBack {}).to(WHEEL)).await;
        assert_eq!((stage.cell(COUNT).await, stage.cell(FIRST).await), (0, 0));
        assert_eq!(page.knows(NodeCommand::Pdos(PdoCommand::Pdos {}).to(WHEEL)).await["can_undo"], false);
    });
}

#[test]
fn a_write_that_is_refused_half_way_leaves_every_pdo_as_it_was() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let before = page.knows(NodeCommand::Pdos(PdoCommand::Pdos {}).to(WHEEL)).await["pdos"].clone();
        // This drive accepts entries longer than their object; only the drive knows that it refuses a shorter one.
        let half = pdo("TPDO2", &[("6064h:00", 16)]);
        let (kind, text) = page.refused(written(vec![state_and_position(), half])).await;
        assert!(kind == "rolled_back" && text.contains("1A01h:01"), "{kind}: {text}");
        assert_eq!(page.knows(NodeCommand::Pdos(PdoCommand::Pdos {}).to(WHEEL)).await["pdos"], before);
        assert_eq!(stage.cell(COUNT).await, 0);
        assert_eq!(stage.state()["nodes"][1]["mapped"], 0);
    });
}

#[test]
fn an_invalid_pdo_is_refused_with_the_reason_and_writes_nothing() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let id = |id| NewPdo { id: Some(id), ..state_and_position() };
        let cases = [
            (pdo("TPDO9", &[]), "unfit_pdo", "has no TPDO9; it has TPDO1"),
            (pdo("PDO1", &[]), "malformed", "expected tpdo1"),
            (pdo("TPDO1", &[("6041", 16), ("6064", 32), ("606C", 32)]), "unfit_pdo", "80 bits"),
            (pdo("TPDO1", &[("1017", 16)]), "unfit_pdo", "does not let it be mapped"),
            (pdo("TPDO1", &[("5FFF", 16)]), "unknown_object", "not in the description"),
            (pdo("RPDO1", &[("6041", 16)]), "unfit_pdo", "only be read"),
            (id(0x601), "bad_value", "another service"),
            (id(0x801), "bad_value", "an 11-bit identifier"),
            (NewPdo { event_ms: Some(-1.0), ..state_and_position() }, "bad_value", "0 or more"),
            (NewPdo { event_ms: Some(40_000.0), ..state_and_position() }, "unfit_pdo", "32.7675s"),
        ];
        for (new, kind, words) in cases {
            let (found, text) = page.refused(written(vec![new.clone()])).await;
            assert!(found == kind && text.contains(words), "{new:?}: {found}: {text}");
        }
        for (pdos, cycle_ms, bitrate, words) in [
            (vec![], 10.0, None, "1 to 64"),
            (vec![state_and_position(), state_and_position()], 10.0, None, "named twice"),
            (vec![state_and_position()], 0.0, None, "0.25 to 60000"),
            (vec![state_and_position()], f64::NAN, None, "0.25 to 60000"),
            (vec![state_and_position()], 10.0, Some(0), "bit rate"),
        ] {
            let (kind, text) =
                page.refused(NodeCommand::Pdos(PdoCommand::PlanPdos { pdos, cycle_ms, bitrate }).to(WHEEL)).await;
            assert!(kind == "malformed" && text.contains(words), "{kind}: {text}");
        }
        page.must(to(WHEEL, drive::Command::Enable)).await;
        assert_eq!(page.refused(written(vec![state_and_position()])).await.0, "at_work");
        page.must(to(WHEEL, drive::Command::Disable)).await;
        assert_eq!(stage.cell(COUNT).await, 0);
    });
}

/// Half the period is twice the load, and twice the bit rate half of it.
#[test]
fn the_load_is_computed_for_the_given_cycle_and_bit_rate() {
    play(async |stage| {
        let mut page = stage.page().await;
        let mut load = async |cycle_ms, bitrate| {
            let pdos = vec![state_and_position()];
            let shown = page.knows(NodeCommand::Pdos(PdoCommand::PlanPdos { pdos, cycle_ms, bitrate }).to(WHEEL)).await
                ["bus"]
                .clone();
            shown["cycle_load_percent"]["after"].as_f64().expect("a number")
        };
        let (usual, twice, half) = (load(10.0, None).await, load(5.0, None).await, load(10.0, Some(1_000_000)).await);
        // The bus has only the cycle: no heartbeat by default (1017h is 0). Given to two decimals.
        assert!((twice - 2.0 * usual).abs() < 0.02 && (half - usual / 2.0).abs() < 0.02, "{usual} {twice} {half}");
    });
}

#[test]
fn a_node_goes_to_operational_and_back_and_not_while_it_turns() {
    play(async |stage| {
        let mut page = stage.page().await;
        let nmt = |command| NodeCommand::Pdos(PdoCommand::Nmt { command }).to(WHEEL);
        assert_eq!(page.refused(nmt(NmtChange::Start)).await.0, "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        let is = async || {
            stage.sleep(100).await;
            stage.network.facts(WHEEL).probable_state(devices::model("zlac8030l"))
        };
        page.must(nmt(NmtChange::Start)).await;
        assert_eq!(is().await, Some(NmtState::Operational));
        page.must(velocity(WHEEL, 30.0)).await;
        assert_eq!(page.refused(nmt(NmtChange::PreOperational)).await.0, "busy");
        page.must(to(WHEEL, drive::Command::Disable)).await;
        page.must(nmt(NmtChange::PreOperational)).await;
        assert_eq!(is().await, Some(NmtState::PreOperational));
        let absent = NodeCommand::Pdos(PdoCommand::Nmt { command: NmtChange::Start }).to(super::node(9));
        assert_eq!(page.refused(absent).await.0, "no_such_drive");
        assert_eq!(page.refused(NodeCommand::Pdos(PdoCommand::Pdos {}).to(super::node(9))).await.0, "no_such_drive");
    });
}

#[test]
fn a_pdo_is_switched_off_and_omitted_fields_stay() {
    play(async |stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        page.knows(written(vec![NewPdo { event_ms: Some(250.0), ..state_and_position() }])).await;
        // The event timer counts 0.5 ms (6.1).
        assert_eq!(stage.cell(Mux::new(0x1800, 5)).await, 500);
        let off = NewPdo { valid: false, objects: None, transmission: None, ..state_and_position() };
        page.knows(written(vec![off])).await;
        assert_eq!(stage.cell(COB_ID).await & 0xBFFF_FFFF, 0x8000_0184);
        assert_eq!((stage.cell(COUNT).await, stage.cell(Mux::new(0x1800, 2)).await), (2, 1));
        let moved = NewPdo { id: Some(0x1A4), objects: None, transmission: None, ..state_and_position() };
        page.knows(written(vec![moved])).await;
        assert_eq!(stage.cell(COB_ID).await & 0xBFFF_FFFF, 0x1A4);
        stage.sleep(200).await;
    });
}

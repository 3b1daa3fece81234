//! The trace of virtual drives: the contents of its lines, and filters.

use can::Instant;
use canopen::Mux;
use canopen::object::DEVICE_TYPE;
use cia402::object::{POSITION_ACTUAL_VALUE, TARGET_VELOCITY};
use serde_json::{Value, json};

use super::{ARM, Stage, WHEEL, play, play_in, setting};
use crate::Setting;
use crate::command::SessionCommand;
use crate::trace::{Asked, Origin, Trace};
use can::BusFrame;

impl Stage {
    /// The answer to a query.
    fn trace(&self, asked: Value) -> Value {
        let asked: Asked = serde_json::from_value(asked).expect("parameters");
        let query = asked.understand().expect("it makes sense");
        serde_json::to_value(query.select(&self.handle.trace().held())).expect("JSON")
    }

    pub(super) fn lines(&self, asked: Value) -> Vec<Value> {
        self.trace(asked)["lines"].as_array().expect("lines").clone()
    }

    /// Lets the host process the frames so far.
    async fn settle(&self) {
        self.sleep(50).await;
    }
}

fn text(line: &Value) -> &str {
    line["text"].as_str().expect("text")
}

#[test]
fn an_sdo_transfer_is_one_line_in_words_with_its_client_and_its_duration() {
    play(async |stage| {
        let begin = stage.trace(json!({}))["next"].clone();
        stage.network.node(ARM).read::<u32>(DEVICE_TYPE).await.expect("it has a type");
        stage.network.node(WHEEL).write(TARGET_VELOCITY, 60_i32).await.expect("it is taken");
        stage.network.node(WHEEL).write(POSITION_ACTUAL_VALUE, 1_i32).await.expect_err("it is read only");
        stage.settle().await;
        let shown = |asked: &str| {
            let lines = stage.lines(json!({ "after": begin, "text": asked, "transfers": true }));
            assert_eq!(lines.len(), 1, "{asked}: {lines:?}");
            lines[0].clone()
        };
        let asked = shown("1000h");
        assert!(text(&asked).starts_with("SDO node 2: read 1000h:00 device_type = "), "{asked}");
        assert_eq!((&asked["from"], &asked["node"], &asked["kind"]), (&"studio".into(), &2.into(), &"sdo".into()));
        // The answer has 108 bits or more, at 500 kbit/s.
        assert!(asked["took_ms"].as_f64().expect("a time") >= 108.0 / 500.0, "{asked}");
        assert!(text(&shown("target_velocity")).starts_with("SDO node 4: wrote 60FFh:00 target_velocity = 60"));
        assert!(text(&shown("6064h,aborts")).contains("0601 0002"));
        let frames = stage.lines(json!({ "after": begin, "text": "1000h", "node": "2" }));
        let ids: Vec<_> = frames.iter().map(|line| line["id"].as_str().expect("an identifier")).collect();
        assert_eq!(ids, ["602", "582"], "each frame");
    });
}

/// CiA 301, 7.2.4.3.5 and 7.2.4.3.6: nine bytes are read in two segments, by another master.
#[test]
fn segments_of_a_transfer_are_one_line_with_the_time_from_the_first_to_the_last() {
    let trace = Trace::new(master::Models::default(), Origin::default());
    let frames = [
        "602#4008100000000000",
        "582#4108100009000000",
        "602#6000000000000000",
        "582#0031323334353637",
        "602#7000000000000000",
        "582#1B38390000000000",
    ];
    for (at_ms, frame) in frames.iter().enumerate() {
        let at = Instant::from_millis(at_ms as u64);
        trace.append(BusFrame { at, frame: frame.parse().expect("a frame"), own: false });
    }
    let select = |asked: Value| {
        let asked: Asked = serde_json::from_value(asked).expect("parameters");
        serde_json::to_value(asked.understand().expect("sense").select(&trace.held())).expect("JSON")["lines"].clone()
    };
    assert_eq!(select(json!({})).as_array().expect("lines").len(), 6);
    // The same when the reader has seen all but the last frame.
    for asked in [json!({ "transfers": true }), json!({ "transfers": true, "after": 5 })] {
        let lines = select(asked);
        assert_eq!(lines.as_array().expect("lines").len(), 1, "{lines}");
        assert_eq!(text(&lines[0]), "SDO node 2: read 1008h:00 manufacturer_device_name = \"123456789\"");
        assert_eq!((&lines[0]["from"], &lines[0]["took_ms"]), (&"others".into(), &5.0.into()));
    }
    assert_eq!(select(json!({ "transfers": true, "before": 5 })), json!([]));
}

#[test]
fn filters_show_only_matching_lines() {
    play(async |stage| {
        stage.network.node(ARM).nmt(canopen::NmtCommand::ResetNode);
        stage.sleep(1000).await;
        let (all, of_arm) = (stage.lines(json!({})), stage.lines(json!({ "node": "2" })));
        assert!(all.iter().any(|line| line["node"] == 4));
        assert!(!of_arm.is_empty() && of_arm.iter().all(|line| line["node"] == 2), "{of_arm:?}");
        let booted = stage.lines(json!({ "kind": "nmt,heartbeat", "node": "2", "count": 1000 }));
        let shown: Vec<_> = booted.iter().map(text).collect();
        let reset = shown.iter().position(|text| *text == "NMT reset node, node 2").expect("the command");
        assert!(shown[reset..].contains(&"boot-up node 2"), "{shown:?}");
        assert_eq!(booted[reset]["from"], "studio");
        assert!(booted.iter().any(|line| line["from"] == "node 2"));
        let by_id = stage.lines(json!({ "text": "702" }));
        assert!(by_id.iter().any(|line| text(line) == "boot-up node 2"), "{by_id:?}");
        assert_eq!(stage.lines(json!({ "text": "boot-up,no_such_word" })), Vec::<Value>::new());
    });
}

#[test]
fn the_reads_of_the_studio_can_be_omitted() {
    play(async |stage| {
        stage.network.node(WHEEL).write(TARGET_VELOCITY, 60_i32).await.expect("it is taken");
        stage.sleep(300).await;
        for transfers in [false, true] {
            let of = |quiet: bool| {
                stage.lines(json!({ "kind": "sdo", "count": 2000, "quiet": quiet, "transfers": transfers }))
            };
            let (all, quiet) = (of(false), of(true));
            assert!(all.len() > 100);
            let expected = if transfers { 1 } else { 2 };
            assert_eq!(quiet.len(), expected, "only what was written stays: {quiet:?}");
            assert!(text(&quiet[0]).contains("60FFh:00 target_velocity = 60"), "{quiet:?}");
        }
    });
}

#[test]
fn an_invalid_query_is_refused_with_the_reason() {
    for (asked, why) in [
        (json!({ "node": "128" }), "1 to 127"),
        (json!({ "node": "4,x" }), "'x' is not a node-ID"),
        (json!({ "kind": "sdos" }), "expected some of nmt, sync"),
        (json!({ "from_s": -1.0 }), "expected a bus time"),
    ] {
        let asked: Asked = serde_json::from_value(asked).expect("parameters");
        let refused = asked.understand().expect_err("it is not valid");
        assert!(refused.contains(why), "{refused}");
    }
    assert!(serde_json::from_value::<Asked>(json!({ "nodes": "4" })).is_err(), "an unknown parameter");
}

/// Consecutive parts have each line once, and a reader that is too slow is given the number of frames
/// that were skipped.
#[test]
fn a_reader_continues_where_it_was_and_gets_the_number_of_skipped_frames() {
    play(async |stage| {
        let first = stage.trace(json!({ "count": 10 }));
        assert_eq!(first["lines"].as_array().expect("lines").len(), 10);
        assert_eq!((&first["skipped"], &first["to"]), (&0.into(), &first["next"]));
        let number = |part: &Value, field: &str| part[field].as_u64().expect("a number");
        assert_eq!(number(&first, "from") + 10, number(&first, "to"));
        let older = stage.trace(json!({ "count": 10, "before": first["from"] }));
        assert_eq!(older["to"], first["from"]);
        stage.sleep(1000).await;
        let next = stage.trace(json!({ "after": first["to"], "count": 2000 }));
        assert_eq!((&next["from"], &next["skipped"]), (&first["to"], &0.into()));
        let numbers: Vec<_> =
            next["lines"].as_array().expect("lines").iter().map(|line| number(line, "number")).collect();
        assert!(numbers.iter().copied().eq(number(&next, "from")..number(&next, "to")), "each once");
        let late = stage.trace(json!({ "after": first["to"], "count": 20 }));
        assert_eq!(number(&late, "skipped") + 20, number(&late, "to") - number(&first, "to"));
    });
}

/// Both changes by another program over SDO and mappings from before the studio count.
#[test]
fn a_pdo_is_split_by_the_mapping_that_is_in_the_drive() {
    play(async |stage| {
        // ZLAC8030L: TPDO1 (1800h, 1A00h) is made to carry the speed alone, and sent each 100 ms.
        let wheel = stage.network.node(WHEEL);
        wheel.write(Mux::new(0x1800, 1), 0x8000_0184_u32).await.expect("off");
        wheel.write(Mux::new(0x1A00, 0), 0_u8).await.expect("it is taken");
        wheel.write(Mux::new(0x1A00, 1), 0x606C_0020_u32).await.expect("it is taken");
        wheel.write(Mux::new(0x1A00, 0), 1_u8).await.expect("it is taken");
        wheel.write(Mux::new(0x1800, 2), 0xFF_u8).await.expect("it is taken");
        wheel.write(Mux::new(0x1800, 5), 200_u16).await.expect("it is taken");
        wheel.write(Mux::new(0x1800, 1), 0x0184_u32).await.expect("on");
        wheel.nmt(canopen::NmtCommand::Start);
        stage.sleep(500).await;
        let sent = stage.lines(json!({ "kind": "pdo", "node": "4" }));
        let last = sent.last().expect("it sends");
        assert!(text(last).contains("606Ch:00 velocity_actual_value = 0"), "{last}");
        assert_eq!((&last["from"], &last["id"]), (&"node 4".into(), &"184".into()));
    });
}

#[test]
fn the_log_reads_back_frame_by_frame() {
    play(async |stage| {
        stage.settle().await;
        let held = stage.handle.trace().held();
        let log = |asked: Value| {
            let query = serde_json::from_value::<Asked>(asked).expect("parameters").understand().expect("sense");
            let (mut log, mut next) = (String::new(), 0);
            while let Some(part) = query.log_part(&held, stage.handle.trace().origin(), next) {
                log += &part.text;
                next = part.next;
            }
            log
        };
        let read = |log: &str| -> Vec<_> {
            let records = log.lines().map(|line| canlog::parse_line(line).expect("it is read"));
            records.map(|record| record.expect("no comment")).collect()
        };
        let records = read(&log(json!({})));
        assert_eq!(records.len() as u64, held.next() - held.oldest());
        let lines = stage.lines(json!({ "before": held.next(), "count": 2000 }));
        for (record, line) in records.iter().rev().zip(lines.iter().rev()) {
            let canlog::Content::Frame(frame) = &record.content else { panic!("{record:?}") };
            assert_eq!(frame.id().to_string(), line["id"].as_str().expect("an identifier"));
            let since = record.at.expect("a time").as_secs_f64() - 1_700_000_000.0;
            assert!((since - line["at_s"].as_f64().expect("a time")).abs() < 2e-6);
            let sent = record.direction == Some(canlog::Direction::Transmitted);
            assert_eq!(sent, line["from"] == "studio");
        }
        let of_arm = read(&log(json!({ "node": "2", "kind": "sdo" })));
        assert!(of_arm.len() > 100 && of_arm.len() < records.len());
    });
}

/// A SYNC at 0, 10, 24, 34 and 44 ms, and a heartbeat of an extended identifier between.
#[test]
fn the_frames_of_each_identifier_are_counted_and_timed_in_parts_that_add_up() {
    let trace = Trace::new(master::Models::default(), Origin::default());
    for (at_ms, frame) in [(0, "080#"), (10, "080#"), (12, "00000080#"), (24, "080#"), (34, "080#"), (44, "080#")] {
        let at = Instant::from_millis(at_ms);
        trace.append(BusFrame { at, frame: frame.parse().expect("a frame"), own: false });
    }
    let of = |asked: Value| {
        let asked: Asked = serde_json::from_value(asked).expect("parameters");
        serde_json::to_value(asked.understand().expect("sense").identifiers(&trace.held())).expect("JSON")
    };
    let near = |value: &Value, wanted: f64| (value.as_f64().expect("a number") - wanted).abs() < 1e-6;
    let all = of(json!({}));
    let rows = all["identifiers"].as_array().expect("rows");
    assert_eq!(rows.iter().map(|row| row["id"].as_str().expect("text")).collect::<Vec<_>>(), ["080", "00000080"]);
    assert_eq!((&rows[0]["count"], &rows[0]["last"]["number"], &all["to"]), (&5.into(), &5.into(), &6.into()));
    assert!(near(&rows[0]["least_ms"], 10.0) && near(&rows[0]["most_ms"], 14.0), "{all}");
    assert!(rows[1]["least_ms"].is_null() && rows[1]["count"] == 1, "{all}");
    let later = of(json!({ "after": 3, "kind": "sync" }));
    assert_eq!(later["identifiers"].as_array().expect("rows").len(), 1);
    let row = &later["identifiers"][0];
    assert!(row["count"] == 3 && near(&row["first_s"], 0.024) && near(&row["most_ms"], 10.0), "{later}");
    assert_eq!(of(json!({ "text": "nothing" }))["identifiers"], json!([]));
}

/// CiA 301, 7.2.8.3.1: NMT start is 01h of identifier 0.
#[test]
fn a_frame_is_sent_as_it_is_and_one_that_may_move_needs_leave() {
    play(async |stage| {
        let mut page = stage.page().await;
        let send = |frame: &str| SessionCommand::SendFrame { frame: frame.into() };
        assert_eq!(page.ask(send("604#4000100000000000")).await.error_kind(), "not_in_control");
        page.must(SessionCommand::TakeControl {}).await;
        let sent = page.ask(send("604#4000100000000000")).await;
        assert!(sent.is_ok() && sent.json().contains("sent: SDO node 4: read 1000h:00"), "{}", sent.json());
        stage.settle().await;
        let seen = stage.lines(json!({ "text": "40 00 10 00" }));
        assert!(seen.iter().any(|line| line["from"] == "studio"), "{seen:?}");
        let begin = stage.trace(json!({}))["next"].clone();
        for (frame, why) in [("000#0104", "NMT start"), ("604#2B40600006000000", "a controlword"), ("204#0F00", "PDO")]
        {
            let refused = page.ask(send(frame)).await;
            assert_eq!(refused.error_kind(), "motion", "{}", refused.json());
            assert!(refused.json().contains(why) && refused.json().contains("--allow-motion"), "{}", refused.json());
        }
        let malformed = page.ask(send("604#4")).await;
        assert_eq!(malformed.error_kind(), "malformed", "{}", malformed.json());
        stage.settle().await;
        assert_eq!(stage.lines(json!({ "after": begin, "kind": "nmt" })), Vec::<Value>::new(), "nothing was sent");
    });
}

#[test]
fn what_a_frame_with_leave_may_move_counts_as_moved() {
    let scene = async |stage: &Stage| {
        let mut page = stage.page().await;
        page.must(SessionCommand::TakeControl {}).await;
        let shown = |stage: &Stage| stage.state()["nodes"].as_array().expect("nodes").clone();
        let moving = |stage: &Stage| shown(stage).iter().any(|node| node["node"] == 4 && node["moving"] == true);
        assert!(!moving(stage));
        page.must(SessionCommand::LimitSpeed { rpm: Some(20.0) }).await;
        let send = || SessionCommand::SendFrame { frame: "604#2B40600006000000".into() };
        assert_eq!(page.ask(send()).await.error_kind(), "speed_limit");
        page.must(SessionCommand::LimitSpeed { rpm: None }).await;
        page.must(send()).await;
        stage.sleep(200).await;
        assert!(moving(stage), "{:?}", shown(stage));
        drop(page);
        stage.sleep(1500).await;
        assert!(!moving(stage), "it was stopped with the session, and is seen to stand");
    };
    play_in(Setting { allow_motion: true, ..setting() }, scene, |_| {}, async |_| {}, |_| {}, async |_| {});
}

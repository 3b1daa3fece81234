//! The commands of every day on the embedded bus.

use processes::{done, ferrodrive, scratch};
use serde_json::{Value, json};

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn verbose_shows_each_frame_of_a_command_in_words() {
    let shown = done(&["read", "4", "6041", "-v"]);
    let frames: Vec<&str> = shown.err.lines().collect();
    // CiA 301, 7.2.4.3.5: 40h asks for an upload, 4Bh answers with two bytes.
    assert!(frames[0].contains("604#4041600000000000  SDO node 4: read 6041h:00 statusword"), "{}", shown.err);
    assert!(frames[1].contains("584#4B416000") && frames[1].contains("Switch on disabled"), "{}", shown.err);
    assert_eq!(done(&["read", "4", "6041"]).err, "");
}

#[test]
fn frames_are_sent_as_they_are_typed() {
    let shown = done(&["send", "604#4041600000000000", "184#R8", "1ABCDE00#11.22", "-v"]);
    for part in ["604#4041600000000000", "184#R8", "1ABCDE00#1122", "584#4B416000"] {
        assert!(shown.err.contains(part), "{part} in {}", shown.err);
    }
    let sent = done(&["--json", "send", "123#11", "--every", "10ms", "--count", "5"]).json();
    assert_eq!((&sent["sent"], &sent["frames"]), (&json!(5), &json!(["123#11"])));
}

#[test]
fn sync_comes_at_its_rate_and_with_its_counter() {
    let shown = done(&["sync", "--every", "10ms", "--count", "5", "--sync-counter", "3", "-v"]);
    let syncs: Vec<(f64, &str)> = shown
        .err
        .lines()
        .filter_map(|line| {
            let (time, rest) = line.strip_prefix('(')?.split_once(") ")?;
            Some((time.parse().ok()?, rest.split_whitespace().next()?)).filter(|(_, frame)| frame.starts_with("080#"))
        })
        .collect();
    let frames: Vec<&str> = syncs.iter().map(|(_, frame)| *frame).collect();
    assert_eq!(frames, ["080#01", "080#02", "080#03", "080#01", "080#02"]);
    // In virtual time to the wire's last bit: a frame may wait for another, of 135 bits at the most.
    for (place, pair) in syncs.windows(2).enumerate() {
        assert!((pair[1].0 - pair[0].0 - 0.010).abs() < 135.0 / 500e3, "{place}: {syncs:?}");
    }
}

#[test]
fn the_time_of_day_is_sent_as_cia_301_counts_it() {
    // 1000000000 s after 1 January 1970 is 2001-09-09 01:46:40 UTC: day 11574 since then, 6461 since 1 January 1984.
    let sent = done(&["--json", "time", "--unix", "1000000000"]).json();
    assert_eq!((&sent["days"], &sent["ms"]), (&json!(11_574 - 5113), &json!(6_400_000)));
    assert_eq!(ferrodrive(&["time", "--unix", "1000"]).status, Some(2));
}

#[test]
fn bytes_go_to_a_file_and_come_from_one() {
    let directory = scratch("bytes");
    let path = directory.join("mode").to_str().unwrap().to_owned();
    let read = done(&["--json", "read", "4", "6083", "--to", &path]).json();
    assert_eq!((&read["file"], std::fs::read(&path).unwrap().len()), (&json!(path), 4));
    let again = ferrodrive(&["--json", "read", "4", "6083", "--to", &path]);
    assert_eq!((again.status, &again.json()["error"]["kind"]), (Some(1), &json!("file_exists")));
    done(&["read", "4", "6083", "--to", &path, "--force"]);
    std::fs::write(&path, [3]).unwrap();
    let written = done(&["--json", "write", "4", "6060", "--from", &path]).json();
    assert_eq!((&written["value"], &written["meaning"]), (&json!(3), &json!("profile velocity")));
    for (content, said) in [(&b""[..], "is empty"), (&[0; (1 << 20) + 1], "larger than the limit of 1 MB")] {
        std::fs::write(&path, content).unwrap();
        let refused = ferrodrive(&["write", "4", "6060", "--from", &path]);
        assert!(refused.status == Some(1) && refused.err.contains(said), "{}", refused.err);
    }
}

#[test]
fn watching_prints_a_line_for_each_look() {
    let looks = lines(&done(&["--json", "watch", "4", "606C", "statusword", "--every", "100ms", "--count", "3"]).out);
    let times: Vec<f64> = looks.iter().map(|look| look["t"].as_f64().unwrap()).collect();
    assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 0.1).abs() < 1e-9), "{times:?}");
    assert_eq!(looks[0]["values"][0]["unit"], "r/min");
    assert_eq!(looks[2]["values"][1]["meaning"], "Switch on disabled, target reached");
    let absent = ferrodrive(&["watch", "4", "5FFF"]);
    assert!(absent.status == Some(1) && absent.err.contains("5FFFh:00"), "{}", absent.err);
}

#[test]
fn a_node_is_waited_for_until_its_heartbeat_says_what_it_was_told() {
    // The joint sends its heartbeat each second as delivered (M joint manual, 5.11.1).
    assert_eq!(done(&["--json", "nmt", "1", "start", "--wait"]).json()["state"], "operational");
    let silent = ferrodrive(&["nmt", "4", "start", "--wait", "1s"]);
    assert_eq!(silent.status, Some(1));
    assert!(silent.err.contains("1017h is 0") && silent.err.contains("write 4 1017 100"), "{}", silent.err);
    let all = done(&["--json", "nmt", "all", "reset", "--wait", "3s"]).json();
    let booted = all["nodes"].as_array().unwrap().iter().filter(|node| node["booted"] == true).count();
    assert_eq!(booted, 3, "{all}");
}

#[test]
fn pdos_are_shown_as_the_manual_has_them() {
    let shown = done(&["--json", "pdo", "show", "4"]).json();
    let pdos = shown["nodes"][0]["pdos"].as_array().unwrap();
    // Four each way; RPDO1 is at 200h + node-ID (CiA 301, 7.3.3), event-driven, with the controlword (quick start guide, 7.2).
    let rpdo1 = pdos.iter().find(|pdo| pdo["pdo"] == "RPDO1").unwrap();
    assert_eq!((pdos.len(), &rpdo1["id"]), (8, &json!(0x204)));
    assert_eq!(rpdo1["objects"][0], json!({ "object": "6040h:00", "name": "controlword", "bits": 16 }));
}

#[test]
fn a_log_is_filtered_by_node_service_and_object() {
    let directory = scratch("filter");
    let log = directory.join("trace.log").to_str().unwrap().to_owned();
    let frames = [
        "(1000000000.000000) can0 704#00",
        "(1000000000.500000) can0 604#4041600000000000",
        "(1000000000.501000) can0 584#4B41600070060000",
        "(1000000001.000000) can0 601#4064600000000000",
        "(1000000002.000000) can0 000#8000",
        "(1000000003.000000) can0 100#00A861003D19",
    ];
    std::fs::write(&log, frames.join("\n") + "\n").unwrap();
    let bus = format!("log:{log}");
    let count = |options: &[&str]| done(&[&["--bus", &bus, "--json", "dump"], options].concat()).out.lines().count();
    assert_eq!(count(&[]), 6);
    // An NMT command for all nodes is for node 4 too.
    assert_eq!(count(&["--node", "4"]), 4);
    assert_eq!(count(&["--service", "sdo"]), 3);
    assert_eq!(count(&["--service", "sdo,nmt", "--node", "4"]), 3);
    assert_eq!(count(&["--object", "6041"]), 2);
    assert_eq!(count(&["--object", "statusword", "--object", "6064:00"]), 3);
    let shown = done(&["--bus", &bus, "dump", "--time", "absolute", "--service", "time"]);
    assert_eq!(shown.out.trim(), "2001-09-09 01:46:43.000000 100#00A861003D19      TIME 2001-09-09 01:46:40.000");
    let counts = "6 frames in 3.000 s, 1 of them shown: 1 nmt, 1 time, 3 sdo, 1 heartbeat; of node 1: 1, 4: 3";
    assert_eq!(shown.err.trim(), counts);
    let shown = done(&["--bus", &bus, "dump", "--time", "delta", "--service", "sdo"]).out;
    let stamps: Vec<&str> = shown.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(stamps, ["(+0.000000)", "(+0.001000)", "(+0.499000)"]);
    for wrong in [&["--service", "sdos"][..], &["--object", "statuswort"], &["--node", "0"]] {
        let refused = ferrodrive(&[&["--bus", &bus, "dump"], wrong].concat());
        assert_eq!(refused.status, Some(2), "{wrong:?}: {}", refused.err);
    }
}

#[test]
fn words_in_another_order_are_understood_where_that_does_no_harm() {
    let read = done(&["4", "read", "6060"]);
    assert_eq!(read.out, done(&["read", "4", "6060"]).out);
    assert_eq!(read.err.trim(), "note: interpreted as: ferrodrive read 4 6060");
    assert_eq!(done(&["--json", "4", "read", "6060"]).err, "");
    for (typed, meant) in [
        (&["4", "velocity", "60rpm"][..], "ferrodrive velocity 4 60rpm"),
        (&["move", "90deg", "4"], "ferrodrive move 4 90deg"),
        (&["nmt", "start", "all"], "ferrodrive nmt all start"),
        (&["write", "6060", "4", "'profile velocity'"], "ferrodrive write 4 6060"),
    ] {
        let refused = ferrodrive(typed);
        assert_eq!((refused.status, refused.out.as_str()), (Some(2), ""), "{typed:?}");
        assert!(refused.err.contains(&format!("did you mean: {meant}")), "{typed:?}: {}", refused.err);
    }
}

#[test]
fn several_objects_are_read_at_once() {
    let all = lines(&done(&["--json", "read", "4", "1018:*", "6060..6061", "statusword"]).out);
    let objects: Vec<&str> = all.iter().map(|line| line["object"].as_str().unwrap()).collect();
    let expected = ["1018h:00", "1018h:01", "1018h:02", "1018h:03", "6060h:00", "6061h:00", "6041h:00"];
    assert_eq!(objects, expected);
}

#[test]
fn a_motion_that_takes_longer_than_it_may_is_given_up() {
    let late = ferrodrive(&["--json", "velocity", "4", "60rpm", "--within", "1ms"]);
    assert_eq!((late.status, &late.json()["error"]["kind"]), (Some(1), &json!("not_reached")));
    assert_eq!(done(&["--json", "velocity", "4", "60rpm", "--within", "10s"]).json()["reached"], true);
}

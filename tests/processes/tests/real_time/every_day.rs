//! The commands of every day, on the embedded bus and on one that a simulator serves.

use processes::{Simulator, done, ferrodrive, scratch, wait_for};
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
    let shown = done(&["sync", "--every", "10ms", "--count", "5", "--counter", "3", "-v"]);
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
fn several_objects_are_read_at_once() {
    let all = lines(&done(&["--json", "read", "4", "1018:*", "6060..6061", "statusword"]).out);
    let objects: Vec<&str> = all.iter().map(|line| line["object"].as_str().unwrap()).collect();
    let expected = ["1018h:00", "1018h:01", "1018h:02", "1018h:03", "6060h:00", "6061h:00", "6041h:00"];
    assert_eq!(objects, expected);
    // Without a table too: what is there is found by asking.
    let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    done(&["--bus", &bus, "--timeout", "10s", "nmt", "4", "reset", "--wait", "60s"]);
    let found = lines(&done(&["--bus", &bus, "--timeout", "10s", "--json", "read", "4", "1000..1018"]).out);
    let listed = lines(&done(&["--json", "read", "4", "1000..1018"]).out);
    let of =
        |lines: &[Value]| lines.iter().map(|line| (line["object"].clone(), line["bytes"].clone())).collect::<Vec<_>>();
    assert_eq!(of(&found), of(&listed));
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
fn what_is_on_a_bus_is_shown_as_it_comes() {
    let simulator = Simulator::start(&["--drive", "m4230e17b50@1", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on = |arguments: &[&str]| {
        done(&[&["--bus", &bus, "--timeout", "10s", "--model", "1=m4230e17b50"], arguments].concat())
    };
    on(&["nmt", "1", "reset", "--wait", "60s"]);
    // An own frame is seen too: EMCY of node 9, over-current by its class (CiA 301, table 26).
    let watch = std::thread::scope(|scope| {
        let watching = scope.spawn(|| on(&["--json", "emcy", "watch", "--for", "5s"]).out);
        for _ in 0..20 {
            // Written by another thread, once the command listens; nothing says when it does.
            std::thread::sleep(std::time::Duration::from_millis(200));
            on(&["send", "089#1023020000000000"]);
            if watching.is_finished() {
                break;
            }
        }
        watching.join().unwrap()
    });
    let reported = lines(&watch);
    assert!(!reported.is_empty());
    assert_eq!(
        (&reported[0]["node"], &reported[0]["code"], &reported[0]["error_register"]),
        (&json!(9), &json!(0x2310), &json!(2))
    );
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
fn a_motion_that_takes_longer_than_it_may_is_given_up_and_stopped() {
    let late = ferrodrive(&["--json", "velocity", "4", "60rpm", "--within", "1ms"]);
    assert_eq!((late.status, &late.json()["error"]["kind"]), (Some(1), &json!("not_reached")));
    assert_eq!(done(&["--json", "velocity", "4", "60rpm", "--within", "10s"]).json()["reached"], true);
    let mut simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    let on = |arguments: &[&str]| {
        ferrodrive(&[&["--bus", &bus, "--timeout", "10s", "--model", "4=zlac8030l"], arguments].concat())
    };
    on(&["nmt", "4", "reset", "--wait", "60s"]);
    let late = on(&["move", "4", "200turn", "--relative", "--profile-velocity", "60rpm", "--within", "2s"]);
    assert_eq!(late.status, Some(1), "{}", late.err);
    assert!(late.err.contains("node 4 was moving and has been quick-stopped"), "{}", late.err);
    let speed = simulator.ask("4 get")["velocity_rpm"].as_f64().unwrap();
    assert!(speed.abs() < 20.0, "{speed}");
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

/// A servo of the standard behind a simulator, which has booted.
fn served_servo() -> (Simulator, String) {
    let simulator = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = simulator.bus("socketcand");
    done(&["--bus", &bus, "--timeout", "10s", "nmt", "5", "reset", "--wait", "60s"]);
    (simulator, bus)
}

#[test]
fn errors_that_a_node_remembers_are_shown_with_their_meaning() {
    let (_simulator, bus) = served_servo();
    let on = |arguments: &[&str]| done(&[&["--bus", &bus, "--timeout", "10s", "--json"], arguments].concat()).json();
    assert_eq!(on(&["emcy", "show", "5"])["errors"], json!([]));
    // CiA 301, 7.5.2.19: node 7Fh within 100 ms. One heartbeat begins the watch, and none follows.
    on(&["write", "5", "1016:01", "0x7F0064"]);
    on(&["send", "77F#05"]);
    let errors = wait_for("an error that is remembered", || {
        let shown = on(&["emcy", "show", "5"]);
        if shown["errors"] == json!([]) { Err(shown.to_string()) } else { Ok(shown["errors"].clone()) }
    });
    // CiA 301, table 26: 8130h is the life guard or heartbeat error.
    assert_eq!((&errors[0]["code"], &errors[0]["node"]), (&json!(0x8130), &json!(5)), "{errors}");
    let text = done(&["--bus", &bus, "--timeout", "10s", "emcy", "show", "5"]).out;
    assert!(text.starts_with("node 5: 8130h ") && text.to_lowercase().contains("heartbeat"), "{text}");
}

#[test]
fn pdos_that_come_are_shown_with_their_objects() {
    let (_simulator, bus) = served_servo();
    let bus = ["--bus", &bus, "--timeout", "10s"];
    // CiA 301, 7.5.2.37: an event timer of 50 ms.
    done(&[&bus[..], &["write", "5", "1800:05", "50"]].concat());
    done(&[&bus[..], &["nmt", "5", "start"]].concat());
    let watched = lines(&done(&[&bus[..], &["--json", "pdo", "watch", "5", "--for", "5s"]].concat()).out);
    let first = watched.first().expect("no PDO came");
    assert_eq!((&first["pdo"], &first["node"]), (&json!("TPDO1"), &json!(5)));
    assert_eq!(first["values"][0]["object"], json!("6041h:00"));
    // CiA 402-2, table 30: Switch on disabled is x1xx 0000 in the low byte.
    let bytes = first["bytes"].as_str().unwrap();
    let low = u8::from_str_radix(&bytes[..2], 16).unwrap();
    assert_eq!(low & 0x4F, 0x40, "{bytes}");
}

/// Whatever this machine does beside it: of what cannot be heard it is never said that it stands.
#[test]
fn an_emergency_stop_that_was_not_seen_ends_with_1() {
    let mut simulator = Simulator::start(&["--drive", "cia402@5", "--serve", "socketcand://127.0.0.1:0"]);
    let bus = format!("socketcand://{}/can0", simulator.address("socketcand"));
    simulator.send("5 cable cut");
    assert!(simulator.line().starts_with(r#"{"ok":true"#));
    for command in [&["estop"][..], &["estop", "all"], &["quick-stop", "all"], &["stop", "all"]] {
        for (known, kind) in [(&[][..], "no_node"), (&["--model", "5=cia402"], "not_stopped")] {
            let ended = ferrodrive(&[&["--json", "--bus", &bus][..], known, command].concat());
            assert_eq!(
                (ended.status, &ended.json()["error"]["kind"]),
                (Some(1), &json!(kind)),
                "{command:?}: {}",
                ended.out
            );
        }
    }
}

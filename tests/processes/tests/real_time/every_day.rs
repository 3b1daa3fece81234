//! The commands of every day, on a bus that a simulator serves.

use processes::{Simulator, done, ferrodrive, wait_for};
use serde_json::{Value, json};

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
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

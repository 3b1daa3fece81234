//! `ferrodrive capture` over a socket in the time of the clock: what was had, and a kill (kill -9) while it captures. What is not put back
//! by a program that dies is put back by the next, from the journal.
#![allow(clippy::print_stdout, reason = "how late a busy machine is can be shown and not judged")]
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Output, Stdio};
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use processes::{Scratch, Simulator, command, scratch, wait_until};
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

struct Served {
    /// It ends with this.
    _simulator: Simulator,
    bus: String,
    /// Where journals are kept.
    folder: Scratch,
}

impl Served {
    fn new(name: &str) -> Self {
        let simulator = Simulator::start(&["--drive", "zlac8030l@4", "--serve", "socketcand://127.0.0.1:0"]);
        let served = Self { bus: simulator.bus("socketcand"), _simulator: simulator, folder: scratch(name) };
        wait_until("the drive boots", || served.run(&["read", "4", "1000"]).status.success());
        served
    }

    fn command(&self, arguments: &[&str]) -> std::process::Command {
        let mut command =
            command(&[&["--bus", &self.bus, "--model", "4=zlac8030l", "--timeout", "10s"], arguments].concat());
        command.current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    /// A command that goes on by itself.
    fn runs(&self, arguments: &[&str]) -> Child {
        let mut command = self.command(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it runs")
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the binary runs")
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.run(&[arguments, &["--json"]].concat());
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{arguments:?}: {error} in {text}"))
    }

    /// Identifier, type, timers and mapping of each TPDO.
    fn tpdos(&self) -> Vec<Value> {
        let shown = self.json(&["pdo", "show", "4"]);
        let all = shown["nodes"][0]["pdos"].as_array().expect("rows").iter();
        all.filter(|pdo| pdo["pdo"].as_str().is_some_and(|name| name.starts_with("TPDO"))).cloned().collect()
    }
}

#[test]
fn a_capture_over_a_socket_has_what_the_drive_sent_in_time() {
    let served = Served::new("captured-live");
    let before = served.tpdos();
    let report = served.json(&["capture", "4", "velocity", "position", "--rate", "2ms", "--for", "1s", "-o", "x.csv"]);
    let traces = report["captures"][0]["traces"].as_array().expect("traces");
    assert_eq!(traces.len(), 2, "{report}");
    for trace in traces {
        // How late a busy machine is cannot be said: what came belongs to a TPDO, and has a period.
        let [period_s, jitter_s] = [&trace["period_s"], &trace["jitter_s"]].map(|time| time.as_f64().expect("a time"));
        println!(
            "{}: {} ms, jitter {} ms, {} readings",
            trace["quantity"],
            period_s * 1e3,
            jitter_s * 1e3,
            trace["readings"]
        );
        assert!(trace["by"].as_str().is_some_and(|by| by.starts_with("TPDO")) && period_s > 0.0, "{trace}");
    }
    let csv = std::fs::read_to_string(served.folder.join("x.csv")).expect("it is written");
    assert!(csv.starts_with("t_s,") && csv.lines().count() > 10, "{} lines", csv.lines().count());
    assert_eq!(served.tpdos(), before);
    assert!(!served.folder.join("ferrodrive-node4.journal").exists());
}

/// The law: whatever kills a capture, its journal leads the TPDOs back, and no other capture begins over it.
#[test]
fn a_capture_that_is_killed_leaves_a_journal_that_leads_back() {
    leads_back("captured-killed", |served| {
        served.runs(&["capture", "4", "velocity", "current", "--for", "1h", "-o", "x.mcap"])
    });
}

/// Its drive stops by its own watch over its host (2000h, 1000 ms as delivered: quick start guide V1.00, chapter 9), and holds: it is written
/// without power.
#[test]
fn a_test_motion_that_is_killed_leaves_a_journal_that_leads_back() {
    leads_back("moved-killed", |served| {
        served.runs(&["test-motion", "4", "steps", "--speed", "20rpm", "--time", "1h", "--acceleration", "600rpm/s"])
    });
}

/// What a page of it has begun.
#[test]
fn a_studio_that_is_killed_leaves_a_journal_that_leads_back() {
    leads_back("studio-killed", |served| {
        let mut child = served.command(&["studio", "--listen", "127.0.0.1:0"]);
        let mut child = child.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it runs");
        let mut said = String::new();
        BufReader::new(child.stdout.as_mut().expect("piped")).read_line(&mut said).expect("text");
        std::thread::spawn(move || {
            let page = captures_of_a_page(said.trim().strip_prefix("studio http://").expect("its address"));
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
            // Until the studio is gone.
            runtime.block_on(page)
        });
        child
    });
}

/// A page that takes control, captures again and again, and shows that it is alive.
async fn captures_of_a_page(address: &str) -> Option<()> {
    let (host, token) = address.split_once("/?token=")?;
    let mut request = format!("ws://{host}/ws").into_client_request().ok()?;
    request.headers_mut().insert("authorization", format!("Bearer {token}").parse().ok()?);
    request.headers_mut().insert("origin", format!("http://{host}").parse().ok()?);
    let (mut socket, _) = tokio_tungstenite::connect_async(request).await.ok()?;
    let welcome = socket.next().await?.ok()?;
    let welcome: Value = serde_json::from_str(welcome.to_text().ok()?).ok()?;
    let capture = json!({ "do": "capture", "node": 4, "quantities": ["velocity", "current"], "period_ms": 10, "duration_ms": 600_000, "trigger": null });
    for seq in 1.. {
        let mut message = match seq % 20 {
            1 => json!({ "do": "take_control" }),
            // Its drive is found when its scan is through: until then it is refused.
            2 => capture.clone(),
            _ => json!({ "do": "alive" }),
        };
        (message["seq"], message["session"]) = (seq.into(), welcome["word"].clone());
        socket.send(Message::text(message.to_string())).await.ok()?;
        // Signs of life are due every 200 ms; what the studio sends is not read.
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    None
}

/// Has something capture, kills it, and goes back.
fn leads_back(name: &str, begin: impl Fn(&Served) -> Child) {
    let served = Served::new(name);
    let (before, journal) = (served.tpdos(), served.folder.join("ferrodrive-node4.journal"));
    let is_killed = || {
        let mut child = begin(&served);
        wait_until("its TPDOs are mapped", || is_whole(&journal) && served.tpdos() != before);
        // It may be between two writes, or capture by now.
        child.kill().expect("it runs for long");
        child.wait().expect("it has ended");
        journal.exists()
    };
    // A page that a busy machine holds up for too long ends its capture, which is put back: the kill was too late.
    wait_until("it is killed while it captures", is_killed);
    // The answer to its last request may be on its way.
    wait_until("the drive answers", || served.run(&["read", "4", "1000"]).status.success());
    assert_ne!(served.tpdos(), before);
    let refused = served.run(&["capture", "4", "velocity", "--for", "20ms"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(1) && said.contains("params rollback 4"), "{said}");
    // A drive that holds or turns is not written, and what to do is said.
    wait_until("it goes back", || {
        let back = served.run(&["params", "rollback", "4"]);
        let said = String::from_utf8_lossy(&back.stderr).into_owned();
        if said.contains("ferrodrive disable 4") {
            served.run(&["disable", "4"]);
        }
        back.status.success()
    });
    assert_eq!(served.tpdos(), before);
    assert!(!journal.exists());
    // And it can be captured again.
    let again = served.json(&["capture", "4", "velocity", "--for", "20ms"]);
    assert_eq!(again["ok"], true, "{again}");
    assert_eq!(served.tpdos(), before);
}

fn is_whole(journal: &Path) -> bool {
    std::fs::read_to_string(journal).is_ok_and(|text| text.contains("whole = true"))
}

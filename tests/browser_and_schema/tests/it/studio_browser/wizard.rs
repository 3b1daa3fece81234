//! The wizard for gains to its end, in a real browser. What the studio's host answers for a wheel with a load is that of its session in virtual
//! time (`crates/host/src/tests/tune.rs`), which a page with a clock cannot have: here the page is handed those answers when it asks.

use serde_json::{Value, json};

use super::Stage;

/// What the host has answered to `tune`, and to `try_gains` behind it.
const FOUND: &str = include_str!("../../data/tune_found.json");
const TRIED: &str = include_str!("../../data/tune_tried.json");

/// Answers these commands in place of the studio, and keeps what was asked.
const ANSWER: &str = "const answers = JSON.parse(arguments[0]), send = WebSocket.prototype.send; window.asked = []; \
    WebSocket.prototype.send = function (text) { \
      const message = JSON.parse(text), result = answers[message.do]; \
      if (!result) return send.call(this, text); \
      window.asked.push(message); \
      const data = JSON.stringify({ type: 'answer', seq: message.seq, ok: true, result }); \
      setTimeout(() => this.dispatchEvent(new MessageEvent('message', { data }))); }";

impl Stage {
    /// Shows the form of the Scope view, of the wheel.
    async fn wizard(&self) {
        self.take_the_wheel().await;
        self.click("#tabs [data-name=scope]").await;
        self.find("#tune").await;
        self.script("document.getElementById('tune').open = true").await;
        self.says("#tune-warning", "120 r/min at most").await;
    }

    /// How many elements there are.
    async fn count(&self, css: &str) -> Value {
        self.script(&format!("return document.querySelectorAll({css:?}).length")).await
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_wizard_for_gains_shows_what_was_found_writes_it_and_goes_back() {
    let (found, tried): (Value, Value) =
        (serde_json::from_str(FOUND).expect("JSON"), serde_json::from_str(TRIED).expect("JSON"));
    let stage = Stage::open("wizard").await;
    stage.wizard().await;
    let back = json!({ "steps": [], "rounded": [] });
    let answers = json!({ "tune": found, "try_gains": tried, "roll_back": back }).to_string();
    stage.client.execute(ANSWER, vec![answers.into()]).await.expect("it runs");
    stage.has_done("#tune-agreed[aria-pressed=false], #tune-start", "#tune-status", "The drive has what it had").await;
    // The order has the limits that were agreed to.
    let asked = stage.script("return window.asked[0]").await;
    assert_eq!((&asked["do"], &asked["node"]), (&"tune".into(), &4.into()), "{asked}");
    let limits = ["speed_rpm", "current_a", "travel_turns"].map(|name| asked[name].as_f64().unwrap_or(f64::NAN));
    assert_eq!(limits, [120.0, 15.0, 40.0], "{asked}");
    // Bode: gain, phase and coherence, with the drive, its twin and the model in the first two.
    assert_eq!(stage.count("#tune-had svg:first-of-type .frame").await, 3);
    for line in ["line", "twin", "model"] {
        assert!(stage.count(&format!("#tune-had svg:first-of-type path.{line}")).await.as_u64() >= Some(2), "{line}");
    }
    let inertia = found["inertia_kg_m2"].as_f64().expect("an inertia");
    let shown = stage.says("#tune-had", "kg·m²").await;
    // Three digits of it.
    let digits =
        shown.split("Inertia").nth(1).and_then(|rest| rest.trim().split(' ').next()).expect("a figure").parse::<f64>();
    assert!((digits.expect("a number") / inertia - 1.0).abs() < 0.005, "{inertia}: {shown}");
    for gain in found["gains"].as_array().expect("gains") {
        let row = ["object", "name", "before", "after"].map(|name| gain[name].to_string().replace('"', ""));
        let is_row = "return [...document.querySelectorAll('#tune-had tr')].map((row) => [...row.cells].map((cell) => cell.textContent).join('|'))";
        let rows = stage.script(is_row).await;
        assert!(rows.as_array().expect("rows").contains(&row.join("|").into()), "{row:?}: {rows}");
    }
    stage.find("#tune-back[hidden]").await;
    stage.is_usable("what was found").await;
    stage.device(320, 640).await;
    let wide = stage.script("document.querySelector('#tune-had').scrollIntoView(); return document.documentElement.scrollWidth - innerWidth").await;
    assert!(wide.as_f64() <= Some(0.0), "{wide} px too wide");
    stage.shoot("wizard_320").await;
    stage.device(1280, 900).await;
    stage.script("document.querySelector('#tune-had').scrollIntoView()").await;
    stage.shoot("wizard_found").await;
    // Written and tried; then back by one press.
    stage.says("#tune-write", "Write them, and have the drive try a step").await;
    stage.has_done("#tune-write", "#tune-status", "not stored yet").await;
    stage.says("#tune-had", "A step, on the drive").await;
    stage.find("#tune-write[hidden]").await;
    stage.script("document.querySelector('#tune-had').scrollIntoView()").await;
    stage.shoot("wizard_tried").await;
    stage.has_done("#tune-back", "#tune-status", "the drive has its former values, read back").await;
    let words = stage.script("return window.asked.map((message) => `${message.do} ${message.node}`)").await;
    assert_eq!(words, json!(["tune 4", "try_gains 4", "roll_back 4"]));
    stage.find("#tune-back[hidden]").await;
    stage.close().await;
}

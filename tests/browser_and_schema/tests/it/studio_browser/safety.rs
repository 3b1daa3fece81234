//! What the page says when it no longer sees the drives, and that nothing on it keeps a stop from its way: in a real browser, at the
//! widths of a telephone, a tablet and a desk.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use fantoccini::key::Key;
use serde_json::{Value, json};

use processes::studio::Studio;

use super::{PATIENCE, Stage, press, speed};

/// The stepper of the embedded bus, by its place: nothing stops it when the studio dies.
const STEPPER: usize = 1;

pub(super) const VIEWS: [&str; 10] =
    ["bus", "drive", "motion", "scope", "parameters", "pdo", "trace", "faults", "world", "console"];

impl Stage {
    /// A window of this size; narrow ones as those of a device that is touched, whose layout is as wide as its contents.
    pub(super) async fn device(&self, width: u32, height: u32) {
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 1000 });
        self.devtools("Emulation.setDeviceMetricsOverride", metrics).await;
    }

    /// A command of Chromium's own (Chrome DevTools Protocol), which its driver passes on.
    pub(super) async fn devtools(&self, command: &str, parameters: Value) {
        let session = self.client.session_id().await.expect("it answers").expect("it has begun");
        let body = json!({ "cmd": command, "params": parameters }).to_string();
        let stream = TcpStream::connect(&self.driver_address).expect("the driver listens");
        // The watchdog's clock: a driver that hangs ends the test.
        stream.set_read_timeout(Some(PATIENCE)).expect("it takes it");
        let head = format!(
            "POST /session/{session}/goog/cdp/execute HTTP/1.1\r\nHost: {}\r\nContent-Length: {}\r\n\r\n",
            self.driver_address,
            body.len()
        );
        (&stream).write_all((head + &body).as_bytes()).expect("it is sent");
        let mut answer = String::new();
        BufReader::new(&stream).read_line(&mut answer).expect("it answers");
        assert!(answer.starts_with("HTTP/1.1 200"), "{command}: {answer}");
    }

    pub(super) async fn script(&self, script: &str) -> Value {
        self.client.execute(script, Vec::new()).await.unwrap_or_else(|error| panic!("{script}: {error}"))
    }

    async fn key(&self, key: impl Into<char>) {
        self.client.perform_actions(press(key.into())).await.expect("a key");
        self.client.release_actions().await.expect("a release");
    }

    async fn focus(&self, css: &str) {
        self.find(css).await;
        self.script(&format!("document.querySelector({css:?}).focus()")).await;
    }

    async fn take_the_stepper(&self) {
        self.take_the_wheel().await;
        self.choose_drive("motion", 2).await;
    }

    /// Sends a signal to the studio.
    fn signal(&self, name: &str) {
        let sent = std::process::Command::new("kill").args([name, &self.studio.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()), "{name}");
    }

    fn stepper(&self, what: &str, wanted: impl Fn(&Value) -> bool) {
        self.studio.wait(what, |state| wanted(&state["nodes"][STEPPER]));
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_studio_that_freezes_or_dies_is_said_to_and_so_is_a_stop_that_nobody_confirms() {
    let stage = Stage::open("frozen").await;
    stage.take_the_stepper().await;
    stage.says("#guarding .bad", "Node 2: if the studio dies, nothing stops it").await;
    stage.click("#go-turn").await;
    stage.find("#guarding button:focus").await;
    stage.shoot("guarding").await;
    stage.stepper("a stepper that is not even enabled", |node| node["drive"]["state"] == "Switch on disabled");
    stage.click("#guarding button").await;
    stage.find("#guarding:not(:has(button))").await;
    stage.click("#go-turn").await;
    stage.stepper("a stepper that turns", |node| speed(node) > 50.0);
    stage.says(".motion .status", "in motion by this studio").await;
    // The host confirms a stop, and no notice is shown.
    stage.key(Key::Escape).await;
    stage.stepper("a stepper that rests", |node| speed(node) < 2.0);
    stage.find("#stop-notice[hidden]").await;
    stage.stepper("only a turning drive is reported as moving", |node| !node["moving"].as_bool().unwrap_or(true));
    stage.click("#go-turn").await;
    stage.stepper("a stepper that turns", |node| speed(node) > 50.0);
    stage.signal("-STOP");
    let shown = stage.says("#banner:not([hidden])", "no longer knows what moves").await;
    assert!(shown.contains("Nothing stops node 2 if the studio is dead: use the emergency stop"), "{shown}");
    assert!(!shown.contains("is stopped"), "{shown}");
    stage.find("body.unseen .motion fieldset[disabled]").await;
    assert!(!stage.says("#control", "is stale").await.contains("You have control"));
    assert!(!stage.says(".motion .status", "Unknown").await.contains("in motion"));
    let opacity = stage.script("return Number(getComputedStyle(document.querySelector('#view')).opacity)").await;
    assert!(opacity.as_f64().is_some_and(|opacity| opacity < 0.6), "values are grey: {opacity}");
    stage.key(Key::Escape).await;
    stage.says("#stop-notice.unconfirmed", "STOP WAS NOT CONFIRMED: use the emergency stop").await;
    let wide = stage.script("const of = document.querySelector('#stop-notice').getBoundingClientRect(); return of.width / document.documentElement.clientWidth").await;
    assert!(wide.as_f64().is_some_and(|part| part > 0.99), "over the whole width: {wide}");
    stage.shoot("frozen").await;
    stage.device(375, 667).await;
    stage.shoot("frozen_375").await;
    stage.device(1280, 900).await;
    // It continues: the hold ended long ago, and the page sees again.
    stage.signal("-CONT");
    stage.find("body:not(.unseen)").await;
    stage.stepper("a stepper that rests", |node| speed(node) < 2.0);
    stage.signal("-KILL");
    stage.says("#banner:not([hidden])", "No connection to the studio").await;
    stage.find("body.unseen").await;
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_speed_limit_and_keys_that_are_off_are_kept_by_the_browser() {
    let stage = Stage::open("limits").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.find("#speed-limit").await.send_keys("30").await.expect("typed");
    stage.key(Key::Enter).await;
    stage.says(".motion [role=status].quiet", "refuses every motion of this page that is faster").await;
    stage.click("#what").await;
    stage.click_for("#character-keys", "#character-keys[aria-pressed=false]").await;
    stage.client.refresh().await.expect("loaded anew");
    stage.take_the_wheel().await;
    // A session of its own, which has been given the limit before it had control.
    stage.studio.wait("a limit", |state| state["speed_limit_rpm"] == 30.0);
    stage.click("#go-turn").await;
    stage.says("#news", "speed limit of this session, 30 r/min").await;
    stage.wheel("no power", |wheel| wheel["drive"]["state"] == "Switch on disabled");
    for key in ['1', '?', 'd'] {
        stage.key(key).await;
    }
    assert_eq!(stage.script("return location.hash + document.querySelector('#help').hidden").await, "#motiontrue");
    stage.click("#enable").await;
    stage.wheel("power", |wheel| wheel["drive"]["state"] == "Operation enabled");
    stage.key('d').await;
    stage.key(' ').await;
    stage.wheel("no power", |wheel| wheel["drive"]["state"] != "Operation enabled");
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn an_old_tab_says_what_to_do_after_a_restart_and_goes_on_where_the_token_was_kept() {
    let mut stage = Stage::open("restart").await;
    let address = stage.studio.address.clone();
    stage.signal("-KILL");
    stage.says("#banner:not([hidden])", "No connection to the studio. Trying again").await;
    let token = stage.profile.join("token");
    let kept = ["--token-file", token.to_str().expect("a path")];
    stage.studio = Studio::start_at(&address, &[], &kept);
    let shown = stage.says("#banner:not([hidden])", "does not admit this page: open the address").await;
    assert!(!shown.contains("Trying again"), "{shown}");
    stage.shoot("restart").await;
    // The address that it printed, in the same browser; and once more, where nothing has to be done.
    stage.load().await;
    stage.find("#take").await;
    stage.signal("-KILL");
    stage.says("#banner:not([hidden])", "No connection to the studio").await;
    stage.studio = Studio::start_at(&address, &[], &kept);
    stage.find("body:not(.unseen) #take").await;
    stage.find("#banner[hidden]").await;
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn esc_and_space_stop_with_any_list_open() {
    let stage = Stage::open("lists").await;
    stage.take_the_wheel().await;
    assert_eq!(stage.script("return document.querySelectorAll('select').length").await, 0);
    let lists = [
        ("scope", "#scope-window"),
        ("scope", "#trigger-mode"),
        ("scope", "#scope-object"),
        ("motion", "#base-left"),
        ("world", ".world-form .choice"),
    ];
    for (at, (view, list)) in lists.into_iter().enumerate() {
        stage.click("#tabs [data-name=motion]").await;
        stage.turn().await;
        stage.click(&format!("#tabs [data-name={view}]")).await;
        if view == "motion" {
            stage.click("#group summary").await;
        }
        stage.click_for(&format!("{list} > button"), &format!("{list} > ul:not([hidden])")).await;
        if at == 0 {
            stage.shoot("choice").await;
        }
        stage.key(if at % 2 == 0 { char::from(Key::Escape) } else { ' ' }).await;
        stage.rests();
        stage.wheel("a quick stop", |wheel| wheel["drive"]["state"] != "Operation enabled");
        stage.find(&format!("{list} > ul[hidden]")).await;
    }
    assert_eq!(stage.script("return document.querySelectorAll('select, input[type=checkbox]').length").await, 0);
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn by_the_keyboard_everything_is_chosen_and_nothing_moves_by_enter_or_a_letter() {
    let stage = Stage::open("keyboard").await;
    stage.take_the_wheel().await;
    let rests = |stage: &Stage| stage.wheel("no power", |wheel| wheel["drive"]["state"] == "Switch on disabled");
    stage.says("#go-turn", "Enable and turn").await;
    for field in ["#velocity-rpm", "#velocity-ramp", "#move-degrees", "#torque-amperes", "#jog-speed", "#group-rpm"] {
        if field == "#group-rpm" {
            stage.click("#group summary").await;
        }
        stage.focus(field).await;
        stage.key(Key::Enter).await;
    }
    stage.script("document.activeElement.blur()").await;
    for letter in ('a'..='z').filter(|letter| *letter != 'p') {
        stage.key(letter).await;
    }
    // A notice meanwhile would be seen: states come every 50 ms.
    tokio::time::sleep(Duration::from_millis(500)).await;
    rests(&stage);
    let answered = stage.studio.state();
    assert!(answered["nodes"].as_array().expect("nodes").iter().all(|node| node["moving"] == false), "{answered}");
    for (view, toggle) in [
        ("motion", "#move-relative"),
        ("parameters", "#parameters-changed"),
        ("trace", "#trace-quiet"),
        ("faults", "#faults-only"),
    ] {
        stage.click(&format!("#tabs [data-name={view}]")).await;
        let before = stage.find(toggle).await.attr("aria-pressed").await.expect("it answers").expect("it has it");
        stage.focus(toggle).await;
        stage.key(Key::Enter).await;
        stage.find(&format!("{toggle}[aria-pressed={}]", before != "true")).await;
    }
    stage.click("#tabs [data-name=scope]").await;
    stage.focus("#scope-window > button").await;
    for key in [Key::Down, Key::Down, Key::Enter] {
        stage.key(key).await;
    }
    stage.says("#scope-window > button", "30 s").await;
    rests(&stage);
    stage.click("#tabs [data-name=motion]").await;
    stage.focus("#velocity-rpm").await;
    stage
        .find("#velocity-rpm")
        .await
        .send_keys(&(Key::Control + &char::from(Key::Enter).to_string()))
        .await
        .expect("keys");
    stage.turns();
    stage.says("#go-turn", "Turn").await;
    stage.key(Key::Escape).await;
    stage.rests();
    stage.close().await;
}

/// Where the newest piece of news stands, wherever the page is scrolled to; and the stop, in a page that is scrolled to its end.
const SEEN: &str = "const isSeen = () => { const of = document.querySelector('#news').getBoundingClientRect(); \
      return of.top >= 0 && of.bottom <= visualViewport.height && of.height > 12 && Boolean(document.elementFromPoint(of.left + 20, of.top + 12)?.closest('#news li')) }; \
    scrollTo(0, 0); const above = isSeen(); \
    scrollTo(0, document.body.scrollHeight); \
    const of = document.querySelector('#stop').getBoundingClientRect(), view = visualViewport; \
    const top = document.elementFromPoint((of.left + of.right) / 2, (of.top + of.bottom) / 2)?.id; \
    const bus = document.querySelector('#bus-line'); \
    const bar = document.querySelector('header'); \
    const stays = Math.max(...[bar, document.querySelector('#tabs')].filter((one) => getComputedStyle(one).position === 'sticky').map((one) => one.getBoundingClientRect().height)); \
    return { news: above && isSeen(), left: of.left, top: of.top, right: of.right - view.width, bottom: of.bottom - view.height, \
             scale: view.scale, wide: document.documentElement.scrollWidth - innerWidth, id: top, \
             cut: bus.scrollWidth - bus.clientWidth, stays: stays / view.height, text: bus.textContent }";

/// It is in the window with nothing over it, all of the bus line is shown, and the header leaves the room to the view.
fn is_right(seen: &Value) -> bool {
    let number = |name: &str| seen[name].as_f64().unwrap_or(f64::NAN);
    let is_inside = number("left") >= 0.0 && number("top") >= 0.0 && number("right") <= 0.0 && number("bottom") <= 0.0;
    let fits = number("wide") <= 0.0 && (number("scale") - 1.0).abs() < 1e-6 && number("cut") <= 0.0;
    let says_load = seen["text"].as_str().is_some_and(|text| text.contains("load "));
    is_inside && fits && says_load && seen["news"] == true && seen["id"] == "stop" && number("stays") < 0.17
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn stop_is_on_the_screen_in_every_view_at_every_width() {
    let stage = Stage::open("widths").await;
    stage.take_the_wheel().await;
    // A refusal, which is news: no drive here is so fast.
    stage.fill("#velocity-rpm", "1e9").await;
    stage.click_for("#go-turn", "#news li.bad").await;
    for view in VIEWS {
        stage.script(&format!("document.querySelector('#tabs [data-name={view}]').click()")).await;
        stage.find(&format!("#tabs [data-name={view}][aria-current=page]")).await;
        let open = "for (const css of ['#group', '#homing', '.parameters details.group']) { \
                    const of = document.querySelector(css); if (of) of.open = true }";
        stage.script(open).await;
        // What is fetched for it has come, and is drawn.
        tokio::time::sleep(Duration::from_millis(400)).await;
        for (width, height) in [(320, 568), (375, 667), (667, 375), (820, 1180), (1366, 768)] {
            stage.device(width, height).await;
            stage.script(open).await;
            // It is drawn at this width, with what was opened.
            tokio::time::sleep(Duration::from_millis(50)).await;
            // The watchdog's: where the machine is busy, the page draws later.
            let until = Instant::now() + PATIENCE;
            loop {
                let seen = stage.script(SEEN).await;
                if is_right(&seen) {
                    break;
                }
                // The watchdog's clock.
                assert!(Instant::now() < until, "{view} at {width}: {seen}");
                // Looked at again and again.
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
            if width != 667 {
                stage.shoot(&format!("{view}_{width}")).await;
            }
        }
    }
    stage.close().await;
}

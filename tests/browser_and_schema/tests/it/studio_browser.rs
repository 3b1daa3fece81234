//! The page of the studio in a real browser: Chromium, moved by its WebDriver.
//!
//! `cargo xtask test --only studio` installs both where it can, and runs this. A screenshot of each view is left in
//! `target/studio` to be looked at.

mod axe;
mod fast_capture;
mod figures;
mod group;
mod help;
mod homing;
mod measuring;
mod pdo;
mod safety;
mod scope;
mod sending;
mod tour;
mod turning;
mod watch;
mod world;

use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use fantoccini::actions::{InputSource, KeyAction, KeyActions, MOUSE_BUTTON_LEFT, MouseActions, PointerAction};
use fantoccini::elements::Element;
use fantoccini::error::{CmdError, ErrorStatus};
use fantoccini::key::Key;
use fantoccini::{Client, ClientBuilder, Locator};
use processes::studio::Studio;
use processes::{PATIENCE, Simulator};
use serde_json::{Value, json};

const WHEEL: usize = 2;

/// What a click has not brought by then, another one may.
const RETRY: std::time::Duration = std::time::Duration::from_secs(5);

/// A studio with a browser before it; both end with this.
struct Stage {
    studio: Studio,
    driver: Child,
    /// Host and port of the driver.
    driver_address: String,
    client: Client,
    profile: processes::Scratch,
}

/// The page has drawn the element anew since it was found.
fn is_replaced(error: &CmdError) -> bool {
    matches!(error, CmdError::Standard(error) if error.error == ErrorStatus::StaleElementReference)
}

impl Stage {
    async fn open(name: &str) -> Self {
        Self::open_on(name, &[]).await
    }

    /// The same on a bus that `arguments` name.
    async fn open_on(name: &str, arguments: &[&str]) -> Self {
        let studio = Studio::start(arguments);
        studio.scanned();
        let mut driver = Command::new("chromedriver");
        // With its browser a group of processes, which ends as one.
        driver.process_group(0);
        let mut driver =
            driver.arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("chromedriver is there");
        let mut said = BufReader::new(driver.stdout.take().expect("piped")).lines();
        let port = said.find_map(|line| {
            let line = line.expect("text");
            Some(line.split_once("successfully on port ")?.1.trim_end_matches('.').to_owned())
        });
        // It keeps printing, and its output need not be read.
        std::thread::spawn(move || said.for_each(drop));
        let profile = processes::scratch(&format!("studio_{name}"));
        let arguments = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--window-size=1280,900",
            &format!("--user-data-dir={}", profile.display()),
        ];
        let mut capabilities = serde_json::Map::new();
        let keeping = json!({ "download.default_directory": &*profile, "download.prompt_for_download": false });
        capabilities.insert("goog:chromeOptions".into(), json!({ "args": arguments, "prefs": keeping }));
        // The watchdog's, in ms: for the pages and scripts of a busy machine.
        let patience = PATIENCE.as_millis() as u64;
        capabilities.insert("timeouts".into(), json!({ "script": patience, "pageLoad": patience }));
        let driver_address = format!("127.0.0.1:{}", port.expect("it says its port"));
        let client = ClientBuilder::new(hyper_util::client::legacy::connect::HttpConnector::new())
            .capabilities(capabilities)
            .connect(&format!("http://{driver_address}"))
            .await
            .expect("a browser starts");
        let stage = Self { studio, driver, driver_address, client, profile };
        stage.load().await;
        stage
    }

    async fn load(&self) {
        let url = format!("http://{}/?token={}", self.studio.address, self.studio.token);
        self.client.goto(&url).await.expect("the page loads");
        self.find("#view table tbody tr:nth-child(3)").await;
    }

    async fn find(&self, css: &str) -> Element {
        self.client
            .wait()
            // The watchdog's.
            .at_most(PATIENCE)
            .for_element(Locator::Css(css))
            .await
            .unwrap_or_else(|error| panic!("{css}: {error}"))
    }

    /// The state that the page shows is current: while it is stale, as on a busy machine, it sends nothing but a stop.
    async fn sees(&self) {
        self.find("body:not(.unseen)").await;
    }

    /// Clicks. What the page draws anew between finding and clicking it is looked for again.
    async fn click(&self, css: &str) {
        self.sees().await;
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        loop {
            // The watchdog's clock: a page that hangs ends the test.
            let is_late = std::time::Instant::now() >= until;
            match self.find(css).await.click().await {
                Ok(()) => return,
                Err(error) if is_replaced(&error) && !is_late => {}
                // Below the header or the news, which stay where they are.
                Err(CmdError::Standard(error)) if error.error == ErrorStatus::ElementClickIntercepted && !is_late => {
                    let scroll = "document.querySelector(arguments[0])?.scrollIntoView({ block: 'center' })";
                    self.client.execute(scroll, vec![css.into()]).await.expect("it scrolls");
                }
                Err(error) => panic!("{css}: {error}"),
            }
        }
    }

    /// Clicks until it has an effect: an element that the page moves between finding and clicking is missed, as by a person.
    async fn click_for(&self, css: &str, wanted: &str) {
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        loop {
            self.click(css).await;
            let found = self.client.wait().at_most(RETRY).for_element(Locator::Css(wanted)).await;
            match found {
                Ok(_) => return,
                // The watchdog's.
                Err(error) => assert!(std::time::Instant::now() < until, "{wanted} after {css}: {error}"),
            }
        }
    }

    /// Gives an element the focus, and presses a key on it.
    async fn press_on(&self, css: &str, key: char) {
        self.find(css).await;
        let focus = "const on = document.querySelector(arguments[0]); on.focus(); return document.activeElement === on";
        let has_it = self.client.execute(focus, vec![css.into()]).await.expect("it runs");
        assert_eq!(has_it, true, "{css} takes the focus");
        self.client.perform_actions(press(key)).await.expect("a key");
        self.client.release_actions().await.expect("a release");
    }

    /// Takes control and shows what moves the wheel.
    async fn take_the_wheel(&self) {
        self.click("#take").await;
        self.find("#release").await;
        self.click("#tabs [data-name=motion]").await;
        self.choose_drive("motion", 3).await;
        self.find(".motion fieldset:not([disabled])").await;
    }

    /// Chooses a drive in a view, by its place.
    async fn choose_drive(&self, view: &str, place: usize) {
        let button = format!(".{view} .chooser[aria-label=Drive] button:nth-child({place})");
        self.click_for(&button, &format!("{button}[aria-pressed=true]")).await;
    }

    /// Chooses from a list of the page.
    async fn choose(&self, css: &str, value: &str) {
        self.click_for(&format!("{css} > button"), &format!("{css} > ul:not([hidden])")).await;
        self.click(&format!("{css} li[data-value='{value}']")).await;
        self.find(&format!("{css} > ul[hidden]")).await;
    }

    /// Waits until an element says this, and gives all that it says.
    async fn says(&self, css: &str, part: &str) -> String {
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        loop {
            let text = match self.find(css).await.text().await {
                Err(error) if is_replaced(&error) => continue,
                text => text.unwrap_or_else(|error| panic!("{css}: {error}")),
            };
            if text.contains(part) {
                return text;
            }
            // The watchdog's.
            assert!(std::time::Instant::now() < until, "{css} says {text:?}, not {part:?}");
            // Looked at again and again.
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
    }

    fn wheel(&self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        self.studio.wait(what, |state| wanted(&state["nodes"][WHEEL]))
    }

    fn turns(&self) {
        self.wheel("a wheel that turns", |wheel| speed(wheel) > 50.0);
    }

    fn rests(&self) {
        self.wheel("a wheel that rests", |wheel| speed(wheel) < 2.0);
    }

    async fn shoot(&self, name: &str) {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("../studio");
        std::fs::create_dir_all(&folder).expect("a folder");
        let picture = self.client.screenshot().await.expect("a picture");
        assert!(picture.starts_with(b"\x89PNG"), "{name}");
        std::fs::write(folder.join(format!("{name}.png")), picture).expect("it is written");
    }

    /// Waits for a line of the trace.
    async fn line(&self, text: &str) {
        let path = format!("//*[contains(@class, 'trace-row') and contains(., '{text}')]");
        self.client
            .wait()
            // The watchdog's.
            .at_most(PATIENCE)
            .for_element(Locator::XPath(&path))
            .await
            .unwrap_or_else(|error| panic!("{text}: {error}"));
    }

    /// Waits until something is so.
    async fn until(&self, what: &str, is_so: impl AsyncFn() -> bool) {
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        while !is_so().await {
            // The watchdog's.
            assert!(std::time::Instant::now() < until, "waited for {what}");
            // Looked at again and again.
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
    }

    /// Waits for a file that the browser saves; it has another name until it is whole.
    async fn saved(&self, name: &str) -> PathBuf {
        let file = self.profile.join(name);
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        while !file.exists() {
            // The watchdog's.
            assert!(std::time::Instant::now() < until, "no file is saved");
            // Looked at again and again.
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
        file
    }

    async fn close(self) {
        // The window may be gone already.
        let _ = self.client.clone().close().await;
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        // A browser does not end with the driver that is killed.
        let _ = Command::new("kill").args(["-KILL", "--", &format!("-{}", self.driver.id())]).status();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn speed(wheel: &Value) -> f64 {
    wheel["drive"]["velocity_rpm"].as_f64().expect("a speed").abs()
}

fn press(key: char) -> KeyActions {
    KeyActions::new("keys".into()).then(KeyAction::Down { value: key })
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_drive_is_found_enabled_moved_and_stopped() {
    let stage = Stage::open("moved").await;
    stage.shoot("bus").await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.click("#enable").await;
    stage.wheel("an enabled drive", |wheel| wheel["drive"]["state"] == "Operation enabled");
    stage.click("#go-move").await;
    let angle = |wheel: &Value| wheel["drive"]["angle_degrees"].as_f64().expect("an angle");
    stage.wheel("a quarter of a turn", |wheel| (angle(wheel) - 90.0).abs() < 2.0);
    stage.turn().await;
    stage.shoot("motion").await;
    stage.client.perform_actions(press(' ')).await.expect("a key");
    stage.rests();
    stage.wheel("a quick stop", |wheel| wheel["drive"]["state"] != "Operation enabled");
    a_sequence_is_played_and_runs_as_a_scenario(&stage).await;
    stage.click("#tabs [data-name=drive]").await;
    stage.click_for("#why:not([disabled])", ".findings details.cause").await;
    stage.shoot("drive").await;
    stage.click("#theme").await;
    stage.shoot("drive_other_theme").await;
    stage.close().await;
}

/// What was recorded moves the wheel again until Stop, and the scenario made of it runs on the command line.
async fn a_sequence_is_played_and_runs_as_a_scenario(stage: &Stage) {
    stage.click("#sequence-record").await;
    stage.says(".sequence li:nth-child(2)", "node 4: Move by 90°").await;
    stage.says("#sequence-text", "ferrodrive velocity 4 60rpm --no-wait").await;
    stage.choose("#sequence-form", "python").await;
    stage.says("#sequence-text", "node_4.move(90, relative=True, wait=False)").await;
    stage.choose("#sequence-form", "scenario").await;
    stage.click("#sequence-save").await;
    let scenario = stage.saved("sequence.toml").await;
    let ran = processes::ferrodrive(&["run", &scenario.to_string_lossy(), "--json"]);
    assert_eq!(ran.status, Some(0), "{} {}", ran.out, ran.err);
    stage.play().await;
    stage.client.perform_actions(press(Key::Escape.into())).await.expect("a press");
    stage.client.release_actions().await.expect("a release");
    stage.rests();
    // The last command is sent by then: all were, or Stop was sooner.
    stage.find("#sequence-play[aria-pressed=false]").await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_jog_ends_with_the_button_the_key_and_the_tab() {
    let stage = Stage::open("jogged").await;
    stage.take_the_wheel().await;
    let button = stage.find("button.jog:last-child").await;
    let down = MouseActions::new("mouse".into())
        .then(PointerAction::MoveToElement { element: button, duration: None, x: 0.0, y: 0.0 })
        .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT });
    stage.jog(async || stage.client.perform_actions(down.clone()).await.expect("a press")).await;
    stage.client.release_actions().await.expect("a release");
    stage.rests();
    stage.wheel("a ramp, not a quick stop", |wheel| wheel["drive"]["state"] == "Operation enabled");
    stage.jog(async || stage.client.perform_actions(press(Key::Right.into())).await.expect("a press")).await;
    stage.client.release_actions().await.expect("a release");
    stage.rests();
    stage.jog(async || stage.client.perform_actions(down.clone()).await.expect("a press")).await;
    stage.client.close_window().await.expect("it closes");
    stage.rests();
    stage.wheel("a quick stop", |wheel| wheel["drive"]["state"] != "Operation enabled");
    stage.studio.wait("no session in control", |state| state["controller"].is_null());
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_trace_says_what_passes_and_a_filter_hides_the_rest() {
    let stage = Stage::open("trace").await;
    stage.take_the_wheel().await;
    stage.click("#go-move").await;
    let angle = |wheel: &Value| wheel["drive"]["angle_degrees"].as_f64().expect("an angle");
    stage.wheel("a quarter of a turn", |wheel| (angle(wheel) - 90.0).abs() < 2.0);
    stage.click("#tabs [data-name=trace]").await;
    // What the studio itself reads is hidden until it is asked for.
    stage.line("SDO node 4: wrote 6040h:00 controlword = ").await;
    let readings = "return [...document.querySelectorAll('.trace-row')].filter((row) => row.textContent.includes(': read ')).length";
    assert_eq!(stage.client.execute(readings, vec![]).await.expect("it runs"), 0);
    stage.shoot("trace").await;
    stage.find("#trace-nodes").await.send_keys("4").await.expect("typed");
    stage.find("#trace-text").await.send_keys("target_position").await.expect("typed");
    // 90 degrees of 4096 counts a turn (ZLAC8030L).
    stage.line("SDO node 4: wrote 607Ah:00 target_position = 1024").await;
    // The list stands still while it is read.
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=true]").await;
    let words = stage.client.find_all(Locator::Css(".trace-list .trace-row")).await.expect("lines");
    assert!(!words.is_empty());
    for line in words {
        let text = line.text().await.expect("text");
        assert!(text.contains("target_position") && text.contains("node 4"), "the filter let through: {text}");
    }
    stage.click("#theme").await;
    stage.shoot("trace_filtered_other_theme").await;
    stage.click("#trace-save-log").await;
    let saved = stage.saved("trace.log").await;
    let decoded =
        processes::ferrodrive(&["--bus", &format!("log:{}", saved.display()), "--model", "4=zlac8030l", "dump"]);
    assert_eq!(decoded.status, Some(0), "{}", decoded.err);
    assert!(decoded.out.contains("write 607Ah:00 target_position = 1024"), "{}", decoded.out);
    assert!(!decoded.out.contains("node 2"), "of node 4 alone");
    other_forms_hold_the_same(&stage, &saved).await;
    identifiers_and_the_cursor(&stage).await;
    stage.close().await;
}

/// Wireshark's form, read by the command line, has at least the frames that candump's had some time before.
async fn other_forms_hold_the_same(stage: &Stage, candump: &std::path::Path) {
    stage.click("#trace-save-pcapng").await;
    let packed = stage.saved("trace.pcapng").await;
    let decode = |file: &std::path::Path| {
        let bus = format!("log:{}", file.display());
        let decoded = processes::ferrodrive(&["--bus", &bus, "--model", "4=zlac8030l", "--json", "dump"]);
        assert_eq!(decoded.status, Some(0), "{}", decoded.err);
        let line = |line: &str| serde_json::from_str::<Value>(line).expect("JSON")["frame"].clone();
        decoded.out.lines().map(line).filter(|frame| frame.is_string()).collect::<Vec<_>>()
    };
    let (earlier, later) = (decode(candump), decode(&packed));
    assert!(earlier.len() > 100 && later.starts_with(&earlier), "{} and {} frames", earlier.len(), later.len());
}

/// A line that is pressed is where the cursor of the scope stands, and back; by COB-ID the studio's readings show their period.
async fn identifiers_and_the_cursor(stage: &Stage) {
    stage.click(".trace-list .trace-row").await;
    stage.find(".trace-row.chosen-line").await;
    stage.choose("#trace-delta", "chosen").await;
    stage.says(".trace-row.chosen-line span", "0.000000").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.says(".readout", "A at ").await;
    stage.click("#tabs [data-name=trace]").await;
    stage.click("#trace-cursor").await;
    stage.find(".trace-row.chosen-line").await;
    for field in ["#trace-nodes", "#trace-text"] {
        stage.client.execute("const field = document.querySelector(arguments[0]); field.value = ''; field.dispatchEvent(new Event('input'))", vec![field.into()]).await.expect("cleared");
    }
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=false]").await;
    stage.click("#trace-quiet").await;
    stage.click("#trace-by-id").await;
    stage.find(".identifiers tr[data-id='604']").await;
    // The studio asks each of three drives for some values nine times a second: several requests in each 113 ms.
    let period = "const cells = document.querySelectorAll(\".identifiers tr[data-id='604'] td\"); return [Number(cells[3].textContent), Number(cells[4].textContent)]";
    stage
        .until("a period of the requests", async || {
            let read = stage.client.execute(period, vec![]).await.expect("it runs");
            let (count, period_ms) = (read[0].as_f64().unwrap_or(0.0), read[1].as_f64().unwrap_or(0.0));
            count > 50.0 && period_ms > 1.0 && period_ms < 113.0
        })
        .await;
    stage.shoot("trace_by_id").await;
    stage.click("#send summary").await;
    stage.click("#send .send").await;
    stage.says("#send-status", "604#4041600000000000 sent; sent: SDO node 4: read 6041h:00").await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_trace_draws_what_is_in_view_and_fetches_what_is_older() {
    let stage = Stage::open("trace_scrolled").await;
    let kept = |script: &'static str| async {
        // A list that is not full is as tall as its view, which is not a whole number of lines.
        stage.client.execute(script, vec![]).await.expect("it runs").as_f64().expect("a number") as u64
    };
    const FIRST: &str = "return Number(document.querySelector('.trace-list .trace-row').dataset.number)";
    const DRAWN: &str = "return document.querySelectorAll('.trace-list .trace-row').length";
    const TALL: &str = "return document.querySelector('.trace-list').scrollHeight / 24";
    stage.click("#tabs [data-name=trace]").await;
    stage.click("#trace-quiet").await;
    stage.click("#trace-transfers").await;
    stage.until("lines that do not fit into the view", async || kept(TALL).await > 500).await;
    assert!(kept(DRAWN).await < 60, "only what is in view is drawn");
    let newest = kept(FIRST).await;
    stage.until("new lines, of which the newest are in view", async || kept(FIRST).await > newest).await;
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=true]").await;
    // Each time it comes to the top there is more above, until the first frame of all.
    let up = "const list = document.querySelector('.trace-list'); list.scrollTop = 0; \
              return Number(document.querySelector('.trace-list .trace-row').dataset.number)";
    stage.until("the first frame of all", async || kept(up).await == 0).await;
    assert!(kept(DRAWN).await < 60, "only what is in view is drawn");
    stage.close().await;
}

/// ZLAC8030L quick start guide V1.00, chapters 8 and 9: 0001h is over-voltage.
#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_fault_is_shown_with_its_remedy_and_the_frames_around() {
    let drives = ["zlac8030l@4", "m4230e17b50@1", "zlim42c@2"].map(|drive| ["--drive", drive]).concat();
    let mut simulator = Simulator::start(&[&drives[..], &["--serve", "socketcand://127.0.0.1:0"]].concat());
    let bus = simulator.bus("socketcand");
    let stage = Stage::open_on("faults", &["--bus", &bus, "--model", "4=zlac8030l", "--model", "2=zlim42c"]).await;
    let ok = simulator.ask("4 supply 80");
    assert_eq!(ok["ok"], true, "{ok}");
    stage.wheel("a fault", |wheel| wheel["drive"]["fault_code"] == 1);
    // The page is opened anew: what happened before is there.
    stage.load().await;
    stage.click("#tabs [data-name=faults]").await;
    stage.click(".happening.emcy.lasts").await;
    stage.says("#remedy", "bleeder resistor").await;
    stage.says("#fault-source", "ZLAC8030L quick start guide V1.00, chapters 8 and 9").await;
    stage.says(".around .marked", "EMCY node 4: 0001h (over-voltage)").await;
    stage.shoot("faults").await;
    stage.click(".around a").await;
    let saved = stage.saved("node4_fault.log").await;
    let saved = std::fs::read_to_string(saved).expect("text");
    assert!(saved.contains(" 084#0100") && saved.lines().count() > 3, "{saved}");
    stage.click(".happening.emcy").await;
    // Above stands what came next: the keys go through the list.
    stage.client.perform_actions(press(Key::Up.into())).await.expect("a key");
    stage.client.release_actions().await.expect("a release");
    stage.find(".happening.emcy:not([aria-pressed=true])").await;
    stage.find(".happening:not(.emcy)[aria-pressed=true]:focus").await;
    stage.says("#concerns", "1 drive with a fault").await;
    stage.click("#tabs [data-name=bus]").await;
    stage.find("#bus-filter").await.send_keys("over-voltage").await.expect("typed");
    stage
        .until("the drive with the fault alone", async || {
            let listed = stage.client.find_all(Locator::Css(".bus tbody tr")).await.expect("rows");
            listed.len() == 1
        })
        .await;
    stage.says("#bus-summary", "3 nodes · 3 drives · 0 enabled · 1 drive with a fault").await;
    simulator.ask("4 supply 48");
    stage.click("#take").await;
    stage.find("#release").await;
    stage.click("#concerns").await;
    // The remedy of a fault has its button.
    stage.click(".happening.emcy.lasts").await;
    stage.click(".fault-detail [data-does=reset_fault]").await;
    stage.wheel("no fault", |wheel| wheel["drive"]["fault_code"] == 0);
    stage.find("#concerns[hidden]").await;
    stage.find(".happening.emcy:not(.lasts)").await;
    stage.click("#theme").await;
    stage.shoot("faults_other_theme").await;
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_parameter_is_found_changed_and_rolled_back() {
    let stage = Stage::open("parameters").await;
    stage.take_the_wheel().await;
    stage.click("#tabs [data-name=parameters]").await;
    stage.click(".parameters details.group:nth-of-type(1) summary").await;
    stage.find(".parameters details[open] tbody tr:nth-child(2)").await;
    stage.shoot("parameters").await;
    // A space in a text field is one, as long as nothing moves.
    stage.find("#parameters-search").await.send_keys("2008 speed").await.expect("typed");
    let row = ".parameters tr[data-object='2008h:00']";
    // ZLAC8030L quick start guide V1.00, chapter 9: 1 r/min as delivered, 1 to 300.
    stage.says(row, "1 r/min").await;
    stage.click(row).await;
    stage.find("#parameter-value").await.send_keys("500").await.expect("typed");
    stage.click("#parameter-write").await;
    stage.says("#parameter-notice", "1 to 300").await;
    let field = stage.find("#parameter-value").await;
    field.clear().await.expect("cleared");
    field.send_keys("60rpm").await.expect("typed");
    stage.click("#parameter-write").await;
    stage.says("#parameter-notice", "Written and read back").await;
    stage.says(row, "60 r/min").await;
    stage.find(".parameters tr.changed[data-object='2008h:00']").await;
    stage.says(".parameters tr.chosen", "3C 00").await;
    stage.click("#theme").await;
    stage.shoot("parameters_other_theme").await;
    stage.click("#parameters-backup").await;
    let kept = std::fs::read_to_string(stage.saved("node4.toml").await).expect("text");
    assert!(kept.contains("\"2008:00\" = 60"), "{kept}");
    stage.click("#parameters-backup-dcf").await;
    let kept = stage.saved("node4.dcf").await;
    stage.click("#parameters-back").await;
    stage.says(row, "1 r/min").await;
    stage.find("#parameters-file").await.send_keys(&kept.to_string_lossy()).await.expect("chosen");
    stage.says("#parameters-notice", "node4.dcf").await;
    stage.says("#parameters-notice", "1 differ from the drive").await;
    let file = stage.profile.join("node4.toml");
    stage.find("#parameters-file").await.send_keys(&file.to_string_lossy()).await.expect("chosen");
    stage.says("#parameters-notice", "1 differ from the drive").await;
    stage.find(".parameters-diff tr.other").await;
    stage.click("#parameters-plan").await;
    stage.says("#parameters-notice", "1 write, in this order").await;
    stage.says(".parameters-diff", "60 r/min").await;
    stage.shoot("parameters_file").await;
    stage.click("#parameters-apply").await;
    stage.says("#parameters-notice", "1 write done and read back").await;
    stage.says(row, "60 r/min").await;
    stage.close().await;
}

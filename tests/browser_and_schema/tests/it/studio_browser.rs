//! The page of the studio in a real browser: Chromium, moved by its WebDriver.
//!
//! `cargo xtask test --only studio` installs both where it can, and runs this. A screenshot of each view is left in
//! `target/studio` to be looked at.

mod axe;
mod drives;
mod fast_capture;
mod faults;
mod figures;
mod first_visit;
mod group;
mod help;
mod homing;
mod measuring;
mod parameters;
mod pdo;
mod safety;
mod scope;
mod sending;
mod tour;
mod trace;
mod turning;
mod watch;
mod wizard;
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
use processes::PATIENCE;
use processes::studio::Studio;
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
        Self::open_with(name, arguments, 3).await
    }

    /// The same on a bus of so many drives.
    async fn open_with(name: &str, arguments: &[&str], drives: usize) -> Self {
        let studio = Studio::start(arguments);
        studio.found(drives);
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
    // Without control it is said why nothing can be commanded, with the button for it.
    stage.click("#tabs [data-name=motion]").await;
    stage.choose_drive("motion", 3).await;
    stage.says("#motion-why", "Nothing can be commanded here until this page has control").await;
    stage.find(".motion fieldset[disabled]").await;
    stage.click("#motion-take").await;
    stage.find("#motion-why[hidden]").await;
    stage.find(".motion fieldset:not([disabled])").await;
    // In turns a quarter is what 90 degrees are: the field has that, and the drive obeys it.
    stage.choose("#motion-unit-angle_degrees", "turns").await;
    stage.says("label[for=move-degrees]", "turns").await;
    assert_eq!(stage.script("return document.querySelector('#move-degrees').value").await, "0.25");
    stage.click("#sequence summary").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.click("#enable").await;
    stage.wheel("an enabled drive", |wheel| wheel["drive"]["state"] == "Operation enabled");
    stage.click("#go-move").await;
    let angle = |wheel: &Value| wheel["drive"]["angle_degrees"].as_f64().expect("an angle");
    stage.wheel("a quarter of a turn", |wheel| (angle(wheel) - 90.0).abs() < 2.0);
    let shown = async || stage.says(".motion .tile:first-child b", "0.").await.parse::<f64>().expect("a number");
    stage.until("the page shows it in turns", async || (shown().await - 0.25).abs() < 2.0 / 360.0).await;
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
    stage.says("#sequence-text", "ferrodrive velocity 4 60rpm --for ").await;
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

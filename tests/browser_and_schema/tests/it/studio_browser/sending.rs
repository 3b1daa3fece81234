//! What the page sends by itself, a sequence and frames in cycles, and what ends it.

use std::time::Duration;

use fantoccini::key::Key;

use super::{Stage, press, speed};

/// By script, while it plays: a press of a button that a late state has released would play again.
const RELEASE: &str = "const of = document.querySelector('#sequence-play'); if (of.checked) of.click()";
const HIDE: &str = "Object.defineProperty(document, 'hidden', { value: true, configurable: true }); \
                    document.dispatchEvent(new Event('visibilitychange')); delete document.hidden";

impl Stage {
    async fn escape(&self) {
        self.client.perform_actions(press(Key::Escape.into())).await.expect("a key");
        self.client.release_actions().await.expect("a release");
    }

    /// A press of stop by another program.
    fn stop_from_elsewhere(&self) {
        let (address, token) = (&self.studio.address, &self.studio.token);
        let headers = format!("Authorization: Bearer {token}\r\nOrigin: http://{address}\r\n");
        let answer = self.studio.ask("POST /api/stop", &headers);
        assert!(answer.starts_with("HTTP/1.1 2"), "{answer}");
    }

    /// Plays the sequence until the wheel turns; once more where a busy machine has ended it, by a state that came late.
    pub(super) async fn play(&self) {
        let press =
            "const of = document.querySelector('#sequence-play'), was = of.checked; if (!was) of.click(); return was";
        self.until("a play that turns the wheel", async || {
            self.script(press).await == true && speed(&self.studio.state()["nodes"][super::WHEEL]) > 50.0
        })
        .await;
    }

    /// Plays, ends the play by this, and waits for the wheel to stand; again where a state that came late has ended it before.
    async fn play_ends(&self, whys: &[&str], end: impl AsyncFn()) {
        loop {
            self.play().await;
            end().await;
            self.find("#sequence-play[aria-pressed=false]").await;
            let status = self.find("#sequence-status").await.text().await.expect("text");
            self.rests();
            if whys.iter().any(|why| status.contains(why)) {
                return;
            }
            assert!(status.contains("stale"), "{status}");
        }
    }

    fn is_enabled(&self) -> bool {
        self.studio.state()["nodes"][super::WHEEL]["drive"]["state"] == "Operation enabled"
    }

    /// How often the first frame was sent, as the send window says.
    async fn sent(&self) -> String {
        self.find("#send-status").await.text().await.expect("text")
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_play_that_ends_early_stops_what_it_moved() {
    let stage = Stage::open("played").await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    // What Stop ends is recorded with its stop.
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.turn().await;
    stage.escape().await;
    stage.rests();
    stage.click("#sequence-record").await;
    stage.says(".sequence li:nth-child(1)", "node 4: Turn at 60 r/min").await;
    stage.says(".sequence li:nth-child(2)", "node 4: Quick stop").await;
    assert!(stage.client.find(super::Locator::Css(".sequence li:nth-child(3)")).await.is_err(), "one stop");
    // A minute of motion, with a command every 50 ms: what is due behind a stop would turn the wheel again.
    let steps = "const step = (after_s, command) => ({ after_s, command }); \
                 const turn = { do: 'velocity', node: 4, rpm: 60, rpm_per_s: null }; \
                 const steps = [step(0, { do: 'enable', node: 4 }), ...Array.from({ length: 150 }, (_, at) => step(at ? 0.05 : 1, turn)), step(60, { do: 'stop', node: 4 })]; \
                 localStorage.setItem('sequence', JSON.stringify(steps))";
    stage.script(steps).await;
    stage.load().await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    stage.play_ends(&["ended by the button"], async || drop(stage.script(RELEASE).await)).await;
    assert!(stage.is_enabled(), "stopped by its ramp");
    stage.play_ends(&["ended: the page was hidden"], async || drop(stage.script(HIDE).await)).await;
    for stops in [true, false] {
        let stop = async || match stops {
            true => stage.escape().await,
            false => stage.stop_from_elsewhere(),
        };
        // The answer to the command that it ends may come before the news of the stop itself.
        stage.play_ends(&["ended by Stop", "stopped by a press of stop"], stop).await;
        // More than ten steps would have been due.
        tokio::time::sleep(Duration::from_millis(700)).await;
        let wheel = stage.studio.state()["nodes"][super::WHEEL].clone();
        assert!(speed(&wheel) < 2.0 && wheel["drive"]["state"] != "Operation enabled", "{wheel}");
    }
    stage.close().await;
}

/// A minute of a motion of two drives that the page holds: what ends the play ends that, and it is not held any more.
#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_play_that_ends_early_lets_go_of_what_it_held() {
    let stage = Stage::open("played_held").await;
    let steps = "const axes = [{ node: 1, rpm: 5 }, { node: 4, rpm: 60 }]; \
                 const steps = [{ after_s: 0, command: { do: 'group_jog', axes, rpm_per_s: 200 } }, { after_s: 60, command: { do: 'group_end' } }]; \
                 localStorage.setItem('sequence', JSON.stringify(steps))";
    stage.script(steps).await;
    stage.load().await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    stage.play_ends(&["ended by the button"], async || drop(stage.script(RELEASE).await)).await;
    stage.play_ends(&["ended: the page was hidden"], async || drop(stage.script(HIDE).await)).await;
    let stops = &["ended by Stop", "stopped by a press of stop"];
    stage.play_ends(stops, async || stage.escape().await).await;
    stage.play_ends(stops, async || stage.stop_from_elsewhere()).await;
    stage.studio.wait("the joint rests too", |state| speed(&state["nodes"][0]) < 1.0);
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_cyclic_frame_ends_with_its_button_and_with_a_stop_from_anywhere() {
    let stage = Stage::open("cyclic").await;
    stage.click("#take").await;
    stage.find("#release").await;
    stage.click("#tabs [data-name=trace]").await;
    stage.click("#send summary").await;
    let cyclic = "#send li button[aria-pressed]";
    for end in ["button", "stop", "elsewhere"] {
        // On, off and on again while the first one is on its way.
        let presses = format!("const of = document.querySelector({cyclic:?}); of.click(); of.click(); of.click()");
        stage.script(&presses).await;
        stage.says("#send-status", " times").await;
        match end {
            "button" => stage.click(cyclic).await,
            "stop" => stage.escape().await,
            _ => stage.stop_from_elsewhere(),
        }
        stage.find("#send li button[aria-pressed=false]").await;
        // One that was on its way is still counted, late on a busy machine.
        stage
            .until(&format!("nothing is sent any more: {end}"), async || {
                let before = stage.sent().await;
                // By the clock of the page, whose timers these are: five periods.
                tokio::time::sleep(Duration::from_millis(500)).await;
                stage.sent().await == before
            })
            .await;
    }
    stage.close().await;
}

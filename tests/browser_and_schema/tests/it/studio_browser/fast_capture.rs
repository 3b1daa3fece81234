//! Fast capture, test motion and report in a real browser: a button each, with everything put back.

use super::{Key, Stage, press};

impl Stage {
    /// Shows the form of a fast capture of the wheel.
    async fn fast_capture(&self) {
        self.click("#tabs [data-name=scope]").await;
        self.find("#fast-capture").await;
        self.client.execute("document.querySelector('#fast-capture').open = true", Vec::new()).await.expect("it opens");
        self.find("[data-quantity=target_velocity]").await;
    }

    async fn fill(&self, css: &str, text: &str) {
        let fill = "const of = document.querySelector(arguments[0]); of.value = arguments[1]; of.dispatchEvent(new Event('change'))";
        self.client.execute(fill, vec![css.into(), text.into()]).await.expect("it is filled in");
    }

    /// Clicks until this is said; again where the page of a busy machine has sent nothing, its state stale, or was silent for too long.
    async fn has_done(&self, css: &str, status: &str, part: &str) -> String {
        loop {
            self.click(css).await;
            let is_late = |said: &str| {
                said.contains("Nothing was sent")
                    || said.contains("the page that began it has gone")
                    || said.contains("it was stopped")
            };
            self.until(part, async || {
                let said = self.says(status, "").await;
                said.contains(part) || is_late(&said)
            })
            .await;
            let said = self.says(status, "").await;
            if said.contains(part) {
                return said;
            }
        }
    }

    /// What the first TPDO of the wheel carries, as the PDO view of a page that has just been loaded says.
    async fn tpdo(&self) -> String {
        self.load().await;
        self.click("#tabs [data-name=pdo]").await;
        self.choose_drive("pdo", 3).await;
        self.says("tr[data-pdo=TPDO1]", "184h").await
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_turning_wheel_is_captured_fast_and_reported() {
    let stage = Stage::open("fast").await;
    stage.take_the_wheel().await;
    stage.turn().await;
    stage.fast_capture().await;
    stage.choose("#fast-period", "5").await;
    stage.fill("#fast-time", "0.5").await;
    // The studio's own world says what is true beside what the drive says.
    stage.choose("#fast-true", "true_velocity_rpm").await;
    let said = stage.has_done("#fast-begin", "#fast-status", "The PDOs are as they were").await;
    assert!(said.contains(" rows in ") && said.contains("of the bus at most"), "{said}");
    let had = stage.says("#fast-had", "true_velocity_rpm").await;
    for part in ["velocity_rpm", "TPDO", "world", " ms", "Jitter"] {
        assert!(had.contains(part), "{part}: {had}");
    }
    // It is kept, and shown by itself.
    stage.says("#capture-status", "kept as ").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.find(".captures li").await;
    stage.shoot("fast_capture").await;
    // Its notes are there after a reload.
    stage.fill(".captures [data-notes]", "belt tight").await;
    stage.test_motion().await;
    stage.fast_report().await;
    assert!(stage.tpdo().await.contains("nothing is mapped into it"));
    stage.click("#tabs [data-name=scope]").await;
    let notes = "return document.querySelector('.captures [data-notes]')?.value ?? null";
    stage
        .until("notes over a reload", async || {
            stage.client.execute(notes, Vec::new()).await.expect("it runs").as_str() == Some("belt tight")
        })
        .await;
    stage.close().await;
}

impl Stage {
    /// Two runs of steps with their figures, laid over each other; then a motion that its Stop ends.
    async fn test_motion(&self) {
        self.client.perform_actions(press(Key::Escape.into())).await.expect("a press");
        self.client.release_actions().await.expect("a release");
        self.rests();
        self.client.execute("document.querySelector('#test-motion').open = true", Vec::new()).await.expect("it opens");
        self.fill("#test-count", "2").await;
        self.fill("#test-acceleration_rpm_s", "500").await;
        self.find("#test-start:not([disabled])").await;
        let said = self.has_done("#test-start", "#test-status", "The drive stands without power").await;
        assert!(said.contains("2 runs within 60 r/min, 500 r/min/s"), "{said}");
        let had = self.says("#test-had", "rise, 0 to 60 r/min").await;
        for part in ["settling, 60 to 0 r/min", "A r.m.s.", "steps 2"] {
            assert!(had.contains(part), "{part}: {had}");
        }
        self.find(".captures li:nth-child(3)").await;
        self.shoot("test_motion").await;
        self.fill("#test-count", "99").await;
        self.click_for("#test-start", "#test-stop:not([hidden])").await;
        let stop = "const of = document.querySelector('#test-stop'); if (!of.hidden) of.click()";
        self.until("a test motion that was stopped", async || {
            self.client.execute(stop, Vec::new()).await.expect("it runs");
            self.says("#test-status", "").await.contains("it was stopped")
        })
        .await;
        self.rests();
        // Everything was put back by then.
        self.find("#test-start:not([disabled])").await;
    }

    async fn fast_report(&self) {
        self.click("#tabs [data-name=drive]").await;
        // Not typed: while the wheel turns, Space is Stop.
        self.fill("#report-by", "A. Fitter").await;
        self.has_done("#report", "#report-status", "saved as node4.html").await;
        let page = std::fs::read_to_string(self.saved("node4.html").await).expect("text");
        for part in ["A. Fitter", "zlac8030l", "test motion steps, run 2", "<svg"] {
            assert!(page.contains(part), "{part} is in the report");
        }
        self.shoot("report_button").await;
        self.client.goto(&format!("file://{}", self.saved("node4.html").await.display())).await.expect("it is shown");
        self.shoot("report").await;
    }
}

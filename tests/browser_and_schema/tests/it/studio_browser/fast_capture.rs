//! Fast capture and report in a real browser: a button each, with everything put back.

use fantoccini::wd::PrintConfiguration;
use serde_json::json;

use super::{PATIENCE, Stage};

impl Stage {
    /// Shows the form of a fast capture of the wheel.
    async fn fast_capture(&self) {
        self.click("#tabs [data-name=scope]").await;
        self.find("#fast-capture").await;
        self.client.execute("document.querySelector('#fast-capture').open = true", Vec::new()).await.expect("it opens");
        self.find("[data-quantity=target_velocity]").await;
    }

    pub(super) async fn fill(&self, css: &str, text: &str) {
        let fill = "const of = document.querySelector(arguments[0]); of.value = arguments[1]; of.dispatchEvent(new Event('change'))";
        self.client.execute(fill, vec![css.into(), text.into()]).await.expect("it is filled in");
    }

    /// Clicks until this is said; again whenever the button can be clicked and it is not: a page of a busy machine sends nothing while its
    /// state is stale, and has to take control again where its connection was silent for too long.
    pub(super) async fn has_done(&self, button: &str, status: &str, part: &str) -> String {
        let click = "const [button, status, part] = arguments; const said = document.querySelector(status).textContent; \
                     if (said.includes(part)) return said; \
                     document.querySelector('#take')?.click(); const of = document.querySelector(button); \
                     if (!of.disabled && !of.hidden) of.click(); return said";
        // The watchdog's.
        let until = std::time::Instant::now() + PATIENCE;
        loop {
            let said =
                self.client.execute(click, vec![button.into(), status.into(), part.into()]).await.expect("it runs");
            let said = said.as_str().expect("a text").to_owned();
            if said.contains(part) {
                return said;
            }
            // The watchdog's.
            assert!(std::time::Instant::now() < until, "{status} says {said:?}, not {part:?}");
            // Looked at again and again.
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
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
    // Armed again: both are kept.
    stage.fill("#fast-times", "2").await;
    // The studio's own world says what is true beside what the drive says.
    stage.choose("#fast-true", "true_velocity_rpm").await;
    let said = stage.has_done("#fast-begin", "#fast-status", "2 of 2: ").await;
    assert!(said.contains("The PDOs are as they were"), "{said}");
    assert!(said.contains(" rows in ") && said.contains("of the bus at most"), "{said}");
    let had = stage.says("#fast-had", "true_velocity_rpm").await;
    for part in ["velocity_rpm", "TPDO", "world", " ms", "Jitter"] {
        assert!(had.contains(part), "{part}: {had}");
    }
    // It is kept, and shown by itself.
    stage.says("#capture-status", "kept as ").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.find(".captures li:nth-child(2)").await;
    stage.shoot("fast_capture").await;
    stage.is_usable("a fast capture").await;
    // Its notes are there after a reload.
    stage.fill(".captures [data-notes]", "belt tight").await;
    stage.fast_report().await;
    assert!(stage.tpdo().await.contains("nothing is mapped into it"));
    stage.click("#tabs [data-name=scope]").await;
    let notes = "return document.querySelector('.captures [data-notes]')?.value ?? null";
    stage
        .until("notes over a reload", async || {
            stage.client.execute(notes, Vec::new()).await.expect("it runs").as_str() == Some("belt tight")
        })
        .await;
    a_capture_of_a_sequence_is_kept_too(&stage).await;
    a_closed_tab_puts_the_mapping_back(&stage).await;
    stage.close().await;
}

/// A capture is a command of a sequence, and what it had when it was played is kept beside the two of before.
async fn a_capture_of_a_sequence_is_kept_too(stage: &Stage) {
    let steps = json!([{ "after_s": 0, "command": { "do": "capture", "node": 4, "quantities": ["velocity"], "period_ms": 5, "duration_ms": 300,
        "trigger": null, "pre_ms": 0, "sdo": false } }]);
    stage.script(&format!("localStorage.setItem('sequence', JSON.stringify({steps}))")).await;
    stage.load().await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    stage.says(".sequence li", "node 4: Capture velocity every 5ms for 0.3 s").await;
    stage.says("#sequence-text", "capture 4 velocity --for 300ms --rate 5ms").await;
    stage.click("#sequence-play").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.find(".captures li:nth-child(3)").await;
}

/// Of a capture of a minute: another tab sees what it has mapped, and that it is put back when the first one is closed.
async fn a_closed_tab_puts_the_mapping_back(stage: &Stage) {
    stage.fast_capture().await;
    stage.fill("#fast-time", "60").await;
    stage.fill("#fast-times", "1").await;
    stage.has_done("#fast-begin", "#fast-status", "capturing").await;
    let first = stage.client.window().await.expect("a window");
    let other = stage.client.new_window(true).await.expect("a tab").handle;
    stage.client.switch_to_window(other.clone()).await.expect("there");
    stage.until("a mapping", async || !stage.tpdo().await.contains("nothing is mapped into it")).await;
    stage.client.switch_to_window(first).await.expect("there");
    stage.client.close_window().await.expect("it closes");
    stage.client.switch_to_window(other).await.expect("there");
    stage.until("the mapping of before", async || stage.tpdo().await.contains("nothing is mapped into it")).await;
}

impl Stage {
    async fn fast_report(&self) {
        self.click("#tabs [data-name=drive]").await;
        // Not typed: while the wheel turns, Space is Stop.
        self.fill("#report-by", "A. Fitter").await;
        self.has_done("#report", "#report-status", "saved as node4.html").await;
        let page = std::fs::read_to_string(self.saved("node4.html").await).expect("text");
        for part in ["A. Fitter", "zlac8030l", "capture of target_velocity_rpm", "true_velocity", "<svg"] {
            assert!(page.contains(part), "{part} is in the report");
        }
        self.shoot("report_button").await;
        self.client.goto(&format!("file://{}", self.saved("node4.html").await.display())).await.expect("it is shown");
        self.shoot("report").await;
        self.prints_well().await;
    }

    /// On paper it is as wide as the paper, dark on white, and all of it is there.
    async fn prints_well(&self) {
        self.devtools("Emulation.setEmulatedMedia", json!({ "media": "print" })).await;
        // A4 less margins of 15 mm, at 96 pixels an inch.
        self.device(((210.0 - 30.0) / 25.4 * 96.0) as u32, 1000).await;
        let seen = self.script("const style = getComputedStyle(document.body); return [document.documentElement.scrollWidth - innerWidth, style.color, style.backgroundColor]").await;
        assert!(seen[0].as_f64() <= Some(0.0), "{} px wider than the paper", seen[0]);
        let pdf = self.client.print(PrintConfiguration::default()).await.expect("it prints");
        assert!(pdf.starts_with(b"%PDF-"), "a PDF");
        let pages = String::from_utf8_lossy(&pdf).matches("/Type /Page\n").count();
        assert!((1..20).contains(&pages), "{pages} pages");
        std::fs::write(self.profile.join("report.pdf"), &pdf).expect("it is written");
        self.devtools("Emulation.setEmulatedMedia", json!({ "media": "" })).await;
        self.device(1280, 900).await;
    }
}

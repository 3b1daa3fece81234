//! The wizard for gains to its end, in a real browser, with a virtual drive: a wheel with a load. Then the same from a recorded sequence.

use serde_json::Value;

use super::Stage;

/// A wheel with a load on its shaft, behind two other drives.
const MACHINE: &str = "drive = [
    { model = \"cia402\", node = 1 },
    { model = \"zlim42c\", node = 2 },
    { model = \"zlac8030l\", node = 4, load = { inertia_kg_m2 = 0.05, friction = { coulomb_nm = 0.2, viscous_nm_s = 0.01 } } },
]
";
const LOAD_KG_M2: f64 = 0.05;

/// The rows of the table of proposed gains, each `[object, name, has, proposed]`.
const GAINS: &str = "return [...document.querySelectorAll('#tune-had tr')].map((row) => [...row.cells].map((cell) => cell.textContent)) \
    .filter(([object]) => /^2[0-9A-F]{3}h/.test(object))";

impl Stage {
    /// Shows the form of the Scope view, of the wheel.
    async fn wizard(&self) {
        self.click("#tabs [data-name=scope]").await;
        self.find("#tune").await;
        self.script("document.getElementById('tune').open = true").await;
        self.says("#tune-warning", "120 r/min at most").await;
        // Another wish than the usual one.
        let margin = "const field = document.querySelector('#tune-gains-phase_margin_deg'); field.value = '60'; field.dispatchEvent(new Event('change'))";
        self.script(margin).await;
    }

    async fn measures(&self) {
        self.has_done("#tune-agreed[aria-pressed=false], #tune-start", "#tune-status", "The drive has what it had")
            .await;
    }

    /// Has the drive try what was found, which it keeps. A page that was held up has ended the trial, and what was found is gone with it: it is
    /// measured once more then.
    async fn tries_the_gains(&self) {
        let press = "document.querySelector('#take')?.click(); const of = document.querySelector('#tune-write'); \
                     if (!of.disabled && !of.hidden) of.click(); const said = document.querySelector('#tune-status'); \
                     return said.className === 'bad' || said.textContent.includes('not stored yet') ? said.textContent : null";
        loop {
            let said = std::cell::RefCell::new(String::new());
            self.until("the trial has ended", async || {
                let Value::String(text) = self.script(press).await else { return false };
                said.replace(text);
                true
            })
            .await;
            let said = said.into_inner();
            if said.contains("not stored yet") {
                return;
            }
            let shown = self.says("#tune-had", "Proposed").await;
            let is_refused = said.contains("asked for") || shown.contains("A step, on the drive");
            assert!(!is_refused, "not what is found on this wheel: {said}");
            self.measures().await;
        }
    }

    /// What the drive has in these objects, read by the page.
    async fn upload_all(&self, objects: &[String]) -> Vec<String> {
        let read = "const [objects, done] = arguments; import('/page/bundle.js').then(async ({ modules }) => \
                    done(await modules['link.js'].ask({ do: 'read_objects', node: 4, objects })))";
        let read = self.client.execute_async(read, vec![objects.into()]).await.expect("it is asked");
        let values = read["result"]["values"].as_array().unwrap_or_else(|| panic!("{read}"));
        values
            .iter()
            .map(|value| value["text"].as_str().and_then(|text| text.split(' ').next()).expect("a value").to_owned())
            .collect()
    }

    /// How many elements there are.
    async fn count(&self, css: &str) -> Value {
        self.script(&format!("return document.querySelectorAll({css:?}).length")).await
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_wizard_for_gains_shows_what_was_found_writes_it_and_goes_back() {
    let folder = processes::scratch("studio_wizard_machine");
    let machine = folder.join("machine.toml");
    std::fs::write(&machine, MACHINE).expect("it is written");
    let stage = Stage::open_on("wizard", &["--bus", &format!("sim:{}", machine.display())]).await;
    stage.take_the_wheel().await;
    stage.click("#sequence summary").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.wizard().await;
    stage.measures().await;
    // Bode: gain, phase and coherence, with the drive, its twin and the model in the first two.
    assert_eq!(stage.count("#tune-had svg:first-of-type .frame").await, 3);
    for line in ["line", "twin", "model"] {
        assert!(stage.count(&format!("#tune-had svg:first-of-type path.{line}")).await.as_u64() >= Some(2), "{line}");
    }
    let shown = stage.says("#tune-had", "kg·m²").await;
    let inertia = shown.split("Inertia").nth(1).and_then(|rest| rest.trim().split(' ').next()).expect("a figure");
    let inertia: f64 = inertia.parse().expect("a number");
    // That of the load and of its rotor, which is far less. How true it is, the host's tests ask.
    assert!(inertia > LOAD_KG_M2 && inertia < 1.5 * LOAD_KG_M2, "{inertia} kg m²");
    let proposed = stage.script(GAINS).await;
    let proposed = proposed.as_array().expect("rows");
    // Its gains, and a filter, which may be right as it is.
    assert!(proposed.len() >= 2 && proposed.iter().take(2).all(|row| row[2] != row[3]), "{proposed:?}");
    let objects: Vec<String> = proposed.iter().map(|row| row[0].as_str().expect("an object").to_owned()).collect();
    let has = async || stage.upload_all(&objects).await;
    let column =
        |at: usize| proposed.iter().map(|row| row[at].as_str().expect("a value").to_owned()).collect::<Vec<_>>();
    assert_eq!(has().await, column(2), "nothing is written yet");
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
    stage.tries_the_gains().await;
    let tried = stage.script(GAINS).await;
    let tried = tried.as_array().expect("rows").iter().map(|row| row[3].as_str().expect("a value").to_owned());
    assert_eq!(has().await, tried.collect::<Vec<_>>());
    // What leads back is not part of the sequence that is played below.
    stage.click("#tabs [data-name=motion]").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=false]").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.says("#tune-had", "A step, on the drive").await;
    stage.find("#tune-write[hidden]").await;
    stage.script("document.querySelector('#tune-had').scrollIntoView()").await;
    stage.shoot("wizard_tried").await;
    stage.has_done("#tune-back", "#tune-status", "the drive has its former values, read back").await;
    stage.find("#tune-back[hidden]").await;
    assert_eq!(has().await, column(2), "as it was");
    a_recorded_tuning_is_played(&stage).await;
    assert_ne!(has().await, column(2), "the gains that were found last");
    stage.close().await;
}

/// Recorded with its limits; played, the trial waits for what the measurement finds.
async fn a_recorded_tuning_is_played(stage: &Stage) {
    stage.click("#tabs [data-name=motion]").await;
    let recorded = stage.says(".sequence li:nth-last-child(2)", "Find gains for a phase margin of 60°").await;
    assert!(recorded.ends_with("at most 120 r/min, 15 A, 40 turns"), "{recorded}");
    stage.says(".sequence li:last-child", "Try the gains that were found last").await;
    let line = "ferrodrive tune 4 --phase-margin 60 --speed 120rpm --current 15A --travel 40turn --period 5ms --apply";
    stage.says("#sequence-text", line).await;
    let listen = "window.applied = false; addEventListener('played', ({ detail }) => (window.applied = detail.result?.applied ?? window.applied))";
    stage.script(listen).await;
    // Pressed again where a page that was held up has ended it before the trial.
    let play = "const of = document.querySelector('#sequence-play'); if (of.checked) return false; \
                const said = document.querySelector('#sequence-status').textContent; \
                const has_ended = said.includes('commands were sent'); \
                if (!has_ended) of.click(); return has_ended";
    stage.until("all are sent", async || stage.script(play).await == true).await;
    stage.wheel("nothing goes on any more", |wheel| wheel["doing"].is_null() && super::speed(wheel) < 2.0);
    assert_eq!(stage.script("return window.applied").await, true);
}

//! The scope in a real browser: what it keeps, saves and triggers on.

use serde_json::Value;

use fantoccini::actions::{Actions, InputSource, MOUSE_BUTTON_LEFT, PointerAction, TouchActions};

use super::{Key, Locator, PATIENCE, Stage, press};

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_scope_keeps_what_the_drive_said_and_saves_it() {
    let stage = Stage::open("scope").await;
    stage.take_the_wheel().await;
    stage.click("#go-move").await;
    let angle = |wheel: &Value| wheel["drive"]["angle_degrees"].as_f64().expect("an angle");
    stage.wheel("a quarter of a turn", |wheel| (angle(wheel) - 90.0).abs() < 2.0);
    stage.rests();
    stage.client.perform_actions(press('4')).await.expect("a key");
    stage.choose("#scope-window", "1").await;
    // Longer than the half of what is shown, so that there is a reading under the cursor.
    tokio::time::sleep(std::time::Duration::from_secs(3)).await;
    stage.click("#scope-pause").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.click("canvas").await;
    stage
        .client
        .wait()
        .at_most(PATIENCE)
        .for_element(Locator::XPath("//p[starts-with(., 'A at') and contains(., 'Position')]"))
        .await
        .expect("a cursor");
    stage.shoot("scope").await;
    stage.click("#scope-save").await;
    let saved = std::fs::read_to_string(stage.saved("node4.csv").await).expect("text");
    let mut lines = saved.lines();
    assert_eq!(
        lines.next(),
        Some("t_s,4.velocity_rpm,4.position_deg,4.current_a,4.supply_v,4.position_counts,4.statusword,mark")
    );
    // A line of what happened has no values.
    let values = lines.filter(|line| !line.contains(",,"));
    let values = values.map(|line| line.split(',').take(7).map(|value| value.parse().expect("a number")).collect());
    let samples: Vec<Vec<f64>> = values.collect();
    assert!(samples.len() > 5 && samples.is_sorted_by(|a, b| a[0] < b[0]), "each reading once: {saved}");
    let (first, last) = (&samples[0], &samples[samples.len() - 1]);
    assert!(first[2].abs() < 2.0 && (last[2] - 90.0).abs() < 2.0, "{saved}");
    assert!(samples.iter().any(|sample| sample[1] > 20.0), "it was seen turning: {saved}");
    another_unit_and_a_computed_quantity(&stage).await;
    two_fingers_zoom(&stage).await;
    captures_stay_over_a_reload(&stage).await;
    stage.close().await;
}

/// The number behind a label in the readout.
async fn read(stage: &Stage, label: &str) -> f64 {
    let text = stage.says(".readout", label).await;
    let number = text
        .split(label)
        .nth(1)
        .map(|rest| rest.trim_start_matches([':', ' ']).split([' ', '\n']).next().unwrap_or_default());
    number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{label} has no number in {text:?}"))
}

/// The position under the cursor in turns is that in degrees by 360; the derivative of the speed is shown beside it.
async fn another_unit_and_a_computed_quantity(stage: &Stage) {
    let degrees = read(stage, "Position").await;
    stage.choose("#scale-pane", "angle_degrees").await;
    stage.choose("#scope-unit", "turns").await;
    stage.says(".readout", " turns").await;
    let turns = read(stage, "Position").await;
    // Three decimals, and one of the degrees.
    assert!((turns - degrees / 360.0).abs() < 0.5e-3 + 0.05 / 360.0 + 1e-9, "{degrees}° are {turns} turns");
    stage.choose("#scope-unit", "°").await;
    stage.script("document.querySelector('#computed-name').closest('details').open = true").await;
    // Not typed: Space and letters are keys of the page.
    for (field, text) in
        [("#computed-name", "acceleration"), ("#computed-formula", "d(speed"), ("#computed-unit", "r/min/s")]
    {
        stage.fill(field, text).await;
    }
    stage.click("#computed-add").await;
    stage.says("#computed-status", "expected").await;
    stage.fill("#computed-formula", "d(speed)").await;
    stage.click("#computed-add").await;
    stage.find("[data-computed=acceleration]").await;
    let shown = stage.says(".readout", "acceleration").await;
    assert!(shown.contains("r/min/s"), "{shown}");
    stage.click("[data-computed=acceleration]").await;
    stage
        .until("it is removed", async || {
            !stage.find(".readout").await.text().await.expect("text").contains("acceleration")
        })
        .await;
}

/// By how much a press of the arrow with Shift moves the cursor: a fiftieth of the time shown.
async fn a_fiftieth_s(stage: &Stage) -> f64 {
    let before = read(stage, "A at").await;
    let press = "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft', shiftKey: true, bubbles: true }))";
    stage.script(press).await;
    stage.until("a cursor that moved", async || (read(stage, "A at").await - before).abs() > 1e-9).await;
    (read(stage, "A at").await - before).abs()
}

/// Two fingers on the picture that move to twice their distance: half the time is shown, as on a tablet.
async fn two_fingers_zoom(stage: &Stage) {
    let before_s = a_fiftieth_s(stage).await;
    stage.script("document.querySelector('canvas').scrollIntoView({ block: 'center' })").await;
    let canvas = stage.find("canvas").await;
    let finger = |name: &str, side: f64| {
        let to = |x: f64| PointerAction::MoveToElement { element: canvas.clone(), duration: None, x: side * x, y: 0.0 };
        TouchActions::new(name.into())
            .then(to(60.0))
            .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT })
            .then(to(120.0))
            .then(PointerAction::Up { button: MOUSE_BUTTON_LEFT })
    };
    let both = Actions::from(finger("left", -1.0)).and(finger("right", 1.0));
    stage.client.perform_actions(both).await.expect("two fingers");
    stage.client.release_actions().await.expect("a release");
    let after_s = a_fiftieth_s(stage).await;
    // Times are shown with three decimals.
    assert!((after_s - before_s / 2.0).abs() < 1.5e-3, "{before_s} s, then {after_s} s");
}

/// What is shown is kept, the saved record is loaded, and both are there after a reload, to be laid over each other.
async fn captures_stay_over_a_reload(stage: &Stage) {
    stage.click("#capture-keep").await;
    stage.says("#capture-status", "kept as ").await;
    let record = stage.profile.join("node4.csv");
    stage.find("#capture-file").await.send_keys(&record.to_string_lossy()).await.expect("chosen");
    stage.says("#capture-status", "node4.csv: 6 values").await;
    stage.load().await;
    stage.click("#tabs [data-name=scope]").await;
    stage.find(".captures li:nth-child(2)[data-capture='node4.csv']").await;
    // By the keyboard alone: shown by itself, a cursor in its middle, and the first capture less it.
    stage.press_on(".captures li:nth-child(2) button:nth-of-type(2)", Key::Enter.into()).await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.press_on(".captures li:nth-child(1) button", Key::Enter.into()).await;
    stage.press_on("#capture-subtract", Key::Enter.into()).await;
    stage.press_on("canvas", Key::Right.into()).await;
    // One and the same data: the record was saved of what was kept.
    stage.choose("#capture-align", "time").await;
    let read = stage.says(".readout", "Speed: difference").await;
    let difference = async || {
        let read = stage.says(".readout", "Speed: difference").await;
        read.split_once("Speed: difference").and_then(|(_, rest)| Some(rest.split_once(" r/min")?.0.to_owned()))
    };
    // To the right, where what was shown as it was kept begins.
    stage
        .until("a cursor where both have values", async || {
            let is_known = !difference().await.expect("a value").ends_with('\u{2013}');
            if !is_known {
                stage.press_on("canvas", Key::Right.into()).await;
            }
            is_known
        })
        .await;
    let known = difference().await.expect("a value");
    assert!(known.ends_with(" 0.0"), "{known}");
    assert!(read.starts_with("A at ") && read.contains("Position of node 4"), "{read}");
    // The scale by the keyboard: half the span after arrows up, and its own again.
    let span = async || {
        let span = "return document.querySelector('#scale-high').value - document.querySelector('#scale-low').value";
        stage.client.execute(span, vec![]).await.expect("it runs").as_f64().expect("a number")
    };
    let whole = span().await;
    stage.press_on("canvas", Key::Up.into()).await;
    stage.until("a smaller span", async || (span().await - whole / 1.25).abs() < 0.01 * whole).await;
    stage.press_on("canvas", Key::End.into()).await;
    stage.until("the span of the values", async || (span().await - whole).abs() < 0.01 * whole).await;
    stage.shoot("scope_captures").await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_scope_draws_any_object_that_passes() {
    let stage = Stage::open("scope_object").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.choose_drive("scope", 3).await;
    // ZLAC8030L: 2029h is the bus voltage in 0.01 V, which the studio reads; 48 V is the supply as delivered.
    stage.choose("#scope-object", "4:2029:00").await;
    stage.find("[data-object='4:2029:00']").await;
    // A picture of so long a time.
    tokio::time::sleep(std::time::Duration::from_secs(2)).await;
    stage.click("#scope-pause").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.shoot("scope_object").await;
    stage.click("#scope-save").await;
    let saved = std::fs::read_to_string(stage.saved("node4.csv").await).expect("text");
    let mut lines = saved.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let title = lines.next().expect("titles");
    let column = title.iter().position(|name| *name == "4.2029_00").unwrap_or_else(|| panic!("{title:?}"));
    let volts: Vec<f64> = lines.filter_map(|line| line[column].parse().ok()).collect();
    assert!(volts.len() > 5 && volts.iter().all(|volts| (volts - 4800.0).abs() < 100.0), "{volts:?}");
    // The same as MCAP, which `ferrodrive plot` and others read. (That the values are the same is held by the tests of the studio.)
    stage.click("#scope-mcap").await;
    let record = stage.saved("node4.mcap").await;
    let picture = record.with_extension("svg");
    let (record, svg) = (record.to_str().expect("UTF-8"), picture.to_str().expect("UTF-8"));
    processes::done(&["plot", record, "--signals", "4.2029_00,4.velocity_rpm", "--svg", svg]);
    let drawn = std::fs::read_to_string(&picture).expect("a picture");
    assert!(drawn.contains("2029") && drawn.contains("r/min"), "{drawn}");
    // A trigger on what was added: the supply falls through 30 V, and the picture is held.
    stage.click("#scope-pause").await;
    stage.find("#scope-pause[aria-pressed=false]").await;
    stage.choose("#trigger-field", "4:2029:00").await;
    stage.choose("#trigger-edge", "falling").await;
    let level = stage.find("#trigger-level").await;
    level.clear().await.expect("cleared");
    level.send_keys("3000").await.expect("typed");
    stage.choose("#scope-window", "1").await;
    stage.choose("#trigger-mode", "once").await;
    stage.click_for("#trigger-keep", "#trigger-keep[aria-pressed=true]").await;
    stage.says("#trigger-status", "waiting").await;
    stage.click("#take").await;
    stage.find("#release").await;
    stage.click("#tabs [data-name=world]").await;
    stage.find("[data-place='4']").await;
    stage.find("#world-line").await.send_keys("4 supply 24").await.expect("typed");
    stage.click("#world-do").await;
    stage.says(".world-changes li:first-child b", "4 supply 24").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.says("#trigger-status", "fired at").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    // Kept by itself.
    stage.says("#capture-status", "kept as ").await;
    stage.find(".captures li").await;
    stage.shoot("scope_triggered").await;
    stage.close().await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_scope_waits_for_its_trigger_and_measures_the_step() {
    let stage = Stage::open("trigger").await;
    stage.take_the_wheel().await;
    stage.click("#tabs [data-name=scope]").await;
    stage.choose("#scope-window", "10").await;
    stage.choose("#trigger-mode", "once").await;
    stage.says("#trigger-status", "waiting").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.turn().await;
    stage.click("#tabs [data-name=scope]").await;
    stage.says("#trigger-status", "fired at").await;
    // The part after it, 80 % of 10 s: while the wheel goes on turning.
    stage.find("#scope-pause[aria-pressed=true]").await;
    stage.click("#scope-step").await;
    // A ramp of less than a second, read nine times a second: reported as too few readings.
    let reported = stage.says(".readout", "Step of Speed").await;
    assert!(
        reported.contains("Step of Speed: too few readings: ") && reported.contains("event timer of 1 ms"),
        "{reported}"
    );
    assert!(!reported.contains("rise time") && !reported.contains("Step of Current"), "{reported}");
    measures_what_comes_each_millisecond(&stage).await;
    stage.click("#scope-svg").await;
    let drawing = std::fs::read_to_string(stage.saved("node4.svg").await).expect("text");
    assert!(
        drawing.starts_with("<svg ") && drawing.ends_with("</svg>\n") && drawing.contains(">Speed</text>"),
        "{drawing}"
    );
    // Each value over the speed: a pane less, with a title for it.
    stage.click_for("#scope-xy", "#scope-across:not([hidden])").await;
    stage.choose("#scope-across", "velocity_rpm").await;
    stage.click("#scope-svg").await;
    let drawing = std::fs::read_to_string(stage.saved("node4 (1).svg").await).expect("text");
    assert!(drawing.contains(" over Speed</text>") && !drawing.contains(">Speed</text>"), "{drawing}");
    stage.shoot("scope_xy").await;
    stage.click("#scope-fft").await;
    stage.find("#scope-xy[aria-pressed=false]").await;
    stage.press_on("canvas", Key::Right.into()).await;
    // Read nine times a second, by a busy machine less often than the sixteen times in 2 s that a spectrum takes.
    let read = stage.says(".readout", " Hz: Speed ").await;
    assert!(read.contains("Speed not sampled so often") || read.contains("Speed too few readings"), "{read}");
    assert!(read.starts_with("A at ") && read.contains("(line at "), "{read}");
    stage.shoot("scope_spectrum").await;
    stage.close().await;
}

/// The speed in a TPDO each millisecond: from rest to 60 r/min within 120 ms, by two joined parabolas (6083h of the ZLTECH drives). Of
/// `2 x²` and `1 - 2 (1 - x)²` 10 % lie at sqrt(0.05) and 90 % at 1 - sqrt(0.05).
async fn measures_what_comes_each_millisecond(stage: &Stage) {
    let set = "const done = arguments[arguments.length - 1]; import('/page/bundle.js').then(async ({ modules }) => { const { ask } = modules['link.js']; \
               await ask({ do: 'stop', node: 4 }); await ask({ do: 'disable', node: 4 }); \
               const pdos = [{ pdo: 'TPDO1', valid: true, objects: [{ object: '606Ch:00', bits: 32 }], transmission: 255, event_ms: 1 }]; \
               done([await ask({ do: 'write_pdos', node: 4, pdos }), await ask({ do: 'nmt', node: 4, command: 'start' })]); })";
    let set = stage.client.execute_async(set, Vec::new()).await.expect("it is asked");
    assert!(set[0]["ok"] == true && set[1]["ok"] == true, "{set}");
    stage.rests();
    stage.choose("#trigger-mode", "off").await;
    stage.choose("#scope-object", "4:606C:00").await;
    stage.find("[data-object='4:606C:00']").await;
    for hidden in ["angle_degrees", "current_a"] {
        stage.click(&format!("[data-field={hidden}]")).await;
    }
    stage.choose("#scope-window", "2").await;
    stage.choose("#trigger-field", "4:606C:00").await;
    let level = stage.find("#trigger-level").await;
    level.clear().await.expect("cleared");
    // 0.1 r/min is a count.
    level.send_keys("100").await.expect("typed");
    stage.click("#tabs [data-name=motion]").await;
    stage.find("#velocity-ramp").await.send_keys("500").await.expect("typed");
    let reported = a_step_is_triggered(stage).await;
    let (rise_s, grid_s) = rise_of(&reported);
    let truth_s = (1.0 - 2.0 * 0.05_f64.sqrt()) * 60.0 / 500.0;
    // The shaft follows its loop, which takes some milliseconds of its own.
    assert!(grid_s <= 0.002 && (rise_s - truth_s).abs() < grid_s + 0.003, "{reported}, not {truth_s} s");
    let readout = "document.querySelector('.readout').scrollIntoView({ block: 'end' })";
    stage.client.execute(readout, Vec::new()).await.expect("it scrolls");
    stage.shoot("scope_step").await;
}

/// The rise time that is reported and its ±, the time between two readings.
fn rise_of(reported: &str) -> (f64, f64) {
    let rise = reported.split("rise time (10 to 90 %) ").nth(1).and_then(|rest| rest.split(" s,").next());
    let (rise, grid) = rise.and_then(|rise| rise.split_once(" ± ")).unwrap_or_else(|| panic!("{reported}"));
    (rise.parse().expect("a time"), grid.parse().expect("what it may be off by"))
}

/// Turns the wheel from rest, and gives what is reported of the step that the trigger has held.
async fn a_step_is_triggered(stage: &Stage) -> String {
    stage.click("#tabs [data-name=scope]").await;
    stage.choose("#trigger-mode", "once").await;
    stage.says("#trigger-status", "waiting").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.turn().await;
    stage.click("#tabs [data-name=scope]").await;
    stage.find("#scope-pause[aria-pressed=true]").await;
    let reported = stage.says(".readout", "Step of 4:606C:00").await;
    reported.lines().find(|line| line.starts_with("Step of 4:606C:00")).expect("its line").to_owned()
}

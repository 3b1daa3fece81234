//! Several drives as one motion, in a real browser.

use fantoccini::actions::{InputSource, MOUSE_BUTTON_LEFT, MouseActions, PointerAction};
use fantoccini::key::Key;
use serde_json::Value;

use super::{Stage, press, speed};

/// The stepper and the wheel of the embedded bus, by their places.
const BOTH: [usize; 2] = [1, 2];

fn angle(node: &Value) -> f64 {
    node["drive"]["angle_degrees"].as_f64().expect("an angle")
}

fn angles(state: &Value) -> [f64; 2] {
    BOTH.map(|at| angle(&state["nodes"][at]))
}

fn all(state: &Value, wanted: impl Fn(&Value) -> bool) -> bool {
    BOTH.iter().all(|at| state["nodes"][*at]["drive"].is_object() && wanted(&state["nodes"][*at]))
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn two_drives_move_together_turn_while_held_and_stop_together() {
    let stage = Stage::open("grouped").await;
    stage.take_the_wheel().await;
    stage.click("#group summary").await;
    stage.click("#group-move").await;
    stage.says("#group-notice", "Choose two or more drives").await;
    stage.click("#group-in-2").await;
    stage.click("#group-in-4").await;
    stage.says("#group-guarding", "Node 2: if the studio dies, nothing stops it").await;
    stage.click("#group-guarding button").await;
    stage.find("#group-guarding:not(:has(button))").await;
    stage.click("#sequence summary").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.click("#group-move").await;
    stage.says("#group-notice", "2 drives moved together in").await;
    stage.click("#sequence-record").await;
    // How far exactly is held in virtual time: a busy machine brings set-points late, and the drives lag behind them.
    stage.studio.wait("both have moved", |state| all(state, |node| angle(node) > 45.0 && speed(node) < 2.0));
    stage.shoot("group").await;
    // Recorded, it is a line of a scenario for these two.
    stage.says(".sequence li", "nodes 2, 4: Move together by 90°, 90°").await;
    stage.choose("#sequence-form", "scenario").await;
    stage.click("#sequence-save").await;
    let scenario = stage.saved("sequence.toml").await;
    let ran = processes::ferrodrive(&["run", &scenario.to_string_lossy(), "--json"]);
    assert_eq!(ran.status, Some(0), "{} {}", ran.out, ran.err);
    let before = angles(&stage.studio.state());
    // A state that came late ends a play before its first command.
    let send = "const [play, status] = ['play', 'status'].map((id) => document.getElementById(`sequence-${id}`)); \
        const sent = status.textContent.startsWith('all 1 commands'); if (!sent && !play.checked) play.click(); return sent";
    stage.until("the move is sent", async || stage.script(send).await == true).await;
    stage.studio.wait("both have moved on", |state| {
        let moved = angles(state).into_iter().zip(&before).all(|(now, before)| now - before > 45.0);
        moved && all(state, |node| speed(node) < 2.0)
    });
    let hold = async || {
        // What was recorded is drawn above it, and the header lies on what is scrolled away.
        stage.script("document.getElementById('group-forward').scrollIntoView({ block: 'center' })").await;
        let element = stage.find("#group-forward").await;
        let down = MouseActions::new("mouse".into())
            .then(PointerAction::MoveToElement { element, duration: None, x: 0.0, y: 0.0 })
            .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT });
        stage.client.perform_actions(down).await.expect("a press");
    };
    let turn = |state: &Value| all(state, |node| speed(node) > 20.0);
    let rest = |state: &Value| all(state, |node| speed(node) < 2.0);
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=true]").await;
    stage.press_until(turn, hold).await;
    stage.client.release_actions().await.expect("a release");
    stage.studio.wait("both rest", rest);
    stage.says("#group-notice", "at rest, power stage off").await;
    stage.click_for("#sequence-record", "#sequence-record[aria-pressed=false]").await;
    // Played, it is held by the page for as long as the button was, to which belongs the time until both had power.
    stage.says(".sequence li:nth-last-child(2)", "nodes 2, 4: Turn together at 30, 30 r/min").await;
    stage.says(".sequence li:last-child", "End of the held motion").await;
    let play = "const play = document.getElementById('sequence-play'); if (!play.checked) play.click()";
    let begun = |state: &Value| all(state, |node| speed(node) > 5.0);
    stage.press_until(begun, async || drop(stage.script(play).await)).await;
    stage.studio.wait("both rest", rest);
    stage.press_until(turn, hold).await;
    stage.client.perform_actions(press(Key::Escape.into())).await.expect("a press");
    stage.studio.wait("both rest", rest);
    stage.says("#group-notice", "stop").await;
    stage.client.release_actions().await.expect("a release");
    stage.click("#theme").await;
    stage.shoot("group_other_theme").await;
    stage.close().await;
}

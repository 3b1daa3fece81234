//! The homing wizard in a real browser.

use fantoccini::key::Key;

use super::{Stage, press, speed};

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn homing_is_chosen_by_its_drawing_and_ends_with_a_stop() {
    let stage = Stage::open("homed").await;
    stage.take_the_wheel().await;
    stage.choose_drive("motion", 2).await;
    stage.click("#homing summary").await;
    stage.find("#homing .columns:not([hidden]) #home-method li[data-value='24']").await;
    stage.choose("#home-method", "24").await;
    // ZLIM42-C user manual V1.03, 5.3.6; 2030h gives no input a meaning as delivered.
    stage.says("#home-described", "searches for the home switch in positive direction, and reverses at a limit").await;
    stage.says("#home-missing", "No input of this drive is configured as home switch").await;
    stage.find(".homing-picture circle.home").await;
    let details = "document.querySelector('#homing').scrollIntoView({ block: 'start' })";
    stage.client.execute(details, Vec::new()).await.expect("it scrolls");
    stage.shoot("homing").await;
    stage.choose("#home-method", "17").await;
    stage.says("#home-described", "negative limit goes on").await;
    let field = stage.find(".settings input[data-object='6099h:01']").await;
    field.clear().await.expect("cleared");
    field.send_keys("60rpm").await.expect("typed");
    stage.click("#home-write").await;
    stage.says("#home-notice", "Written and read back").await;
    // Nothing stops this model when the studio dies: the page asks before it moves it.
    stage.click("#home-start").await;
    stage.click("#guarding button:focus").await;
    stage.find("#guarding:not(:has(button))").await;
    stage.click("#home-start").await;
    stage.says("#home-progress", "moving negatively").await;
    stage.click("#theme").await;
    stage.shoot("homing_other_theme").await;
    stage.client.perform_actions(press(Key::Escape.into())).await.expect("a press");
    stage.says("#home-progress", "Home not found").await;
    stage.studio.wait("a stepper that rests", |state| speed(&state["nodes"][1]) < 2.0);
    stage.close().await;
}

//! Pages without control, in a real browser.

use super::{Stage, press};

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn who_only_looks_can_stop() {
    let stage = Stage::open("watched").await;
    stage.take_the_wheel().await;
    stage.turn().await;
    let other = stage.client.new_window(false).await.expect("a second window");
    stage.client.switch_to_window(other.handle).await.expect("it is there");
    stage.load().await;
    stage.find("#ask").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.find(".motion fieldset[disabled]").await;
    stage.click("#stop").await;
    stage.rests();
    // That is shown in view, at any scroll position, and once, though a press takes two channels.
    stage.says("#news li:first-child", "node 4: stopped by a press of stop").await;
    let seen = "const line = document.querySelector('#news li').getBoundingClientRect(); \
                const reported = [...document.querySelectorAll('#news li')].filter((one) => one.textContent.includes('node 4: stopped by a press')); \
                return [line.bottom <= innerHeight && line.height > 0, reported.length]";
    let seen = stage.client.execute(seen, Vec::new()).await.expect("it runs");
    assert_eq!(seen, serde_json::json!([true, 1]));
    stage.close().await;
}

/// What is typed into a field is text while nothing moves, and Space is the stop as soon as something does.
#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_space_in_a_text_field_stops_what_moves() {
    let stage = Stage::open("spaced").await;
    stage.take_the_wheel().await;
    stage.click("#tabs [data-name=parameters]").await;
    let search = stage.find("#parameters-search").await;
    search.send_keys("maximum speed").await.expect("typed");
    assert_eq!(search.prop("value").await.expect("it has one").as_deref(), Some("maximum speed"));
    stage.click("#tabs [data-name=motion]").await;
    stage.turn().await;
    stage.click("#tabs [data-name=parameters]").await;
    stage.click("#parameters-search").await;
    stage.client.perform_actions(press(' ')).await.expect("a press");
    stage.client.release_actions().await.expect("a release");
    stage.rests();
    let search = stage.find("#parameters-search").await;
    assert_eq!(search.prop("value").await.expect("it has one").as_deref(), Some("maximum speed"));
    stage.close().await;
}

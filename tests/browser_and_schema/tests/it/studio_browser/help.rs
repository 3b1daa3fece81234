//! What things mean, asked for in a real browser.

use super::{Stage, press};

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_question_mark_tells_what_the_thing_in_focus_means() {
    let stage = Stage::open("asked").await;
    stage.take_the_wheel().await;
    stage.click("#enable").await;
    stage.wheel("an enabled drive", |wheel| wheel["drive"]["state"] == "Operation enabled");
    stage.click("#tabs [data-name=drive]").await;
    stage.click("button.term[data-help=status_bit][data-name='target reached']").await;
    stage.says("#help", "Source: CiA 402-2, 8.4.2").await;
    stage.shoot("help").await;
    stage.click("#help-close").await;
    // By the keyboard: the state that has the focus.
    let focus = "document.querySelector('.state[data-name=\"Operation enabled\"]').focus()";
    stage.client.execute(focus, Vec::new()).await.expect("it has the focus");
    stage.client.perform_actions(press('?')).await.expect("a key");
    stage.says("#help", "follows its set-points").await;
    stage.says("#help", "CiA 402-2, 8.2").await;
    stage.click("#tabs [data-name=parameters]").await;
    stage.find("#parameters-search").await.send_keys("6083").await.expect("typed");
    let row = ".parameters tr[data-object='6083h:00']";
    stage.find(row).await;
    let focus = "document.querySelector('.parameters tr[data-object=\"6083h:00\"]').focus()";
    stage.client.execute(focus, Vec::new()).await.expect("it has the focus");
    stage.client.perform_actions(press('?')).await.expect("a key");
    stage.says("#help", "Source: ZLAC8030L quick start guide V1.00, chapter 9").await;
    stage.click("#theme").await;
    stage.shoot("help_other_theme").await;
    stage.click("#help-close").await;
    stage.click("#tabs [data-name=bus]").await;
    stage.click("#what").await;
    stage.says("#help", "Help in this view").await;
    stage.close().await;
}

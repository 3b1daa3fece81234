//! The tour in a real browser, as a person walks it.

use fantoccini::key::Key;

use super::{Stage, press};

impl Stage {
    /// To the view of the step.
    async fn go_on(&self) {
        self.find("#tour-go:not([hidden])").await;
        self.to_top().await;
        self.click("#tour-go").await;
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_tour_goes_on_when_the_drive_did_what_it_asks_for() {
    let stage = Stage::open("toured").await;
    stage.says("#tour", "Ten steps").await;
    stage.click("#tour-start").await;
    stage.says("#tour", "1 of 10: Enable").await;
    stage.go_on().await;
    // A press on nothing that does it changes nothing; a control that is marked is the next one.
    stage.find("#take.tour-mark").await;
    stage.take_the_wheel().await;
    stage.find("#enable.tour-mark").await;
    stage.click("#enable").await;
    stage.says("#tour", "2 of 10: Jog").await;
    stage.shoot("tour").await;
    stage.sees().await;
    stage.client.perform_actions(press(Key::Right.into())).await.expect("a press");
    stage.says("#tour", "3 of 10: Scope").await;
    stage.client.release_actions().await.expect("a release");
    stage.rests();
    stage.turn().await;
    stage.go_on().await;
    stage.says("#tour", "4 of 10: Parameter").await;
    stage.go_on().await;
    stage.find("#stop.tour-mark").await;
    stage.client.perform_actions(press(Key::Escape.into())).await.expect("a press");
    stage.client.release_actions().await.expect("a release");
    stage.click("#disable.tour-mark").await;
    // Left, and taken up again after the page was loaded anew.
    stage.click("#tour-leave").await;
    stage.client.refresh().await.expect("it loads");
    stage.says("#bus-line", "frames").await;
    stage.click("#what").await;
    stage.click("#help .offer").await;
    stage.says("#tour", "4 of 10: Parameter").await;
    stage.click("#take").await;
    stage.find("#release").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.choose_drive("motion", 3).await;
    stage.go_on().await;
    stage.find("#parameters-search").await.send_keys("2013").await.expect("typed");
    stage.click(".parameters tr[data-object='2013h:01']").await;
    stage.find("#parameter-value").await.send_keys("100").await.expect("typed");
    stage.click("#parameter-write").await;
    stage.says("#tour", "5 of 10: Fault").await;
    stage.go_on().await;
    stage.says("#tour", "6 of 10: Reset").await;
    stage.go_on().await;
    stage.click("#parameters-back.tour-mark").await;
    stage.go_on().await;
    stage.click("#reset-fault.tour-mark").await;
    stage.says("#tour", "7 of 10: PDO").await;
    stage.go_on().await;
    stage.click("button[data-edit=TPDO1].tour-mark").await;
    stage.find("#pdo-search.tour-mark").await.send_keys("statusword").await.expect("typed");
    stage.click("button[data-add='6041h:00']").await;
    stage.click("#pdo-apply.tour-mark").await;
    stage.says("#tour", "8 of 10: Save").await;
    stage.click("#theme").await;
    stage.shoot("tour_other_theme").await;
    stage.go_on().await;
    stage.click("#parameters-store.tour-mark").await;
    stage.says("#tour", "9 of 10: Scenario").await;
    stage.go_on().await;
    stage.click("[data-line='cable cut'].tour-mark").await;
    stage.says("#tour", "10 of 10: Recording").await;
    stage.go_on().await;
    stage.click("#trace-save-log.tour-mark").await;
    stage.says("#tour", "The tour is done").await;
    stage.click("#tour-leave").await;
    stage.close().await;
}

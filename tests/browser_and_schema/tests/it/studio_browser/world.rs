//! The world around the machine inside the program, in a real browser: a load, a switch, a cable, and what the drives say of it.

use serde_json::Value;

use super::{Key, Locator, PATIENCE, Stage};

impl Stage {
    /// Does something by its line in words.
    async fn done(&self, line: &str) {
        let field = self.find("#world-line").await;
        field.clear().await.expect("cleared");
        field.send_keys(line).await.expect("typed");
        self.click("#world-do").await;
        self.says(".world-changes li:first-child b", line).await;
    }

    async fn attribute(&self, css: &str, name: &str) -> String {
        self.find(css).await.attr(name).await.expect("an element").unwrap_or_default()
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn what_happens_to_the_world_is_drawn_and_the_drives_say_so() {
    let stage = Stage::open("world").await;
    stage.take_the_wheel().await;
    stage.click("#enable").await;
    stage.turn().await;
    stage.click("#tabs [data-name=world]").await;
    stage.find("[data-place='4'][aria-pressed=true]").await;
    // By node-ID, as everywhere else; the machine file has 4, 1, 2.
    let places = "return [...document.querySelectorAll('.world-card')].map((of) => of.dataset.place).join()";
    assert_eq!(stage.script(places).await, "1,2,4");
    // The wheel turns, the others rest: what is drawn is where the shafts are.
    const WHEEL: &str = "[data-place='4'] svg > g";
    let before = stage.attribute(WHEEL, "transform").await;
    stage.until("a wheel that turns", async || stage.attribute(WHEEL, "transform").await != before).await;
    stage.done("4 load torque 1.5").await;
    stage.says("[data-place='4'] svg", "load 1.50 N·m").await;
    stage.to_top().await;
    stage.click(".world-changes li:first-child button").await;
    stage.says(".world-changes li:first-child b", "4 load torque 0").await;
    // A slider stands where the supply is, and a key moves it by a volt.
    stage
        .until("the supply as delivered", async || {
            stage.script("return document.querySelector('#world-slider-supply').value").await == "48"
        })
        .await;
    stage.press_on("#world-slider-supply", Key::Right.into()).await;
    stage.client.release_actions().await.expect("a release");
    stage.says(".world-changes li:first-child b", "4 supply 49").await;
    stage.says("[data-place='4']", "49.0 V").await;
    // A form that is made from the simulator's own words.
    stage.click("[data-place='2']").await;
    stage.find("[data-place='2'][aria-pressed=true]").await;
    stage.click("[data-group=input] [data-line='input 1']").await;
    stage.says(".world-changes li:first-child b", "2 input X0 1").await;
    stage.says("[data-place='2'] .lamps", "● X0").await;
    stage.to_top().await;
    stage.shoot("world").await;
    // What makes no sense is answered with what was expected.
    let field = stage.find("#world-line").await;
    field.send_keys("4 supply much").await.expect("typed");
    stage.click("#world-do").await;
    stage.says("#world-answer", "NODE supply VOLTS").await;
    field.clear().await.expect("cleared");
    // The cable of the wheel: it is silent, and comes back.
    stage.click("[data-place='4']").await;
    stage.click("[data-group=cable] [data-line='cable cut']").await;
    stage.says("[data-place='4']", "bus cut").await;
    stage.to_top().await;
    let silent = |wheel: &Value| wheel["drive"].is_null();
    stage.wheel("a wheel that is silent", silent);
    stage.click(".world-changes li:first-child button").await;
    stage.wheel("a wheel that is heard again", |wheel| !silent(wheel));
    stage.to_top().await;
    stage.click("#theme").await;
    stage.shoot("world_dark").await;
    // A wire that destroys frames: the Bus view counts them.
    stage.to_top().await;
    stage.done("bus corrupt 0.05").await;
    stage.studio.wait("error frames", |state| state["bus"]["health"]["error_frames"].as_u64() > Some(3));
    stage.done("bus corrupt off").await;
    stage.click("#tabs [data-name=bus]").await;
    stage.says("#wire", "error-active, transmit error counter ").await;
    stage.click("#tabs [data-name=faults]").await;
    let silent = stage.client.wait().at_most(PATIENCE).for_element(Locator::XPath("//*[contains(., 'silent')]"));
    silent.await.expect("it is reported");
    stage.close().await;
}

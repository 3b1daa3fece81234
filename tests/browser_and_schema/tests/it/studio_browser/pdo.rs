//! PDOs in a real browser: a mapping is put together, seen before, applied, seen in the trace, and undone.

use std::time::Duration;

use fantoccini::actions::{InputSource, MOUSE_BUTTON_LEFT, MouseActions, PointerAction};
use fantoccini::elements::Element;
use fantoccini::key::Key;

use super::{Locator, RETRY, Stage};

impl Stage {
    /// The header stays where it is: what lies below it cannot be clicked.
    pub(super) async fn to_top(&self) {
        self.client.execute("scrollTo(0, 0)", Vec::new()).await.expect("it scrolls");
    }

    /// Takes hold of the left part of one thing and lets it go over another, until that has its effect: what the page moves meanwhile is
    /// missed.
    async fn drag(&self, from: &str, to: &str, wanted: &str) {
        const TIME: Option<Duration> = Some(Duration::from_millis(200));
        let over = |element: Element| PointerAction::MoveToElement { element, duration: TIME, x: -60.0, y: 0.0 };
        self.until(wanted, async || {
            let pointer = MouseActions::new("mouse".into())
                .then(over(self.find(from).await))
                .then(PointerAction::Down { button: MOUSE_BUTTON_LEFT })
                .then(PointerAction::MoveBy { duration: TIME, x: 4.0, y: 4.0 })
                .then(over(self.find(to).await))
                .then(PointerAction::Up { button: MOUSE_BUTTON_LEFT });
            self.client.perform_actions(pointer).await.expect("a drag");
            self.client.release_actions().await.expect("a release");
            self.client.wait().at_most(RETRY).for_element(Locator::Css(wanted)).await.is_ok()
        })
        .await;
    }

    /// Nothing stands beyond the right edge of a window of this size.
    async fn fits(&self, width: u32, height: u32) {
        self.client.set_window_size(width, height).await.expect("another size");
        let wide = "return document.documentElement.scrollWidth - document.documentElement.clientWidth";
        self.until("a page as wide as its window", async || {
            self.client.execute(wide, Vec::new()).await.expect("it answers").as_i64() == Some(0)
        })
        .await;
    }
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_pdo_is_mapped_seen_in_the_trace_and_undone() {
    let stage = Stage::open("mapped").await;
    stage.take_the_wheel().await;
    stage.click("#tabs [data-name=pdo]").await;
    // ZLAC8030L quick start guide V1.00, chapter 9: it counts PDOs from 0, and its TPDOs carry nothing as delivered.
    let row = stage.says("tr[data-pdo=TPDO1]", "nothing is mapped into it").await;
    assert!(row.contains("manual: TPDO0") && row.contains("184h") && row.contains("on events"), "{row}");
    stage.click_for("button[data-edit=TPDO1]", "#pdo-search").await;
    let search = stage.find("#pdo-search").await;
    search.send_keys("statusword").await.expect("typed");
    stage.click("button[data-add='6041h:00']").await;
    search.clear().await.expect("cleared");
    search.send_keys("position_actual").await.expect("typed");
    stage.click("button[data-add='6064h:00']").await;
    stage.says("#pdo-bits", "48 of 64 bits, 2 of 4 objects").await;
    // What does not fit any more, and what the drive does not let be mapped, is there with the reason.
    search.clear().await.expect("cleared");
    search.send_keys("velocity_actual").await.expect("typed");
    stage.says(".found", "32 bits, 16 free").await;
    search.clear().await.expect("cleared");
    search.send_keys("1017").await.expect("typed");
    stage.says(".found", "does not let it be mapped").await;
    stage.find("button[data-add='1017h:00'][disabled]").await;
    // The order, by the keyboard.
    let first = stage.find("li[data-mapped='6064h:00']").await;
    first.send_keys(&(Key::Alt + &char::from(Key::Up).to_string())).await.expect("a press");
    stage.find("li[data-mapped='6064h:00']:first-child").await;
    // And by the pointer: down, and up again.
    stage.drag(".mapped li:first-child", ".mapped li:last-child", "li[data-mapped='6041h:00']:first-child").await;
    stage.drag(".mapped li:last-child", ".mapped li:first-child", "li[data-mapped='6064h:00']:first-child").await;
    let timer = stage.find("#pdo-event_ms").await;
    timer.clear().await.expect("cleared");
    timer.send_keys("100").await.expect("typed");
    stage.says("#pdo-notice", "Nothing has been written yet").await;
    let load = stage.says("#pdo-load", "in time").await;
    assert!(load.contains('→'), "{load}");
    stage.says("#pdo-plan", "off while it is changed").await;
    let bar = "document.querySelector('.pdo-editor').scrollIntoView()";
    stage.client.execute(bar, Vec::new()).await.expect("it scrolls");
    stage.shoot("pdo").await;
    stage.click("#pdo-apply").await;
    stage.says("#pdo-notice", "TPDO1: written and read back").await;
    stage.says("tr[data-pdo=TPDO1]", "6064h:00 position_actual_value (32), 6041h:00 statusword (16)").await;
    stage.to_top().await;
    stage.click("#pdo-nmt").await;
    stage.says("section.pdo > p", "operational").await;
    stage.click("#tabs [data-name=trace]").await;
    stage.click("[data-kind=pdo]").await;
    stage.says(".trace-list", "position_actual_value").await;
    stage.click("#tabs [data-name=pdo]").await;
    stage.click("#theme").await;
    stage.to_top().await;
    stage.shoot("pdo_other_theme").await;
    stage.click("#pdo-undo").await;
    stage.says("tr[data-pdo=TPDO1]", "nothing is mapped into it").await;
    // What a manual forbids is grey, with its section: M4230E17B50 and its siblings, 5.08.
    stage.choose_drive("pdo", 1).await;
    stage.click_for("button[data-edit=TPDO1]", "#pdo-fixed").await;
    stage.says("#pdo-fixed", "Its mapping is fixed").await;
    stage.find(".mapped button[disabled]").await;
    stage.find("#pdo-event_ms[disabled]").await;
    stage.shoot("pdo_fixed_other_theme").await;
    stage.fits(820, 1100).await;
    stage.shoot("pdo_tablet_other_theme").await;
    stage.close().await;
}

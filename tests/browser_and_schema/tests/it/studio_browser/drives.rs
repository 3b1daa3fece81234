//! More drives than fit into a row of buttons: a list with a filter, and a table that is sorted.

use serde_json::Value;

use super::Stage;

/// The drives that a list of the Motion view offers, by their node-IDs.
const OFFERED: &str =
    "return [...document.querySelectorAll('.motion .many-drives li')].map((of) => Number(of.dataset.value))";

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn of_nine_drives_one_is_found_by_a_word_and_the_table_is_sorted() {
    let folder = processes::scratch("studio_nine_drives");
    let machine = folder.join("machine.toml");
    // A turn of the spindle of node 7 moves 90 mm.
    let of = |node| if node == 7 { "\"zlim42c\", units = { feed_constant = \"90mm\" }" } else { "\"cia402\"" };
    let drive = |node: u8| format!("    {{ model = {}, node = {node} }},\n", of(node));
    let text = format!("drive = [\n{}]\n", (1..=9).map(drive).collect::<String>());
    std::fs::write(&machine, text).expect("it is written");
    let bus = format!("sim:{}", machine.display());
    let stage = Stage::open_with("drives", &["--bus", &bus], 9).await;
    stage.says("#bus-summary", "9 nodes · 9 drives · 0 enabled · no faults").await;
    let rows = "return [...document.querySelectorAll('.bus tbody tr')].map((of) => Number(of.dataset.node))";
    let nodes = |script: &'static str| async { stage.script(script).await };
    assert_eq!(nodes(rows).await, Value::from((1..=9).collect::<Vec<_>>()));
    stage.click(".bus th[data-label=Node] button").await;
    stage.until("the other way", async || nodes(rows).await == Value::from((1..=9).rev().collect::<Vec<_>>())).await;
    stage.click("#tabs [data-name=motion]").await;
    stage.find(".motion .chooser[aria-label=Drive][hidden]").await;
    stage.until("all in the list", async || nodes(OFFERED).await.as_array().is_some_and(|all| all.len() == 9)).await;
    stage.find(".motion .many-drives input").await.send_keys("zlim").await.expect("typed");
    // The one that is chosen stays in the list.
    stage.until("those that have the word", async || nodes(OFFERED).await == Value::from(vec![1, 7])).await;
    stage.choose(".motion .many-drives .choice", "7").await;
    stage.says(".motion h2", "Node 7: ").await;
    stage.shoot("nine_drives").await;
    // 90° are 22.5 mm there, and the 20° of a test motion 5 mm.
    let [distance, amplitude] =
        ["#move-degrees", "#test-by_deg"].map(|css| format!("return document.querySelector('{css}').value"));
    stage.choose("#motion-unit-angle_degrees", "mm").await;
    stage.until("the distance is in mm", async || stage.script(&distance).await == "22.5").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.until("the amplitude is in mm", async || stage.script(&amplitude).await == "5").await;
    stage.click("#tabs [data-name=motion]").await;
    stage.is_usable("a list of drives").await;
    stage.close().await;
}

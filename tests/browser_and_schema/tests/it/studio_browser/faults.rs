//! Faults in a real browser: with their remedy, the frames around them, and a button in each view that shows one.

use fantoccini::Locator;
use fantoccini::key::Key;
use processes::Simulator;

use super::{Stage, press};

/// ZLAC8030L quick start guide V1.00, chapters 8 and 9: 0001h is over-voltage.
#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_fault_is_shown_with_its_remedy_and_the_frames_around() {
    let drives = ["zlac8030l@4", "m4230e17b50@1", "zlim42c@2"].map(|drive| ["--drive", drive]).concat();
    let mut simulator = Simulator::start(&[&drives[..], &["--serve", "socketcand://127.0.0.1:0"]].concat());
    let bus = simulator.bus("socketcand");
    // A scan waits as long for nodes that are not there.
    let patient = ["--timeout", "5s", "--bus", &bus, "--model", "4=zlac8030l", "--model", "2=zlim42c"];
    let stage = Stage::open_on("faults", &patient).await;
    let ok = simulator.ask("4 supply 80");
    assert_eq!(ok["ok"], true, "{ok}");
    stage.wheel("a fault", |wheel| wheel["drive"]["fault_code"] == 1);
    // The page is opened anew: what happened before is there.
    stage.load().await;
    stage.click("#tabs [data-name=faults]").await;
    stage.click(".happening.emcy.lasts").await;
    stage.says("#remedy", "bleeder resistor").await;
    stage.says("#fault-source", "ZLAC8030L quick start guide V1.00, chapters 8 and 9").await;
    stage.says(".around .marked", "EMCY node 4: 0001h (over-voltage)").await;
    stage.shoot("faults").await;
    stage.click(".around a").await;
    let saved = stage.saved("node4_fault.log").await;
    let saved = std::fs::read_to_string(saved).expect("text");
    assert!(saved.contains(" 084#0100") && saved.lines().count() > 3, "{saved}");
    stage.click(".happening.emcy").await;
    // Above stands what came next: the keys go through the list.
    stage.client.perform_actions(press(Key::Up.into())).await.expect("a key");
    stage.client.release_actions().await.expect("a release");
    stage.find(".happening.emcy:not([aria-pressed=true])").await;
    stage.find(".happening:not(.emcy)[aria-pressed=true]:focus").await;
    stage.says("#concerns", "1 drive with a fault").await;
    stage.click("#tabs [data-name=bus]").await;
    stage.find("#bus-filter").await.send_keys("over-voltage").await.expect("typed");
    stage
        .until("the drive with the fault alone", async || {
            let listed = stage.client.find_all(Locator::Css(".bus tbody tr")).await.expect("rows");
            listed.len() == 1
        })
        .await;
    stage.says("#bus-summary", "3 nodes · 3 drives · 0 enabled · 1 drive with a fault").await;
    simulator.ask("4 supply 48");
    stage.click("#take").await;
    stage.find("#release").await;
    stage.click("#concerns").await;
    // The remedy of a fault has its button.
    stage.click(".happening.emcy.lasts").await;
    stage.click(".fault-detail [data-does=reset_fault]").await;
    stage.wheel("no fault", |wheel| wheel["drive"]["fault_code"] == 0);
    stage.find("#concerns[hidden]").await;
    stage.find(".happening.emcy:not(.lasts)").await;
    // And in the Drive view, where it is read.
    simulator.ask("4 supply 80");
    stage.wheel("a fault", |wheel| wheel["drive"]["fault_code"] == 1);
    simulator.ask("4 supply 48");
    stage.click("#tabs [data-name=drive]").await;
    stage.choose_drive("drive", 3).await;
    stage.says(".drive .faults", "over-voltage").await;
    stage.click(".drive [data-does=reset_fault]").await;
    stage.wheel("no fault", |wheel| wheel["drive"]["fault_code"] == 0);
    stage.says(".drive .faults", "None").await;
    stage.click("#tabs [data-name=faults]").await;
    stage.click("#theme").await;
    stage.shoot("faults_other_theme").await;
    stage.close().await;
}

//! Parameters in a real browser: changed in their row, kept as a file, compared, and rolled back.

use super::Stage;

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn a_parameter_is_found_changed_and_rolled_back() {
    let stage = Stage::open("parameters").await;
    stage.take_the_wheel().await;
    stage.click("#tabs [data-name=parameters]").await;
    stage.click(".parameters details.group:nth-of-type(1) summary").await;
    stage.find(".parameters details[open] tbody tr:nth-child(2)").await;
    stage.shoot("parameters").await;
    // A space in a text field is one, as long as nothing moves.
    stage.find("#parameters-search").await.send_keys("2008 speed").await.expect("typed");
    let row = ".parameters tr[data-object='2008h:00']";
    // ZLAC8030L quick start guide V1.00, chapter 9: 1 r/min as delivered, 1 to 300.
    stage.says(row, "1 r/min").await;
    stage.says(&format!("{row} td[data-label='One count']"), "r/min").await;
    stage.click(row).await;
    stage.find(&format!("{row} #parameter-value")).await;
    stage.find("#parameter-value").await.send_keys("500").await.expect("typed");
    stage.click("#parameter-write").await;
    stage.says("#parameter-notice", "1 to 300").await;
    let field = stage.find("#parameter-value").await;
    field.clear().await.expect("cleared");
    field.send_keys("60rpm").await.expect("typed");
    stage.click("#parameter-write").await;
    stage.says("#parameter-notice", "Written and read back").await;
    stage.says(row, "60 r/min").await;
    stage.find(".parameters tr.changed[data-object='2008h:00']").await;
    stage.says(".parameters tr.chosen", "3C 00").await;
    stage.click("#theme").await;
    stage.shoot("parameters_other_theme").await;
    stage.click("#parameters-backup").await;
    let kept = std::fs::read_to_string(stage.saved("node4.toml").await).expect("text");
    assert!(kept.contains("\"2008:00\" = 60"), "{kept}");
    stage.click("#parameters-backup-dcf").await;
    let kept = stage.saved("node4.dcf").await;
    stage.click("#parameters-back").await;
    stage.says(row, "1 r/min").await;
    stage.find("#parameters-file").await.send_keys(&kept.to_string_lossy()).await.expect("chosen");
    stage.says("#parameters-notice", "node4.dcf").await;
    stage.says("#parameters-notice", "1 differ from the drive").await;
    let file = stage.profile.join("node4.toml");
    stage.find("#parameters-file").await.send_keys(&file.to_string_lossy()).await.expect("chosen");
    stage.says("#parameters-notice", "1 differ from the drive").await;
    stage.find(".parameters-diff tr.other").await;
    stage.click("#parameters-plan").await;
    stage.says("#parameters-notice", "1 write, in this order").await;
    stage.says(".parameters-diff", "60 r/min").await;
    stage.shoot("parameters_file").await;
    stage.click("#parameters-apply").await;
    stage.says("#parameters-notice", "1 write done and read back").await;
    stage.says(row, "60 r/min").await;
    stage.close().await;
}

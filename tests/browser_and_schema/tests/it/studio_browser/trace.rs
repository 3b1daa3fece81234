//! The trace in a real browser: what passes in words, saved and loaded, and the lines that are in view.

use fantoccini::Locator;
use serde_json::Value;

use super::Stage;

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_trace_says_what_passes_and_a_filter_hides_the_rest() {
    let stage = Stage::open("trace").await;
    stage.take_the_wheel().await;
    stage.click("#go-move").await;
    let angle = |wheel: &Value| wheel["drive"]["angle_degrees"].as_f64().expect("an angle");
    stage.wheel("a quarter of a turn", |wheel| (angle(wheel) - 90.0).abs() < 2.0);
    stage.click("#tabs [data-name=trace]").await;
    // What the studio itself reads is hidden until it is asked for.
    stage.line("SDO node 4: wrote 6040h:00 controlword = ").await;
    let readings = "return [...document.querySelectorAll('.trace-row')].filter((row) => row.textContent.includes(': read ')).length";
    assert_eq!(stage.client.execute(readings, vec![]).await.expect("it runs"), 0);
    stage.shoot("trace").await;
    stage.find("#trace-nodes").await.send_keys("4").await.expect("typed");
    stage.find("#trace-text").await.send_keys("target_position").await.expect("typed");
    // 90 degrees of 4096 counts a turn (ZLAC8030L).
    stage.line("SDO node 4: wrote 607Ah:00 target_position = 1024").await;
    // The list stands still while it is read.
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=true]").await;
    let words = stage.client.find_all(Locator::Css(".trace-list .trace-row")).await.expect("lines");
    assert!(!words.is_empty());
    for line in words {
        let text = line.text().await.expect("text");
        assert!(text.contains("target_position") && text.contains("node 4"), "the filter let through: {text}");
    }
    stage.click("#theme").await;
    stage.shoot("trace_filtered_other_theme").await;
    stage.click("#trace-save-log").await;
    let saved = stage.saved("trace.log").await;
    let decoded =
        processes::ferrodrive(&["--bus", &format!("log:{}", saved.display()), "--model", "4=zlac8030l", "dump"]);
    assert_eq!(decoded.status, Some(0), "{}", decoded.err);
    assert!(decoded.out.contains("write 607Ah:00 target_position = 1024"), "{}", decoded.out);
    assert!(!decoded.out.contains("node 2"), "of node 4 alone");
    other_forms_hold_the_same(&stage, &saved).await;
    a_log_is_shown_in_its_place(&stage, &saved).await;
    identifiers_and_the_cursor(&stage).await;
    stage.close().await;
}

/// The other forms, read by the command line, have at least the frames that candump's had some time before.
async fn other_forms_hold_the_same(stage: &Stage, candump: &std::path::Path) {
    let decode = |file: &std::path::Path| {
        let bus = format!("log:{}", file.display());
        let decoded = processes::ferrodrive(&["--bus", &bus, "--model", "4=zlac8030l", "--json", "dump"]);
        assert_eq!(decoded.status, Some(0), "{}", decoded.err);
        let line = |line: &str| serde_json::from_str::<Value>(line).expect("JSON")["frame"].clone();
        decoded.out.lines().map(line).filter(|frame| frame.is_string()).collect::<Vec<_>>()
    };
    let earlier = decode(candump);
    for form in ["pcapng", "asc", "blf"] {
        stage.click(&format!("#trace-save-{form}")).await;
        let later = decode(&stage.saved(&format!("trace.{form}")).await);
        let (had, has) = (earlier.len(), later.len());
        assert!(had > 100 && later.starts_with(&earlier), "{form}: {had} and {has} frames");
    }
}

/// The log that was saved is loaded in place of the bus: every frame of it is read, by the same words, and the bus comes back.
async fn a_log_is_shown_in_its_place(stage: &Stage, log: &std::path::Path) {
    let frames = std::fs::read_to_string(log).expect("text").lines().count();
    stage.find("#trace-file").await.send_keys(&log.to_string_lossy()).await.expect("chosen");
    stage.says("#trace-status", &format!("{frames} of {frames} frames read")).await;
    // The filter of before holds.
    stage.line("SDO node 4: wrote 607Ah:00 target_position = 1024").await;
    stage.find("#trace-pause[hidden]").await;
    stage.shoot("trace_log").await;
    stage.click("#trace-live").await;
    stage.says("#trace-status", "the studio keeps").await;
    stage.line("SDO node 4: wrote 607Ah:00 target_position = 1024").await;
}

/// A line that is pressed is where the cursor of the scope stands, and back; by COB-ID the studio's readings show their period.
async fn identifiers_and_the_cursor(stage: &Stage) {
    stage.click(".trace-list .trace-row").await;
    stage.find(".trace-row.chosen-line").await;
    stage.choose("#trace-delta", "chosen").await;
    stage.says(".trace-row.chosen-line span", "0.000000").await;
    stage.click("#tabs [data-name=scope]").await;
    stage.says(".readout", "A at ").await;
    stage.click("#tabs [data-name=trace]").await;
    stage.click("#trace-cursor").await;
    stage.find(".trace-row.chosen-line").await;
    for field in ["#trace-nodes", "#trace-text"] {
        stage.client.execute("const field = document.querySelector(arguments[0]); field.value = ''; field.dispatchEvent(new Event('input'))", vec![field.into()]).await.expect("cleared");
    }
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=false]").await;
    stage.click("#trace-quiet").await;
    stage.click("#trace-by-id").await;
    stage.find(".identifiers tr[data-id='604']").await;
    // The studio asks each of three drives for some values nine times a second: several requests in each 113 ms.
    let period = "const cells = document.querySelectorAll(\".identifiers tr[data-id='604'] td\"); return [Number(cells[3].textContent), Number(cells[4].textContent)]";
    stage
        .until("a period of the requests", async || {
            let read = stage.client.execute(period, vec![]).await.expect("it runs");
            let (count, period_ms) = (read[0].as_f64().unwrap_or(0.0), read[1].as_f64().unwrap_or(0.0));
            count > 50.0 && period_ms > 1.0 && period_ms < 113.0
        })
        .await;
    stage.shoot("trace_by_id").await;
    stage.click("#send summary").await;
    stage.click("#send .send").await;
    stage.says("#send-status", "604#4041600000000000 sent; sent: SDO node 4: read 6041h:00").await;
}

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
async fn the_trace_draws_what_is_in_view_and_fetches_what_is_older() {
    let stage = Stage::open("trace_scrolled").await;
    let kept = |script: &'static str| async {
        // A list that is not full is as tall as its view, which is not a whole number of lines.
        stage.client.execute(script, vec![]).await.expect("it runs").as_f64().expect("a number") as u64
    };
    const FIRST: &str = "return Number(document.querySelector('.trace-list .trace-row').dataset.number)";
    const DRAWN: &str = "return document.querySelectorAll('.trace-list .trace-row').length";
    const TALL: &str = "return document.querySelector('.trace-list').scrollHeight / 24";
    stage.click("#tabs [data-name=trace]").await;
    stage.click("#trace-quiet").await;
    stage.click("#trace-transfers").await;
    stage.until("lines that do not fit into the view", async || kept(TALL).await > 500).await;
    assert!(kept(DRAWN).await < 60, "only what is in view is drawn");
    let newest = kept(FIRST).await;
    stage.until("new lines, of which the newest are in view", async || kept(FIRST).await > newest).await;
    stage.click("#trace-pause").await;
    stage.find("#trace-pause[aria-pressed=true]").await;
    // Each time it comes to the top there is more above, until the first frame of all.
    let up = "const list = document.querySelector('.trace-list'); list.scrollTop = 0; \
              return Number(document.querySelector('.trace-list .trace-row').dataset.number)";
    stage.until("the first frame of all", async || kept(up).await == 0).await;
    assert!(kept(DRAWN).await < 60, "only what is in view is drawn");
    stage.close().await;
}

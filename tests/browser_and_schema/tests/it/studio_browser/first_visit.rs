//! The first visit on a slow line: 1 Mbit/s with a round trip of 150 ms, as Chromium makes it of the loopback (Chrome DevTools Protocol).
//!
//! What it takes is printed (`docs/performance.md`), not held: it is wall time of a machine that may be busy. Held is what makes it so short:
//! before the first rows there is one page, its style and one script, and the rest comes after them.

use serde_json::{Value, json};

use super::Stage;

/// When the views and the rows of the Bus view are there, in ms since the first request.
const WATCH: &str = "new MutationObserver(() => { \
    if (!window.tabs_ms && document.querySelector('#tabs button')) window.tabs_ms = performance.now(); \
    if (!window.rows_ms && document.querySelector('#view table tbody tr:nth-child(3)')) window.rows_ms = performance.now(); \
    }).observe(document, { subtree: true, childList: true })";

/// What was fetched: its path, when its request began, and its size on the line.
const FETCHED: &str = "const of = performance.getEntriesByType('resource').filter(({ name }) => name.startsWith('http')); \
    return { tabs_ms: window.tabs_ms, rows_ms: window.rows_ms, page: performance.getEntriesByType('navigation')[0].encodedBodySize, \
    fetched: of.map(({ name, startTime, encodedBodySize }) => [new URL(name).pathname, startTime, encodedBodySize]) }";

#[tokio::test]
#[ignore = "needs a browser: cargo xtask test --only studio"]
#[allow(clippy::print_stdout, reason = "what it measures is what it is for")]
async fn the_first_visit_fetches_little_before_the_first_rows() {
    let stage = Stage::open("first_visit").await;
    stage.client.goto("about:blank").await.expect("it is left");
    for command in ["Network.enable", "Network.clearBrowserCache", "Network.clearBrowserCookies", "Page.enable"] {
        stage.devtools(command, json!({})).await;
    }
    let bytes_s = 1_000_000 / 8;
    let slow = json!({ "offline": false, "latency": 150, "downloadThroughput": bytes_s, "uploadThroughput": bytes_s });
    stage.devtools("Network.emulateNetworkConditions", slow).await;
    stage.devtools("Page.addScriptToEvaluateOnNewDocument", json!({ "source": WATCH })).await;
    stage.load().await;
    // The other views come in the end.
    stage.until("all is fetched", async || is_fetched(&stage.script(FETCHED).await, "/page/later.js")).await;
    let seen = stage.script(FETCHED).await;
    let ms = |name: &str| seen[name].as_f64().unwrap_or_else(|| panic!("{name}: {seen}"));
    println!(
        "first visit at 150 ms and 1 Mbit/s: views after {:.0} ms, rows after {:.0} ms",
        ms("tabs_ms"),
        ms("rows_ms")
    );
    let (mut before, mut bytes) = (Vec::new(), seen["page"].as_f64().expect("a size"));
    for one in seen["fetched"].as_array().expect("a list") {
        if one[1].as_f64().expect("a time") < ms("rows_ms") {
            before.push(one[0].as_str().expect("a path"));
            bytes += one[2].as_f64().expect("a size");
        }
    }
    assert_eq!(before, ["/page/style.css", "/page/bundle.js"], "{seen}");
    // Four round trips (where no token is seen, page, script, socket) and a TCP connection before them are 0.75 s of 1.5 s; 25 kB are 0.2 s.
    assert!(bytes < 25_000.0, "{bytes} bytes: {seen}");
    stage.close().await;
}

fn is_fetched(seen: &Value, path: &str) -> bool {
    seen["fetched"].as_array().is_some_and(|all| all.iter().any(|one| one[0] == path && one[2].as_f64() > Some(0.0)))
}

//! Every view by axe-core (npm), which checks WCAG 2.2 A and AA and the best practice: light and dark, at a desk's and a telephone's width.

use std::path::PathBuf;

use serde_json::Value;

use super::Stage;
use super::safety::VIEWS;

/// Where `cargo xtask test --only studio` puts it.
fn axe() -> String {
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("../npm/axe-core/node_modules/axe-core/axe.min.js");
    std::fs::read_to_string(&file).unwrap_or_else(|error| {
        panic!("{}: {error}; cargo xtask test --only studio installs axe-core there", file.display())
    })
}

/// Everything in the view that can be opened is open.
const OPEN: &str = "document.querySelectorAll('#view details').forEach((one) => (one.open = true)); \
                    return !document.body.classList.contains('unseen') && document.querySelector('#view').textContent.length > 40";

/// A page whose state has just become stale (the machine is busy) is grey by intent: it is looked at again.
const RUN: &str = "const done = arguments[arguments.length - 1]; \
    axe.run(document, { resultTypes: ['violations'] }).then(({ violations }) => done(document.body.classList.contains('unseen') ? null : \
        violations.map(({ id, impact, nodes }) => `${impact} ${id}: ${nodes.map(({ target }) => target.join(' ')).join(', ')}`)))";

#[tokio::test]
#[ignore = "needs a browser and axe-core: cargo xtask test --only studio"]
async fn axe_finds_nothing_in_any_view_light_or_dark() {
    let axe = axe();
    let stage = Stage::open("axe").await;
    stage.client.execute(&axe, Vec::new()).await.expect("it is a script");
    stage.click("#take").await;
    stage.find("#release").await;
    let mut found = Vec::new();
    for (theme, width, height) in [("light", 1366, 768), ("dark", 320, 640)] {
        stage.device(width, height).await;
        let set = format!("document.documentElement.dataset.theme = '{theme}'");
        stage.client.execute(&set, Vec::new()).await.expect("it runs");
        for view in VIEWS {
            let show = format!("document.querySelector('#tabs [data-name={view}]').click()");
            stage.client.execute(&show, Vec::new()).await.expect("it runs");
            stage.until("a view", async || stage.client.execute(OPEN, vec![]).await.expect("it runs") == true).await;
            let violations = loop {
                match stage.client.execute_async(RUN, Vec::new()).await.expect("axe runs") {
                    Value::Null => {}
                    violations => break violations,
                }
            };
            let violations = violations.as_array().expect("a list");
            found.extend(
                violations.iter().map(|text| format!("{theme}, {view}: {}", text.as_str().unwrap_or_default())),
            );
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    stage.close().await;
}

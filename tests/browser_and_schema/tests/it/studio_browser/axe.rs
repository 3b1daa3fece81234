//! Every view by axe-core (npm), which checks WCAG 2.2 A and AA and the best practice: light and dark, both at a desk's and a telephone's width.

use std::path::PathBuf;

use super::Stage;
use super::safety::VIEWS;

/// Where `cargo xtask test --only studio` puts it.
fn axe() -> Option<String> {
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("../npm/axe-core/node_modules/axe-core/axe.min.js");
    std::fs::read_to_string(file).ok()
}

/// Everything in the view that can be opened is open.
const OPEN: &str = "document.querySelectorAll('#view details').forEach((one) => (one.open = true)); \
                    return !document.body.classList.contains('unseen') && document.querySelector('#view').textContent.length > 40";

/// The rules that depend on whether a page is light or dark.
const COLOURS: &str = "['color-contrast', 'link-in-text-block']";

/// A page whose state is stale (the machine is busy) is grey by intent, which is not what is looked at.
const NOT_GREY: &str = "const sheet = document.styleSheets[0]; \
    sheet.insertRule('.unseen #view, .unseen #bus-line, .unseen #tour { opacity: 1 !important }', sheet.cssRules.length)";

fn run(only: Option<&str>) -> String {
    let only = only.map_or(String::new(), |only| format!("runOnly: {only},"));
    format!(
        "const done = arguments[arguments.length - 1]; \
         axe.run(document, {{ {only} resultTypes: ['violations'] }}).then(({{ violations }}) => done(violations.map( \
         ({{ id, impact, nodes }}) => `${{impact}} ${{id}}: ${{nodes.map(({{ target }}) => target.join(' ')).join(', ')}}`)))"
    )
}

impl Stage {
    /// What axe finds in the page as it is, light and dark.
    async fn violations(&self) -> Vec<String> {
        let mut found = Vec::new();
        self.script(NOT_GREY).await;
        for (theme, only) in [("light", None), ("dark", Some(COLOURS))] {
            self.script(&format!("document.documentElement.dataset.theme = '{theme}'")).await;
            let of_theme = self.client.execute_async(&run(only), Vec::new()).await.expect("axe runs");
            let of_theme = of_theme.as_array().expect("a list");
            found.extend(of_theme.iter().map(|text| format!("{theme}: {}", text.as_str().unwrap_or_default())));
        }
        found
    }

    /// Nothing is found in the page as it is, if axe-core is there.
    pub(super) async fn is_usable(&self, what: &str) {
        let Some(axe) = axe() else { return };
        self.client.execute(&axe, Vec::new()).await.expect("it is a script");
        let found = self.violations().await;
        assert!(found.is_empty(), "{what}: {}", found.join("\n"));
    }
}

#[tokio::test]
#[ignore = "needs a browser and axe-core: cargo xtask test --only studio"]
async fn axe_finds_nothing_in_any_view_light_or_dark() {
    let axe = axe().expect("cargo xtask test --only studio installs axe-core");
    let stage = Stage::open("axe").await;
    stage.client.execute(&axe, Vec::new()).await.expect("it is a script");
    stage.click("#take").await;
    stage.find("#release").await;
    let mut found = Vec::new();
    for (width, height) in [(1366, 768), (320, 640)] {
        stage.device(width, height).await;
        for view in VIEWS {
            stage.script(&format!("document.querySelector('#tabs [data-name={view}]').click()")).await;
            stage.until("a view", async || stage.script(OPEN).await == true).await;
            found.extend(stage.violations().await.into_iter().map(|text| format!("{view} at {width}, {text}")));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    stage.close().await;
}

//! The page of the studio in a real browser: Chromium, moved by its WebDriver.

use crate::tally::Tally;
use crate::{cargo_tests, debian, workspace};

/// The browser and what moves it, with the packages of Debian that they are in.
const PROGRAMS: &[(&str, &str)] = &[("chromium", "chromium"), ("chromedriver", "chromium-driver")];

pub(crate) fn step() -> Tally {
    if let Err(reason) = debian::install(PROGRAMS) {
        return Tally::skipped(reason);
    }
    // One browser at a time: each takes some hundred megabytes and a core.
    let words = ["test", "--workspace", "--test", "studio_browser", "--", "--ignored", "--test-threads=1"];
    cargo_tests::run(workspace::cargo().args(words))
}

//! The page of the studio in a real browser: Chromium, moved by its WebDriver.

use crate::tally::Tally;
use crate::test_programs::{self, How, SCHEMA_AND_BROWSER};
use crate::{debian, npm};

/// The browser and what moves it, with the packages of Debian that they are in.
const PROGRAMS: &[(&str, &str)] = &[("chromium", "chromium"), ("chromedriver", "chromium-driver")];

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    debian::install(PROGRAMS)
}

/// What judges whether people with a disability can use the page.
const AXE: &str = "axe-core";
const AXE_VERSION: &str = "4.14.1";

pub(crate) fn step() -> Tally {
    if let Err(reason) = fetch() {
        return Tally::skipped(reason);
    }
    let mut arguments = vec!["--ignored", "studio_browser::"];
    let without_axe = npm::install(AXE, AXE_VERSION, "axe.min.js").err();
    if without_axe.is_some() {
        arguments.extend(["--skip", "studio_browser::axe::"]);
    }
    // Three browsers at a time: each takes some hundred megabytes, and waits most of its time.
    let how = How { programs: 1, threads: 3, arguments: &arguments };
    let tally = test_programs::of_processes(SCHEMA_AND_BROWSER, how);
    match without_axe {
        Some(reason) if tally.failed == 0 => {
            Tally { skipped: tally.skipped + 1, note: format!("{AXE}: {reason}"), ..tally }
        }
        _ => tally,
    }
}

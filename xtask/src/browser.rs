//! The page of the studio in a real browser: Chromium, moved by its WebDriver.

use crate::debian;
use crate::tally::Tally;
use crate::test_programs::{self, How, SCHEMA_AND_BROWSER};

/// The browser and what moves it, with the packages of Debian that they are in.
const PROGRAMS: &[(&str, &str)] = &[("chromium", "chromium"), ("chromedriver", "chromium-driver")];

/// What the step takes of others.
pub(crate) fn fetch() -> Result<(), String> {
    debian::install(PROGRAMS)
}

pub(crate) fn step() -> Tally {
    if let Err(reason) = fetch() {
        return Tally::skipped(reason);
    }
    // One browser at a time: each takes some hundred megabytes and a core.
    let how = How { programs: 1, threads: 1, arguments: &["--ignored", "studio_browser::"] };
    test_programs::build(SCHEMA_AND_BROWSER).map_or_else(Tally::failed, |programs| test_programs::run(programs, how))
}

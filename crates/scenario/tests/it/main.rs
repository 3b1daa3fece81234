//! Scenarios as files. One program: a file each.

mod hostile_files;
mod scenario_words;
mod worked_scenarios;

//! Machine files, scenarios and records. One program: a file each.

mod check;
mod control;
mod documented;
mod hostile_files;
mod init;
mod scenario_words;
mod worked_scenarios;

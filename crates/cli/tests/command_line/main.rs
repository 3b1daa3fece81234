//! The command line on drives of its own: commands that end by themselves, in virtual time. One program: a file each.

mod boot;
mod broken_pipe;
mod completion;
mod conform;
mod cycles;
mod dump;
mod eds;
mod every_day;
mod groups;
mod handbook;
mod init;
mod json;
mod latency;
mod limits;
#[path = "../../src/tests/lines.rs"]
mod lines;
mod logs;
mod machine;
mod on_sim;
mod output;
mod params;
mod plan;
mod program;
mod recording;
mod run;
mod serving;
mod status;
mod sweep;
mod units;
mod usage;

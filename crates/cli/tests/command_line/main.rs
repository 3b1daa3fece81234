//! The command line on drives of its own: commands that end by themselves, in virtual time. One program: a file each.

mod broken_pipe;
mod completion;
mod cycles;
mod eds;
mod handbook;
mod init;
mod json;
mod machine;
mod on_sim;
mod output;
mod plan;
mod run;
mod status;
mod units;
mod usage;

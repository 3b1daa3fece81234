//! The project's own chores, in Rust, so that they run wherever the project builds.
//!
//! `cargo xtask test` runs what can fail; `cargo xtask tidy` checks what a program can check of the house
//! style. Nothing here is part of what users get.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a chore talks to a terminal")]

mod bare_metal;
mod bench;
mod bench_peers;
mod browser;
mod builder;
mod conform_peers;
mod cross;
mod debian;
mod defects;
mod dist;
mod examples;
mod idle;
mod libtest;
mod npm;
mod packages;
mod page;
mod peers;
mod pgo;
mod process;
mod program;
mod python;
mod say;
mod since;
mod site;
mod steps;
mod sysroot;
mod table;
mod tally;
mod test;
mod test_programs;
mod tidy;
mod times;
mod vcan;
mod wasm_order;
mod web;
mod wheel;
mod workspace;

use std::process::ExitCode;

const USAGE: &str = "\
The project's own chores.

  cargo xtask test               the quick list: every test in virtual time, with a table and a count at the end
  cargo xtask test --all         everything: also lints, real processes, Python, other people's programs, a browser
  cargo xtask test --only STEP   one step (may be repeated)
  cargo xtask test --list        the steps
  cargo xtask test --quick-since REVISION    the tests nearest to what differs from a revision of git
  cargo xtask test .. --timings  the slowest tests, too
  cargo xtask vcan-test          the tests that need CAN interfaces, in a virtual machine that has them
  cargo xtask tidy               the style that a program can check
  cargo xtask defects [--only NUMBER]..    do the tests notice what is wrong: defects put into a copy of the tree, one at a time
  cargo xtask wheel              the Python package, in dist/: the library, the binary, the interface for python-can
  cargo xtask web [-o FOLDER]    the studio with virtual drives in it, as static files; and the JavaScript package
  cargo xtask dist [aarch64]     what is released, in dist/: an archive of the program, the wheel, checksums
  cargo xtask pgo                the binary to release, optimised by what a training run does
  cargo xtask bench [--compare COMMIT] [ROW..]    what frames, control periods and cycles cost, in instructions; paired with a commit
  cargo xtask times [ROW..]      how long the first commands, the tests and pip take, each from a fresh clone
  cargo xtask conform-peers [NAME]..    the conformance suite against stacks of other people; writes the table of docs/conformance.md
  cargo xtask bench-peers        what a frame costs nodes of ours and of other people's stacks, as the tables of docs/performance.md
  cargo xtask idle [SECONDS]     what a simulator costs that waits, in per cent of a core
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        words if words.is_empty() || words.iter().any(|word| ["help", "--help", "-h"].contains(word)) => {
            print!("{USAGE}");
            ExitCode::SUCCESS
        }
        ["test", rest @ ..] => test::command(rest),
        ["tidy"] => tidy::command(),
        ["defects", rest @ ..] => defects::command(rest),
        ["dist"] => dist::command(None),
        ["dist", architecture] => dist::command(Some(architecture)),
        ["web", rest @ ..] => web::command(rest),
        ["wheel"] => wheel::command(),
        ["pgo"] => pgo::command(),
        ["bench-peers"] => bench_peers::command(),
        ["conform-peers", rest @ ..] => conform_peers::command(rest),
        ["vcan-test"] => vcan::command(),
        ["idle", rest @ ..] => idle::command(rest),
        ["bench", rest @ ..] => bench::command(rest),
        ["times", rest @ ..] => times::command(rest),
        _ => {
            eprint!("unknown chore: {}\n\n{USAGE}", words.join(" "));
            ExitCode::from(2)
        }
    }
}

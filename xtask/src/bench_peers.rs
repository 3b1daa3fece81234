//! `cargo xtask bench-peers`: what a frame costs a node of ours and nodes of other people's stacks, in one run, as the tables
//! of docs/performance.md.
//!
//! Instructions are counted by callgrind, as the difference of two lengths: they do not depend on what else the machine does.
//! Processor times stand beside them, since an interpreter's instructions say little; compare their ratios.

use std::path::Path;
use std::process::{Command, ExitCode};

use crate::conform_peers::{compiled_blocks, rust_program};
use crate::{process, python, workspace};

/// What is done, and the frame that begins it.
const EXCHANGES: &[(&str, &str)] = &[
    ("SDO expedited upload", "upload"),
    ("SDO expedited download", "download"),
    ("RPDO with 1 object", "rpdo"),
    ("TPDO with 1 object on SYNC", "tpdo"),
    ("a frame not for this node", "foreign"),
];
/// The nodes that one program has.
const COMPILED: &[&str] = &["ours", "canopen-rs", "zencan-node"];
const SCRIPT: &str = "tests/peers/stacks/canopen_python_costs.py";
const SHEET: &str = "tests/peers/stacks/stack.eds";

pub(crate) fn command() -> ExitCode {
    match tables() {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("bench-peers: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn tables() -> Result<(), String> {
    if !process::works("valgrind", &["--version"]) {
        return Err("valgrind is missing: install it".to_owned());
    }
    let nodes = rust_program("peer_costs", "release")?;
    let python = python::environment("peers-venv", "tests/peers/requirements.txt")?;
    println!(
        "| instructions; ns | ours | canopen-rs 0.6.1 | zencan-node 0.0.5 | canopen-python 2.4.1 |\n|---|---|---|---|---|"
    );
    for (what, exchange) in EXCHANGES {
        let mut cells = Vec::new();
        for node in COMPILED {
            let instructions = difference(&nodes, &[node, exchange], 10_000)?;
            cells.push(format!("{instructions:.0}; {:.0}", numbers(&nodes, &[node, exchange, "2000000"])?[0]));
        }
        let script = [SCRIPT, exchange, "100000", SHEET];
        cells.push(format!("{:.0} ns", numbers(&python, &script)?[0]));
        println!("| {what} | {} |", cells.join(" | "));
    }
    blocks(&nodes)
}

/// 64 KiB in blocks: both sides in one program.
fn blocks(nodes: &Path) -> Result<(), String> {
    println!(
        "\n| 64 KiB in blocks, client and server | instructions a byte | µs | of what the wire can carry |\n|---|---|---|---|"
    );
    let row = |name: &str, program: &Path, words: &[&str]| {
        let instructions = difference(program, words, 10)? / 65_536.0;
        let all = numbers(program, &[words, &["200"]].concat())?;
        let [ns, bits, least] = all[..] else { return Err(format!("{name}: expected three numbers, got {all:?}")) };
        println!("| {name} | {instructions:.1} | {:.0} | {:.1} % |", ns / 1000.0, least / bits * 100.0);
        Ok(())
    };
    row("upload, ours", nodes, &["ours", "upload-blocks"])?;
    row("download, ours", nodes, &["ours", "download-blocks"])?;
    match compiled_blocks() {
        Ok(lely) => {
            row("upload, Lely core 2.3", &lely, &["upload"])?;
            row("download, Lely core 2.3", &lely, &["download"])?;
        }
        Err(reason) => println!("Lely core: {reason}"),
    }
    Ok(())
}

/// Instructions of one exchange.
fn difference(program: &Path, words: &[&str], count: u32) -> Result<f64, String> {
    let [short, long] = [count, 2 * count].map(|count| collected(program, words, count));
    Ok((long? - short?) as f64 / f64::from(count))
}

/// Instructions of a whole run.
fn collected(program: &Path, words: &[&str], count: u32) -> Result<i64, String> {
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(words)
        .arg(count.to_string());
    let output = valgrind.output().map_err(|error| format!("cannot run valgrind: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let line = said.lines().find_map(|line| line.split_once("Collected : "));
    let number = line.and_then(|(_, number)| number.trim().parse().ok());
    number.filter(|_| output.status.success()).ok_or(format!("valgrind {}: {said}", program.display()))
}

/// The numbers that a program prints.
fn numbers(program: &Path, words: &[&str]) -> Result<Vec<f64>, String> {
    let mut command = Command::new(program);
    let output = process::output(command.current_dir(workspace::root()).args(words))?;
    let numbers: Vec<f64> = output.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    if numbers.is_empty() {
        Err(format!("{}: expected a number, got '{output}'", program.display()))
    } else {
        Ok(numbers)
    }
}

//! `cargo xtask conform-peers`: the conformance suite against stacks of other people, and the table of docs/conformance.md.
//!
//! Each stack runs as a program on the bus of `ferrodrive sim`, with the objects of an EDS. What a stack leaves to the
//! application stays undone. Counts go into the page's table; a failed case that the page does not explain is printed with
//! its frames, and is an error, and so is an explanation of a case that does not fail.

mod page;
mod stacks;

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitCode, Stdio};

use serde_json::Value;

use crate::{program, workspace};
use stacks::{STACKS, Stack};
pub(crate) use stacks::{compiled_blocks, rust_program};

const PAGE: &str = "docs/conformance.md";
const NODE: &str = "5";
/// On the same bus, so that there is one: `sim` has a drive at least.
const BYSTANDER: &str = "zlim42c@15";

/// Runs the suite against the stacks whose names contain one of the words, or against all.
pub(crate) fn command(words: &[&str]) -> ExitCode {
    match table(words) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            eprintln!("conform-peers: {PAGE} does not explain what failed");
            ExitCode::FAILURE
        }
        Err(reason) => {
            eprintln!("conform-peers: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// Writes a row for each stack; whether the page explains each failed case.
fn table(words: &[&str]) -> Result<bool, String> {
    let program = program::built()?;
    let chosen: Vec<&Stack> = STACKS
        .iter()
        .filter(|stack| words.is_empty() || words.iter().any(|word| stack.name.contains(word)))
        .filter(|stack| stack.missing().inspect(|reason| println!("{}: {reason}", stack.name)).is_none())
        .collect();
    let started = chosen.iter().map(|stack| Ok((stack.command()?, stack.eds.file(stack.name)?)));
    let started = started.collect::<Result<Vec<_>, String>>()?;
    // The suite waits most of the time: each stack has a bus of its own, and all run at once.
    let reports: Vec<Result<Value, String>> = std::thread::scope(|scope| {
        let run = |(node, eds)| scope.spawn(|| report_of(node, eds, &program));
        let running: Vec<_> = started.into_iter().map(run).collect();
        running.into_iter().map(|thread| thread.join().unwrap_or_else(|_| Err("panicked".to_owned()))).collect()
    });
    let mut good = true;
    for (stack, report) in chosen.iter().zip(reports) {
        good &= add_row(stack, &report.map_err(|reason| format!("{}: {reason}", stack.name))?)?;
    }
    Ok(good)
}

/// Writes the row of a stack; whether the page explains each failed case.
fn add_row(stack: &Stack, report: &Value) -> Result<bool, String> {
    let counts = ["pass", "fail", "not_applicable"].map(|name| report["summary"][name].as_u64().unwrap_or(0));
    println!("{}: {} passed, {} failed, {} not applicable", stack.name, counts[0], counts[1], counts[2]);
    let path = workspace::root().join(PAGE);
    let page = std::fs::read_to_string(&path).map_err(|error| format!("{PAGE}: {error}"))?;
    std::fs::write(&path, page::with_row(&page, stack.name, counts)?).map_err(|error| format!("{PAGE}: {error}"))?;
    Ok(is_explained(report, &page::explained(&page, stack.name)?))
}

/// Prints what is not as the page says.
fn is_explained(report: &Value, explained: &BTreeSet<String>) -> bool {
    let failed = report["cases"].as_array().into_iter().flatten().filter(|case| case["result"] == "fail");
    let mut open = explained.clone();
    let mut good = true;
    for case in failed {
        let words = ["id", "clause", "why"].map(|name| case[name].as_str().unwrap_or_default());
        if open.remove(words[0]) {
            continue;
        }
        let frames: Vec<&str> = case["frames"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        println!("  {} ({}): {}\n    {}", words[0], words[1], words[2], frames.join(" "));
        good = false;
    }
    open.iter().for_each(|id| println!("  {id}: does not fail, and {PAGE} says that it does"));
    for left in report["not_restored"].as_array().into_iter().flatten() {
        println!("  not put back: {left}");
    }
    good && open.is_empty()
}

/// A program that ends with the value; its output is kept open, since it may go on to print.
struct Ends(Child, Option<BufReader<ChildStdout>>);

impl Drop for Ends {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a program and waits for its first line.
fn started(command: &mut Command) -> Result<(Ends, String), String> {
    let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = Ends(child.map_err(|error| format!("{command:?}: {error}"))?, None);
    let mut out = BufReader::new(child.0.stdout.take().ok_or("no standard output")?);
    let mut line = String::new();
    out.read_line(&mut line).map_err(|error| error.to_string())?;
    child.1 = Some(out);
    Ok((child, line.trim().to_owned()))
}

/// The report of the suite about a node that this command starts.
fn report_of(mut node: Command, eds: PathBuf, program: &Path) -> Result<Value, String> {
    let served = ["sim", "--drive", BYSTANDER, "--serve", "socketcand://127.0.0.1:0"];
    let (_bus, line) = started(Command::new(program).args(served))?;
    let address =
        line.strip_prefix("ready socketcand://").ok_or(format!("expected the bus's address, got '{line}'"))?;
    let (host, port) = address.rsplit_once(':').ok_or(format!("expected HOST:PORT, got '{address}'"))?;
    node.args([host, port, NODE]).arg(&eds);
    let (_node, line) = started(&mut node)?;
    if line != "running" {
        return Err(format!("it does not run: {line}"));
    }
    let mut suite = Command::new(program);
    suite.args(["--bus", &format!("socketcand://{address}/can0"), "conform", NODE, "--json", "--eds"]).arg(&eds);
    let output = suite.output().map_err(|error| error.to_string())?;
    let report: Value = serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())?;
    // Without a summary no case was asked.
    if report["summary"].is_null() { Err(report["error"].to_string()) } else { Ok(report) }
}

//! `cargo xtask conform-peers`: the conformance suite against stacks of other people, and the table of docs/conformance.md.
//!
//! Each stack runs as a program on the bus of `ferrodrive sim`, with the objects of an EDS. What a stack leaves to the
//! application stays undone. Counts go into the page's table; a failed case that the page does not explain is printed with
//! its frames, and is an error, and so is an explanation of a case that does not fail. Stacks run by the clock: what differs
//! from the page is asked again, alone, since a busy machine keeps a program waiting for longer than a case waits for it.

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
/// How often what differs from the page is asked again.
const AGAIN: usize = 6;
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
    let path = workspace::root().join(PAGE);
    let mut page = std::fs::read_to_string(&path).map_err(|error| format!("{PAGE}: {error}"))?;
    let chosen: Vec<&Stack> = STACKS
        .iter()
        .filter(|stack| words.is_empty() || words.iter().any(|word| stack.name.contains(word)))
        .filter(|stack| stack.missing().inspect(|reason| println!("{}: {reason}", stack.name)).is_none())
        .collect();
    let nodes = chosen.iter().map(|stack| {
        let explained = page::explained(&page, stack.name)?;
        Ok(PeerNode { command: stack.command()?, eds: stack.eds.file(stack.name)?, explained })
    });
    let nodes = nodes.collect::<Result<Vec<_>, String>>()?;
    // The suite waits most of the time: each stack has a bus of its own, and all run at once.
    let asked: Vec<Result<CaseResults, String>> = std::thread::scope(|scope| {
        let running: Vec<_> = nodes.iter().map(|node| scope.spawn(|| node.asked(&program))).collect();
        running.into_iter().map(|thread| thread.join().unwrap_or_else(|_| Err("panicked".to_owned()))).collect()
    });
    let mut good = true;
    for ((stack, node), asked) in chosen.iter().zip(&nodes).zip(asked) {
        let asked = asked.map_err(|reason| format!("{}: {reason}", stack.name))?;
        let [passed, failed, not_applicable, not_run] =
            ["pass", "fail", "not_applicable", "not_run"].map(|result| asked.count(result));
        let counts = [passed, failed, not_applicable + not_run];
        println!("{}: {passed} passed, {failed} failed, {} not applicable or not run", stack.name, counts[2]);
        page = page::with_row(&page, stack.name, counts)?;
        good &= asked.is_as(&node.explained);
    }
    std::fs::write(&path, page).map_err(|error| format!("{PAGE}: {error}"))?;
    Ok(good)
}

/// A node of a stack, how it is started, and the cases that the page says it fails.
struct PeerNode {
    command: Command,
    eds: PathBuf,
    explained: BTreeSet<String>,
}

/// The cases that a node was asked, by their last results, in order; and what was left otherwise than it was.
#[derive(Default)]
struct CaseResults {
    cases: Vec<Value>,
    not_restored: Vec<Value>,
}

fn text<'a>(case: &'a Value, name: &str) -> &'a str {
    case[name].as_str().unwrap_or_default()
}

impl CaseResults {
    fn count(&self, result: &str) -> u64 {
        self.cases.iter().filter(|case| case["result"] == result).count() as u64
    }

    /// Cases whose results are not those of the page.
    fn differing(&self, explained: &BTreeSet<String>) -> Vec<&Value> {
        self.cases.iter().filter(|case| (case["result"] == "fail") != explained.contains(text(case, "id"))).collect()
    }

    /// Takes what a further run says of the cases that it asked.
    fn take(&mut self, mut report: Value) {
        let Value::Array(cases) = report["cases"].take() else { return };
        for case in cases {
            match self.cases.iter_mut().find(|known| known["id"] == case["id"]) {
                Some(known) => *known = case,
                None => self.cases.push(case),
            }
        }
        self.not_restored.extend(report["not_restored"].as_array().into_iter().flatten().cloned());
    }

    /// Prints what is not as the page says.
    fn is_as(&self, explained: &BTreeSet<String>) -> bool {
        let differing = self.differing(explained);
        for case in &differing {
            if case["result"] == "fail" {
                let frames: Vec<&str> =
                    case["frames"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
                let [id, clause, why] = ["id", "clause", "why"].map(|name| text(case, name));
                println!("  {id} ({clause}): {why}\n    {}", frames.join(" "));
            } else {
                println!("  {}: does not fail, and {PAGE} says that it does", text(case, "id"));
            }
        }
        let unknown: Vec<_> =
            explained.iter().filter(|id| self.cases.iter().all(|case| text(case, "id") != **id)).collect();
        unknown.iter().for_each(|id| println!("  {id}: is explained by {PAGE}, and was not asked"));
        self.not_restored.iter().for_each(|left| println!("  not put back: {left}"));
        differing.is_empty() && unknown.is_empty()
    }
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

impl PeerNode {
    /// Asks all cases, and those again whose results differ from the page.
    fn asked(&self, program: &Path) -> Result<CaseResults, String> {
        let mut asked = CaseResults::default();
        let mut only = String::new();
        let mut failure = None;
        for _ in 0..=AGAIN {
            match self.report(program, &only) {
                Ok(report) => asked.take(report),
                Err(reason) => failure = Some(reason),
            }
            let differing: Vec<&str> = asked.differing(&self.explained).iter().map(|case| text(case, "id")).collect();
            if differing.is_empty() && !asked.cases.is_empty() {
                break;
            }
            only = differing.join(",");
        }
        if asked.cases.is_empty() { Err(failure.unwrap_or_default()) } else { Ok(asked) }
    }

    /// The report of the suite about these cases, or about all, on a bus of its own.
    fn report(&self, program: &Path, only: &str) -> Result<Value, String> {
        let served = ["sim", "--drive", BYSTANDER, "--serve", "socketcand://127.0.0.1:0"];
        let (_bus, line) = started(Command::new(program).args(served))?;
        let address =
            line.strip_prefix("ready socketcand://").ok_or(format!("expected the bus's address, got '{line}'"))?;
        let (host, port) = address.rsplit_once(':').ok_or(format!("expected HOST:PORT, got '{address}'"))?;
        let mut node = Command::new(self.command.get_program());
        node.args(self.command.get_args()).args([host, port, NODE]).arg(&self.eds);
        let (_node, line) = started(&mut node)?;
        if line != "running" {
            return Err(format!("it does not run: {line}"));
        }
        let mut suite = Command::new(program);
        suite
            .args(["--bus", &format!("socketcand://{address}/can0"), "conform", NODE, "--json", "--eds"])
            .arg(&self.eds);
        if !only.is_empty() {
            suite.args(["--only", only]);
        }
        let output = suite.output().map_err(|error| error.to_string())?;
        let report: Value = serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())?;
        // Without a summary no case was asked.
        if report["summary"].is_null() { Err(report["error"].to_string()) } else { Ok(report) }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_differs_from_the_page_is_by_the_last_run_that_asked_it() {
        let case = |id: &str, result: &str| json!({ "id": id, "result": result });
        let explained = BTreeSet::from(["SDO 05".to_owned(), "PDO 03".to_owned()]);
        let ids = |asked: &CaseResults| -> Vec<String> {
            asked.differing(&explained).iter().map(|case| text(case, "id").to_owned()).collect()
        };
        let mut asked = CaseResults::default();
        let first = [case("SDO 01", "pass"), case("SDO 05", "fail"), case("HB 02", "fail"), case("PDO 03", "pass")];
        asked.take(json!({ "cases": first, "not_restored": ["1017h"] }));
        assert_eq!(ids(&asked), ["HB 02", "PDO 03"]);
        asked.take(json!({ "cases": [case("HB 02", "pass"), case("PDO 03", "fail")], "not_restored": [] }));
        assert!(ids(&asked).is_empty() && asked.is_as(&explained), "{:?}", asked.cases);
        assert_eq!(["pass", "fail"].map(|result| asked.count(result)), [2, 2]);
        assert_eq!(asked.not_restored, ["1017h"]);
        // A case of the page that the suite does not have is an error, too.
        assert!(!asked.is_as(&BTreeSet::from(["SDO 05".to_owned(), "PDO 03".to_owned(), "SDO 99".to_owned()])));
    }
}

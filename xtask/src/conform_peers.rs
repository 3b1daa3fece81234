//! `cargo xtask conform-peers`: the conformance suite against stacks of other people, and the table of docs/conformance.md.
//!
//! Each stack runs as a program on the bus of `ferrodrive sim`, with the objects of an EDS in `tests/peers/stacks`. What a
//! stack leaves to the application stays undone. A row of the table goes to standard output, then each failed case.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitCode, Stdio};

use serde_json::Value;

use crate::{process, program, python, workspace};

const NODE: &str = "5";
/// On the same bus, so that there is one: `sim` has a drive at least.
const BYSTANDER: &str = "zlim42c@15";

/// A stack of other people, and how a node of it is started.
struct Stack {
    name: &'static str,
    eds: &'static str,
    program: Program,
}

/// What runs it: `PROGRAM HOST PORT NODE FILE.eds` prints `running` when it does.
enum Program {
    /// A script, in an environment with these requirements.
    Python { requirements: &'static str, script: &'static str },
    /// A package outside of the workspace, and its binary.
    Cargo { folder: &'static str, binary: &'static str },
}

const STACKS: &[Stack] = &[
    Stack {
        name: "canopen-python 2.4.1, `LocalNode`",
        eds: "tests/peers/stacks/stack.eds",
        program: Program::Python {
            requirements: "tests/peers/requirements.txt",
            script: "tests/peers/stacks/canopen_python.py",
        },
    },
    Stack {
        name: "zencan-node 0.0.5",
        eds: "tests/peers/stacks/zencan/stack.eds",
        program: Program::Cargo { folder: "tests/peers/stacks/zencan", binary: "zencan_stack" },
    },
];

impl Program {
    fn command(&self) -> Result<Command, String> {
        let root = workspace::root();
        match self {
            Self::Python { requirements, script } => {
                let mut command = Command::new(python::environment("peers-venv", requirements)?);
                command.arg(root.join(script));
                Ok(command)
            }
            Self::Cargo { folder, binary } => {
                let target = workspace::target().join("stacks");
                let mut build = workspace::cargo();
                build.args(["build", "--quiet"]).current_dir(root.join(folder)).env("CARGO_TARGET_DIR", &target);
                process::output(&mut build)?;
                Ok(Command::new(target.join("debug").join(format!("{binary}{}", std::env::consts::EXE_SUFFIX))))
            }
        }
    }
}

pub(crate) fn command() -> ExitCode {
    match tables() {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("conform-peers: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn tables() -> Result<(), String> {
    let program = program::built()?;
    println!("| stack | passed | failed | not applicable |\n|---|---|---|---|");
    for stack in STACKS {
        let report = report_of(stack, &program)?;
        let count = |name: &str| report["summary"][name].as_u64().unwrap_or(0);
        println!("| {} | {} | {} | {} |", stack.name, count("pass"), count("fail"), count("not_applicable"));
        for case in report["cases"].as_array().into_iter().flatten().filter(|case| case["result"] == "fail") {
            let frames: Vec<&str> = case["frames"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            let words = ["id", "clause", "why"].map(|name| case[name].as_str().unwrap_or_default());
            println!("  {} ({}): {}\n    {}", words[0], words[1], words[2], frames.join(" "));
        }
    }
    Ok(())
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

fn report_of(stack: &Stack, program: &Path) -> Result<Value, String> {
    let mut node = stack.program.command()?;
    let served = ["sim", "--drive", BYSTANDER, "--serve", "socketcand://127.0.0.1:0"];
    let (_bus, line) = started(Command::new(program).args(served))?;
    let address =
        line.strip_prefix("ready socketcand://").ok_or(format!("expected the bus's address, got '{line}'"))?;
    let (host, port) = address.rsplit_once(':').ok_or(format!("expected HOST:PORT, got '{address}'"))?;
    let eds = workspace::root().join(stack.eds);
    node.args([host, port, NODE]).arg(&eds);
    let (_node, line) = started(&mut node)?;
    if line != "running" {
        return Err(format!("{} does not run: {line}", stack.name));
    }
    let mut suite = Command::new(program);
    suite.args(["--bus", &format!("socketcand://{address}/can0"), "conform", NODE, "--json", "--eds"]).arg(&eds);
    let output = suite.output().map_err(|error| error.to_string())?;
    serde_json::from_slice(&output.stdout).map_err(|error| format!("{}: {error}", stack.name))
}

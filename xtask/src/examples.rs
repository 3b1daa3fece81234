//! Runs every example of the workspace to its end: an example that nobody runs is wrong before long.

use crate::process;
use crate::tally::Tally;
use crate::workspace;

/// Runs each example without arguments. They all run on an embedded virtual bus when given none.
pub(crate) fn run() -> Tally {
    let packages = match workspace::packages() {
        Ok(packages) => packages,
        Err(error) => return Tally::failed(error),
    };
    let mut tally = Tally::default();
    for package in &packages {
        for example in &package.examples {
            tally.add(&run_one(&package.name, example));
        }
    }
    if tally == Tally::default() { Tally::skipped("the workspace has no examples") } else { tally }
}

fn run_one(package: &str, example: &str) -> Tally {
    println!("   example {example} of {package}");
    let mut output = Vec::new();
    let mut cargo = workspace::cargo();
    cargo.args(["run", "--quiet", "--package", package, "--example", example]);
    let ended_well = process::run(&mut cargo, |line| output.push(line.to_owned())).unwrap_or(false);
    if !ended_well {
        output.iter().for_each(|line| println!("{line}"));
    }
    Tally::of_check(ended_well, &format!("example {example} ended badly"))
}

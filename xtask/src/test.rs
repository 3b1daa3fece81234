//! `cargo xtask test`: runs the steps in order, prints a table and a count, and fails when anything failed.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use crate::steps::{STEPS, Step};
use crate::tally::Tally;

/// Runs `cargo xtask test` with the words that follow it.
pub(crate) fn command(words: &[&str]) -> ExitCode {
    match choose(words) {
        Ok(Choice::List) => {
            STEPS.iter().for_each(|step| println!("{:10} {}", step.name, step.does));
            ExitCode::SUCCESS
        }
        Ok(Choice::Run(steps)) => run(&steps),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

enum Choice {
    List,
    Run(Vec<&'static Step>),
}

fn choose(words: &[&str]) -> Result<Choice, String> {
    let mut steps = Vec::new();
    let mut words = words.iter();
    while let Some(&word) = words.next() {
        match word {
            "--list" => return Ok(Choice::List),
            "--only" => {
                let name = words.next().ok_or("--only needs the name of a step: see cargo xtask test --list")?;
                let step = STEPS.iter().find(|step| step.name == *name);
                steps.push(step.ok_or(format!("no step is called {name}: see cargo xtask test --list"))?);
            }
            other => return Err(format!("unknown option {other}: --only STEP and --list are the ones there are")),
        }
    }
    Ok(Choice::Run(if steps.is_empty() { STEPS.iter().collect() } else { steps }))
}

fn run(steps: &[&Step]) -> ExitCode {
    let mut rows = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        println!("[{}/{}] {}: {}", number + 1, steps.len(), step.name, step.does);
        let start = Instant::now();
        let tally = (step.run)();
        let took = start.elapsed();
        println!("        {} in {}", tally.verdict(), seconds(took));
        rows.push((step.name, took, tally));
    }
    print_table(&rows);
    let mut sum = Tally::default();
    rows.iter().for_each(|(_, _, tally)| sum.add(tally));
    println!("{}", sum.summary());
    if sum.failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn print_table(rows: &[(&str, Duration, Tally)]) {
    println!("\n{:10} {:8} {:>8} {:>7} {:>7} {:>8}  note", "step", "result", "time", "passed", "failed", "skipped");
    for (name, took, tally) in rows {
        let Tally { passed, failed, skipped, note } = tally;
        println!("{name:10} {:8} {:>8} {passed:>7} {failed:>7} {skipped:>8}  {note}", tally.verdict(), seconds(*took));
    }
    println!();
}

fn seconds(duration: Duration) -> String {
    format!("{:.1} s", duration.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_options_every_step_runs() {
        let Ok(Choice::Run(steps)) = choose(&[]) else { panic!("expected steps") };
        assert_eq!(steps.len(), STEPS.len());
    }

    #[test]
    fn only_the_named_steps_run_in_the_order_given() {
        let Ok(Choice::Run(steps)) = choose(&["--only", "tidy", "--only", "fmt"]) else { panic!("expected steps") };
        assert_eq!(steps.iter().map(|step| step.name).collect::<Vec<_>>(), ["tidy", "fmt"]);
    }

    #[test]
    fn a_step_that_does_not_exist_is_refused_with_the_way_to_find_them() {
        let Err(message) = choose(&["--only", "tidyy"]) else { panic!("expected a refusal") };
        assert!(message.contains("tidyy") && message.contains("--list"), "{message}");
    }
}

//! `cargo xtask test`: runs steps, prints a table and a count, and fails when anything failed.

use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::since;
use crate::steps::{FETCHES, STEPS, TestStep, When};
use crate::table::{StepRow, conclude, seconds, sum};
use crate::{libtest, say};

/// How many steps that wait run side by side, beside those that compute.
const WAITING_AT_A_TIME: usize = 2;

/// Runs `cargo xtask test` with the words that follow it.
pub(crate) fn command(words: &[&str]) -> ExitCode {
    match choose(words) {
        Ok(Choice::List) => {
            let when = |step: &TestStep| match step.when {
                When::Quick => "quick ",
                When::Building | When::Busy | When::Waiting => "--all ",
                When::Named => "--only",
            };
            STEPS.iter().for_each(|step| println!("{:10} {}  {}", step.name, when(step), step.does));
            ExitCode::SUCCESS
        }
        Ok(Choice::Run(steps)) => run(&steps),
        Ok(Choice::Since(revision)) => since::command(&revision),
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

enum Choice {
    List,
    Run(Vec<&'static TestStep>),
    Since(String),
}

fn choose(words: &[&str]) -> Result<Choice, String> {
    let mut steps = Vec::new();
    let mut all = false;
    let mut words = words.iter();
    while let Some(&word) = words.next() {
        match word {
            "--list" => return Ok(Choice::List),
            "--all" => all = true,
            "--timings" => libtest::time_all(),
            "--quick-since" => {
                let revision = words.next().ok_or("--quick-since needs a revision of git, such as HEAD")?;
                return Ok(Choice::Since((*revision).to_owned()));
            }
            "--only" => {
                let name = words.next().ok_or("--only needs the name of a step: see cargo xtask test --list")?;
                let step = STEPS.iter().find(|step| step.name == *name);
                steps.push(step.ok_or(format!("no step is called {name}: see cargo xtask test --list"))?);
            }
            other => {
                let known = "--all, --only STEP, --quick-since REVISION, --timings and --list are the ones there are";
                return Err(format!("unknown option {other}: {known}"));
            }
        }
    }
    if steps.is_empty() {
        let is_meant = |step: &&TestStep| step.when == When::Quick || all && step.when != When::Named;
        steps = STEPS.iter().filter(is_meant).collect();
    }
    Ok(Choice::Run(steps))
}

fn run(steps: &[&'static TestStep]) -> ExitCode {
    let start = Instant::now();
    let of = |when: When| steps.iter().copied().filter(move |step| step.when == when);
    let rows = Mutex::new(Vec::new());
    let (busy, waits) = (of(When::Busy).count(), of(When::Waiting).count());
    let beside = waits > 1 || waits > 0 && busy > 0;
    let waiting = Mutex::new(of(When::Waiting));
    std::thread::scope(|scope| {
        if of(When::Quick).count() > 0 {
            scope.spawn(|| fetch_for(steps));
        }
        of(When::Quick).chain(of(When::Building)).chain(of(When::Named)).for_each(|step| run_one(step, false, &rows));
        for _ in 0..WAITING_AT_A_TIME {
            scope.spawn(|| {
                // The lock is held while one is taken, not while it runs.
                let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).next();
                std::iter::from_fn(next).for_each(|step| run_one(step, beside, &rows));
            });
        }
        of(When::Busy).for_each(|step| run_one(step, beside, &rows));
    });
    let rows = rows.into_inner().unwrap_or_default();
    let ended = conclude(&rows, start.elapsed());
    let left_out: Vec<&str> = STEPS.iter().map(|step| step.name).filter(|name| !ran(&rows, name)).collect();
    if !left_out.is_empty() {
        println!("left out: {} (cargo xtask test --list says when each runs)", left_out.join(", "));
    }
    // The count is the last line.
    println!("{}", sum(&rows).summary());
    ended
}

/// What these steps take of others. What fails here fails again in its step, which reports it.
fn fetch_for(steps: &[&'static TestStep]) {
    say::work_for(Some("fetch"));
    for (_, fetch) in FETCHES.iter().filter(|(name, _)| steps.iter().any(|step| step.name == *name)) {
        let _ = fetch();
    }
}

fn ran(rows: &[StepRow], name: &str) -> bool {
    rows.iter().any(|(ran, ..)| *ran == name)
}

/// Runs a step; `beside` others, each of its lines begins with its name.
fn run_one(step: &'static TestStep, beside: bool, rows: &Mutex<Vec<StepRow>>) {
    println!("[{}] {}", step.name, step.does);
    say::work_for(beside.then_some(step.name));
    let start = Instant::now();
    let tally = (step.run)();
    let took = start.elapsed();
    println!("[{}] {} in {}", step.name, tally.verdict(), seconds(took));
    if let Ok(mut rows) = rows.lock() {
        rows.push((step.name, took, tally));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(words: &[&str]) -> Vec<&'static str> {
        let Ok(Choice::Run(steps)) = choose(words) else { panic!("expected steps") };
        steps.iter().map(|step| step.name).collect()
    }

    fn refusal(words: &[&str]) -> String {
        choose(words).err().expect("it is refused")
    }

    #[test]
    fn without_options_the_quick_list_runs_and_with_all_every_step() {
        assert_eq!(names(&[]), ["fmt", "tidy", "tests", "doctests", "demo", "core"]);
        assert_eq!(
            STEPS.iter().map(|step| step.name).filter(|name| !names(&["--all"]).contains(name)).collect::<Vec<_>>(),
            ["aarch64"]
        );
        assert_eq!(names(&["--only", "aarch64"]), ["aarch64"]);
    }

    #[test]
    fn only_the_named_steps_run_in_the_order_given() {
        assert_eq!(names(&["--only", "tidy", "--only", "fmt"]), ["tidy", "fmt"]);
    }

    #[test]
    fn what_does_not_exist_is_refused_with_the_way_to_find_it() {
        let message = refusal(&["--only", "tidyy"]);
        assert!(message.contains("tidyy") && message.contains("--list"), "{message}");
        let message = refusal(&["--fast"]);
        assert!(message.contains("--fast") && message.contains("--all"), "{message}");
    }
}

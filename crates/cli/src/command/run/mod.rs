//! `ferrodrive run`: a scenario in virtual time, once or with many seeds and values.

mod report;
mod sweeping;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use testbench::document::reader::Parameters;
use testbench::scenario::{Runner, Scenario};

use crate::failure::Failure;
use crate::output::Format;
use crate::progress::Progress;
use crate::recording::{Batch, Pace, RecordOptions};
use crate::serve::speaker::Speaker;
use crate::session::exit_on_signal;
use report::RunReport;

/// Run a scenario in virtual time, and see whether everything is as it expects
///
/// A scenario is a TOML file: a machine, what happens to it, what a host does with it, what is expected (docs/scenarios.md). The
/// exit status is 0 if everything is as expected, 1 if not, 2 if the file cannot be used.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive run examples/scenarios/brown_out.toml\n  \
    ferrodrive run scenario.toml --seed 7 --set torque=1.5 --junit result.xml\n  \
    ferrodrive run scenario.toml --seeds 1..1000 --jobs 4")]
pub(crate) struct Run {
    /// The scenario
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Decides everything random; without it the scenario's, its machine's, or 1
    #[arg(long, value_name = "N", conflicts_with = "seeds")]
    seed: Option<u64>,
    /// The value of a parameter of the scenario; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parameter)]
    set: Vec<(String, String)>,
    /// Run with each of these seeds, and with each value of the scenario's [sweep]
    #[arg(long, value_name = "FIRST..LAST", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,
    /// How many runs at once in a sweep; without it one for each core
    #[arg(long, value_name = "N", requires = "seeds", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Write the result in JUnit's XML too, as build servers read it
    #[arg(long, value_name = "FILE", conflicts_with = "seeds")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordOptions,
}

/// Steps of the world between two batches of a record: 50 ms of a busy bus or more.
const STEPS_A_BATCH: u32 = 512;

/// How long the end waits for the disk.
const DISK_PATIENCE: Duration = Duration::from_secs(60);

/// Steps of the world between two looks at the progress.
const STEPS_A_LOOK: u32 = 4096;

impl Run {
    /// Runs it.
    pub(crate) fn run(&self, format: Format) -> Result<(), Failure> {
        let scenario = self.scenario()?;
        if self.seeds.is_some() && self.recording.path().is_some() {
            return Err(Failure::usage("a sweep is many runs, and --record writes one")
                .next("the summary says how to repeat a run: give --record with that"));
        }
        match &self.seeds {
            Some(seeds) => {
                let jobs = self.jobs.map(usize::from);
                sweeping::sweep(scenario, seeds.clone(), jobs, &self.file, format)
            }
            None => self.once(&scenario, format),
        }
    }

    fn scenario(&self) -> Result<Scenario, Failure> {
        let shown = self.file.display();
        let unusable = |reason: String| {
            Failure::usage(format!("cannot use the scenario {shown}"))
                .because(reason)
                .next("docs/scenarios.md describes each key; examples/scenarios has ten of them")
        };
        let scenario = Scenario::read(&self.file).map_err(unusable)?;
        let mut values: Parameters = scenario.parameters.clone();
        let strange = self.set.iter().find(|(name, _)| !values.contains_key(name));
        if let Some((name, _)) = strange {
            let known: Vec<_> = values.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "it has none".into() } else { format!("it has: {}", known.join(", ")) };
            return Err(unusable(format!("it has no parameter '{name}'; {known}")));
        }
        values.extend(self.set.iter().cloned());
        scenario.with(&values).map_err(|bad| unusable(bad.named(shown.to_string()).to_string()))
    }

    fn once(&self, scenario: &Scenario, format: Format) -> Result<(), Failure> {
        exit_on_signal();
        let progress = Progress::new(format.json);
        let mut runner = Runner::new(scenario, self.seed).map_err(|bad| {
            Failure::usage(format!("cannot build the machine of {}", self.file.display())).because(bad)
        })?;
        let warnings = Speaker::of_warnings();
        let mut record = self.recording.start(runner.world_mut(), Pace::Free, warnings.clone())?;
        if record.is_some() {
            runner.keep_carried();
        }
        let mut steps = 0u32;
        while runner.step() {
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(STEPS_A_BATCH) {
                record.iter_mut().for_each(|record| record.write(batch(&mut runner)));
            }
            if steps.is_multiple_of(STEPS_A_LOOK) {
                let (now, limit) = (runner.now().as_nanos() as f64 / 1e9, runner.limit().as_nanos() as f64 / 1e9);
                progress.show(format!("{}: {now:.2} s of virtual time, at most {limit} s", scenario.title));
            }
        }
        if let Some(mut record) = record {
            record.write(batch(&mut runner));
            record.finish(DISK_PATIENCE);
            warnings.finish(DISK_PATIENCE);
        }
        let outcome = runner.conclude();
        progress.clear();
        if let Some(path) = &self.junit {
            write(path, &outcome.to_junit())?;
        }
        let report = RunReport::new(&outcome, &self.file);
        format.print(&report).map_err(|error| Failure::new("cannot write to standard output").because(error))?;
        match report.failure() {
            // It stands in the report.
            Some(failure) if format.json => Err(Failure { told: true, ..failure }),
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }
}

/// What has happened since the batch before.
fn batch(runner: &mut Runner) -> Batch {
    let frames = runner.take_carried();
    let world = runner.world_mut();
    Batch { recorded: world.take_recorded(), frames, events: std::iter::from_fn(|| world.poll_event()).collect() }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| Failure::new(format!("cannot write {}", path.display())).because(error))
}

/// `torque=1.5`.
fn parameter(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("'{text}' is incomplete; expected NAME=VALUE, e.g. torque=1.5"))?;
    Ok((name.to_owned(), value.to_owned()))
}

/// `1..1000`, both ends included.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let expected = || format!("'{text}' is no range of seeds; expected FIRST..LAST, e.g. 1..1000");
    let (first, last) = text.split_once("..").ok_or_else(expected)?;
    let number = |text: &str| text.trim_start_matches('=').parse::<u64>().map_err(|_| expected());
    let (first, last) = (number(first)?, number(last)?);
    if first > last { Err(expected()) } else { Ok(first..=last) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_have_both_ends_and_parameters_a_value() {
        assert_eq!(seeds("1..3"), Ok(1..=3));
        assert_eq!(seeds("0..=0"), Ok(0..=0));
        for wrong in ["", "5", "3..1", "-1..3", "a..b"] {
            assert!(seeds(wrong).is_err_and(|reason| reason.contains("1..1000")), "{wrong}");
        }
        assert_eq!(parameter("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(parameter("a").is_err());
    }
}

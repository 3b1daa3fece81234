//! `ferrodrive run`: a scenario in virtual time, once or with many seeds and values.

mod crew;
mod loaded;
mod report;
mod results;
mod serving;
mod several;
mod sweeping;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use recording::Batch;
use scenario::sweep::{Shard, Sweep, set_option};
use scenario::{Kept, Outcome, Runner, Scenario};
use sim::Fidelity;

use crate::failure::Failure;
use crate::output::{Format, is_stdout, junit_path, refuse_json_beside};
use crate::plain::plain;
use crate::progress::Progress;
use crate::recording::RecordOptions;
use crate::session::exit_on_signal;
use console::numbers::whole;
use loaded::{Loaded, unbuildable, write};
use report::RunReport;
use serve::messages::Messages;
use serve::writing::Pace;
use serving::ServeOptions;

/// Run scenarios in virtual time, and check what they expect
///
/// A scenario is a TOML file: a machine, what happens to it, what a host does with it, what is expected
/// (docs/scenarios.md). The exit status is 0 if everything is as expected, 1 if not or if a file cannot be used.
/// Several files are shown in a row each, and all are run, whatever the results of the others.
///
/// With --serve the host is a program outside, and the scenario follows the clock.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive run examples/scenarios/brown_out.toml\n  \
    ferrodrive run examples/scenarios/*.toml --junit result.xml\n  \
    ferrodrive run scenario.toml --serve socketcand://127.0.0.1:29536\n  \
    ferrodrive run scenario.toml --seed 7 --set torque=1.5 --junit result.xml\n  \
    ferrodrive run wheel.toml --seeds 1..9999 --shard 3/8 -o part-3.jsonl --resume\n  \
    ferrodrive run wheel.toml --seeds 1..9999 --merge part-*.jsonl -o all.jsonl")]
pub(crate) struct Run {
    /// Scenario files
    #[arg(value_name = "FILE.toml", required = true)]
    files: Vec<PathBuf>,
    /// Random seed (default: the scenario's, its machine's, or 1)
    #[arg(long, value_name = "N", conflicts_with = "seeds", value_parser = |text: &str| whole(text, 0..=u64::MAX))]
    seed: Option<u64>,
    /// Set a parameter of the scenario; may be repeated. With several scenarios, in those that have it
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parameter)]
    set: Vec<(String, String)>,
    /// Compute each control period of the drives (full), or their mechanics and outer loops only (mechanical), many times
    /// faster (default: the machine's, or full; docs/fidelity.md)
    #[arg(long, value_name = "full|mechanical", hide_short_help = true)]
    fidelity: Option<Fidelity>,
    /// Run with each of these seeds and each value of [sweep]
    #[arg(long, value_name = "FIRST..LAST", value_parser = seeds)]
    seeds: Option<RangeInclusive<u64>>,
    /// Make a part of the runs: the I-th of N. Each meets each value, and --merge puts them together
    #[arg(long, value_name = "I/N", requires = "seeds", hide_short_help = true)]
    shard: Option<Shard>,
    /// Also write the result of each run to this file, or with - to standard output, a line of JSON each
    #[arg(long = "output", short = 'o', alias = "out", value_name = "NAME.jsonl", requires = "seeds", value_parser = results_path)]
    output: Option<PathBuf>,
    /// Go on with the runs after those whose results are in the output file, if it is there
    #[arg(long, requires = "output", hide_short_help = true)]
    resume: bool,
    /// Put the results of all shards together instead of making runs: their summary, and with -o one file of them
    #[arg(long, value_name = "PART.jsonl", num_args = 1.., requires = "seeds", conflicts_with_all = ["shard", "resume", "jobs"], hide_short_help = true)]
    merge: Vec<PathBuf>,
    /// Number of runs at once (default: one for each core)
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=1024_u16))]
    jobs: Option<u16>,
    /// Threads that compute the drives of one run; the result is the same on any number of them (default: 1)
    ///
    /// It pays from some 20 turning drives on. Several runs share the cores by --jobs.
    #[arg(long, value_name = "N", conflicts_with = "seeds", hide_short_help = true, value_parser = |text: &str| whole(text, 1..=64_u8))]
    threads: Option<u8>,
    /// Also write the result as JUnit XML, as build servers read it
    #[arg(long, value_name = "FILE.xml", value_parser = junit_path)]
    junit: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordOptions,
    #[command(flatten)]
    serving: ServeOptions,
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
        self.serving.check()?;
        if self.recording.is_live() && !self.serving.is_asked_for() {
            return Err(Failure::usage("--foxglove has no meaning where virtual time does not follow the clock")
                .because("this run is over before anyone could look")
                .next("add --serve URL or --control HOST:PORT, or give --record NAME.mcap and open that"));
        }
        let [file] = self.files.as_slice() else {
            self.refuse_for_several()?;
            return several::run(
                &self.files,
                self.seed,
                (&self.set, self.fidelity),
                self.jobs,
                self.junit.as_deref(),
                format,
            );
        };
        if self.jobs.is_some() && self.seeds.is_none() {
            return Err(Failure::usage("--jobs needs several runs, and this is one")
                .next("omit it, or give --seeds 1..100 or several files"));
        }
        let scenario = Loaded::read(file, &self.set, self.fidelity).and_then(Loaded::with_all)?;
        if let Some(what) = scenario.not_shown() {
            Messages::of_warnings().say(&plain(&what));
        }
        let Some(seeds) = &self.seeds else {
            return self.once(&scenario, file, format);
        };
        if self.recording.path().is_some() || self.recording.is_live() {
            return Err(Failure::usage("--record and --foxglove are for one run, and a sweep has many")
                .next("the summary shows how to repeat one run: add them to that"));
        }
        if self.serving.is_asked_for() {
            return Err(Failure::usage("--serve and --control serve one run, and a sweep has many")
                .next("give --seed in place of --seeds, or omit --serve"));
        }
        refuse_json_beside("the results", self.output.as_deref(), format.json)?;
        if self.resume && self.output.as_deref().is_some_and(is_stdout) {
            return Err(Failure::usage("--resume needs the file with the results that are there")
                .next("give --output NAME.jsonl, or omit --resume"));
        }
        let sweep = Sweep::new(scenario, seeds.clone()).map_err(|reason| {
            Failure::usage("cannot sweep").because(reason).next("give --seeds 1..1000, and fewer values to [sweep]")
        })?;
        let sweep = sweep.of_shard(self.shard.unwrap_or(Shard::WHOLE));
        let asked = sweeping::SweepOptions {
            jobs: self.jobs,
            output: self.output.as_deref(),
            resume: self.resume,
            merge: &self.merge,
            junit: self.junit.as_deref(),
            again: self.again(file, seeds),
        };
        sweeping::sweep(&sweep, &asked, file, format)
    }

    /// The command that makes the same sweep.
    fn again(&self, file: &Path, seeds: &RangeInclusive<u64>) -> String {
        let set = self.set.iter().map(|(name, value)| set_option(name, value));
        let fidelity = self.fidelity.map(|fidelity| format!(" --fidelity {fidelity}"));
        let options: String = set.chain(fidelity).collect();
        format!("ferrodrive run {} --seeds {}..{}{options}", file.display(), seeds.start(), seeds.end())
    }

    /// What is about one run only is not given with several files.
    fn refuse_for_several(&self) -> Result<(), Failure> {
        let given = [
            (self.seeds.is_some(), "--seeds"),
            (self.recording.path().is_some(), "--record"),
            (self.recording.is_live(), "--foxglove"),
            (self.serving.is_asked_for(), "--serve and --control"),
            (self.threads.is_some(), "--threads"),
        ];
        match given.iter().find(|(is_given, _)| *is_given) {
            None => Ok(()),
            Some((_, what)) => {
                Err(Failure::usage(format!("{what} takes one scenario, and there are {}", self.files.len()))
                    .next("give one file with it"))
            }
        }
    }

    /// One run, with what is written about it.
    fn once(&self, scenario: &Scenario, file: &Path, format: Format) -> Result<(), Failure> {
        let (outcome, ended) = if self.serving.is_asked_for() {
            self.serving.run(scenario, self.seed, self.threads(), &self.recording, (file, format.json))?
        } else {
            (self.in_virtual_time(scenario, file, format)?, Ok(()))
        };
        if let Some(path) = &self.junit {
            write(path, &outcome.to_junit())?;
        }
        let report = RunReport::new(&outcome, file);
        let judged = format.print_judged(&report, report.failure());
        ended.and(judged)
    }

    fn threads(&self) -> usize {
        self.threads.unwrap_or(1).into()
    }

    fn in_virtual_time(&self, scenario: &Scenario, file: &Path, format: Format) -> Result<Outcome, Failure> {
        exit_on_signal();
        let progress = Progress::new(format.json);
        let mut runner = Runner::new(scenario, self.seed).map_err(|bad| unbuildable(file, bad))?;
        runner.world_mut().set_threads(self.threads());
        let warnings = Messages::of_warnings();
        let mut record = self.recording.start(runner.world_mut(), Pace::Free, warnings.clone())?;
        if record.is_some() {
            runner.keep();
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
            let recorded = record.finish(DISK_PATIENCE);
            warnings.finish(DISK_PATIENCE);
            recorded?;
        }
        progress.clear();
        Ok(runner.conclude())
    }
}

/// What has happened since the batch before.
fn batch(runner: &mut Runner) -> Batch {
    let Kept { frames, events } = runner.take_kept();
    Batch::of_world(runner.world_mut().take_recorded(), frames, &events)
}

/// Where the results of a sweep go.
fn results_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.ends_with(".jsonl") {
        return Ok(text.into());
    }
    Err("expected NAME.jsonl, or - for standard output; --json prints the summary for programs".into())
}

/// `torque=1.5`.
fn parameter(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("expected NAME=VALUE, e.g. torque=1.5, got '{text}'"))?;
    Ok((name.to_owned(), value.to_owned()))
}

/// `1..1000`, both ends included.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let expected = || format!("expected a range of seeds FIRST..LAST, e.g. 1..1000, got '{text}'");
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

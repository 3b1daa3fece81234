//! Sweeps: one scenario with many seeds and values of its parameters.
//!
//! A [`Sweep`] numbers its runs; a caller with threads makes [`Sweep::run`] of the numbers in any order, and adds the
//! outcome of them to a [`Summary`]. The summary does not depend on that order, and its size not on the number of runs.

mod alike;
pub mod file;
mod report;
pub mod results;
mod shard;
mod summary;

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use serde::Serialize;
use sim::machine::{Realism, TimingMode};

use crate::{Outcome, Runner, Scenario};
use file::SweepAxis;
use machine::file::Machine;
use words::document::BadFile;
use words::document::reader::Parameters;

pub use alike::Alike;
pub use report::{SweepReport, Worst};
pub use shard::Shard;
pub use summary::{Distribution, Failed, OfValue, Summary};

/// Runs that a sweep may have: more would take too long.
pub const MOST_RUNS: u64 = 1_000_000_000;

/// A scenario, the seeds and the values that it is run with.
#[derive(Clone, Debug)]
pub struct Sweep {
    scenario: Scenario,
    axes: Vec<SweepAxis>,
    /// The parameters of which all values are numbers.
    numeric: BTreeSet<String>,
    seeds: RangeInclusive<u64>,
    runs: u64,
    shard: Shard,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Point {
    /// What decides everything random.
    pub seed: u64,
    /// The values that differ from run to run.
    pub values: Parameters,
}

impl Point {
    /// The options of `ferrodrive run` that repeat it.
    pub fn options(&self) -> String {
        let values = self.values.iter().map(|(name, value)| set_option(name, value));
        format!("--seed {}{}", self.seed, values.collect::<String>())
    }
}

/// The option of `ferrodrive run` that gives a parameter this value, behind a space.
pub fn set_option(name: &str, value: &str) -> String {
    format!(" --set {name}={}", quoted(value))
}

/// A value as a shell takes it.
fn quoted(value: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-+:/".contains(c);
    if !value.is_empty() && value.chars().all(plain) {
        value.to_owned()
    } else {
        format!("'{}'", value.replace('\'', "'\\''"))
    }
}

impl Sweep {
    /// All seeds with all values of the scenario's `[sweep]`, each with each.
    ///
    /// # Errors
    /// There are none, or too many.
    pub fn new(scenario: Scenario, seeds: RangeInclusive<u64>) -> Result<Self, String> {
        let axes = scenario.sweep.clone();
        let count = seeds.end().checked_sub(*seeds.start()).and_then(|span| span.checked_add(1));
        let runs = axes.iter().try_fold(count.unwrap_or(0), |runs, axis| runs.checked_mul(axis.values.len() as u64));
        match runs {
            None | Some(0) if seeds.is_empty() => Err("there is no seed in this range".into()),
            Some(runs @ 1..=MOST_RUNS) => {
                let numeric = axes.iter().filter(|axis| axis.is_numeric()).map(|axis| axis.name.clone()).collect();
                Ok(Self { scenario, axes, numeric, seeds, runs, shard: Shard::WHOLE })
            }
            _ => Err(format!("more than {MOST_RUNS} runs; take fewer seeds or values")),
        }
    }

    /// The scenario's title.
    pub fn title(&self) -> &str {
        &self.scenario.title
    }

    /// The same sweep, of which this part is to be made. The numbers of its runs stay what they are.
    #[must_use]
    pub fn of_shard(self, shard: Shard) -> Self {
        Self { shard, ..self }
    }

    /// The part that is to be made.
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// How many runs there are, of all parts together.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// How many of them are to be made here.
    pub fn share(&self) -> u64 {
        self.shard.share(self.runs)
    }

    /// Which setting of the parameters a run has; runs of one setting differ in their seeds alone.
    fn setting(&self, number: u64) -> u64 {
        number / self.seeds_of_a_setting()
    }

    fn seeds_of_a_setting(&self) -> u64 {
        self.seeds.end() - self.seeds.start() + 1
    }

    /// What the machine does not have that would make runs of different seeds differ, in the words of its file.
    fn ways_to_differ(&self) -> String {
        let Machine { realism, timing, .. } = self.scenario.machine;
        let realism =
            (realism.unwrap_or_default() == Realism::Ideal).then_some("realism = \"full\" (noise of sensors)");
        let timing = (timing == Some(TimingMode::Ideal)).then_some("timing = \"device\" (jitter of answers)");
        realism.into_iter().chain(timing).collect::<Vec<_>>().join(" and ")
    }

    /// Each parameter that is swept, and which of its values the run of this number has.
    fn places(&self, number: u64) -> impl Iterator<Item = (&SweepAxis, usize)> {
        let mut rest = self.setting(number);
        self.axes.iter().map(move |axis| {
            let count = axis.values.len() as u64;
            let place = (rest % count) as usize;
            rest /= count;
            (axis, place)
        })
    }

    /// The run of this number, from 0 on: the seed changes first, then the parameters in the order of the alphabet.
    pub fn point(&self, number: u64) -> Point {
        let values = self.places(number).map(|(axis, place)| (axis.name.clone(), axis.values[place].clone()));
        Point { values: values.collect(), seed: self.seeds.start() + number % self.seeds_of_a_setting() }
    }

    /// Makes the run of this number.
    ///
    /// # Errors
    /// That a value of it makes no sense in the scenario.
    pub fn run(&self, number: u64) -> Result<Outcome, BadFile> {
        self.runner(number).map(Runner::run)
    }

    /// The run of this number at its beginning, for a caller that looks in between.
    ///
    /// # Errors
    /// That a value of it makes no sense in the scenario.
    pub fn runner(&self, number: u64) -> Result<Runner, BadFile> {
        let Point { seed, values } = self.point(number);
        if values.is_empty() {
            return Runner::new(&self.scenario, Some(seed));
        }
        // What the command line has set stays.
        let mut all = self.scenario.parameters.clone();
        all.extend(values);
        Runner::new(&self.scenario.with(&all)?, Some(seed))
    }
}

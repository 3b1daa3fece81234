//! The results of many runs, in a size that does not grow with them.

use std::collections::BTreeMap;

use serde::Serialize;

use super::results::RunResult;
use super::{Point, Sweep};
use crate::junit::{case_of_run, suite_of_runs};

/// Failed runs that are listed: those with the lowest numbers.
const MOST_LISTED: usize = 10;

/// Values of a figure that are kept for its median; of more runs every second, every fourth and so on.
const MOST_KEPT: usize = 1 << 16;

/// Settings of the parameters whose runs are compared with each other: those with the lowest numbers.
const MOST_COMPARED: u64 = 1024;

/// The results of the runs so far.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// By the setting of the parameters: the digest of a run, and whether another one had another.
    compared: BTreeMap<u64, Compared>,
    passed: u64,
    /// By the setting of the parameters, and by number: the first of each of the first settings that failed.
    failed: BTreeMap<u64, BTreeMap<u64, Failed>>,
    failures: u64,
    /// By the parameter that is swept, and by its value: runs that passed, and that failed.
    values: Vec<Vec<(u64, u64)>>,
    figures: BTreeMap<String, FigureSpread>,
    /// A test case of JUnit's XML for each run, where that was asked for; it grows with them.
    cases: Option<String>,
}

/// The runs of one setting of the parameters, which differ in their seeds alone.
#[derive(Clone, Copy, Debug)]
struct Compared {
    digest: u64,
    runs: u64,
    differ: bool,
}

/// A run that failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Failed {
    /// Which run.
    #[serde(flatten)]
    pub point: Point,
    /// What was asked first that was not so.
    pub asked: String,
    /// What was seen.
    pub seen: String,
}

/// The results of the runs with one value of a parameter that is swept.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OfValue {
    /// The parameter.
    pub parameter: String,
    /// Its value.
    pub value: String,
    /// Runs with it that were made.
    pub runs: u64,
    /// Those that passed.
    pub passed: u64,
    /// Those that did not.
    pub failed: u64,
}

/// How a figure is distributed over the runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Distribution {
    /// Its name.
    pub name: String,
    /// Runs in which there was something to measure.
    pub runs: u64,
    /// The least.
    pub min: f64,
    /// Half of the runs have less; of more than 65536 runs it is taken from a part that is spread evenly.
    pub median: f64,
    /// The most.
    pub max: f64,
    /// The run with the least.
    pub lowest: Point,
    /// The run with the most.
    pub highest: Point,
}

#[derive(Clone, Debug)]
struct FigureSpread {
    runs: u64,
    /// Value and number of the run; among equals the lowest number.
    min: (f64, u64),
    max: (f64, u64),
    kept: BTreeMap<u64, f64>,
    stride: u64,
}

impl Summary {
    /// One that lists each run for [`to_junit`](Self::to_junit), too.
    pub fn with_cases() -> Self {
        Self { cases: Some(String::new()), ..Self::default() }
    }

    /// As a test suite in JUnit's XML, a test case for each run; without any if they were not asked for.
    pub fn to_junit(&self, sweep: &Sweep) -> String {
        let (runs, cases) = (self.passed + self.failures, self.cases.as_deref().unwrap_or_default());
        suite_of_runs(sweep.title(), (runs, self.failures), cases)
    }

    /// Adds the result of a run.
    pub fn add(&mut self, sweep: &Sweep, result: &RunResult) {
        if let Some(cases) = &mut self.cases {
            cases.push_str(&case_of_run(sweep.title(), &sweep.point(result.run).options(), result));
        }
        if let Some(digest) = result.digest.as_ref().and_then(|digest| u64::from_str_radix(digest, 16).ok()) {
            self.add_digest(sweep, result.run, digest);
        }
        let figures = result.figures.iter().filter_map(|(name, value)| Some((name.as_str(), (*value)?)));
        let seen = |asked: &String| (asked.clone(), result.seen.clone().unwrap_or_default());
        let failure = (!result.passed).then(|| result.asked.as_ref().map(seen).unwrap_or_default());
        self.add_run(sweep, result.run, figures, failure);
    }

    /// Adds a run that was made elsewhere: its figures, and of a failed one what was asked first that was not so, and what was
    /// seen.
    pub fn add_run<'a>(
        &mut self,
        sweep: &Sweep,
        number: u64,
        figures: impl IntoIterator<Item = (&'a str, f64)>,
        failure: Option<(String, String)>,
    ) {
        for (name, value) in figures.into_iter().filter(|(_, value)| value.is_finite()) {
            let figure = self.figures.entry(name.to_owned());
            figure.or_insert_with(|| FigureSpread::new(value, number)).add(value, number);
        }
        self.count_values(sweep, number, failure.is_some());
        let Some((asked, seen)) = failure else {
            self.passed += 1;
            return;
        };
        self.failures += 1;
        let of_setting = self.failed.entry(sweep.setting(number)).or_default();
        of_setting.insert(number, Failed { point: sweep.point(number), asked, seen });
        if of_setting.len() > MOST_LISTED {
            of_setting.pop_last();
        }
        if self.failed.len() > MOST_LISTED {
            self.failed.pop_last();
        }
    }

    fn count_values(&mut self, sweep: &Sweep, number: u64, failed: bool) {
        if self.values.is_empty() {
            self.values = sweep.axes.iter().map(|axis| vec![(0, 0); axis.values.len()]).collect();
        }
        for ((_, place), counts) in sweep.places(number).zip(&mut self.values) {
            let (passed, failures) = &mut counts[place];
            *if failed { failures } else { passed } += 1;
        }
    }

    /// Adds the digest of a run, which shows whether seeds make a difference.
    pub fn add_digest(&mut self, sweep: &Sweep, number: u64, digest: u64) {
        let setting = sweep.setting(number);
        if setting < MOST_COMPARED {
            let compared = self.compared.entry(setting).or_insert(Compared { digest, runs: 0, differ: false });
            compared.runs += 1;
            compared.differ |= compared.digest != digest;
        }
    }

    /// Whether a seed makes a difference to a run; `None` if there are no two runs that differ in their seeds alone.
    pub fn seeds_differ(&self) -> Option<bool> {
        let differ = self.compared.values().any(|compared| compared.differ);
        (differ || self.compared.values().any(|compared| compared.runs > 1)).then_some(differ)
    }

    /// That a seed makes no difference, why, and what to turn on; `None` if it makes one, or that is not known.
    pub fn note(&self, sweep: &Sweep) -> Option<String> {
        const WHAT: &str =
            "all seeds give the same run: nothing in it is random, so that it is made once and counts for each seed";
        const STEP: &str = "a step such as \"bus corrupt 0.01\" makes runs differ";
        (self.seeds_differ() == Some(false)).then(|| match sweep.ways_to_differ() {
            ways if ways.is_empty() => format!("{WHAT}; {STEP}"),
            ways => format!("{WHAT}; {STEP}, and so does in [machine]: {ways}"),
        })
    }

    /// Runs that passed.
    pub fn passed(&self) -> u64 {
        self.passed
    }

    /// Runs that did not.
    pub fn failures(&self) -> u64 {
        self.failures
    }

    /// The first of those, in their order: one of each setting of the parameters before a second of any.
    pub fn failed(&self) -> impl Iterator<Item = &Failed> {
        let ranked = self.failed.values().flat_map(|of_setting| (0usize..).zip(of_setting));
        let mut first: Vec<_> = ranked.collect();
        first.sort_by_key(|(rank, (number, _))| (*rank, **number));
        first.truncate(MOST_LISTED);
        first.sort_by_key(|(_, (number, _))| **number);
        first.into_iter().map(|(_, (_, failed))| failed)
    }

    /// The results of the runs with each value of each parameter that is swept.
    pub fn of_values(&self, sweep: &Sweep) -> Vec<OfValue> {
        let rows = sweep.axes.iter().zip(&self.values).flat_map(|(axis, counts)| {
            axis.values.iter().zip(counts).map(|(value, (passed, failed))| OfValue {
                parameter: axis.name.clone(),
                value: value.clone(),
                runs: passed + failed,
                passed: *passed,
                failed: *failed,
            })
        });
        rows.collect()
    }

    /// How each named figure is distributed.
    pub fn distributions(&self, sweep: &Sweep) -> Vec<Distribution> {
        let distribution = |(name, figure): (&String, &FigureSpread)| {
            let mut kept: Vec<f64> = figure.kept.values().copied().collect();
            kept.sort_by(f64::total_cmp);
            let half = kept.len() / 2;
            let upper = kept.get(half).copied().unwrap_or(f64::NAN);
            let median = if kept.len().is_multiple_of(2) && half > 0 { (kept[half - 1] + upper) / 2.0 } else { upper };
            Distribution {
                name: name.clone(),
                runs: figure.runs,
                min: figure.min.0,
                median,
                max: figure.max.0,
                lowest: sweep.point(figure.min.1),
                highest: sweep.point(figure.max.1),
            }
        };
        self.figures.iter().map(distribution).collect()
    }
}

impl FigureSpread {
    fn new(value: f64, number: u64) -> Self {
        Self { runs: 0, min: (value, number), max: (value, number), kept: BTreeMap::new(), stride: 1 }
    }

    fn add(&mut self, value: f64, number: u64) {
        self.runs += 1;
        if value < self.min.0 || value == self.min.0 && number < self.min.1 {
            self.min = (value, number);
        }
        if value > self.max.0 || value == self.max.0 && number < self.max.1 {
            self.max = (value, number);
        }
        if number.is_multiple_of(self.stride) {
            self.kept.insert(number, value);
        }
        while self.kept.len() > MOST_KEPT {
            self.stride *= 2;
            self.kept.retain(|number, _| number.is_multiple_of(self.stride));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use can::Instant;

    use super::*;
    use crate::{Outcome, Scenario};
    use words::document::BadFile;

    fn sweep(seeds: u64) -> Sweep {
        let text = "machine = { timing = 'ideal', drive = [{ model = 'zlac8030l', node = 4 }] }\n[parameters]\na = 1\nb = 'x'\n\
                    [sweep]\na = { from = 0, to = 1, step = 0.1 }\nb = ['x', 'it is']\n";
        let scenario = Scenario::parse(text, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
        Sweep::new(scenario, 1..=seeds).expect("a sweep")
    }

    fn outcome(value: f64) -> Result<Outcome, BadFile> {
        Ok(Outcome {
            title: String::new(),
            seed: 1,
            parameters: Vec::new(),
            end: Instant::ZERO,
            rows: Vec::new(),
            figures: vec![("figure".into(), value)],
            digest: 0,
            is_random: true,
            last_frames: Vec::new(),
        })
    }

    #[test]
    fn each_value_meets_each_seed_once_and_the_options_repeat_a_run() {
        let sweep = sweep(3);
        assert_eq!(sweep.runs(), 3 * 11 * 2);
        let all: std::collections::BTreeSet<_> =
            (0..sweep.runs()).map(|number| sweep.point(number).options()).collect();
        assert_eq!(all.len(), 66);
        assert!(
            all.contains("--seed 3 --set a=0.3 --set b='it is'") && all.contains("--seed 1 --set a=1 --set b=x"),
            "{all:?}"
        );
    }

    #[test]
    fn the_order_in_which_runs_end_does_not_matter_and_their_number_does_not_fill_the_memory() {
        let sweep = sweep(100_000);
        let value = |number: u64| ((number * 7919) % 200_003) as f64;
        let mut forth = Summary::default();
        let mut back = Summary::default();
        for number in 0..200_000 {
            forth.add(&sweep, &RunResult::new(&sweep, number, &outcome(value(number))));
            back.add(&sweep, &RunResult::new(&sweep, 199_999 - number, &outcome(value(199_999 - number))));
        }
        assert_eq!(forth.distributions(&sweep), back.distributions(&sweep));
        let found = &forth.distributions(&sweep)[0];
        assert!(found.runs == 200_000 && (found.median - 100_000.0).abs() < 2_000.0, "{found:?}");
        assert!(forth.figures["figure"].kept.len() <= MOST_KEPT);
    }

    #[test]
    fn of_equal_values_the_first_run_is_named_whichever_ends_first() {
        for numbers in [[3, 8], [8, 3]] {
            let mut figure = FigureSpread::new(2.0, numbers[0]);
            numbers.iter().for_each(|number| figure.add(2.0, *number));
            assert_eq!((figure.min, figure.max), ((2.0, 3), (2.0, 3)));
        }
    }

    /// Of a sweep of 11 values of one parameter with 2 of another, and 3 seeds, every run above 0.6 fails.
    #[test]
    fn each_value_has_its_runs_counted_and_its_first_failure_listed_before_a_second_of_another() {
        let sweep = sweep(3);
        let (mut forth, mut back) = (Summary::default(), Summary::default());
        let add = |summary: &mut Summary, number: u64| {
            let over = sweep.point(number).values["a"].parse::<f64>().expect("a number") > 0.65;
            summary.add_run(&sweep, number, [], over.then(|| ("a".into(), "b".into())));
        };
        (0..sweep.runs()).for_each(|number| add(&mut forth, number));
        (0..sweep.runs()).rev().for_each(|number| add(&mut back, number));
        let rows = forth.of_values(&sweep);
        let counts = |parameter: &str| -> Vec<_> {
            let its = rows.iter().filter(|row| row.parameter == parameter);
            its.map(|row| (row.value.as_str(), row.runs, row.passed, row.failed)).collect()
        };
        let a = counts("a");
        assert_eq!((a.len(), a[6], a[7], a[10]), (11, ("0.6", 6, 6, 0), ("0.7", 6, 0, 6), ("1", 6, 0, 6)));
        assert_eq!(counts("b"), [("x", 33, 21, 12), ("it is", 33, 21, 12)]);
        assert_eq!((forth.passed(), forth.failures()), (42, 24));
        let listed = |summary: &Summary| -> Vec<_> { summary.failed().map(|failed| failed.point.options()).collect() };
        let expected = listed(&forth);
        assert_eq!(expected, listed(&back));
        // All eight settings, and the second seed of the first two of them.
        let settings: std::collections::BTreeSet<_> =
            expected.iter().map(|options| &options["--seed 1".len()..]).collect();
        assert_eq!((expected.len(), settings.len()), (10, 8), "{expected:?}");
        assert_eq!(expected[..2], ["--seed 1 --set a=0.7 --set b=x", "--seed 2 --set a=0.7 --set b=x"]);
    }

    #[test]
    fn that_no_seed_makes_a_difference_is_reported_and_one_that_differs_is_enough() {
        let sweep = sweep(3);
        let with_digest = |digest: u64| outcome(1.0).map(|outcome| Outcome { digest, ..outcome });
        let mut summary = Summary::default();
        summary.add(&sweep, &RunResult::new(&sweep, 0, &with_digest(7)));
        // Another value of a parameter, not another seed.
        summary.add(&sweep, &RunResult::new(&sweep, 3, &with_digest(8)));
        assert_eq!((summary.seeds_differ(), summary.note(&sweep)), (None, None));
        summary.add(&sweep, &RunResult::new(&sweep, 1, &with_digest(7)));
        assert_eq!(summary.seeds_differ(), Some(false));
        let note = summary.note(&sweep).unwrap_or_default();
        assert!(note.contains("realism = \"full\"") && note.contains("timing = \"device\""), "{note}");
        summary.add(&sweep, &RunResult::new(&sweep, 5, &with_digest(9)));
        assert_eq!((summary.seeds_differ(), summary.note(&sweep)), (Some(true), None));
    }

    #[test]
    fn too_many_runs_and_no_seed_are_refused() {
        let scenario = sweep(1).scenario;
        assert!(Sweep::new(scenario.clone(), 0..=u64::MAX).is_err());
        assert!(
            Sweep::new(scenario, std::ops::RangeInclusive::new(5, 4)).is_err_and(|reason| reason.contains("no seed"))
        );
    }
}

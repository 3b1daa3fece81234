//! Where a run of a scenario stands: which steps are done, which expectations are decided, and when to look next.

use std::time::Duration;

use can::Instant;
use sim::StationId;
use sim::World;

use super::condition::{View, of_body};
use super::file::Scenario;
use super::occurrence::Occurrence;
use super::outcome::{Row, RowKind, Verdict};
use super::plan::{Act, Base, Expect, Law, Measure, PlannedFigure, ScenarioStep, Statistic, Until, Wait};
use master::units::Shown;
use words::document::Located;

/// The state of everything that is not a host.
pub(super) struct Script {
    steps: Vec<StepProgress>,
    expects: Vec<Option<Verdict>>,
    figures: Vec<Tally>,
    pub(super) rows: Vec<Row>,
    /// Names of steps and hosts, and when they were done.
    done: Vec<(String, Instant)>,
    /// A step has taken the host away.
    pub(super) host_died: bool,
    /// When values were looked at last.
    looked: Option<Instant>,
}

/// How far a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum StepProgress {
    Waiting,
    Due(Instant),
    Done,
}

/// What is known of a figure so far.
#[derive(Clone, Copy, Debug)]
struct Tally {
    value: f64,
    sum: f64,
    count: u64,
}

impl Tally {
    const NOTHING: Self = Self { value: f64::NAN, sum: 0.0, count: 0 };

    fn add(&mut self, statistic: Statistic, value: f64) {
        if value.is_nan() {
            return;
        }
        self.sum += value;
        self.count += 1;
        // Of a number and none, `min` and `max` give the number.
        self.value = match statistic {
            Statistic::Min => self.value.min(value),
            Statistic::Max => self.value.max(value),
            Statistic::Peak => self.value.max(value.abs()),
            Statistic::Last => value,
            Statistic::Mean => self.sum / self.count as f64,
        };
    }
}

/// An instant of the run that is `time` from its beginning.
fn instant(time: Duration) -> Instant {
    Instant::ZERO + time
}

impl Script {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            steps: vec![StepProgress::Waiting; scenario.steps.len()],
            expects: vec![None; scenario.expects.len()],
            figures: vec![Tally::NOTHING; scenario.figures.len()],
            rows: Vec::new(),
            done: Vec::new(),
            host_died: false,
            looked: None,
        }
    }

    /// Notes that a step or a host is done.
    pub(super) fn note_done(&mut self, name: &str, now: Instant) {
        self.done.push((name.to_owned(), now));
    }

    /// Whether it is.
    pub(super) fn is_done(&self, name: &str) -> bool {
        self.done_at(name).is_some()
    }

    fn done_at(&self, name: &str) -> Option<Instant> {
        self.done.iter().find(|(done, _)| done == name).map(|(_, at)| *at)
    }

    /// When something counts from, if that is known yet.
    fn begin(&self, base: &Base) -> Option<Instant> {
        match base {
            Base::At(time) => Some(instant(*time)),
            Base::After(name, _) => self.done_at(name),
        }
    }

    fn end(&self, expect: &Expect) -> Option<Instant> {
        match expect.until {
            Until::End => None,
            Until::At(time) => Some(instant(time)),
            Until::Within(time) => self.begin(&expect.from).map(|begin| begin + time),
        }
    }

    /// True if values have to be looked at again and again.
    pub(super) fn samples(&self, scenario: &Scenario) -> bool {
        let signals = scenario.figures.iter().any(|figure| !matches!(figure.of, Measure::Time(_)));
        let steps = scenario.steps.iter().zip(&self.steps).any(|(step, progress)| {
            *progress == StepProgress::Waiting && step.when.as_ref().is_some_and(|when| !when.condition.is_event())
        });
        let expects = scenario.expects.iter().zip(&self.expects);
        signals
            || steps
            || expects.into_iter().any(|(expect, verdict)| verdict.is_none() && !expect.condition.is_event())
    }

    /// The next time at which something begins, is due or ends, and at which values have not been looked at.
    pub(super) fn next_time(&self, scenario: &Scenario) -> Option<Instant> {
        let steps = scenario.steps.iter().zip(&self.steps).flat_map(|(step, progress)| match progress {
            StepProgress::Due(at) => [Some(*at), None],
            StepProgress::Done => [None, None],
            StepProgress::Waiting => {
                let begin = self.begin(&step.base);
                let limit = begin.zip(step.within).map(|(begin, within)| begin + within);
                [begin.map(|begin| if step.when.is_none() { begin + step.delay } else { begin }), limit]
            }
        });
        let expects = scenario.expects.iter().zip(&self.expects).filter(|(_, verdict)| verdict.is_none());
        let expects = expects.flat_map(|(expect, _)| [self.begin(&expect.from), self.end(expect)]);
        steps.chain(expects).flatten().filter(|at| self.looked.is_none_or(|looked| *at > looked)).min()
    }

    /// Looks at everything: because of what has just happened, or at values if that is nothing. Does what is due.
    pub(super) fn look(
        &mut self,
        scenario: &Scenario,
        world: &mut World,
        host: StationId,
        occurrence: Option<Occurrence<'_>>,
    ) {
        // What one step does may be what another waits for, at the same instant.
        while self.look_at_steps(scenario, world, host, occurrence) {}
        self.look_at_expectations(scenario, world, occurrence);
        if occurrence.is_none() {
            self.looked = Some(world.now());
            self.measure(scenario, world);
        }
    }

    fn look_at_steps(
        &mut self,
        scenario: &Scenario,
        world: &mut World,
        host: StationId,
        occurrence: Option<Occurrence<'_>>,
    ) -> bool {
        let now = world.now();
        let mut changed = false;
        for (n, step) in scenario.steps.iter().enumerate() {
            if self.steps[n] == StepProgress::Waiting {
                self.arm(n, step, world, occurrence);
            }
            if matches!(self.steps[n], StepProgress::Due(at) if at <= now) {
                self.steps[n] = StepProgress::Done;
                let refused = self.act(step, world, host);
                let verdict = if refused.is_none() { Verdict::Passed } else { Verdict::Failed };
                self.row_of_step((step, &step.place), Some(now), verdict, refused.unwrap_or_else(|| "done".into()));
                if let Some(name) = &step.name {
                    self.note_done(name, now);
                }
                changed = true;
            }
        }
        changed
    }

    /// Decides whether a step that waits is due, and when; or that it has waited too long.
    fn arm(&mut self, n: usize, step: &ScenarioStep, world: &mut World, occurrence: Option<Occurrence<'_>>) {
        let now = world.now();
        let Some(begin) = self.begin(&step.base).filter(|begin| *begin <= now) else { return };
        let Some(Wait { condition: when, asked, place }) = &step.when else {
            self.steps[n] = StepProgress::Due(begin + step.delay);
            return;
        };
        if when.is_event() == occurrence.is_some() {
            let done = |name: &str| self.is_done(name);
            if when.holds(&mut View { world, occurrence, done: &done }) {
                self.steps[n] = StepProgress::Due(now + step.delay);
                return;
            }
        }
        if let Some(within) = step.within.filter(|within| now >= begin + *within) {
            let done = |name: &str| self.is_done(name);
            let seen = when.seen(&mut View { world, occurrence: None, done: &done });
            self.steps[n] = StepProgress::Done;
            let seen = format!("'{asked}' did not hold within {} s: {seen}", Shown(within.as_secs_f64()));
            self.row_of_step((step, place), Some(now), Verdict::Failed, seen);
        }
    }

    /// Does what a step says; the first refusal ends it.
    fn act(&mut self, step: &ScenarioStep, world: &mut World, host: StationId) -> Option<String> {
        for act in &step.acts {
            match act {
                Act::World(place, stimulus) => {
                    let applied = world.apply(*place, stimulus).map_err(|error| error.to_string());
                    let refused = applied.and_then(|applied| applied.map_err(|refused| refused.to_string()));
                    if let Err(reason) = refused {
                        return Some(format!("'{place} {stimulus}': {reason}"));
                    }
                }
                Act::Wire(fault) => world.disturb(*fault),
                Act::Body(name, stimulus) => {
                    // The file has been asked for the name: it is there.
                    if let Some(Err(refused)) = world.apply_to_body(name, stimulus) {
                        return Some(format!("'body {name} {stimulus}': {refused}"));
                    }
                }
                Act::HostCable(true) => world.cut(host),
                Act::HostCable(false) => world.join(host),
                Act::HostDies => {
                    world.remove(host);
                    self.host_died = true;
                }
            }
        }
        None
    }

    fn row_of_step(
        &mut self,
        (step, place): (&ScenarioStep, &Located),
        at: Option<Instant>,
        verdict: Verdict,
        seen: String,
    ) {
        let (name, asked) = (step.name.clone().unwrap_or_default(), step.asked.clone());
        self.rows.push(Row { kind: RowKind::Step, name, asked, at, seen, verdict, place: place.line });
    }

    fn look_at_expectations(&mut self, scenario: &Scenario, world: &mut World, occurrence: Option<Occurrence<'_>>) {
        let now = world.now();
        for (n, expect) in scenario.expects.iter().enumerate() {
            let begun = self.begin(&expect.from).is_some_and(|begin| begin <= now);
            if self.expects[n].is_some() || !begun {
                continue;
            }
            let end = self.end(expect);
            let over = end.is_some_and(|end| now >= end);
            let asked = expect.condition.is_event() == occurrence.is_some();
            let done = |name: &str| self.is_done(name);
            let mut view = View { world, occurrence, done: &done };
            let in_time = end.is_none_or(|end| now <= end);
            let holds = asked && in_time && expect.condition.holds(&mut view);
            let verdict = match (expect.law, asked && in_time, holds) {
                (Law::Once, _, true) => Some(Verdict::Passed),
                (Law::Always, true, false) | (Law::Never, _, true) => Some(Verdict::Failed),
                // An event at this very instant may still come: what is about instants ends when values are looked at.
                (Law::Once, ..) if over && occurrence.is_none() => Some(Verdict::Failed),
                (Law::Always | Law::Never, ..) if over && occurrence.is_none() => Some(Verdict::Passed),
                _ => None,
            };
            if let Some(verdict) = verdict {
                let seen = expect.condition.seen(&mut view);
                self.decide(n, expect, Some(now), verdict, seen);
            }
        }
    }

    fn decide(&mut self, n: usize, expect: &Expect, at: Option<Instant>, verdict: Verdict, seen: String) {
        self.expects[n] = Some(verdict);
        let (name, asked) = (expect.name.clone(), expect.asked.clone());
        self.rows.push(Row { kind: RowKind::Expect, name, asked, at, seen, verdict, place: expect.place.line });
    }

    fn measure(&mut self, scenario: &Scenario, world: &mut World) {
        for (tally, PlannedFigure { of, .. }) in self.figures.iter_mut().zip(&scenario.figures) {
            let (statistic, place, signal) = match of {
                Measure::Time(_) => continue,
                Measure::Body(statistic, name, signal) => {
                    tally.add(*statistic, of_body(world, name, signal).unwrap_or(f64::NAN));
                    continue;
                }
                Measure::Signal(statistic, place, signal) => (statistic, place, signal),
            };
            let report = world.with_drive(place.node, |drive, now| {
                drive.advance(now);
                drive.report_of(place.axis)
            });
            if let Ok(report) = report {
                tally.add(*statistic, signal.of(&report));
            }
        }
    }

    /// The figures as they stand.
    pub(super) fn figures(&self, scenario: &Scenario) -> Vec<(String, f64)> {
        let value = |(tally, figure): (&Tally, &PlannedFigure)| match &figure.of {
            Measure::Signal(..) | Measure::Body(..) => tally.value,
            Measure::Time(name) => self.done_at(name).map_or(f64::NAN, |at| at.as_nanos() as f64 / 1e9),
        };
        let figures = self.figures.iter().zip(&scenario.figures);
        figures.map(|(tally, figure)| (figure.name.clone(), value((tally, figure)))).collect()
    }

    /// True if nothing is left to be done or decided, but for what counts to the end of the run.
    pub(super) fn is_through(&self, scenario: &Scenario) -> bool {
        let steps = self.steps.iter().all(|progress| *progress == StepProgress::Done);
        let mut expects = scenario.expects.iter().zip(&self.expects);
        steps
            && expects.all(|(expect, verdict)| {
                verdict.is_some()
                    || expect.law != Law::Once && expect.until == Until::End && self.begin(&expect.from).is_some()
            })
    }

    /// Decides what is still open at the end of the run.
    pub(super) fn conclude(&mut self, scenario: &Scenario, world: &mut World) {
        for (n, step) in scenario.steps.iter().enumerate() {
            if self.steps[n] != StepProgress::Done {
                let done = |name: &str| self.is_done(name);
                let mut view = View { world, occurrence: None, done: &done };
                let (place, seen) = match &step.when {
                    Some(Wait { condition, asked, place }) => {
                        (place, format!("'{asked}' did not come to hold: {}", condition.seen(&mut view)))
                    }
                    None => (&step.place, "its time never came".to_owned()),
                };
                self.row_of_step((step, place), None, Verdict::Failed, seen);
            }
        }
        for (n, expect) in scenario.expects.iter().enumerate() {
            if self.expects[n].is_some() {
                continue;
            }
            let begun = self.begin(&expect.from).is_some_and(|begin| begin <= world.now());
            let done = |name: &str| self.is_done(name);
            let seen = expect.condition.seen(&mut View { world, occurrence: None, done: &done });
            let now = world.now();
            match (begun, expect.law, expect.until) {
                (false, ..) => self.decide(n, expect, None, Verdict::Failed, "its time never began".into()),
                (true, Law::Once, _) => {
                    self.decide(n, expect, None, Verdict::Failed, format!("not by the end of the run: {seen}"));
                }
                (true, _, Until::End) => self.decide(n, expect, Some(now), Verdict::Passed, seen),
                (true, ..) => self.decide(n, expect, None, Verdict::Failed, "the run ended before".into()),
            }
        }
    }
}

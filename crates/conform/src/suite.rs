//! A run: which cases, one after the other, and what came of each.

use std::time::Duration;

use canopen::{AbortCode, Mux, NmtCommand};
use cia402::{PowerState, Statusword};
use devices::Departure;
use master::Network;

use crate::bench::{Bench, Restorer, SILENCE, refused};
use crate::capture::Capture;
use crate::case::{Case, Group, Need};
use crate::cases;
use crate::finding::{Finding, Verdict, fail};
use crate::options::Options;
use crate::report::{CaseResult, Outcome, Report};
use crate::subject::Subject;

/// Why there was no run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SuiteError {
    /// A name that is neither a case's nor a group's.
    Unknown(String),
    /// The node does not answer.
    NoAnswer(Duration),
    /// The motor is energised: resets and stops would let it go.
    Enabled,
}

impl std::fmt::Display for SuiteError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown(name) => {
                let groups = Group::ALL.map(|(_, prefix, _)| prefix).join(", ");
                write!(f, "expected a case such as 'SDO 07' or a group ({groups}), got '{name}'")
            }
            Self::NoAnswer(waited) => {
                write!(f, "the node does not answer: 1000h was read, nothing came within {} ms", waited.as_millis())
            }
            Self::Enabled => {
                f.write_str("the drive is in Operation enabled: the cases reset the node and stop its communication")
            }
        }
    }
}

impl std::error::Error for SuiteError {}

/// The cases that these names choose: `SDO 07`, `sdo07`, `402-01`, or a group `SDO`.
///
/// # Errors
/// [`SuiteError::Unknown`].
pub fn selected(only: &[String], skip: &[String]) -> Result<Vec<&'static Case>, SuiteError> {
    let unknown = only.iter().chain(skip).find(|name| !cases::all().any(|case| is_named(case, name)));
    if let Some(name) = unknown {
        return Err(SuiteError::Unknown(name.clone()));
    }
    let named = |case: &&Case, names: &[String]| names.iter().any(|name| is_named(case, name));
    Ok(cases::all().filter(|case| (only.is_empty() || named(case, only)) && !named(case, skip)).collect())
}

fn is_named(case: &Case, name: &str) -> bool {
    let plain = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_uppercase();
    let wanted = plain(name);
    wanted == plain(case.id) || wanted == plain(case.group().prefix())
}

/// How far a run is.
#[derive(Clone, Copy, Debug)]
pub struct CaseProgress<'a> {
    /// The case that begins, or that has ended.
    pub case: &'static Case,
    /// What came of it, once it has ended.
    pub result: Option<&'a CaseResult>,
    /// Its place in the run, from 1 on.
    pub number: usize,
    /// How many there are.
    pub of: usize,
}

/// A run against one node.
#[derive(Debug)]
pub struct Suite {
    bench: Bench,
    options: Options,
    /// The drive was found in a fault, which is left as it is.
    in_fault: bool,
}

impl Suite {
    /// A run to come. `capture` has to hear what passes `network` ([`can::Tap`]).
    pub fn new(network: Network, capture: Capture, subject: Subject, options: Options) -> Self {
        Self { bench: Bench::new(network, capture, subject, &options), options, in_fault: false }
    }

    /// What puts back what the run has touched, if it is given up on the way.
    pub fn restorer(&self) -> Restorer {
        self.bench.restorer.clone()
    }

    /// Runs the cases; `progress` hears of each when it begins and when it has ended.
    ///
    /// # Errors
    /// [`SuiteError`]: nothing was run then.
    pub async fn run(mut self, mut progress: impl FnMut(CaseProgress<'_>)) -> Result<Report, SuiteError> {
        let wanted = selected(&self.options.only, &self.options.skip)?;
        let identity = self.prepare().await?;
        let mut results: Vec<CaseResult> = Vec::with_capacity(wanted.len());
        let mut not_restored = Vec::new();
        for (position, case) in wanted.iter().enumerate() {
            let (number, of) = (position + 1, wanted.len());
            progress(CaseProgress { case, result: None, number, of });
            let (result, left) = self.run_case(case).await;
            progress(CaseProgress { case, result: Some(&result), number, of });
            results.push(result);
            not_restored.extend(left);
        }
        let summary = Report::of(&results);
        let subject = self.bench.subject;
        Ok(Report {
            ok: summary.fail == 0 && not_restored.is_empty(),
            node: subject.node.raw(),
            model: subject.description.title.to_owned(),
            source: subject.description.manual.to_owned(),
            identity,
            cases: results,
            summary,
            not_restored,
        })
    }

    /// Looks whether the node is there and at rest, and in which state it was found.
    async fn prepare(&mut self) -> Result<Vec<u32>, SuiteError> {
        let bench = &mut self.bench;
        bench.begin();
        let Ok(device_type) = bench.upload(Mux::new(0x1000, 0)).await else {
            return Err(SuiteError::NoAnswer(self.options.timeout));
        };
        let mut identity = vec![number(&device_type.unwrap_or_default())];
        for sub_index in 1..=4 {
            let Ok(Ok(value)) = bench.upload(Mux::new(0x1018, sub_index)).await else { break };
            identity.push(number(&value));
        }
        for axis in bench.subject.description.axes {
            let Ok(Ok(word)) = bench.upload(axis.object(Mux::new(0x6041, 0))).await else { continue };
            let statusword = Statusword(number(&word) as u16);
            if axis.power_state(statusword) == Some(PowerState::OperationEnabled) {
                return Err(SuiteError::Enabled);
            }
            self.in_fault |= axis.power_state(statusword) == Some(PowerState::Fault);
        }
        let shown = bench.find_state().await.map(|state| bench.subject.description.nmt_state(state));
        let found = shown.unwrap_or(bench.subject.description.nmt.start_state);
        bench.restorer.set_found(found);
        Ok(identity)
    }

    async fn run_case(&mut self, case: &'static Case) -> (CaseResult, Vec<String>) {
        let subject = self.bench.subject;
        let result = |result, why, frames| CaseResult {
            id: case.id,
            title: case.title,
            clause: case.clause,
            result,
            why,
            frames,
        };
        if let Some(need) = case.unmet(&subject, &self.options) {
            let (outcome, why, frames) = self.absent(need).await;
            return (result(outcome, why, frames), Vec::new());
        }
        self.bench.begin();
        let verdict = (case.run)(&mut self.bench).await;
        let (outcome, mut why) = self.judge(case, verdict).await;
        let frames = self.bench.evidence();
        if outcome != Outcome::Pass {
            // An answer that is late is not taken for that of another request.
            self.bench.pause(SILENCE).await;
        }
        let mut left = Vec::new();
        if case.needs.contains(&Need::PowerStates) {
            left.extend(self.bench.let_go().await);
        }
        left.extend(self.bench.restorer.restore().await);
        if !self.in_fault {
            // A lost heartbeat is a fault to a drive, which would hide the next one.
            let _ = self.bench.leave_fault().await;
        }
        if outcome == Outcome::Fail && !self.is_alive().await {
            why.push_str(&self.revive().await);
            left = self.bench.restorer.restore().await;
        }
        let left: Vec<String> = left.iter().map(|left| format!("{}: {left}", case.id)).collect();
        (result(outcome, why, frames), left)
    }

    /// What it means that the subject does not have what a case needs. What its manual states is looked at first: that a
    /// description does not have an object shows nothing of the device.
    async fn absent(&mut self, need: Need) -> (Outcome, String, Vec<String>) {
        let subject = self.bench.subject;
        let (Some(departure), Some(object)) = (stated_absence(&subject, need), need.object()) else {
            let outcome = if need.is_an_option() { Outcome::NotRun } else { Outcome::NotApplicable };
            return (outcome, need.to_string(), Vec::new());
        };
        self.bench.begin();
        let (outcome, why) = self.shown(&departure, object).await;
        (outcome, why, self.bench.evidence())
    }

    /// Looks whether a departure is there that a manual states of an object.
    async fn shown(&mut self, departure: &Departure, object: Mux) -> (Outcome, String) {
        let seen = match departure {
            Departure::EchoesControlword(statusword) => self.shows_no_state(*statusword).await,
            _ => self.is_refused(object).await,
        };
        let cited = self.bench.subject.cited(departure);
        match seen {
            Ok(seen) => (Outcome::Expected, format!("{cited}: {seen}")),
            Err(Finding::Fail(why) | Finding::NotApplicable(why)) => {
                (Outcome::Fail, format!("{why}; the manual states: {cited}"))
            }
        }
    }

    async fn is_refused(&mut self, object: Mux) -> Verdict {
        let codes = [AbortCode::NO_SUCH_OBJECT, AbortCode::NO_SUCH_SUB_INDEX, AbortCode::GENERAL];
        let answer = self.bench.upload(object).await?;
        refused(&format!("read of {object}"), &answer, &codes)
    }

    async fn shows_no_state(&mut self, statusword: Mux) -> Verdict {
        let word = Statusword(self.bench.number(statusword).await? as u16);
        match word.state() {
            Some(state) => fail!("{statusword} is {:04X}h, {}", word.0, state.name()),
            None => Ok(format!("{statusword} is {:04X}h, none of the states of CiA 402", word.0)),
        }
    }

    async fn judge(&mut self, case: &Case, verdict: Result<String, Finding>) -> (Outcome, String) {
        let why = match verdict {
            Ok(seen) => return (Outcome::Pass, seen),
            Err(Finding::NotApplicable(why)) => return (Outcome::NotApplicable, why),
            Err(Finding::Fail(why)) => why,
        };
        let subject = self.bench.subject;
        let stated = |key: &&str| subject.departures().find(|departure| departure.key() == *key);
        let Some(departure) = case.departures.iter().find_map(stated) else { return (Outcome::Fail, why) };
        let absent = departure.object().filter(|object| !subject.description.has_index(object.index));
        let (outcome, seen) = match absent {
            Some(object) => self.shown(&departure, object).await,
            None => (Outcome::Expected, subject.cited(&departure)),
        };
        (outcome, format!("{seen}: {why}"))
    }

    async fn is_alive(&mut self) -> bool {
        self.bench.upload(Mux::new(0x1000, 0)).await.is_ok()
    }

    /// The node has gone silent: what comes after is to be about itself.
    async fn revive(&mut self) -> String {
        match self.bench.reset(NmtCommand::ResetNode).await {
            Ok(_) => "; the node answered no more and was reset".to_owned(),
            Err(_) => "; the node answers no more, not even to a reset".to_owned(),
        }
    }
}

/// The departure by which the subject does not have what a case needs.
fn stated_absence(subject: &Subject, need: Need) -> Option<Departure> {
    let missing = need.object()?;
    subject.departures().find(|departure| match departure {
        // An object that is there, and not what the standard has it be.
        Departure::EchoesControlword(_) => need == Need::PowerStates,
        // What says that nothing is stored is about both objects.
        Departure::NoStoreParameters(_) => matches!(missing.index, 0x1010 | 0x1011),
        _ => {
            let absent = !subject.description.has_index(missing.index);
            absent && departure.object().is_some_and(|object| object.index == missing.index)
        }
    })
}

fn number(data: &[u8]) -> u32 {
    data.iter().take(4).rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

//! Captures and reports that a session commands. A capture ends with the session that began it, with its control or its silence: what it
//! has changed is put back then.

use std::cell::Cell;
use std::rc::Rc;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NodeId;
use futures_util::future::{Aborted, abortable};
use machine::file::tpdo_id;
use master::Drive;
use recording::{Capture, Column, Recorded, Series, Subject};
use serde_json::{Value, json};
use sim::recorder::{LiveValues, Signal};
use words::counted;
use words::failure::Failure;

use super::measurand::{Measurand, TRUE, Way};
use super::quantity::had;
use super::run::{CaptureOutcome, CaptureRun, NamedCapture};
use super::{Captured, Running, SeenBy, Span, Taken, Wanted, WayBack, not_put_back, with_left};
use crate::command::{CaptureCommand, CaptureOrder};
use crate::motion::guarding::UNGUARDED;
use crate::network::params::journal::default_path;
use crate::network::report::{self, Made, NodeReport};
use crate::parameters::transactions::Refusal;
use crate::parameters::{STORING, answer, busy, refuse};
use crate::state::Host;
use crate::work::{Asked, Done};

/// Readings of one capture that a page is sent at most: some megabytes as JSON.
const MOST_READINGS: u128 = 400_000;
/// Captures of a node that its report has: the newest.
const MOST_REPORTED: usize = 4;
/// Quantities of one capture: as many as the TPDOs of a drive carry, and some by SDO.
const MOST_QUANTITIES: usize = 32;
/// The longest texts of a report's head.
const LONGEST: usize = 100;

impl Host {
    /// Executes a command about a capture or a report, or starts it.
    pub(crate) fn take_capture(&mut self, node: NodeId, command: CaptureCommand, asked: Asked) {
        match command {
            CaptureCommand::CaptureQuantities {} => answer(asked, self.quantities_of(node)),
            CaptureCommand::Capture(order) => match self.begin_capture(node, order) {
                Ok(work) => self.work.push(Box::pin(async move { Done::Captured(asked, Box::new(work.await)) })),
                Err(refusal) => refuse(asked, refusal),
            },
            CaptureCommand::TestMotion(order) => self.take_test_motion(node, order, asked),
            CaptureCommand::EndCapture {} => match self.captures.get(&node).and_then(|run| run.ended.as_ref()) {
                Some(ended) => {
                    ended.set(true);
                    answer(asked, Ok(json!({ "node": node.raw() })));
                }
                None => refuse(asked, ("no_capture", format!("nothing is being captured of node {node}"))),
            },
            CaptureCommand::Report { at, by } => self.begin_report(node, at, by, asked),
        }
    }

    /// What can be captured of a node.
    fn quantities_of(&self, node: NodeId) -> Result<Value, Refusal> {
        let (drive, model) = self.known_model(node)?;
        let names = drive.axis_description().map(|axis| had(model, axis)).unwrap_or_default();
        let signals = Signal::ALL.iter().filter(|_| self.true_values().is_some());
        let true_values: Vec<_> = signals.map(|signal| format!("{TRUE}{}", signal.name())).collect();
        Ok(json!({ "node": node.raw(), "quantities": names, "true_values": true_values }))
    }

    pub(crate) fn true_values(&self) -> Option<&LiveValues> {
        self.setting.world.as_ref()?.values()
    }

    /// Begins a capture: what its future does last is to put everything back.
    fn begin_capture(
        &mut self,
        node: NodeId,
        order: CaptureOrder,
    ) -> Result<impl Future<Output = CaptureOutcome> + use<>, Refusal> {
        let (drive, _) = self.known_model(node)?;
        if self.captures.contains_key(&node) {
            return Err(busy("it is being captured already"));
        }
        self.check_no_test_motion()?;
        if self.parameters.is_writing(node) {
            return Err(busy("its parameters are being written"));
        }
        // Some answer before they have stored, and would keep the TPDOs of the capture.
        if self.running.get(&node).is_some_and(|running| running.what == STORING) {
            return Err(busy("it is storing its parameters"));
        }
        let span = span_of(&order)?;
        let mut wanted = self.wanted(node, order.period_ms, order.sdo)?;
        if !order.take.is_empty() && self.is_in_group(node) {
            return Err(busy("it moves by its PDOs in a group: none of them can be taken"));
        }
        let take = order.take.iter().map(|text| tpdo_id(text)).collect::<Result<_, _>>();
        wanted.take = take.map_err(|why| ("usage", why))?;
        check_size(order.quantities.len(), 1, &wanted, &span)?;
        let way_back = WayBack::in_network(&self.setting.ways_back);
        let restorer = way_back.of(&drive).clone();
        let (world, ended) = (self.true_values().cloned(), Rc::new(Cell::new(false)));
        let (flag, changes) = (Rc::clone(&ended), restorer.clone());
        let (capturing, abort) = abortable(async move {
            wanted.quantities = measurands(&drive, world.as_ref(), &order.quantities).await?;
            wanted.check(&span)?;
            let mut running = wanted.begin(&drive, &changes).await?;
            let taken = running.next_until(&span, || flag.get()).await?;
            Ok((running, taken))
        });
        self.captures.insert(node, CaptureRun { ended: Some(ended), abort });
        Ok(async move {
            let captured: Result<Result<(Running, Taken), Failure>, Aborted> = capturing.await;
            let left = restorer.restore().await;
            way_back.remove_if_done();
            let outcome = match captured {
                Ok(captured) => outcome_of(node, captured, &left, restorer.left_operational()),
                Err(Aborted) => {
                    let gone = Failure::new("the page that began it has gone, or control changed hands");
                    Err(refusal(&with_left(gone.of_kind("stopped"), &left)))
                }
            };
            CaptureOutcome { node, generation: None, outcome }
        })
    }

    /// What is to be captured of a node, without its quantities.
    pub(crate) fn wanted(&self, node: NodeId, period_ms: f64, by_sdo: bool) -> Result<Wanted, Refusal> {
        Ok(Wanted {
            quantities: Vec::new(),
            period: time("a time between two readings", period_ms, Duration::from_micros(50))?,
            bitrate: self.setting.bitrate.unwrap_or(Bitrate::K500),
            take: Vec::new(),
            by_sdo,
            // A virtual bus ends with the program, and nothing is left to go back to.
            journal: self.setting.journals.is_some().then(|| default_path(node)),
            on_kept: |_| (),
        })
    }

    /// A capture has ended, and everything was put back, or could not be.
    pub(crate) fn conclude_capture(&mut self, asked: Asked, ended: CaptureOutcome) {
        let CaptureOutcome { node, generation, outcome } = ended;
        self.captures.remove(&node);
        if let Some(generation) = generation {
            self.conclude_test_motion(node, generation);
        }
        // Pages that show its PDOs read them again.
        self.parameters.note_mapped(node);
        self.learn_pdos(node);
        let outcome = outcome.map(|(captures, value)| {
            let kept = self.captured.entry(node).or_default();
            for (name, capture, followed) in captures {
                if let Ok(mut row) = report::ReportedCapture::of_record(name, recorded(capture), node) {
                    // What a capture alone does not show.
                    row.merit.iter_mut().for_each(|merit| merit.followed = followed);
                    kept.truncate(MOST_REPORTED - 1);
                    kept.insert(0, row);
                }
            }
            value
        });
        if let Err((kind, text)) = &outcome
            && !matches!(*kind, "usage" | UNGUARDED)
        {
            self.send_news(Some(node), text);
        }
        answer(asked, outcome);
    }

    /// The session that began the captures has gone: they end, and what they have changed is put back.
    pub(crate) fn end_captures(&self) {
        self.captures.values().for_each(|run| run.abort.abort());
    }

    fn begin_report(&mut self, node: NodeId, at: String, by: Option<String>, asked: Asked) {
        let drive = match self.known_model(node) {
            Ok((drive, _)) => drive,
            Err(refusal) => return refuse(asked, refusal),
        };
        let is_long = |text: &String| text.chars().count() > LONGEST;
        if is_long(&at) || by.as_ref().is_some_and(is_long) {
            return refuse(asked, ("malformed", format!("expected at most {LONGEST} characters of a date or a name")));
        }
        if !self.parameters.begin_reading() {
            return refuse(asked, busy("too many reads are under way"));
        }
        let made = Made { at, by: by.filter(|by| !by.trim().is_empty()), bus: self.setting.bus.clone() };
        let captures = self.captured.get(&node).cloned().unwrap_or_default();
        let tunings = self.tunings.get(&node).cloned().into_iter().collect();
        self.work.push(Box::pin(async move { Done::Looked(asked, page_of(&drive, made, captures, tunings).await) }));
    }
}

async fn page_of(
    drive: &Drive,
    made: Made,
    captures: Vec<report::ReportedCapture>,
    tunings: Vec<report::Tuning>,
) -> Result<Value, Refusal> {
    let mut report = NodeReport::read(&(), drive, made).await.map_err(|failure| refusal(&failure))?;
    (report.captures, report.tunings) = (captures, tunings);
    Ok(json!({ "node": report.node, "file": format!("node{}.html", report.node), "html": report.to_html() }))
}

fn span_of(order: &CaptureOrder) -> Result<Span, Refusal> {
    let trigger = order.trigger.as_deref().map(str::trim).filter(|text| !text.is_empty());
    Ok(Span {
        duration: time("a length of the capture", order.duration_ms, Duration::from_millis(1))?,
        trigger: trigger.map(str::parse).transpose().map_err(|why: String| ("usage", why))?,
        pre_trigger: time("a time before the trigger", order.pre_ms, Duration::ZERO)?,
    })
}

/// Times as the page has them: in ms.
pub(crate) fn time(what: &str, ms: f64, least: Duration) -> Result<Duration, Refusal> {
    let time =
        Duration::try_from_secs_f64(ms / 1e3).ok().filter(|time| (least..=Duration::from_secs(3600)).contains(time));
    time.ok_or_else(|| ("usage", format!("expected {what} from {least:?} to 1 h, got {ms} ms")))
}

/// Whether a page can be sent so many quantities of so many runs.
pub(crate) fn check_size(count: usize, runs: u32, wanted: &Wanted, span: &Span) -> Result<(), Refusal> {
    if count > MOST_QUANTITIES {
        return Err(("usage", format!("expected at most {MOST_QUANTITIES} quantities, got {count}")));
    }
    // Whether it is to end is looked for once a period.
    if wanted.period > span.duration {
        let text = format!(
            "expected a time between two readings of at most the length, {:?}, got {:?}",
            span.duration, wanted.period
        );
        return Err(("usage", text));
    }
    let rows = (span.duration + span.pre_trigger).as_nanos() / wanted.period.as_nanos();
    let readings = rows * count as u128 * u128::from(runs);
    if readings > MOST_READINGS {
        let text = format!(
            "{readings} readings are more than a page is sent, at most {MOST_READINGS}: capture for a shorter time, at a lower rate, or by `ferrodrive capture`"
        );
        return Err(("usage", text));
    }
    Ok(())
}

/// The quantities of these names, each once.
pub(crate) async fn measurands(
    drive: &Drive,
    world: Option<&LiveValues>,
    names: &[String],
) -> Result<Vec<Measurand>, Failure> {
    let mut quantities = Vec::new();
    for name in names {
        let measurand = Measurand::named(drive, world, name).await?;
        if !quantities.contains(&measurand) {
            quantities.push(measurand);
        }
    }
    Ok(quantities)
}

/// A capture of a node as the page has it, which began then.
pub(crate) fn shown(node: NodeId, capture: &Capture, ways: &[Way], first_at: Instant) -> Value {
    let mut value = serde_json::to_value(Captured::of(capture, ways)).unwrap_or_default();
    // The page has names and notes of its own.
    value
        .as_object_mut()
        .into_iter()
        .for_each(|row| ["name", "notes"].iter().for_each(|field| drop(row.remove(*field))));
    value["node"] = node.raw().into();
    value["begun_s"] = (first_at - Instant::ZERO).as_secs_f64().into();
    value
}

fn outcome_of(
    node: NodeId,
    captured: Result<(Running, Taken), Failure>,
    left: &[String],
    nmt_back: Option<SeenBy>,
) -> Result<(Vec<NamedCapture>, Value), Refusal> {
    let (running, taken) = captured.map_err(|failure| refusal(&with_left(failure, left)))?;
    let Taken { capture, cut_off, first_at } = taken;
    if capture.time_s.is_empty() {
        let failure =
            cut_off.unwrap_or_else(|| Failure::new(format!("node {node}: ended before anything was captured")));
        return Err(refusal(&with_left(failure, left)));
    }
    let mut value = shown(node, &capture, running.ways(), first_at);
    value["pace"] = running.plan().map(|plan| plan.pace.words()).into();
    value["load"] = running.plan().map(|plan| plan.load).into();
    value["nmt_back"] = nmt_back.map(SeenBy::words).into();
    let lacks = cut_off.into_iter().chain(not_put_back(node, left).map(|failure| with_left(failure, left)));
    value["lacks"] = lacks.map(|failure| refusal(&failure).1).collect();
    let name = format!("capture of {}", names_of(&capture));
    Ok((vec![(name, capture, None)], value))
}

/// A failure as its kind and one text: what, why, and what to do.
pub fn refusal(failure: &Failure) -> Refusal {
    let Failure { kind, what, because, next, .. } = failure;
    let lines = std::iter::once(what).chain(because).chain(next).map(String::as_str);
    (*kind, lines.collect::<Vec<_>>().join("; "))
}

fn names_of(capture: &Capture) -> String {
    let names: Vec<&str> = capture.traces.iter().map(|trace| trace.quantity.as_str()).collect();
    match capture.time_s.last() {
        Some(end) if names.len() <= 4 => format!("{}, {end:.3} s", names.join(", ")),
        _ => counted(names.len(), "quantity"),
    }
}

/// A capture as what a reader of records has of it.
fn recorded(capture: Capture) -> Recorded {
    let subject = Subject::Axis(capture.place);
    let series = capture.traces.iter().map(|trace| Series {
        column: Column {
            subject: subject.clone(),
            signal: trace.quantity.clone().into(),
            unit: trace.unit.clone().into(),
        },
        points: capture.points(trace).collect(),
    });
    Recorded { series: series.collect(), marks: Vec::new(), torn: capture.is_cut_off }
}

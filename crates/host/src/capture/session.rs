//! A capture on a bus: the drive is made to send, what comes is collected, and everything is put back.

use std::cell::Cell;
use std::path::PathBuf;
use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::pdo::PdoId;
use canopen::{Mux, NmtCommand, connection_set};
use master::core::LoggedFrame;
use master::parameters::{Parameters, PlanOptions};
use master::{Drive, FrameLog};
use recording::{Capture, Trace};
use sim::Place;
use words::failure::Failure;

use super::plan::{CapturePlan, Request, plan};
use super::quantity::Quantity;
use super::restorer::Restorer;
use super::rows::{Armed, Rows, Trigger};
use crate::network::params::journal::{Kept, default_path};
use crate::network::params::{apply_refused, source};
use machine::parameters::journal::Journal;

/// What is to be captured, and how.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The quantities.
    pub quantities: Vec<Quantity>,
    /// Time between two readings.
    pub period: Duration,
    /// Of the bus.
    pub bitrate: Bitrate,
    /// TPDOs that are taken although they are in use.
    pub take: Vec<PdoId>,
    /// What cannot come by TPDO is read by SDO.
    pub by_sdo: bool,
    /// Where the way back is kept meanwhile; `None` on a virtual bus that ends with the program.
    pub journal: Option<PathBuf>,
    /// Hears what to do about a journal that stays.
    pub on_kept: fn(&str),
}

/// How long a capture is, and when it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// From its begin, or from its trigger.
    pub duration: Duration,
    /// What begins it; at once with `None`.
    pub trigger: Option<Trigger>,
    /// What is kept of before the trigger.
    pub pre_trigger: Duration,
}

/// What was had of a quantity.
#[derive(Clone, Debug, PartialEq)]
pub enum Way {
    /// By this TPDO.
    Tpdo(PdoId),
    /// By SDO, one request after the other.
    Sdo,
}

/// A column and its bits in a frame.
type Field = (usize, std::ops::Range<u32>);

/// A capture that runs: the drive sends.
#[derive(Debug)]
pub struct Running {
    drive: Drive,
    quantities: Vec<Quantity>,
    ways: Vec<Way>,
    plan: Option<CapturePlan>,
    period: Duration,
    log: Option<FrameLog>,
    /// Of each identifier the columns with the bits that they have.
    fields: Vec<(u16, Vec<Field>)>,
    parameters: std::collections::BTreeMap<Mux, Vec<u8>>,
    rows: Rows,
    taken: Vec<LoggedFrame>,
    lost: u64,
}

/// What came of a capture.
#[derive(Debug)]
pub struct Taken {
    /// What was measured.
    pub capture: Capture,
    /// Why it is shorter than asked for, if it is.
    pub cut_off: Option<Failure>,
}

/// How long SYNC of others is listened for.
const LISTEN: Duration = Duration::from_millis(250);
/// How often what came is collected.
const COLLECT: Duration = Duration::from_millis(10);
/// Frames that come between two looks at most: a bus of 1 Mbit/s carries some 20 in a millisecond; the program may be late.
const LOG: usize = 20_000;
/// How long a drive may take to send its first one, and how long none may come later on.
const PATIENCE: Duration = Duration::from_secs(1);
/// Readings that are kept at most: eight bytes each.
const MOST: u128 = 100_000_000;

impl Wanted {
    /// Checks what can be checked without the bus.
    ///
    /// # Errors
    /// Nothing is asked for; it would be more than is kept.
    pub fn check(&self, span: &Span) -> Result<(), Failure> {
        if self.quantities.is_empty() {
            let what = "expected at least one quantity to capture";
            return Err(Failure::usage(what).next(format!("name some of: {}", super::quantity::short_names())));
        }
        let rows = (span.duration + span.pre_trigger).as_nanos() / self.period.as_nanos().max(1);
        let readings = rows * self.quantities.len() as u128;
        if readings > MOST {
            return Err(Failure::usage(format!("{readings} readings are more than are kept, at most {MOST}"))
                .next("capture for a shorter time, at a lower rate, or record it: ferrodrive record"));
        }
        Ok(())
    }

    /// Makes the drive send what is asked for. What it changes is in the [`Restorer`] from before it is changed.
    ///
    /// # Errors
    /// What cannot be had, and what can; nothing is left changed then, unless the drive fell silent.
    pub async fn begin(&self, drive: &Drive) -> Result<(Running, Restorer), Failure> {
        let restorer = Restorer::new(drive.node().clone());
        match self.begun(drive, &restorer).await {
            Ok(running) => Ok((running, restorer)),
            Err(failure) => Err(restorer
                .restore()
                .await
                .iter()
                .fold(failure, |failure, left| failure.because(format!("not put back: {left}")))),
        }
    }

    async fn begun(&self, drive: &Drive, restorer: &Restorer) -> Result<Running, Failure> {
        let node = drive.node();
        // What a drive does not have is refused before anything is written.
        for quantity in &self.quantities {
            node.upload(quantity.object).await?;
        }
        let (planned, by_sdo) = self.planned(drive).await?;
        let parameters = drive.back_up(|_, _, _| ()).await?.parameters.values;
        let ways = self.quantities.iter().map(|quantity| {
            let carries = |plan: &CapturePlan| {
                let mut pdos = plan.pdos.iter();
                pdos.find(|(config, _)| config.map.find(quantity.object).is_some()).map(|(config, _)| config.pdo)
            };
            let carried = planned.as_ref().filter(|_| !by_sdo.contains(&quantity.object)).and_then(carries);
            carried.map_or(Way::Sdo, Way::Tpdo)
        });
        let mut running = Running {
            drive: drive.clone(),
            ways: ways.collect(),
            quantities: self.quantities.clone(),
            plan: planned,
            period: self.period,
            log: None,
            fields: Vec::new(),
            parameters,
            rows: Rows::new(self.quantities.len(), self.period),
            taken: Vec::new(),
            lost: 0,
        };
        if let Some(plan) = running.plan.clone() {
            self.set_up(drive, &plan, restorer).await?;
            running.listen(&plan);
            running.wait_for_first(&plan, restorer).await?;
        }
        Ok(running)
    }

    /// The plan for what can come by TPDO, and what cannot.
    async fn planned(&self, drive: &Drive) -> Result<(Option<CapturePlan>, Vec<Mux>), Failure> {
        let (node, network) = (drive.node().id(), drive.node().network());
        let Some(model) = drive.description() else {
            return Err(Failure::new(format!("node {node}: what a drive of unknown model can send is not known"))
                .of_kind("unknown_model")
                .at_node(node)
                .next(words::models::name_its_model(node, &["MODEL"])));
        };
        let now = drive.pdos().await?;
        let sync = match network.with_core(|core| core.sync_period()) {
            Some(period) => Some(period),
            None => heard_sync(drive).await,
        };
        let mut objects: Vec<Mux> = Vec::new();
        for quantity in &self.quantities {
            if !objects.contains(&quantity.object) {
                objects.push(quantity.object);
            }
        }
        let with = |objects: &[Mux]| {
            let Self { period, bitrate, take, .. } = self;
            plan(model, node, &now, &Request { objects, period: *period, bitrate: *bitrate, sync, take })
        };
        let whole = with(&objects);
        if whole.is_ok() || !self.by_sdo {
            return whole.map(|plan| (Some(plan), Vec::new()));
        }
        // What has a place goes by TPDO, in the order in which it was asked for.
        let (mut fitting, mut plan, mut left) = (Vec::new(), None, Vec::new());
        for object in objects {
            fitting.push(object);
            match with(&fitting) {
                Ok(found) => plan = Some(found),
                Err(_) => left.extend(fitting.pop()),
            }
        }
        Ok((plan, left))
    }

    async fn set_up(&self, drive: &Drive, plan: &CapturePlan, restorer: &Restorer) -> Result<(), Failure> {
        let node = drive.node();
        let wanted = Parameters { node: Some(node.id()), values: plan.values.clone(), ..Parameters::default() };
        let steps = drive.plan_parameters(&wanted, PlanOptions::default()).await.map_err(source::refused)?;
        if !steps.steps.is_empty() {
            let journal = Journal { node: node.id(), identity: steps.identity, undo: steps.undo() };
            let kept = self.journal.as_deref().map(|path| Kept::create(path, &journal, self.on_kept)).transpose()?;
            {
                let mut changed = restorer.lock();
                (changed.undo, changed.journal) = (journal.undo, kept);
            }
            match drive.apply_tpdos(&steps).await.map_err(source::refused)? {
                Ok(_) => {}
                Err(error) => {
                    let path = self.journal.clone().unwrap_or_else(|| default_path(node.id()));
                    return Err(apply_refused(&error, drive.description(), &path));
                }
            }
        }
        if plan.pace == super::plan::Pace::OwnSync {
            restorer.lock().sync = true;
            node.network().sync(Some(plan.period));
        }
        Ok(())
    }
}

/// The period of a SYNC that another node sends: the median distance of those that were heard.
async fn heard_sync(drive: &Drive) -> Option<Duration> {
    let network = drive.node().network();
    let id = connection_set::SYNC.as_standard()?;
    let log = network.log_frames(&[id], LOG);
    network.sleep(LISTEN).await;
    let mut heard = Vec::new();
    log.take(&mut heard);
    let mut distances: Vec<Duration> = heard.windows(2).map(|pair| pair[1].at - pair[0].at).collect();
    distances.sort_unstable();
    let median = distances.get(distances.len() / 2)?;
    // Its producer counts tenths of a millisecond; what the bus adds is less.
    let tenths = (median.as_secs_f64() * 1e4).round().max(1.0);
    Some(Duration::from_micros(100) * tenths as u32)
}

impl Running {
    /// Where each quantity comes from.
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// How the drive was made to send; `None` where all is read by SDO.
    pub const fn plan(&self) -> Option<&CapturePlan> {
        self.plan.as_ref()
    }

    fn listen(&mut self, plan: &CapturePlan) {
        for (config, id) in &plan.pdos {
            let columns = self.quantities.iter().enumerate().filter_map(|(column, quantity)| {
                let is_by_it = self.ways[column] == Way::Tpdo(config.pdo);
                Some((column, config.map.find(quantity.object).filter(|_| is_by_it)?))
            });
            self.fields.push((*id, columns.collect()));
        }
        let ids: Vec<u16> = plan.pdos.iter().map(|(_, id)| *id).collect();
        self.log = Some(self.drive.node().network().log_frames(&ids, LOG));
    }

    /// PDOs are sent by an operational node alone: one that does not send is started, and was not operational before.
    async fn wait_for_first(&mut self, plan: &CapturePlan, restorer: &Restorer) -> Result<(), Failure> {
        let (network, node) = (self.drive.node().network().clone(), self.drive.node().clone());
        network.sleep(plan.period * 2 + COLLECT).await;
        if !self.has_come() {
            restorer.lock().started = true;
            node.nmt(NmtCommand::Start);
        }
        let began = network.now();
        while !self.has_come() {
            if network.now() - began > PATIENCE + plan.period * 2 {
                let ids = plan.pdos.iter().map(|(config, id)| format!("{} ({id:03X}h)", config.pdo));
                return Err(Failure::new(format!(
                    "node {}: {} did not come",
                    node.id(),
                    ids.collect::<Vec<_>>().join(", ")
                ))
                .of_kind("no_pdo")
                .at_node(node.id())
                .because("it was set up, reads back as it should, and the node was started")
                .next(format!("ferrodrive pdo show {} says what a PDO waits for", node.id())));
            }
            network.sleep(COLLECT).await;
        }
        Ok(())
    }

    /// Each of the TPDOs came at least once.
    fn has_come(&mut self) -> bool {
        self.lost += self.log.as_ref().map_or(0, |log| log.take(&mut self.taken));
        self.fields.iter().all(|(id, _)| self.taken.iter().any(|frame| frame.id == *id))
    }

    /// Takes the next capture: waits for its trigger, collects, and goes on sending for a further one.
    ///
    /// # Errors
    /// The trigger is of a quantity that is not captured; a value by SDO does not come. A drive that falls silent cuts the capture off.
    pub async fn next(&mut self, span: &Span) -> Result<Taken, Failure> {
        let network = self.drive.node().network().clone();
        let mut watch = span.trigger.as_ref().map(|trigger| self.armed(trigger)).transpose()?;
        (self.rows, self.lost) = (Rows::new(self.quantities.len(), self.period), 0);
        // What came before belongs to no capture.
        self.has_come();
        self.taken.clear();
        let mut begun = if watch.is_none() { Some(network.now()) } else { None };
        let (mut looked_at, mut heard_at) = (0, network.now());
        let cut_off = loop {
            self.collect().await?;
            let now = network.now();
            while looked_at < self.rows.len() {
                let (at, values) = self.rows.row(looked_at);
                heard_at = at;
                looked_at += 1;
                if let Some((column, armed)) = &mut watch
                    && begun.is_none()
                    && armed.passes(values[*column])
                {
                    begun = Some(at);
                }
            }
            if begun.is_some_and(|begun| now - begun >= span.duration + COLLECT) {
                break None;
            }
            if now - heard_at > PATIENCE + self.period * 2 {
                break Some(self.silent(now - heard_at));
            }
            if begun.is_none() {
                let before = self.rows.len();
                self.rows.forget_before(earlier(now, span.pre_trigger + COLLECT * 2));
                looked_at -= before - self.rows.len();
            }
        };
        Ok(self.capture(span, begun, cut_off))
    }

    /// Captures for as long as something else is being done, from now on.
    ///
    /// # Errors
    /// Those of [`next`](Self::next), beside what came of the other.
    pub async fn during<T>(&mut self, doing: impl Future<Output = T>) -> (T, Result<Taken, Failure>) {
        let network = self.drive.node().network().clone();
        (self.rows, self.lost) = (Rows::new(self.quantities.len(), self.period), 0);
        self.has_come();
        self.taken.clear();
        let (begun, is_done) = (network.now(), Cell::new(false));
        let doing = async {
            let done = doing.await;
            is_done.set(true);
            done
        };
        let collecting = async {
            while !is_done.get() {
                self.collect().await?;
                let heard_at = if self.rows.is_empty() { begun } else { self.rows.row(self.rows.len() - 1).0 };
                if network.now() - heard_at > PATIENCE + self.period * 2 {
                    return Ok(Some(self.silent(network.now() - heard_at)));
                }
            }
            Ok(None)
        };
        let (done, cut_off) = futures_util::future::join(doing, collecting).await;
        let duration = network.now() - begun;
        let span = Span { duration, trigger: None, pre_trigger: Duration::ZERO };
        (done, cut_off.map(|cut_off| self.capture(&span, Some(begun), cut_off)))
    }

    fn armed(&self, trigger: &Trigger) -> Result<(usize, Armed), Failure> {
        let asked = trigger.quantity.to_ascii_lowercase().replace('-', "_");
        let whole = self.quantities.iter().position(|quantity| quantity.name == asked);
        let begins = || {
            let with_unit = format!("{asked}_");
            self.quantities.iter().position(|quantity| quantity.name.starts_with(&with_unit))
        };
        let column = whole.or_else(begins).ok_or_else(|| {
            let names = self.quantities.iter().map(|quantity| quantity.name.as_str()).collect::<Vec<_>>().join(", ");
            Failure::usage(format!("the trigger is of '{}', which is not captured", trigger.quantity))
                .next(format!("name one of: {names}"))
        })?;
        Ok((column, Armed::new(trigger)))
    }

    /// Readings that came meanwhile; those by SDO are asked for one after the other.
    async fn collect(&mut self) -> Result<(), Failure> {
        let network = self.drive.node().network().clone();
        let began = network.now();
        for column in 0..self.quantities.len() {
            if self.ways[column] != Way::Sdo {
                continue;
            }
            let (object, by_sdo) = (self.quantities[column].object, self.quantities[column].by_sdo);
            let raw = self.drive.node().upload(object).await?.raw();
            let (at, value) = (network.now(), by_sdo.value(raw));
            // What came by TPDO until then has earlier times.
            self.take_frames();
            self.rows.add(at, [(column, value)].into_iter());
        }
        // Readings by SDO are a round in a period, or in the time between two looks at what came by TPDO.
        let round = if self.log.is_some() { COLLECT } else { self.period };
        let rest = round.saturating_sub(network.now() - began);
        if !rest.is_zero() {
            network.sleep(rest).await;
        }
        self.take_frames();
        Ok(())
    }

    fn take_frames(&mut self) {
        let Self { log, taken, fields, quantities, rows, lost, .. } = self;
        let Some(log) = log else { return };
        *lost += log.take(taken);
        for frame in taken.drain(..) {
            let Some((_, fields)) = fields.iter().find(|(id, _)| *id == frame.id) else { continue };
            let in_frame = fields.iter().filter(|(_, bits)| bits.end <= u32::from(frame.length) * 8);
            let readings = in_frame.map(|(column, bits)| {
                let mask = u64::MAX >> (u64::BITS - (bits.end - bits.start));
                let raw = (frame.data >> bits.start & mask) as u32;
                (*column, quantities[*column].by_pdo.value(raw))
            });
            rows.add(frame.at, readings);
        }
    }

    fn silent(&self, since: Duration) -> Failure {
        let id = self.drive.node().id();
        Failure::new(format!("node {id}: nothing came for {:.1} s", since.as_secs_f64()))
            .of_kind("capture_cut_off")
            .at_node(id)
            .because("it has lost its supply, its cable or its configuration, or another master has stopped it")
            .next("what came until then is kept")
    }

    fn capture(&mut self, span: &Span, begun: Option<Instant>, mut cut_off: Option<Failure>) -> Taken {
        let begun = begun.unwrap_or_else(|| self.drive.node().network().now());
        self.rows.forget_before(earlier(begun, if span.trigger.is_some() { span.pre_trigger } else { Duration::ZERO }));
        let first = if self.rows.is_empty() { begun } else { self.rows.row(0).0 };
        // Without a trigger it begins with its first reading.
        let from = first.max(begun);
        let rows = (0..self.rows.len()).take_while(|row| self.rows.row(*row).0 - from <= span.duration).count();
        let (mut time_s, columns) = self.rows.columns(first);
        time_s.truncate(rows);
        let traces = self.quantities.iter().zip(columns).map(|(quantity, mut values)| {
            values.truncate(rows);
            Trace::new(quantity.name.clone(), quantity.unit.clone(), values, &time_s)
        });
        let traces = traces.collect();
        if self.lost > 0 && cut_off.is_none() {
            let what = format!("{} frames came faster than this program took them", self.lost);
            cut_off = Some(
                Failure::new(what).of_kind("capture_cut_off").next("lower the rate, or give the machine less to do"),
            );
        }
        let capture = Capture {
            name: String::new(),
            notes: String::new(),
            model: self.drive.description().map_or_else(String::new, |model| model.name.to_owned()),
            place: Place { node: self.drive.node().id().raw(), axis: self.drive.axis_id() },
            trigger_s: span.trigger.as_ref().map(|_| (begun - first).as_secs_f64()),
            time_s,
            traces,
            parameters: self.parameters.clone(),
            is_cut_off: cut_off.is_some(),
        };
        Taken { capture, cut_off }
    }
}

/// A time before another, or the begin of all.
fn earlier(at: Instant, by: Duration) -> Instant {
    Instant::from_nanos(at.as_nanos().saturating_sub(by.as_nanos() as u64))
}

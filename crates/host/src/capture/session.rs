//! A capture on a bus: the drive is made to send, what comes is collected, and everything is put back.

use std::pin::pin;
use std::time::Duration;

use can::Instant;
use canopen::{Mux, NmtCommand, NmtState, connection_set};
use futures_util::future::{Either, select};
use master::core::LoggedFrame;
use master::parameters::{Parameters, PlanOptions};
use master::{Drive, FrameLog};
use recording::{Capture, Trace, is_called};
use sim::Place;
use sim::recorder::{Samples, Subscription};
use words::failure::Failure;

use super::measurand::{Measurand, Way};
use super::plan::{CapturePlan, Request, plan};
use super::restorer::{Restorer, with_left};
use super::rows::{Armed, Rows, Trigger};
use super::wanted::{Span, Wanted};
use crate::network::params::journal::{Kept, default_path};
use crate::network::params::{apply_refused, source};
use machine::parameters::journal::Journal;

/// A TPDO that brings readings.
#[derive(Debug)]
struct TpdoSource {
    id: u16,
    /// Columns with the bits that they have in the frame.
    fields: Vec<(usize, std::ops::Range<u32>)>,
    /// When it was last taken, or first listened for.
    heard_at: Instant,
}

/// Where the readings come from that the drive does not send.
#[derive(Debug)]
struct Truth {
    columns: Vec<usize>,
    samples: Subscription,
}

/// A capture that runs: the drive sends.
#[derive(Debug)]
pub struct Running {
    drive: Drive,
    quantities: Vec<Measurand>,
    ways: Vec<Way>,
    plan: Option<CapturePlan>,
    period: Duration,
    log: Option<FrameLog>,
    sources: Vec<TpdoSource>,
    truth: Option<Truth>,
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
    /// When its first row was taken.
    pub first_at: Instant,
}

/// How long SYNC of others is listened for.
const LISTEN: Duration = Duration::from_millis(250);
/// How long the second SYNC is waited for where one was heard.
const SLOWEST_SYNC: Duration = Duration::from_secs(5);
/// How often what came is collected.
const COLLECT: Duration = Duration::from_millis(10);
/// Frames that come between two looks at most: a bus of 1 Mbit/s carries some 20 in a millisecond; the program may be late.
const LOG: usize = 20_000;
/// How long a drive may take to send its first one, and how long none may come later on.
const PATIENCE: Duration = Duration::from_secs(1);

impl Wanted {
    /// Makes the drive send what is asked for. What it changes is in the restorer, which is of this drive, from before it is changed: it
    /// leads back from a future that was dropped on the way too.
    ///
    /// # Errors
    /// What cannot be had, and what can; nothing is left changed then, unless the drive fell silent.
    pub async fn begin(&self, drive: &Drive, restorer: &Restorer) -> Result<Running, Failure> {
        match self.begun(drive, restorer).await {
            Ok(running) => Ok(running),
            Err(failure) => Err(with_left(failure, &restorer.restore_parameters().await)),
        }
    }

    async fn begun(&self, drive: &Drive, restorer: &Restorer) -> Result<Running, Failure> {
        let node = drive.node();
        // What a drive does not have is refused before anything is written.
        for quantity in self.quantities.iter().filter_map(Measurand::quantity) {
            node.upload(quantity.object).await?;
        }
        let (planned, by_sdo) = self.planned(drive).await?;
        let parameters = drive.back_up(|_, _, _| ()).await?.parameters.values;
        let ways = self.quantities.iter().map(|measurand| {
            let Measurand::Object(quantity) = measurand else { return Way::World };
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
            sources: Vec::new(),
            truth: None,
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
        running.look_into_world().await?;
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
        let mut objects: Vec<Mux> = Vec::new();
        for quantity in self.quantities.iter().filter_map(Measurand::quantity) {
            if !objects.contains(&quantity.object) {
                objects.push(quantity.object);
            }
        }
        if objects.is_empty() {
            return Ok((None, Vec::new()));
        }
        let now = drive.pdos().await?;
        let sync = match network.with_core(|core| core.sync_period()) {
            Some(period) => Some(period),
            None => heard_sync(drive).await,
        };
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
        let state = node.facts().probable_state(drive.description());
        let pre_operational = state == Some(NmtState::PreOperational);
        // What is not changed but for its state is led back by a journal too: it is started, and its PDOs go on for ever.
        if !steps.steps.is_empty() || pre_operational {
            let journal = Journal { node: node.id(), identity: steps.identity, pre_operational, undo: steps.undo() };
            let kept = self.journal.as_deref().map(|path| Kept::create(path, &journal, self.on_kept)).transpose()?;
            restorer.note_written(journal.undo, kept);
            if let Err(error) = drive.apply_tpdos(&steps).await.map_err(source::refused)? {
                let path = self.journal.clone().unwrap_or_else(|| default_path(node.id()));
                return Err(apply_refused(&error, drive.description(), &path));
            }
        }
        if plan.pace == super::plan::Pace::OwnSync {
            restorer.lock().sync = true;
            node.network().sync(Some(plan.period));
        }
        Ok(())
    }
}

/// The period of a SYNC that another node sends: the median distance of those that were heard. Where only one was, the next is waited
/// for: a second producer would have every synchronous PDO of the bus come at another time.
async fn heard_sync(drive: &Drive) -> Option<Duration> {
    let network = drive.node().network();
    let id = connection_set::SYNC.as_standard()?;
    let log = network.log_frames(&[id], LOG);
    let mut heard = Vec::new();
    let began = network.now();
    while heard.is_empty() && network.now() == began || heard.len() == 1 && network.now() - began < SLOWEST_SYNC {
        network.sleep(LISTEN).await;
        log.take(&mut heard);
    }
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
            let columns = self.quantities.iter().enumerate().filter_map(|(column, measurand)| {
                let quantity = measurand.quantity()?;
                let is_by_it = self.ways[column] == Way::Tpdo(config.pdo);
                Some((column, config.map.find(quantity.object).filter(|_| is_by_it)?))
            });
            let heard_at = self.drive.node().network().now();
            self.sources.push(TpdoSource { id: *id, fields: columns.collect(), heard_at });
        }
        let ids: Vec<u16> = plan.pdos.iter().map(|(_, id)| *id).collect();
        self.log = Some(self.drive.node().network().log_frames(&ids, LOG));
    }

    /// PDOs are sent by an operational node alone: one that does not send is started, and was not operational before.
    async fn wait_for_first(&mut self, plan: &CapturePlan, restorer: &Restorer) -> Result<(), Failure> {
        let (network, node) = (self.drive.node().network().clone(), self.drive.node().clone());
        network.sleep(plan.period * 2 + COLLECT).await;
        // One whose heartbeat shows that it is operational stays so: it may be moving by its PDOs.
        let is_operational = node.facts().probable_state(self.drive.description()) == Some(NmtState::Operational);
        if !self.has_come() && !is_operational {
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
                .because("it was set up, reads back as it should, and the node is operational or was started")
                .next(format!("ferrodrive pdo show {} says what a PDO waits for", node.id())));
            }
            network.sleep(COLLECT).await;
        }
        let ids = self.sources.iter().map(|source| source.id).collect();
        restorer.lock().sending = Some((ids, plan.period));
        Ok(())
    }

    /// Samples the world together with the last TPDOs that came, so that both are in one row: a period goes from one to the next.
    async fn look_into_world(&mut self) -> Result<(), Failure> {
        let columns: Vec<usize> = (0..self.quantities.len()).filter(|at| self.ways[*at] == Way::World).collect();
        let of_world = self.quantities.iter().filter_map(|measurand| match measurand {
            Measurand::World(value) => Some(value),
            Measurand::Object(_) => None,
        });
        let Some(values) = of_world.clone().next().map(|value| value.values.clone()) else { return Ok(()) };
        let (network, node) = (self.drive.node().network(), self.drive.node().id());
        let first = self.sources.first().map(|source| source.id);
        let heard_at = self.taken.iter().rev().find(|frame| Some(frame.id) == first).map(|frame| frame.at);
        let first_at = heard_at.map_or_else(|| network.now(), |at| at + self.period);
        let axis = (node.raw(), self.drive.axis_id());
        let signals = of_world.map(|value| value.signal).collect();
        let samples = values.subscribe(axis, signals, first_at, self.period);
        let began = network.now();
        // On a busy machine the world is behind this clock.
        let first = loop {
            network.sleep(self.period * 2 + COLLECT).await;
            let first = samples.take();
            if first.is_missing || !first.times.is_empty() || network.now() - began > PATIENCE * 10 {
                break first;
            }
        };
        if first.is_missing || first.times.is_empty() {
            let missing = "no virtual drive of this world has its node-ID";
            return Err(Failure::new(format!("node {node}: its true values cannot be captured"))
                .of_kind("no_true_values")
                .at_node(node)
                .because(if first.is_missing { missing } else { "its world brings none" }));
        }
        self.truth = Some(Truth { columns, samples });
        Ok(())
    }

    /// Each of the TPDOs came at least once.
    fn has_come(&mut self) -> bool {
        self.lost += self.log.as_ref().map_or(0, |log| log.take(&mut self.taken));
        self.sources.iter().all(|source| self.taken.iter().any(|frame| frame.id == source.id))
    }

    /// Takes the next capture: waits for its trigger, collects, and goes on sending for a further one.
    ///
    /// # Errors
    /// The trigger is of a quantity that is not captured. A drive that falls silent, or does not answer, cuts the capture off.
    pub async fn next(&mut self, span: &Span) -> Result<Taken, Failure> {
        self.next_until(span, || false).await
    }

    /// As [`next`](Self::next), which ends earlier once `ended` is true: what came until then is the capture, nothing if its trigger has
    /// not come.
    ///
    /// # Errors
    /// Those of [`next`](Self::next).
    pub async fn next_until(&mut self, span: &Span, ended: impl Fn() -> bool) -> Result<Taken, Failure> {
        let network = self.drive.node().network().clone();
        let mut watch = span.trigger.as_ref().map(|trigger| self.armed(trigger)).transpose()?;
        self.begin_anew();
        let (mut begun, mut looked_at) = (None, 0);
        let cut_off = loop {
            if let Err(failure) = self.collect().await {
                break Some(failure);
            }
            let now = network.now();
            while looked_at < self.rows.len() {
                let at = self.rows.time(looked_at);
                // The newest row may be one of which a TPDO is still to come.
                if looked_at + 1 == self.rows.len() && now - at < self.period {
                    break;
                }
                // Without a trigger it begins with its first reading.
                let mut passes =
                    |(column, armed): &mut (usize, Armed)| armed.passes(self.rows.value(looked_at, *column));
                if begun.is_none() && watch.as_mut().is_none_or(&mut passes) {
                    begun = Some(at);
                }
                looked_at += 1;
            }
            // A program that was held up has the last ones still to take.
            let has_come = |end: Instant| now >= end + COLLECT && self.rows.newest() + self.period >= end;
            if ended() || begun.is_some_and(|begun| has_come(begun + span.duration)) {
                break None;
            }
            if let Some(failure) = self.fallen_silent() {
                break Some(failure);
            }
            if begun.is_none() && watch.is_some() {
                let before = self.rows.len();
                self.rows.forget_before(earlier(self.rows.newest(), span.pre_trigger + COLLECT * 2));
                looked_at -= before - self.rows.len();
            }
        };
        if begun.is_none() {
            // What was kept for a trigger that has not come belongs to no capture.
            self.rows = Rows::new(self.quantities.len(), self.period);
        }
        Ok(self.capture(span, begun, cut_off))
    }

    /// Captures for as long as something else is being done, from now on: what came of both.
    pub async fn during<T>(&mut self, doing: impl Future<Output = T>) -> (T, Taken) {
        let network = self.drive.node().network().clone();
        self.begin_anew();
        let begun = network.now();
        let collected = {
            let (doing, collecting) = (pin!(doing), pin!(self.until_cut_off()));
            match select(doing, collecting).await {
                // The other has its own cycles to keep: it is not made to wait for a round of readings.
                Either::Left((done, _)) => Ok((done, None)),
                Either::Right((failure, doing)) => Err((failure, doing.await)),
            }
        };
        let (done, cut_off) = collected.unwrap_or_else(|(failure, done)| (done, Some(failure)));
        self.take_frames();
        let duration = network.now() - begun;
        let span = Span { duration, trigger: None, pre_trigger: Duration::ZERO };
        (done, self.capture(&span, Some(begun), cut_off))
    }

    /// Collects until nothing comes any more.
    async fn until_cut_off(&mut self) -> Failure {
        loop {
            if let Err(failure) = self.collect().await {
                return failure;
            }
            if let Some(failure) = self.fallen_silent() {
                return failure;
            }
        }
    }

    /// Leaves out what came before: it belongs to no capture.
    fn begin_anew(&mut self) {
        let now = self.drive.node().network().now();
        (self.rows, self.lost) = (Rows::new(self.quantities.len(), self.period), 0);
        self.has_come();
        self.taken.clear();
        self.truth.iter().for_each(|truth| drop(truth.samples.take()));
        self.sources.iter_mut().for_each(|source| source.heard_at = now);
    }

    /// One of the TPDOs has stayed away for too long. What is read by SDO and does not come is a failure of its own.
    fn fallen_silent(&self) -> Option<Failure> {
        let heard_at = self.sources.iter().map(|source| source.heard_at).min()?;
        let silence = self.drive.node().network().now() - heard_at;
        (silence > PATIENCE + self.period * 2).then(|| self.silent(silence))
    }

    fn armed(&self, trigger: &Trigger) -> Result<(usize, Armed), Failure> {
        let asked = trigger.quantity.to_ascii_lowercase().replace('-', "_");
        let whole = self.quantities.iter().position(|quantity| quantity.name() == asked);
        let begins = || self.quantities.iter().position(|quantity| is_called(quantity.name(), &asked));
        let column = whole.or_else(begins).ok_or_else(|| {
            let names = self.quantities.iter().map(Measurand::name).collect::<Vec<_>>().join(", ");
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
            let Some(quantity) = self.quantities[column].quantity().filter(|_| self.ways[column] == Way::Sdo) else {
                continue;
            };
            let (object, by_sdo) = (quantity.object, quantity.by_sdo);
            let raw = self.drive.node().upload(object).await?.raw();
            let (at, value) = (network.heard_until(), by_sdo.value(raw));
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

    /// What came by TPDO and what the world had meanwhile, in the order of their times.
    fn take_frames(&mut self) {
        let network = self.drive.node().network();
        let (now, heard_until) = (network.now(), network.heard_until());
        let Self { log, taken, sources, quantities, rows, lost, truth, .. } = self;
        *lost += log.as_ref().map_or(0, |log| log.take(taken));
        let (columns, Samples { times, values, lost: missed, .. }) = truth
            .as_ref()
            .map(|truth| (truth.columns.as_slice(), truth.samples.take_until(heard_until)))
            .unwrap_or_default();
        *lost += missed;
        let mut samples = times.iter().zip(values.chunks(columns.len().max(1))).peekable();
        let true_values = |rows: &mut Rows, (at, values): (&Instant, &[f64])| {
            rows.add(*at, columns.iter().copied().zip(values.iter().copied()));
        };
        for frame in taken.drain(..) {
            let Some(source) = sources.iter_mut().find(|source| source.id == frame.id) else { continue };
            while let Some(sample) = samples.next_if(|(at, _)| **at <= frame.at) {
                true_values(rows, sample);
            }
            source.heard_at = now;
            let in_frame = source.fields.iter().filter(|(_, bits)| bits.end <= u32::from(frame.length) * 8);
            let readings = in_frame.filter_map(|(column, bits)| {
                let mask = u64::MAX >> (u64::BITS - (bits.end - bits.start));
                let raw = (frame.data >> bits.start & mask) as u32;
                Some((*column, quantities[*column].quantity()?.by_pdo.value(raw)))
            });
            rows.add(frame.at, readings);
        }
        samples.for_each(|sample| true_values(rows, sample));
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
        let first = if self.rows.is_empty() { begun } else { self.rows.time(0) };
        // Without a trigger it begins with its first reading.
        let from = first.max(begun);
        let rows = (0..self.rows.len()).take_while(|row| self.rows.time(*row) - from <= span.duration).count();
        let (mut time_s, columns) = self.rows.columns(first);
        time_s.truncate(rows);
        let traces = self.quantities.iter().zip(columns).map(|(quantity, mut values)| {
            values.truncate(rows);
            Trace::new(quantity.name().to_owned(), quantity.unit().to_owned(), values, &time_s)
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
        Taken { capture, cut_off, first_at: first }
    }
}

/// A time before another, or the begin of all.
fn earlier(at: Instant, by: Duration) -> Instant {
    Instant::from_nanos(at.as_nanos().saturating_sub(by.as_nanos() as u64))
}

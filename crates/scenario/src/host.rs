//! The host of a scenario at work: its lines, one after the other, as one future over a [`Network`].
//!
//! What it waits for beyond the bus (a condition, a time) it asks of the [`HostBoard`], which the stepper of the world
//! looks at.

mod claims;
mod measured;
mod whole;

use std::cell::RefCell;
use std::future::{Future, poll_fn};
use std::rc::Rc;
use std::task::{Poll, Waker};
use std::time::Duration;

use can::Instant;
use canopen::od::{DataType, Entry};
use canopen::pdo::MappingRecord;
use canopen::{Mux, NodeId};
use devices::Description;
use master::core::PdoMap;
use master::drive::{self, MotionReport, Report};
use master::pdo::{PdoConfig, TimerUnits};
use master::units::Shown;
use master::{Drive, Network};
use sim::Place;

use super::command::{Command, PdoCommand};
use super::outcome::{Row, RowKind, Verdict};
use super::plan::{HostLine, Paths, Sheets, WantedResult};
use machine::file::Machine;
use words::object::ObjectArg;
use words::value::{typed_value, value};

use claims::{Claim, Claimed, Claims};

/// How long a node may take until it says that it has booted, after a reset and at the start.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// After booting a drive looks at its supply, sensors and inputs for some tens of milliseconds before it judges them.
const SETTLING_TIME: Duration = Duration::from_millis(200);

/// What hosts and the stepper of the world exchange.
#[derive(Default)]
pub(super) struct HostBoard {
    /// What hosts wait for.
    pub(super) waits: Vec<AwaitedCondition>,
    /// What hosts have done.
    pub(super) rows: Vec<Row>,
    /// Hosts that are through.
    pub(super) done: Vec<String>,
    /// Drives that hosts have for a while.
    claims: Rc<RefCell<Claims>>,
}

/// A condition that a host waits for.
pub(super) struct AwaitedCondition {
    pub(super) line: (usize, usize),
    /// Set when it was so.
    pub(super) so: bool,
    pub(super) waker: Option<Waker>,
}

/// What a host needs to know.
pub(super) struct HostTask {
    /// Its number among the hosts.
    pub(super) number: usize,
    pub(super) name: String,
    pub(super) network: Network,
    pub(super) machine: Rc<Machine>,
    pub(super) sheets: Rc<Sheets>,
    pub(super) paths: Rc<Paths>,
    pub(super) shared: Rc<RefCell<HostBoard>>,
}

/// Runs the lines of a host; gives up at the first that does not go as the scenario says.
pub(super) async fn run(task: HostTask, start: Option<Duration>, lines: Vec<HostLine>) {
    match start {
        Some(start) => task.network.sleep(start).await,
        None => task.wait_until_booted().await,
    }
    let mut failed = false;
    for (n, line) in lines.iter().enumerate() {
        let began = task.network.now();
        let (verdict, seen) = if failed {
            (Verdict::Skipped, "not reached".to_owned())
        } else {
            line.wanted.judge(task.perform(n, &line.command).await, began, task.network.now())
        };
        failed |= verdict == Verdict::Failed;
        let at = (verdict != Verdict::Skipped).then(|| task.network.now());
        let name = line.name.clone().unwrap_or_else(|| task.name.clone());
        let asked = line.asked.clone();
        task.shared.borrow_mut().rows.push(Row {
            kind: RowKind::Host,
            name,
            asked,
            at,
            seen,
            verdict,
            place: line.place.line,
        });
    }
    if !failed {
        task.shared.borrow_mut().done.push(task.name);
    }
}

/// The result of a line: what was seen, with a number if it is one; or why it did not go.
type Done = Result<(String, Option<f64>), String>;

impl WantedResult {
    fn judge(&self, done: Done, began: Instant, now: Instant) -> (Verdict, String) {
        if let Some(within) = self.within
            && now - began > within
        {
            let seen = done.map_or_else(|error| error, |(seen, _)| seen);
            return (Verdict::Failed, format!("took {} s: {seen}", Shown((now - began).as_secs_f64())));
        }
        match (&self.fails, done) {
            (None, Err(error)) => (Verdict::Failed, error),
            (Some(_), Ok((seen, _))) => (Verdict::Failed, format!("it did not fail: {seen}")),
            (Some(part), Err(error)) if error.to_lowercase().contains(&part.to_lowercase()) => (Verdict::Passed, error),
            (Some(_), Err(error)) => (Verdict::Failed, format!("it failed in another way: {error}")),
            (None, Ok((seen, number))) => match self.value {
                None => (Verdict::Passed, seen),
                Some(value) if number.is_some_and(|number| (number - value).abs() <= self.tolerance) => {
                    (Verdict::Passed, seen)
                }
                Some(_) => (Verdict::Failed, seen),
            },
        }
    }
}

impl HostTask {
    /// Waits until each drive has booted and checked its surroundings; a bounded time for one that does not.
    async fn wait_until_booted(&self) {
        let boots = self
            .machine
            .models()
            .map(|(node, _)| self.network.node(node).wait(|node| node.facts.boot_up, BOOT_PATIENCE));
        master::join_all(boots).await;
        self.network.sleep(SETTLING_TIME).await;
    }

    fn drive(&self, place: Place) -> Result<Drive, String> {
        let id = NodeId::new(place.node).ok_or("expected a node from 1 to 127")?;
        let drive = self.machine.drive(self.network.node(id));
        drive.axis(place.axis).map_err(|error| error.to_string())
    }

    fn model(&self, id: NodeId) -> Option<&'static Description> {
        self.machine.models().find(|(node, _)| *node == id).map(|(_, model)| model)
    }

    /// The drives that a command concerns, and what it has them for while it is carried out.
    fn claim_of(&self, command: &Command) -> (Vec<NodeId>, Option<Claim>) {
        let of = |place: &Place| NodeId::new(place.node).into_iter().collect();
        let of_group = |nodes: Result<_, _>| nodes.map(|(nodes, _)| nodes).unwrap_or_default();
        match command {
            Command::Capture(place, _) => (of(place), Some(Claim::Captured)),
            Command::TestMotion(place, _) | Command::Tune(place, _) => (of(place), Some(Claim::Whole)),
            Command::Group(asked) => (of_group(asked.axes(Some(&self.machine))), Some(Claim::InCycles)),
            Command::Follow(asked) => {
                let follow = self.paths.get(&asked.file).map(|path| asked.of(path.clone()));
                (
                    follow.map_or_else(Vec::new, |follow| of_group(follow.axes(Some(&self.machine)))),
                    Some(Claim::InCycles),
                )
            }
            Command::Base(_) => {
                let wheels = self.machine.base.map(|plan| plan.wheels.map(|(node, _)| node));
                (wheels.into_iter().flatten().collect(), Some(Claim::InCycles))
            }
            // Another host may stop what moves.
            Command::Drive(_, drive::Command::Stop | drive::Command::QuickStop | drive::Command::Disable) => {
                (Vec::new(), None)
            }
            // It would store, or lose, what is to be put back.
            Command::Drive(place, drive::Command::Save | drive::Command::Restore) => (of(place), Some(Claim::Whole)),
            Command::Parameters(node, ..) => (vec![*node], Some(Claim::Whole)),
            Command::Drive(place, _) => (of(place), None),
            Command::Write(node, ..) | Command::Pdo(node, _) => (vec![*node], None),
            _ => (Vec::new(), None),
        }
    }

    async fn perform(&self, line: usize, command: &Command) -> Done {
        let claims = Rc::clone(&self.shared.borrow().claims);
        let _claimed = Claimed::of(&claims, self.number, self.claim_of(command))?;
        let done = |seen: &str| Ok((seen.to_owned(), None));
        let network = &self.network;
        match command {
            Command::Drive(place, command) => report(self.drive(*place)?.perform(command).await),
            Command::Capture(place, asked) => self.capture(*place, asked).await,
            Command::TestMotion(place, asked) => self.test_motion(*place, asked).await,
            Command::Tune(place, asked) => self.tune(*place, asked).await,
            Command::Group(asked) => self.move_group(asked).await,
            Command::Follow(asked) => self.follow(asked).await,
            Command::Base(asked) => self.drive_base(asked).await,
            Command::Boot(options) => self.boot(options).await,
            Command::Parameters(node, what, file) => self.parameters(*node, *what, file.as_ref()).await,
            Command::Read(node, object) => self.read(*node, object).await,
            Command::Write(node, object, text) => self.write(*node, object, text).await,
            Command::Pdo(node, pdo) => self.exchange(*node, pdo).await,
            Command::Nmt(None, command) => {
                network.nmt_all(*command);
                done("sent")
            }
            Command::Nmt(Some(node), command) => {
                use canopen::NmtCommand::{ResetCommunication, ResetNode};
                let node = network.node(*node);
                let booted = node.wait_boot_up(BOOT_PATIENCE);
                node.nmt(*command);
                if !matches!(command, ResetNode | ResetCommunication) {
                    return done("sent");
                }
                booted.await.map_err(|error| error.to_string())?;
                done("booted")
            }
            Command::Watch(node, time) => {
                network.node(*node).watch_heartbeat(Some(*time));
                done("watching")
            }
            Command::Heartbeat(own, period) => {
                network.heartbeat(*own, Some(*period));
                done("producing")
            }
            Command::Sync(period) => {
                network.sync(*period);
                done(if period.is_some() { "producing" } else { "ended" })
            }
            Command::Send(frame) => {
                network.transmit(*frame);
                done("sent")
            }
            Command::Wait(duration) => {
                network.sleep(*duration).await;
                done("waited")
            }
            Command::WaitFor(_, within) => self.wait_for(line, *within).await,
        }
    }

    fn resolve(&self, node: NodeId, object: &ObjectArg) -> Result<(Mux, Option<&'static Entry>), String> {
        object.resolve(self.model(node).map(|model| model.dictionary))
    }

    async fn read(&self, node: NodeId, object: &ObjectArg) -> Done {
        let (mux, row) = self.resolve(node, object)?;
        let payload = self.network.node(node).upload(mux).await.map_err(|error| error.to_string())?;
        let bytes = payload.as_bytes();
        if bytes.is_empty() || bytes.len() > 8 {
            return Ok((String::from_utf8_lossy(bytes).into_owned(), None));
        }
        let raw = bytes.iter().rev().fold(0u64, |raw, byte| raw << 8 | u64::from(*byte));
        Ok(number_of(raw, bytes.len(), row))
    }

    /// Does something with process data.
    async fn exchange(&self, id: NodeId, command: &PdoCommand) -> Done {
        let node = self.network.node(id);
        let done = |seen: String| Ok((seen, None));
        match command {
            PdoCommand::Map(pdo, objects, transmission) => {
                let records = objects.iter().map(|object| self.record(id, object)).collect::<Result<_, _>>()?;
                let config = PdoConfig::new(*pdo, PdoMap(records)).transmission(*transmission);
                let mapped = node.configure_pdo(&config, TimerUnits::STANDARD).await;
                mapped.map_err(|error| error.to_string())?;
                done(format!("{pdo} carries {} bytes", config.map.bytes()))
            }
            PdoCommand::Adopt(pdo) => {
                let adopted = node.adopt_pdo(*pdo, TimerUnits::STANDARD).await.map_err(|error| error.to_string())?;
                let objects: Vec<_> = adopted.map.0.iter().map(|record| record.mux.to_string()).collect();
                let objects = if objects.is_empty() { "nothing".into() } else { objects.join(", ") };
                done(format!("{pdo} carries {objects}"))
            }
            PdoCommand::Write(object, text) => {
                let (mux, row) = self.resolve(id, object)?;
                let (data_type, number) = typed(row, text)?;
                if !node.send_by_pdo(mux, data_type.raw(number).into()) {
                    return Err(format!(
                        "no RPDO of node {id} carries {mux}; `{id} pdo map rpdo 1 ..` or `pdo adopt` first"
                    ));
                }
                done(format!("{number} put into the process data"))
            }
            PdoCommand::Read(object) => {
                let (mux, row) = self.resolve(id, object)?;
                let received = self.network.received(id, mux).ok_or_else(|| {
                    format!("no TPDO of node {id} has brought {mux}; `{id} pdo map tpdo 1 ..` or `pdo adopt` and `nmt start` first")
                })?;
                let length = row.map_or(8, |row| row.data_type.size());
                Ok(number_of(received.raw, length, row))
            }
        }
    }

    /// An object as a PDO maps it.
    fn record(&self, node: NodeId, object: &ObjectArg) -> Result<MappingRecord, String> {
        let (mux, row) = self.resolve(node, object)?;
        let bits = row.map(|row| row.data_type.bits()).filter(|bits| *bits > 0);
        let bits =
            bits.ok_or_else(|| format!("the length of {mux} of node {node} is not known: it cannot be mapped"))?;
        Ok(MappingRecord { mux, bits })
    }

    async fn write(&self, node: NodeId, object: &ObjectArg, text: &str) -> Done {
        let (mux, row) = self.resolve(node, object)?;
        let (data_type, number) = typed(row, text)?;
        let bytes = data_type.raw(number).to_le_bytes();
        let written = self.network.node(node).download(mux, &bytes[..data_type.size()]).await;
        written.map_err(|error| error.to_string())?;
        Ok((format!("{number} written"), None))
    }

    /// Waits until the one who steps the world says that the condition of this line was so.
    async fn wait_for(&self, line: usize, within: Duration) -> Done {
        let key = (self.number, line);
        self.shared.borrow_mut().waits.push(AwaitedCondition { line: key, so: false, waker: None });
        let mut patience = std::pin::pin!(self.network.sleep(within));
        let so = poll_fn(|context| {
            let mut shared = self.shared.borrow_mut();
            let Some(waiting) = shared.waits.iter_mut().find(|waiting| waiting.line == key) else {
                return Poll::Ready(false);
            };
            if waiting.so {
                return Poll::Ready(true);
            }
            waiting.waker = Some(context.waker().clone());
            patience.as_mut().poll(context).map(|()| false)
        })
        .await;
        self.shared.borrow_mut().waits.retain(|waiting| waiting.line != key);
        if so {
            Ok(("it is so".into(), None))
        } else {
            Err(format!("it was not so within {} s", Shown(within.as_secs_f64())))
        }
    }
}

/// A value in words as the object takes it.
fn typed(row: Option<&'static Entry>, text: &str) -> Result<(DataType, i64), String> {
    match row {
        Some(row) => Ok((row.data_type, value(row, text, 1)?)),
        None => typed_value(text),
    }
}

/// A value of so many bytes, which has a sign if the object has, for people and as a number.
fn number_of(raw: u64, length: usize, row: Option<&'static Entry>) -> (String, Option<f64>) {
    // Shifted up and down again the sign is that of the object's length.
    let unused = 64 - 8 * length.clamp(1, 8) as u32;
    let signed = row.is_some_and(|row| row.data_type.is_signed());
    let number = if signed { i128::from((raw << unused) as i64 >> unused) } else { i128::from(raw) };
    (format!("{number} ({raw:0width$X}h)", width = 2 * length), Some(number as f64))
}

fn report(report: Result<Report, master::Error>) -> Done {
    let seen = match report.map_err(|error| error.to_string())? {
        Report::Done => "done".into(),
        Report::Guarded(loss) => loss.to_string(),
        Report::Moved(MotionReport { reached_after: Some(time), .. }) => {
            format!("reached after {} s", Shown(time.as_secs_f64()))
        }
        Report::Moved(_) => "commanded".into(),
    };
    Ok((seen, None))
}

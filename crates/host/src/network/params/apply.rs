//! A transaction: the writes, the journal, the store, and the proof.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::AbortCode;
use devices::Description;
use master::Drive;
use master::parameters::{Applied, ApplyError, Parameters, Plan, PlanOptions, verify};
use serde::Serialize;

use super::journal::{Kept, default_path, not_put_back};
use super::shown::{Shown, name};
use super::{LeftOut, is_kept, notes, source};
use crate::network::Progress;
use machine::parameters::journal::Journal;
use words::counted;
use words::failure::Failure;

/// How long after its boot-up message a drive is left alone.
const SETTLED: Duration = Duration::from_millis(100);

/// How the parameters of a file were written to a node: how many, which the drive rounded or the file left out, and whether they are stored.
#[derive(Debug, Serialize)]
pub struct ApplyReport {
    /// Its node-ID.
    pub node: u8,
    /// Where the values come from.
    pub file: String,
    /// How many writes were done and read back.
    pub writes: usize,
    /// Values that the drive made others of.
    pub rounded: Vec<Rounded>,
    /// What of the file is not written.
    pub left: Vec<LeftOut>,
    /// The drive has stored them.
    pub saved: bool,
    /// How it was started anew, after which everything read as wanted.
    pub proved: Option<&'static str>,
    /// What else is to be known.
    pub notes: Vec<String>,
}

/// A value that the drive made another of.
#[derive(Debug, Serialize)]
pub struct Rounded {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// What was written.
    pub asked: Shown,
    /// What the drive made of it.
    pub found: Shown,
}

/// How a drive starts anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// Its supply is switched off and on by a person.
    PowerCycle,
    /// NMT reset node.
    Reset,
}

/// What is done around the writes.
#[derive(Clone, Debug)]
pub struct Transaction {
    /// Node-ID and bit rate too, as the last.
    pub address: bool,
    /// Store the parameters in the drive afterwards.
    pub save: bool,
    /// Start the drive anew afterwards, and read everything once more.
    pub prove: Option<Proof>,
    /// Longest wait for the drive to come back.
    pub within: Duration,
    /// Where the journal is kept meanwhile; `None` on a virtual bus that ends with the program, where there is nothing to go back to.
    pub journal: Option<PathBuf>,
    /// Hears what to do about a journal that stays.
    pub on_kept: fn(&str),
}

impl Transaction {
    /// Writes these values, which `file` has, to a drive: all or none.
    ///
    /// # Errors
    /// What of them is refused, and how the node stands then.
    pub async fn apply(
        &self,
        progress: &impl Progress,
        drive: &Drive,
        wanted: &Parameters,
        file: String,
    ) -> Result<ApplyReport, Failure> {
        let (id, model) = (drive.node().id(), drive.description());
        drive.check_at_rest().await.map_err(source::refused)?;
        progress.show(format!("node {id}: reading {} objects", wanted.values.len()));
        let plan =
            drive.plan_parameters(wanted, PlanOptions { address: self.address }).await.map_err(source::refused)?;
        let applied = self.write(progress, drive, &plan).await?;
        let mut report = ApplyReport {
            node: id.raw(),
            file,
            writes: applied.writes,
            rounded: rounded(&applied, model),
            left: LeftOut::of(model, &plan),
            saved: false,
            proved: None,
            notes: notes(&plan, model),
        };
        for displaced in &applied.displaced {
            let found = source::found(displaced);
            let found = found.map_or_else(|why| why, |bytes| Shown::new(model, displaced.object, bytes).text);
            let object = displaced.object;
            report.notes.push(format!(
                "{object} had the wanted value, and has {found} after all writes: writing another object changed it"
            ));
        }
        let by_itself = model.and_then(|model| model.storage.stores_each_write());
        if let Some(write) = by_itself.filter(|_| applied.writes > 0 && !self.save) {
            let (object, value) = (write.object, write.value);
            report.notes.push(format!("the drive stores each write by itself while {object} is {value}, as delivered"));
        }
        if self.save {
            progress.show(format!("node {id}: storing"));
            drive.save().await.map_err(|error| unsaved(error, &report))?;
            report.saved = true;
        }
        if let Some(prove) = self.prove {
            report.proved = Some(self.proved(progress, drive, &plan, prove).await?);
        }
        Ok(report)
    }

    /// Writes the plan, with a journal on the disk meanwhile.
    async fn write(&self, progress: &impl Progress, drive: &Drive, plan: &Plan) -> Result<Applied, Failure> {
        let (id, model) = (plan.node, drive.description());
        if plan.steps.is_empty() {
            return Ok(Applied { writes: 0, rounded: Vec::new(), displaced: Vec::new() });
        }
        let path = self.journal.clone().unwrap_or_else(|| default_path(id));
        let journal = || Journal { node: id, identity: plan.identity, pre_operational: false, undo: plan.undo() };
        let kept = self.journal.as_deref().map(|path| Kept::create(path, &journal(), self.on_kept)).transpose()?;
        let done = |kept: Option<Kept>| kept.map_or(Ok(()), Kept::remove);
        let show = |number: usize, step: &master::parameters::ParameterStep| {
            let name = name(model, step.object).unwrap_or_default();
            progress.count(format!("node {id}: {number} of {}: {} {name}", plan.steps.len(), step.object));
        };
        match drive.apply_parameters(plan, show).await {
            Ok(Ok(applied)) => {
                done(kept)?;
                Ok(applied)
            }
            Ok(Err(error)) if error.undone.not_put_back.is_empty() => {
                done(kept)?;
                Err(refused(&error, model, &path))
            }
            Ok(Err(error)) => Err(refused(&error, model, &path)),
            // Before the first write, or silence after the last: the journal of the latter stays.
            Err(error @ master::parameters::PlanError::Node(_)) => Err(source::refused(error)),
            Err(error) => {
                done(kept)?;
                Err(source::refused(error))
            }
        }
    }

    /// Starts the drive anew and reads everything again.
    async fn proved(
        &self,
        progress: &impl Progress,
        drive: &Drive,
        plan: &Plan,
        prove: Proof,
    ) -> Result<&'static str, Failure> {
        let id = plan.node;
        let (how, booted) = match prove {
            Proof::Reset => ("an NMT reset", drive.node().reset(self.within).await),
            Proof::PowerCycle => {
                let booted = drive.node().wait_boot_up(self.within);
                progress.note(&format!("now switch the supply of node {id} off and on again; waiting for its boot-up"));
                ("a power cycle", booted.await)
            }
        };
        booted.map_err(|error| {
            Failure::from(error)
                .because("the parameters are written and stored, but were not read again after a restart")
        })?;
        drive.node().network().sleep(SETTLED).await;
        let model = drive.description();
        // What the model does not keep is in the notes.
        let kept: Vec<_> = plan.wanted.iter().filter(|(object, _)| is_kept(model, **object)).collect();
        let deviations = verify(drive.node(), kept).await?;
        if deviations.is_empty() {
            return Ok(how);
        }
        let many = deviations.len();
        let have = if many == 1 { "has another value than was" } else { "have other values than were" };
        let objects = counted(many, "object");
        let failure = Failure::new(format!("node {id}: after {how}, {objects} {have} stored"));
        let failure = deviations.iter().fold(failure.of_kind("not_stored").at_node(id), |failure, deviation| {
            let found = source::found(deviation);
            let found = found.map_or_else(|why| why, |bytes| Shown::new(model, deviation.object, bytes).text);
            let wanted = Shown::new(model, deviation.object, &deviation.wanted).text;
            let name = name(model, deviation.object).unwrap_or_default();
            failure.because(format!("{} {name} is {found}, not {wanted}", deviation.object))
        });
        Err(failure.next(
            "the drive does not store these: write them after each start (boot by a machine file, or params apply)",
        ))
    }
}

fn rounded(applied: &Applied, model: Option<&'static Description>) -> Vec<Rounded> {
    let rounded = applied.rounded.iter().map(|rounded| Rounded {
        object: rounded.object.to_string(),
        name: name(model, rounded.object),
        asked: Shown::new(model, rounded.object, &rounded.asked),
        found: Shown::new(model, rounded.object, &rounded.found),
    });
    rounded.collect()
}

/// The write that was refused, and how the node stands now.
pub(crate) fn refused(error: &ApplyError, model: Option<&'static Description>, path: &Path) -> Failure {
    let named = name(model, error.object).map(|name| format!(" {name}")).unwrap_or_default();
    let value = Shown::new(model, error.object, &error.value).text;
    let what = format!(
        "node {}: write {} of {}, {}{named} = {value} ({}), failed",
        error.node, error.step, error.of, error.object, error.purpose
    );
    let mut failure = Failure::new(what).of_kind("rolled_back").at_node(error.node).at_object(error.object);
    failure.subject.abort = match &error.why {
        master::parameters::Why::Failed(cause) => cause.abort(),
        master::parameters::Why::ReadsBack { .. } => None::<AbortCode>,
    };
    let mut failure = failure.because(&error.why);
    if let Some(limits) = &error.limits {
        failure = failure.because(format!("{} {} takes {limits}", error.object, limits.name));
    }
    if error.undone.not_put_back.is_empty() {
        return failure.because(&error.undone).next("correct the value, or take it out of the file, and apply again");
    }
    let left = not_put_back(error.node, &error.undone, path);
    failure.kind = left.kind;
    failure.because.extend(left.because);
    failure.next.extend(left.next);
    failure
}

/// The values act, and are not kept.
fn unsaved(error: master::Error, report: &ApplyReport) -> Failure {
    let written = format!("{} written, in effect now, and not stored", counted(report.writes, "value"));
    Failure::from(error).because(written).next(format!("ferrodrive save {}", report.node))
}

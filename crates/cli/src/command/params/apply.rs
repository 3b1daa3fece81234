//! `ferrodrive params apply`: the transaction, its journal, the store, and the proof.

use std::path::Path;
use std::time::Duration;

use canopen::AbortCode;
use devices::Description;
use master::Drive;
use master::parameters::{Applied, ApplyError, Parameters, Plan, PlanOptions, verify};
use serde::Serialize;
use testbench::parameters::journal::Journal;

use super::journal::{Kept, default_path, not_put_back};
use super::plan::{LeftOut, is_kept, notes};
use super::shown::{Shown, name};
use super::{Prove, source};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;

/// How long after its boot-up message a drive is left alone.
const SETTLED: Duration = Duration::from_millis(100);

/// What was done.
#[derive(Debug, Serialize)]
pub(in crate::command) struct ApplyReport {
    node: u8,
    file: String,
    writes: usize,
    /// Values that the drive made others of.
    rounded: Vec<Rounded>,
    left: Vec<LeftOut>,
    saved: bool,
    /// How it was started anew, after which everything read as wanted.
    proved: Option<&'static str>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Rounded {
    object: String,
    name: Option<&'static str>,
    asked: Shown,
    found: Shown,
}

impl super::Apply {
    pub(super) async fn run(&self, context: &Context) -> Result<ApplyReport, Failure> {
        let drive = context.drive_untold(self.wanted.node).await?;
        self.how.check(context, &drive).await?;
        context.tell_guess(&drive);
        let (wanted, file) = source::wanted(context, &self.wanted, drive.description())?;
        self.how.write_all(context, &drive, &wanted, file, self.address).await
    }
}

impl super::Transaction {
    /// Writes these values, which `file` has, to a drive: all or none.
    pub(in crate::command) async fn run(
        &self,
        context: &Context,
        drive: &Drive,
        wanted: &Parameters,
        file: String,
    ) -> Result<ApplyReport, Failure> {
        self.check(context, drive).await?;
        self.write_all(context, drive, wanted, file, false).await
    }

    /// What would fail after the writes, before them.
    async fn check(&self, context: &Context, drive: &Drive) -> Result<(), Failure> {
        self.prove.map(|prove| how(prove, context)).transpose()?;
        if self.save {
            // Parameters that nobody can store were not asked for.
            drive.check_save().await?;
        }
        Ok(())
    }

    async fn write_all(
        &self,
        context: &Context,
        drive: &Drive,
        wanted: &Parameters,
        file: String,
        address: bool,
    ) -> Result<ApplyReport, Failure> {
        let (id, model) = (drive.node().id(), drive.description());
        drive.check_at_rest().await.map_err(source::refused)?;
        context.progress.show(format!("node {id}: reading {} objects", wanted.values.len()));
        let plan = drive.plan_parameters(wanted, PlanOptions { address }).await.map_err(source::refused)?;
        let applied = self.write(context, drive, &plan).await?;
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
            report
                .notes
                .push(format!("{object} was as wanted, and is {found} after all writes: another object moves it"));
        }
        if self.save {
            context.progress.show(format!("node {id}: storing"));
            drive.save().await.map_err(|error| unsaved(error, &report))?;
            report.saved = true;
        }
        if let Some(prove) = self.prove {
            report.proved = Some(self.proved(context, drive, &plan, how(prove, context)?).await?);
        }
        Ok(report)
    }

    /// Writes the plan, with a journal on the disk meanwhile.
    async fn write(&self, context: &Context, drive: &Drive, plan: &Plan) -> Result<Applied, Failure> {
        let (id, model) = (plan.node, drive.description());
        if plan.steps.is_empty() {
            return Ok(Applied { writes: 0, rounded: Vec::new(), displaced: Vec::new() });
        }
        let path = self.journal.clone().unwrap_or_else(|| default_path(id));
        let journal = Journal { node: id, identity: plan.identity, undo: plan.undo() };
        // A virtual bus of this command ends with it, and nothing is left to go back to.
        let kept = if context.is_embedded() { None } else { Some(Kept::create(&path, &journal)?) };
        let done = |kept: Option<Kept>| kept.map_or(Ok(()), Kept::remove);
        let show = |number: usize, step: &master::parameters::Step| {
            let name = name(model, step.object).unwrap_or_default();
            context.progress.count(format!("node {id}: {number} of {}: {} {name}", plan.steps.len(), step.object));
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
        context: &Context,
        drive: &Drive,
        plan: &Plan,
        prove: Prove,
    ) -> Result<&'static str, Failure> {
        let id = plan.node;
        let (how, booted) = match prove {
            Prove::Reset => ("an NMT reset", drive.node().reset(self.within).await),
            Prove::Auto | Prove::PowerCycle => {
                let booted = drive.node().wait_boot_up(self.within);
                context
                    .progress
                    .note(&format!("now switch the supply of node {id} off and on again; waiting for its boot-up"));
                ("a power cycle", booted.await)
            }
        };
        booted.map_err(|error| {
            Failure::from(error).because("the parameters are written and stored, and that is not proved")
        })?;
        context.network.sleep(SETTLED).await;
        let model = drive.description();
        // What the model does not keep has been told as such.
        let kept = plan.wanted.iter().filter(|(object, _)| is_kept(model, **object));
        let deviations = verify(drive.node(), kept).await?;
        if deviations.is_empty() {
            return Ok(how);
        }
        let many = deviations.len();
        let failure = Failure::new(format!("node {id}: after {how} {many} objects have other values than were stored"));
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

/// How a drive is started anew on this bus.
fn how(prove: Prove, context: &Context) -> Result<Prove, Failure> {
    match (prove, context.is_embedded()) {
        (Prove::Auto, true) => Ok(Prove::Reset),
        (Prove::Auto, false) => Ok(Prove::PowerCycle),
        (Prove::PowerCycle, true) => {
            Err(Failure::usage("nobody can switch a drive off that is on a virtual bus of this command alone")
                .next("--prove=reset, or serve the drive: ferrodrive sim, and ferrodrive world NODE power cycle"))
        }
        (prove, _) => Ok(prove),
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
fn refused(error: &ApplyError, model: Option<&'static Description>, path: &Path) -> Failure {
    let named = name(model, error.object).map(|name| format!(" {name}")).unwrap_or_default();
    let value = Shown::new(model, error.object, &error.value).text;
    let what = format!(
        "node {}: write {} of {}, {}{named} = {value} ({}), was not done",
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
    let written = format!("{} values were written and act now; they are not stored", report.writes);
    Failure::from(error).because(written).next(format!("ferrodrive save {}", report.node))
}

impl Report for ApplyReport {
    fn text(&self, paint: Paint) -> String {
        let file = plain(&self.file);
        let mut lines = vec![match self.writes {
            0 => format!("node {} has what {file} says: nothing was written", self.node),
            writes => format!("node {}: {writes} writes done and read back; it has what {file} says", self.node),
        }];
        for rounded in &self.rounded {
            lines.push(format!(
                "{} {}: {} was written, the drive made {} of it",
                rounded.object,
                rounded.name.unwrap_or_default(),
                plain(&rounded.asked.text),
                paint.strong(&plain(&rounded.found.text))
            ));
        }
        lines.extend(self.left.iter().map(LeftOut::text));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        if self.saved {
            lines.push("stored in the drive's memory".to_owned());
        } else if self.writes > 0 {
            lines.push(format!("not stored by a command: ferrodrive save {}", self.node));
        }
        if let Some(how) = self.proved {
            lines.push(format!("after {how} everything that is kept reads as written"));
        }
        lines.join("\n")
    }
}

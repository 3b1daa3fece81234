//! `ferrodrive params plan`.

use canopen::Mux;
use devices::Description;
use master::Drive;
use master::parameters::{Parameters, Plan, PlanOptions};
use serde::Serialize;

use super::shown::{Shown, name};
use super::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;

/// What would be written.
#[derive(Debug, Serialize)]
pub(in crate::command) struct PlanReport {
    node: u8,
    file: String,
    /// Values of the file that the node has already.
    same: usize,
    steps: Vec<Step>,
    left: Vec<LeftOut>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Step {
    object: String,
    name: Option<&'static str>,
    before: Option<Shown>,
    value: Shown,
    /// What the write is for.
    purpose: String,
}

/// An object of the file that is not written.
#[derive(Debug, Serialize)]
pub(super) struct LeftOut {
    object: String,
    name: Option<&'static str>,
    why: String,
}

impl LeftOut {
    pub(super) fn of(model: Option<&'static Description>, plan: &Plan) -> Vec<Self> {
        let left = |(object, why): &(Mux, master::parameters::Left)| Self {
            object: object.to_string(),
            name: name(model, *object),
            why: why.to_string(),
        };
        plan.left.iter().map(left).collect()
    }

    pub(super) fn text(&self) -> String {
        format!("{} {} is left out: {}", self.object, self.name.unwrap_or_default(), self.why)
    }
}

/// What to know about a plan beside its steps.
pub(super) fn notes(plan: &Plan, model: Option<&'static Description>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(revision) = plan.other_revision {
        let found = plan.identity.revision_number.unwrap_or_default();
        notes.push(format!(
            "the file is of revision {revision:X}h, the node has {found:X}h: the same behaviour on the bus by CiA 301, 7.5.2.21"
        ));
    }
    let Some(model) = model else { return notes };
    let later: Vec<String> = model
        .storage
        .effective_after_restart
        .iter()
        .filter(|object| plan.steps.iter().any(|step| step.object == **object))
        .map(ToString::to_string)
        .collect();
    let changed =
        plan.wanted.iter().filter(|(object, value)| plan.current.get(object).is_some_and(|now| now != *value));
    for object in changed.map(|(object, _)| object).filter(|object| !is_kept(Some(model), **object)) {
        let name = name(Some(model), *object).unwrap_or_default();
        notes.push(format!("{object} {name} is not kept in the drive's memory: it is gone with its supply"));
    }
    if !later.is_empty() {
        notes.push(format!("{} takes effect with the next restart, if it is stored by then", later.join(", ")));
    }
    notes
}

/// Whether the model keeps an object in its store; of an unknown model nobody knows, and the proof tells.
pub(super) fn is_kept(model: Option<&'static Description>, object: Mux) -> bool {
    model.and_then(|model| model.row(object)).is_none_or(|row| row.is_kept())
}

impl super::PlanArguments {
    pub(super) async fn run(&self, context: &Context) -> Result<PlanReport, Failure> {
        let drive = context.drive(self.wanted.node).await?;
        let (wanted, file) = source::wanted(context, &self.wanted, drive.description())?;
        plan_of(context, &drive, &wanted, file, self.address).await
    }
}

/// What would be written to give a drive these values, which `file` has.
pub(in crate::command) async fn plan_of(
    context: &Context,
    drive: &Drive,
    wanted: &Parameters,
    file: String,
    address: bool,
) -> Result<PlanReport, Failure> {
    let (id, model) = (drive.node().id(), drive.description());
    context.progress.show(format!("node {id}: reading {} objects", wanted.values.len()));
    let plan = drive.plan_parameters(wanted, PlanOptions { address }).await.map_err(source::refused)?;
    let steps = plan.steps.iter().map(|step| Step {
        object: step.object.to_string(),
        name: name(model, step.object),
        before: step.before.as_deref().map(|bytes| Shown::new(model, step.object, bytes)),
        value: Shown::new(model, step.object, &step.value),
        purpose: step.purpose.to_string(),
    });
    let changed = plan.wanted.keys().filter(|object| plan.steps.iter().any(|step| step.object == **object)).count();
    let mut notes = notes(&plan, model);
    if drive.check_at_rest().await.is_err() {
        notes.push(format!("the drive is at work: apply will refuse it until ferrodrive disable {id}"));
    }
    let (same, left) = (plan.wanted.len() - changed, LeftOut::of(model, &plan));
    Ok(PlanReport { node: id.raw(), file, same, steps: steps.collect(), left, notes })
}

impl Report for PlanReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = Vec::new();
        if self.steps.is_empty() {
            lines.push(format!("node {} has what {} says: nothing is to be written", self.node, plain(&self.file)));
        } else {
            let mut table = Table::new(&["", "object", "name", "has", "gets", "what for"]);
            for (position, step) in self.steps.iter().enumerate() {
                table.row([
                    (position + 1).to_string(),
                    step.object.clone(),
                    step.name.unwrap_or_default().to_owned(),
                    step.before.as_ref().map_or_else(|| "?".to_owned(), |shown| plain(&shown.text)),
                    plain(&step.value.text),
                    step.purpose.clone(),
                ]);
            }
            lines.push(table.plain(paint));
            lines.push(format!("\n{} values are there already", self.same));
        }
        lines.extend(self.left.iter().map(LeftOut::text));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}

//! A node's configuration as one thing: kept in a file, compared, written as a transaction, checked.

mod apply;
mod compare;
pub mod journal;
pub(crate) mod pre_operational;
mod shown;
pub mod source;

use std::path::Path;

use canopen::Mux;
use devices::Description;
use master::Drive;
use master::parameters::{Parameters, Plan, PlanOptions, from_any_state};
use serde::Serialize;

pub(crate) use apply::refused as apply_refused;
pub use apply::{ApplyReport, Proof, Rounded, Transaction};
pub use compare::{
    Deviates, DiffReport, DiffRow, VerifyReport, diff_of_files, diff_of_node, diff_of_nodes, verify_node,
};
pub use pre_operational::SeenBy;
pub use shown::{Shown, name};

use super::Progress;
use machine::parameters::{Form, sheet, to_concise, to_dcf};
use words::failure::Failure;
use words::models::name_its_model;

/// The parameters that were read from a node, as a file or as its text.
#[derive(Debug, Serialize)]
pub struct BackupReport {
    /// Its node-ID.
    pub node: u8,
    /// Where the file is; absent if it is [`parameters`](Self::parameters).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The file itself, as TOML, if it was not written anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<String>,
    /// Values in the file.
    pub values: usize,
    /// Objects that could not be read.
    pub refused: Vec<Refused>,
}

/// An object that a node refused to show.
#[derive(Debug, Serialize)]
pub struct Refused {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// The reason that the drive or the model gives.
    pub why: String,
}

/// Reads all parameters of a node's model: the report without a file, what it has, and its model.
///
/// # Errors
/// The model is not known; those of SDO.
pub async fn back_up(
    progress: &impl Progress,
    drive: &Drive,
) -> Result<(BackupReport, Parameters, &'static Description), Failure> {
    let node = drive.node().id();
    let model = drive.description().ok_or_else(|| {
        let failure = Failure::new(format!("the model of node {node} is not known")).of_kind("unknown_model");
        failure.at_node(node).next(name_its_model(node, &["MODEL"]))
    })?;
    let backup = drive.back_up(|number, of, object| progress.count(format!("{number} of {of}: {object}"))).await?;
    let refused = backup.refused.iter().map(|(object, error)| Refused {
        object: object.to_string(),
        name: name(Some(model), *object),
        why: error.abort().map_or_else(|| error.to_string(), |code| code.to_string()),
    });
    let (refused, values) = (refused.collect(), backup.parameters.values.len());
    let report = BackupReport { node: node.raw(), file: None, parameters: None, values, refused };
    Ok((report, backup.parameters, model))
}

/// The same, the parameters in it as TOML.
///
/// # Errors
/// See [`back_up`].
pub async fn shown(progress: &impl Progress, drive: &Drive) -> Result<BackupReport, Failure> {
    let (report, parameters, model) = back_up(progress, drive).await?;
    Ok(BackupReport { parameters: Some(sheet::print(&parameters, Some(model))), ..report })
}

/// What a file of this form has.
///
/// # Errors
/// A DCF cannot be made of them.
pub fn bytes_of(
    parameters: &Parameters,
    model: &'static Description,
    path: &Path,
    form: Form,
) -> Result<Vec<u8>, Failure> {
    let node = parameters.node.ok_or_else(|| {
        Failure::new("these parameters are not of a node").next("read them from a node: ferrodrive params backup NODE")
    })?;
    Ok(match form {
        Form::Toml => sheet::print(parameters, Some(model)).into_bytes(),
        Form::Dcf => {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let advice = "give the file a short name on one line, or write .toml";
            to_dcf(parameters, model, &name).map_err(|reason| Failure::usage(reason).next(advice))?
        }
        Form::Concise => to_concise(&from_any_state(Some(model), node, &parameters.values)),
    })
}

/// What would be written.
#[derive(Debug, Serialize)]
pub struct PlanReport {
    /// Its node-ID.
    pub node: u8,
    /// Where the values come from.
    pub file: String,
    /// Values of the file that the node has already.
    pub same: usize,
    /// The writes, in their order.
    pub steps: Vec<PlannedWrite>,
    /// What of the file is not written.
    pub left: Vec<LeftOut>,
    /// What else is to be known.
    pub notes: Vec<String>,
}

/// A write of a plan, in the order in which they are made: the object, what it has and what it is to get.
#[derive(Debug, Serialize)]
pub struct PlannedWrite {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// What it has; `None` if that is not known.
    pub before: Option<Shown>,
    /// What it gets.
    pub value: Shown,
    /// What the write is for.
    pub purpose: String,
}

/// An object of the file that is not written.
#[derive(Debug, Serialize)]
pub struct LeftOut {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// Why no file of parameters has it.
    pub why: String,
}

impl LeftOut {
    /// What of a plan is not written.
    pub fn of(model: Option<&'static Description>, plan: &Plan) -> Vec<Self> {
        let left = |(object, why): &(Mux, master::parameters::Left)| Self {
            object: object.to_string(),
            name: name(model, *object),
            why: why.to_string(),
        };
        plan.left.iter().map(left).collect()
    }

    /// One line for people: `6083h:00 profile_acceleration is left out: ` and the reason.
    pub fn text(&self) -> String {
        format!("{} {} is left out: {}", self.object, self.name.unwrap_or_default(), self.why)
    }
}

/// What to know about a plan beside its steps.
fn notes(plan: &Plan, model: Option<&'static Description>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(revision) = plan.other_revision {
        let found = plan.identity.revision_number.unwrap_or_default();
        notes.push(format!(
            "the file is for revision {revision:X}h, the node has {found:X}h: the same behaviour on the bus by CiA 301, 7.5.2.21"
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

/// Whether the model keeps an object in its store; of an unknown model that is not known, and the proof shows it.
fn is_kept(model: Option<&'static Description>, object: Mux) -> bool {
    model.and_then(|model| model.row(object)).is_none_or(|row| row.is_kept())
}

/// What would be written to give a drive these values, which `file` has.
///
/// # Errors
/// The node is another device, or cannot have one of the values; those of SDO.
pub async fn plan_of(
    progress: &impl Progress,
    drive: &Drive,
    wanted: &Parameters,
    file: String,
    address: bool,
) -> Result<PlanReport, Failure> {
    let (id, model) = (drive.node().id(), drive.description());
    progress.show(format!("node {id}: reading {} objects", wanted.values.len()));
    let plan = drive.plan_parameters(wanted, PlanOptions { address }).await.map_err(source::refused)?;
    let steps = plan.steps.iter().map(|step| PlannedWrite {
        object: step.object.to_string(),
        name: name(model, step.object),
        before: step.before.as_deref().map(|bytes| Shown::new(model, step.object, bytes)),
        value: Shown::new(model, step.object, &step.value),
        purpose: step.purpose.to_string(),
    });
    let changed = plan.wanted.keys().filter(|object| plan.steps.iter().any(|step| step.object == **object)).count();
    let mut notes = notes(&plan, model);
    if drive.check_at_rest().await.is_err() {
        notes.push(format!("the drive is enabled: apply refuses it until it is disabled (ferrodrive disable {id})"));
    }
    let (same, left) = (plan.wanted.len() - changed, LeftOut::of(model, &plan));
    Ok(PlanReport { node: id.raw(), file, same, steps: steps.collect(), left, notes })
}

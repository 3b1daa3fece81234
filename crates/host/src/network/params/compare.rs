//! In what a node and a file, or two files, differ.

use std::collections::BTreeMap;
use std::path::Path;

use canopen::Mux;
use devices::Description;
use master::Drive;
use master::parameters::{Difference, Left, Parameters, PlanError, PlanOptions, diff, verify};
use serde::Serialize;

use super::shown::{Shown, name};
use super::source;
use super::source::MACHINE_FILE;
use words::counted;
use words::failure::Failure;
use words::plain;

/// In what two sets of parameters differ.
#[derive(Debug, Serialize)]
pub struct DiffReport {
    /// What the first has; `None`: it has none.
    pub first: String,
    /// What the second has.
    pub second: String,
    /// A row each.
    pub differences: Vec<DiffRow>,
}

/// An object that differs.
#[derive(Debug, Serialize)]
pub struct DiffRow {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// Null: it has none.
    pub first: Option<Shown>,
    /// What the second has.
    pub second: Option<Shown>,
}

impl DiffRow {
    pub(crate) fn new(model: Option<&'static Description>, difference: &Difference) -> Self {
        let object = difference.object;
        let shown = |bytes: &Option<Vec<u8>>| bytes.as_deref().map(|bytes| Shown::new(model, object, bytes));
        Self {
            object: object.to_string(),
            name: name(model, object),
            first: shown(&difference.first),
            second: shown(&difference.second),
        }
    }
}

/// In what two files differ.
///
/// # Errors
/// One is not read as parameters.
pub fn diff_of_files(first: &Path, second: &Path) -> Result<DiffReport, Failure> {
    let (a, b) = (source::read(first, None, None)?, source::read(second, None, None)?);
    let differences = diff(&a.values, &b.values).iter().map(|found| DiffRow::new(None, found)).collect();
    Ok(DiffReport { first: first.display().to_string(), second: second.display().to_string(), differences })
}

/// In what a node differs from these values, which `second` has.
///
/// # Errors
/// Silence.
pub async fn diff_of_node(drive: &Drive, wanted: &Parameters, second: String) -> Result<DiffReport, Failure> {
    let mut has = BTreeMap::new();
    for deviation in verify(drive.node(), &wanted.values).await? {
        if let Ok(found) = deviation.found {
            has.insert(deviation.object, found);
        } else {
            has.remove(&deviation.object);
        }
    }
    // What is as the file says has not been kept above.
    let differ = |object: &Mux| has.contains_key(object);
    let mut differences: Vec<Difference> = Vec::new();
    let same: Vec<_> = wanted.values.iter().filter(|(object, _)| !differ(object)).collect();
    for deviation in verify(drive.node(), same).await? {
        differences.push(Difference { object: deviation.object, first: None, second: Some(deviation.wanted) });
    }
    differences.extend(has.iter().map(|(object, found)| Difference {
        object: *object,
        first: Some(found.clone()),
        second: wanted.values.get(object).cloned(),
    }));
    differences.sort_by_key(|found| found.object);
    let differences = differences.iter().map(|found| DiffRow::new(drive.description(), found)).collect();
    Ok(DiffReport { first: format!("node {}", drive.node().id()), second, differences })
}

/// In what two nodes differ. What depends on the node-ID is compared as the first one's; node-ID and bit rate are left out, of which two
/// nodes have two.
///
/// # Errors
/// Silence; the model of the second is not known.
pub async fn diff_of_nodes(first: &Drive, second: &Drive) -> Result<DiffReport, Failure> {
    let (_, mut has, model) = super::back_up(&(), second).await?;
    has.values.retain(|object, _| !model.storage.address.contains(object));
    let wanted = has.for_node(first.node().id(), Some(model));
    diff_of_node(first, &wanted, format!("node {}", second.node().id())).await
}

/// Whether a node has what a file says.
#[derive(Debug, Serialize)]
pub struct VerifyReport {
    /// It has everything.
    pub ok: bool,
    /// Its node-ID.
    pub node: u8,
    /// Where the values come from.
    pub file: String,
    /// Objects that were read.
    pub compared: usize,
    /// What it has otherwise.
    pub deviations: Vec<Deviates>,
}

/// An object that has another value.
#[derive(Debug, Serialize)]
pub struct Deviates {
    /// The object, such as `6083h:00`.
    pub object: String,
    /// Its name, if the model has it.
    pub name: Option<&'static str>,
    /// What it should have.
    pub wanted: Shown,
    /// Null: the node refused to show it.
    pub found: Option<Shown>,
    /// Why it was not read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// Whether a node has these values, which `file` has.
///
/// # Errors
/// It is another device; silence.
pub async fn verify_node(drive: &Drive, wanted: &Parameters, file: String) -> Result<VerifyReport, Failure> {
    let model = drive.description();
    // A plan refuses another device, and what of the file is not a parameter; what does not fit is a deviation here.
    let left = match drive.plan_parameters(wanted, PlanOptions { address: true }).await {
        Ok(plan) => plan.left,
        Err(PlanError::Unfit { .. }) => Vec::new(),
        Err(error) => return Err(source::refused(error)),
    };
    let counts = |object: &Mux| !left.iter().any(|(other, why)| other == object && *why == Left::Command);
    let compared: Vec<_> = wanted.values.iter().filter(|(object, _)| counts(object)).collect();
    let deviations = verify(drive.node(), compared.clone()).await?;
    let deviations = deviations.iter().map(|deviation| {
        let found = source::found(deviation);
        Deviates {
            object: deviation.object.to_string(),
            name: name(model, deviation.object),
            wanted: Shown::new(model, deviation.object, &deviation.wanted),
            found: found.as_ref().ok().map(|bytes| Shown::new(model, deviation.object, bytes)),
            refused: found.err(),
        }
    });
    let deviations: Vec<_> = deviations.collect();
    Ok(VerifyReport {
        ok: deviations.is_empty(),
        node: drive.node().id().raw(),
        file,
        compared: compared.len(),
        deviations,
    })
}

impl VerifyReport {
    /// What makes the command fail.
    pub fn failure(&self) -> Option<Failure> {
        let many = self.deviations.len();
        (!self.ok).then(|| {
            let have = if many == 1 { "has another value" } else { "have other values" };
            let of = counted(self.compared, "object");
            let next = if self.file == MACHINE_FILE {
                format!("ferrodrive params apply {}, with the same machine file", self.node)
            } else {
                format!("ferrodrive params apply {} {}", self.node, plain(&self.file))
            };
            Failure::new(format!("node {}: {many} of {of} {have} than {}", self.node, plain(&self.file)))
                .of_kind("deviates")
                .next(next)
        })
    }
}

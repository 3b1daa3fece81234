//! `ferrodrive params diff` and `verify`.

use std::collections::BTreeMap;
use std::path::Path;

use canopen::Mux;
use devices::Description;
use master::parameters::{Difference, Left, PlanOptions, diff, verify};
use serde::Serialize;

use super::shown::{Shown, name};
use super::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;
use testbench::words::node::node;

/// In what two sets of parameters differ.
#[derive(Debug, Serialize)]
pub(super) struct DiffReport {
    first: String,
    second: String,
    differences: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    object: String,
    name: Option<&'static str>,
    /// Null: it has none.
    first: Option<Shown>,
    second: Option<Shown>,
}

impl Row {
    fn new(model: Option<&'static Description>, difference: &Difference) -> Self {
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

impl super::Diff {
    pub(super) async fn run(&self, context: &Context) -> Result<DiffReport, Failure> {
        let second = self.second.display().to_string();
        let Ok(id) = node(&self.first) else {
            let path = Path::new(&self.first);
            let (a, b) = (source::read(path, None, None)?, source::read(&self.second, None, None)?);
            let differences = diff(&a.values, &b.values).iter().map(|found| Row::new(None, found)).collect();
            return Ok(DiffReport { first: self.first.clone(), second, differences });
        };
        let drive = context.drive(id).await?;
        let wanted = source::read(&self.second, drive.description(), Some(id))?;
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
        for deviation in verify(drive.node(), wanted.values.iter().filter(|(object, _)| !differ(object))).await? {
            differences.push(Difference { object: deviation.object, first: None, second: Some(deviation.wanted) });
        }
        differences.extend(has.iter().map(|(object, found)| Difference {
            object: *object,
            first: Some(found.clone()),
            second: wanted.values.get(object).cloned(),
        }));
        differences.sort_by_key(|found| found.object);
        let differences = differences.iter().map(|found| Row::new(drive.description(), found)).collect();
        Ok(DiffReport { first: format!("node {id}"), second, differences })
    }
}

impl Report for DiffReport {
    fn text(&self, paint: Paint) -> String {
        let (first, second) = (plain(&self.first), plain(&self.second));
        if self.differences.is_empty() {
            return format!("{first} has what {second} says");
        }
        let mut table = Table::new(&["object", "name", "first", "second"]);
        for row in &self.differences {
            let say = |shown: &Option<Shown>| shown.as_ref().map_or("-".to_owned(), |shown| plain(&shown.text));
            table.row([row.object.clone(), row.name.unwrap_or_default().to_owned(), say(&row.first), say(&row.second)]);
        }
        format!("first   {first}\nsecond  {second}\n\n{}", table.plain(paint))
    }
}

/// Whether a node has what a file says.
#[derive(Debug, Serialize)]
pub(super) struct VerifyReport {
    ok: bool,
    node: u8,
    file: String,
    /// Objects that were read.
    compared: usize,
    deviations: Vec<Deviates>,
}

#[derive(Debug, Serialize)]
struct Deviates {
    object: String,
    name: Option<&'static str>,
    wanted: Shown,
    /// Null: the node did not tell.
    found: Option<Shown>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
}

impl super::Verify {
    pub(super) async fn run(&self, context: &Context) -> Result<VerifyReport, Failure> {
        let drive = context.drive(self.wanted.node).await?;
        let model = drive.description();
        let (wanted, file) = source::wanted(context, &self.wanted, model)?;
        // A plan tells another device, and what of the file is no parameter; what does not fit is a deviation here.
        let left = match drive.plan_parameters(&wanted, PlanOptions { address: true }).await {
            Ok(plan) => plan.left,
            Err(master::parameters::PlanError::Unfit { .. }) => Vec::new(),
            Err(error) => return Err(source::refused(error)),
        };
        let counts = |object: &Mux| !left.iter().any(|(other, why)| other == object && *why == Left::Command);
        let compared: Vec<_> = wanted.values.iter().filter(|(object, _)| counts(object)).collect();
        let deviations = verify(drive.node(), compared.iter().copied()).await?;
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
            node: self.wanted.node.raw(),
            file,
            compared: compared.len(),
            deviations,
        })
    }
}

impl VerifyReport {
    /// What makes the command fail.
    pub(super) fn failure(&self) -> Option<Failure> {
        let many = self.deviations.len();
        (!self.ok).then(|| {
            Failure::new(format!(
                "node {}: {many} of {} objects have another value than the file",
                self.node, self.compared
            ))
            .of_kind("deviates")
            .next(format!("ferrodrive params apply {} {}", self.node, plain(&self.file)))
        })
    }
}

impl Report for VerifyReport {
    fn text(&self, paint: Paint) -> String {
        if self.ok {
            return format!("node {} has what {} says: {} objects", self.node, plain(&self.file), self.compared);
        }
        let mut table = Table::new(&["object", "name", "should be", "is"]);
        for row in &self.deviations {
            let found = row.found.as_ref().map(|shown| shown.text.clone()).or_else(|| row.refused.clone());
            let name = row.name.unwrap_or_default().to_owned();
            table.row([row.object.clone(), name, plain(&row.wanted.text), plain(&found.unwrap_or_default())]);
        }
        table.plain(paint)
    }
}

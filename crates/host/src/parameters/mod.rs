//! Parameters of a drive: its dictionary, values on demand, and the transactions of [`master::parameters`].
//!
//! Reading needs no control. Writes are planned first, go to a drive at rest only, all or nothing, and can be
//! rolled back as long as the studio runs. A transaction is completed even if its page disconnects: half of it is worse than all
//! of it. Commands and set-points are refused: motion has its dead man, in the Motion view.

pub(crate) mod journals;
pub(crate) mod object_rows;
pub(crate) mod transactions;

use std::collections::BTreeMap;

use canopen::od::Entry;
use canopen::{Mux, NodeId};
use devices::Description;
use devices::row::is_parameter;
use machine::parameters::journal::Journal;
use machine::parameters::{sheet, to_dcf};
use master::Drive;
use master::parameters::{ApplyError, Parameters, Plan, PlanError, PlanOptions, default_of, diff};
use serde_json::{Value, json};
use words::object::object;
use words::value::typed_for;

use crate::answer::Answer;
use crate::command::{FileForm, NewValue, ParameterChange, ParameterReading};
use crate::parameters::journals::Journals;
use crate::parameters::object_rows::{bytes_text, row_json, value_text};
use crate::parameters::transactions::{Change, Refusal, Written};
use crate::state::Host;
use crate::work::{Asked, Done, quietly, send};

/// Most objects in one request to read.
const MOST_READ: usize = 64;

/// Shown while a drive stores its parameters.
pub(crate) const STORING: &str = "storing";

impl Host {
    /// Answers with the objects in the description of a drive.
    pub(crate) fn list_objects(&self, node: NodeId, asked: Asked) {
        answer(asked, self.known_model(node).map(|(_, model)| dictionary(node, model)));
    }

    /// Reads or plans parameters.
    pub(crate) fn read_parameters(&mut self, node: NodeId, reading: ParameterReading, asked: Asked) {
        let (drive, model) = match self.known_model(node) {
            Ok(known) => known,
            Err(refusal) => return refuse(asked, refusal),
        };
        if !self.parameters.begin_reading() {
            return refuse(asked, busy("too many reads are under way"));
        }
        self.work.push(Box::pin(async move {
            let outcome = match reading {
                ParameterReading::ReadObjects { objects } => read(&drive, model, &objects).await,
                ParameterReading::PlanParameters { values, file } => match wanted(&drive, model, values, file).await {
                    Ok(wanted) => plan(&drive, model, &wanted).await.map(|plan| plan_json(&plan, model)),
                    Err(refusal) => Err(refusal),
                },
                ParameterReading::CompareParameters { file } => compare(&drive, model, &file).await,
                ParameterReading::BackUp { form } => back_up(&drive, model, form).await,
            };
            Done::Looked(asked, outcome)
        }));
    }

    /// Begins a change of parameters.
    pub(crate) fn change_parameters(&mut self, node: NodeId, change: ParameterChange, asked: Asked) {
        let (drive, model) = match self.known_model(node) {
            Ok(known) => known,
            Err(refusal) => return refuse(asked, refusal),
        };
        match change {
            ParameterChange::WriteParameters { values, file } => {
                self.begin_writing(&drive, model, values, file, asked);
            }
            ParameterChange::Store {} => self.begin_storing(drive, asked),
            ParameterChange::RollBack {} => self.begin_rolling_back(&drive, model, asked),
        }
    }

    /// A drive whose description is known.
    pub(crate) fn known_model(&self, node: NodeId) -> Result<(Drive, &'static Description), Refusal> {
        let known = self.nodes.get(&node).and_then(|known| known.drive.clone());
        known.and_then(|drive| drive.description().map(|model| (drive.clone(), model))).ok_or_else(|| {
            let text =
                format!("the model of node {node} is unknown: scan the bus, or give it with --model {node}=MODEL");
            ("no_such_drive", text)
        })
    }

    /// A read has ended.
    pub(crate) fn conclude_looking(&mut self, asked: Asked, outcome: Result<Value, Refusal>) {
        self.parameters.reading = self.parameters.reading.saturating_sub(1);
        answer(asked, outcome);
    }

    fn begin_writing(
        &mut self,
        drive: &Drive,
        model: &'static Description,
        values: Vec<NewValue>,
        file: Option<String>,
        asked: Asked,
    ) {
        let (drive, journals) = (drive.clone(), self.setting.journals.clone());
        self.begin_transaction(drive.node().id(), Change::Values, asked, async move {
            let wanted = wanted(&drive, model, values, file).await.map_err(|refusal| (refusal, None))?;
            write(&drive, model, &wanted, journals.as_deref()).await
        });
    }

    /// A busy drive is not interrupted: some drives stop while they write their memory.
    fn begin_storing(&mut self, drive: Drive, asked: Asked) {
        let node = drive.node().id();
        let is_busy = self.running.contains_key(&node)
            || self.jogs.contains_key(&node)
            || self.network.moved().contains(node)
            || self.parameters.is_writing(node)
            || self.captures.contains_key(&node);
        if is_busy {
            return refuse(asked, busy("the drive is busy with another command"));
        }
        self.begin(node, STORING, false, Some(asked), async move { quietly(drive.save().await) });
    }

    fn begin_rolling_back(&mut self, drive: &Drive, model: &'static Description, asked: Asked) {
        let (drive, node, journals) = (drive.clone(), drive.node().id(), self.setting.journals.clone());
        let Some(wanted) = self.parameters.before.get(&node).and_then(|before| before.last()).cloned() else {
            let text = format!("no parameters of node {node} were written since the studio started");
            return refuse(asked, ("nothing_to_roll_back", text));
        };
        self.begin_transaction(node, Change::Back, asked, async move {
            write(&drive, model, &wanted, journals.as_deref()).await
        });
    }

    pub(crate) fn begin_transaction(
        &mut self,
        node: NodeId,
        change: Change,
        asked: Asked,
        writing: impl Future<Output = Result<(Value, Option<Parameters>), (Refusal, Option<Parameters>)>> + 'static,
    ) {
        if self.captures.contains_key(&node) {
            return refuse(asked, busy("it is being captured"));
        }
        if self.running.contains_key(&node) || !self.parameters.writing.insert(node) {
            return refuse(asked, busy("the drive is busy with another command"));
        }
        self.work.push(Box::pin(async move {
            let (outcome, before) = match writing.await {
                Ok((done, before)) => (Ok(done), before),
                Err((refusal, before)) => (Err(refusal), before),
            };
            Done::Written(asked, Box::new(Written { node, outcome, before, change }))
        }));
    }

    /// A transaction has ended, successfully or not.
    pub(crate) fn conclude_writing(&mut self, asked: Asked, written: Written) {
        let Written { node, outcome, before, change } = written;
        self.parameters.writing.remove(&node);
        match (&outcome, before) {
            // This was the rollback itself: it cannot be rolled back.
            (Ok(_), _) if change == Change::Back => drop(self.parameters.before.entry(node).or_default().pop()),
            (_, Some(before)) if change != Change::Back => self.parameters.keep(node, before),
            _ => {}
        }
        let left = self.parameters.can_roll_back(node);
        match &outcome {
            Err((_, text)) => self.send_news(Some(node), text),
            Ok(done) => {
                if change == Change::Pdos {
                    self.parameters.note_mapped(node);
                }
                // The journal is still there: a rollback from it after another write would undo this one.
                if let Some(why) = done["journal"].as_str().filter(|why| !why.is_empty()) {
                    self.send_news(Some(node), why);
                }
            }
        }
        // A mapping may have changed.
        self.learn_pdos(node);
        answer(
            asked,
            outcome.map(|mut done| {
                done["can_roll_back"] = json!(left);
                done
            }),
        );
    }
}

fn dictionary(node: NodeId, model: &Description) -> Value {
    let rows: Vec<Value> = model.dictionary.rows().iter().map(|row| row_json(model, row, node)).collect();
    json!({ "node": node.raw(), "model": model.name, "manual": model.manual, "objects": rows })
}

async fn read(drive: &Drive, model: &'static Description, objects: &[String]) -> Result<Value, Refusal> {
    if objects.len() > MOST_READ {
        return Err((
            "malformed",
            format!("expected at most {MOST_READ} objects in one request, got {}", objects.len()),
        ));
    }
    let mut read = Vec::new();
    for text in objects {
        let mux = row(model, text)?.mux();
        read.push(match drive.node().upload(mux).await {
            Ok(payload) => value_json(drive, model, mux, payload.as_bytes()),
            Err(error) => match error.abort() {
                Some(code) => json!({ "object": mux.to_string(), "refused": code.to_string() }),
                None => return Err((error.kind(), error.to_string())),
            },
        });
    }
    Ok(json!({ "values": read }))
}

fn value_json(drive: &Drive, model: &'static Description, mux: Mux, bytes: &[u8]) -> Value {
    let default = default_of_object(drive, model, mux);
    json!({
        "object": mux.to_string(),
        "text": value_text(model, mux, bytes),
        "bytes": bytes_text(bytes),
        "is_default": default.map(|default| is_same(mux, &default, bytes)),
    })
}

fn default_of_object(drive: &Drive, model: &Description, mux: Mux) -> Option<Vec<u8>> {
    default_of(model.row(mux)?, drive.node().id())
}

/// As the transaction compares: bit 30 of a TPDO's COB-ID does not count.
fn is_same(mux: Mux, first: &[u8], second: &[u8]) -> bool {
    let one = |bytes: &[u8]| BTreeMap::from([(mux, bytes.to_vec())]);
    diff(&one(first), &one(second)).is_empty()
}

/// An object of the description, by the text that a page sends.
pub(crate) fn row(model: &'static Description, text: &str) -> Result<&'static Entry, Refusal> {
    let found = object(text).and_then(|object| object.resolve(Some(model.dictionary)));
    let (mux, row) = found.map_err(|why| ("unknown_object", why))?;
    row.ok_or_else(|| ("unknown_object", format!("{mux} is not in the description of the {}", model.name)))
}

/// Typed values, or the values of a file.
async fn wanted(
    drive: &Drive,
    model: &'static Description,
    values: Vec<NewValue>,
    file: Option<String>,
) -> Result<Parameters, Refusal> {
    match (file, values.is_empty()) {
        (Some(file), true) => of_file(drive, model, &file),
        (None, false) => typed(drive, model, &values).await,
        _ => Err(("malformed", "expected either values or a file".into())),
    }
}

fn of_file(drive: &Drive, model: &'static Description, file: &str) -> Result<Parameters, Refusal> {
    let parameters = sheet::parse(file, Some(model)).map_err(|bad| ("bad_parameters", bad.to_string()))?;
    Ok(parameters.for_node(drive.node().id(), Some(model)))
}

async fn typed(drive: &Drive, model: &'static Description, values: &[NewValue]) -> Result<Parameters, Refusal> {
    let mut parameters = Parameters { node: Some(drive.node().id()), ..Parameters::default() };
    for NewValue { object, value } in values {
        let row = row(model, object)?;
        let mux = row.mux();
        if row.access.is_writable() && !is_parameter(row) {
            let text = format!(
                "{mux} {} is a command or a set-point, not a parameter: it is not written here. To move the drive, use the \
                 Motion view",
                row.name
            );
            return Err(("not_a_parameter", text));
        }
        if model.storage.address.contains(&mux) {
            let text = format!(
                "{mux} {} sets node-ID or bit rate: the drive would be unreachable after its restart. Use ferrodrive write",
                row.name
            );
            return Err(("address", text));
        }
        let resolution = match row.resolution {
            Some(_) => {
                let limits = drive.limits(mux).await.map_err(|error| (error.kind(), error.to_string()))?;
                limits.counts_per_unit()
            }
            None => 1,
        };
        let bytes = typed_for(row, value, resolution).map_err(|why| ("bad_value", why))?.bytes();
        parameters.values.insert(mux, bytes);
    }
    Ok(parameters)
}

pub(crate) async fn plan(drive: &Drive, model: &'static Description, wanted: &Parameters) -> Result<Plan, Refusal> {
    drive.check_at_rest().await.map_err(|error| refusal_of(&error, model))?;
    drive.plan_parameters(wanted, PlanOptions::default()).await.map_err(|error| refusal_of(&error, model))
}

/// Writes all or nothing, with a journal until that is done. Returns the values before, if the objects may have
/// others now.
pub(crate) async fn write(
    drive: &Drive,
    model: &'static Description,
    wanted: &Parameters,
    journals: Option<&dyn Journals>,
) -> Result<(Value, Option<Parameters>), (Refusal, Option<Parameters>)> {
    let plan = plan(drive, model, wanted).await.map_err(|refusal| (refusal, None))?;
    let journals = journals.filter(|_| !plan.steps.is_empty());
    if let Some(journals) = journals {
        let journal = Journal { node: plan.node, identity: plan.identity, pre_operational: false, undo: plan.undo() };
        journals.begin(&journal).map_err(|why| (("journal", format!("nothing was written: {why}")), None))?;
    }
    // A journal that is left can be applied later: ferrodrive params rollback.
    let end = || match journals.map_or(Ok(()), |journals| journals.end(plan.node)) {
        Ok(()) => String::new(),
        Err(why) => format!(". {why}"),
    };
    let before = (!plan.steps.is_empty()).then(|| Parameters {
        identity: plan.identity,
        node: Some(plan.node),
        values: plan.current.clone(),
    });
    match drive.apply_parameters(&plan, |_, _| {}).await {
        Ok(Ok(applied)) => {
            let mut done = plan_json(&plan, model);
            let rounded = applied.rounded.iter().map(|rounded| {
                json!({
                    "object": rounded.object.to_string(),
                    "asked": value_text(model, rounded.object, &rounded.asked),
                    "found": value_text(model, rounded.object, &rounded.found),
                })
            });
            done["rounded"] = rounded.collect();
            done["journal"] = json!(end().trim_start_matches(". "));
            done["displaced"] = applied.displaced.iter().map(|found| json!(found.object.to_string())).collect();
            Ok((done, before))
        }
        Ok(Err(error)) => {
            let is_back = error.undone.not_put_back.is_empty();
            let kind = if is_back { "rolled_back" } else { "not_put_back" };
            let then = if is_back { end() } else { String::new() };
            Err(((kind, refused_write(&error, model) + &then), before.filter(|_| !is_back)))
        }
        // A timeout after everything was written, which leaves the journal; the others are before the first write.
        Err(error @ PlanError::Node(_)) => Err((refusal_of(&error, model), before)),
        Err(error) => {
            let (kind, text) = refusal_of(&error, model);
            Err(((kind, text + &end()), before))
        }
    }
}

fn refused_write(error: &ApplyError, model: &Description) -> String {
    let name = model.row(error.object).map_or("", |row| row.name);
    let limits = error.limits.as_ref().map_or_else(String::new, |limits| format!(" Expected {limits}."));
    format!("{} {name} was not written: {}.{limits} {}", error.object, error.why, error.undone)
}

fn refusal_of(error: &PlanError, model: &Description) -> Refusal {
    match error {
        PlanError::Node(error) => (error.kind(), error.to_string()),
        PlanError::OtherDevice { .. } => ("other_device", format!("{error}. Nothing was written")),
        PlanError::AtWork { .. } => ("at_work", format!("{error}: disable the {} first", model.name)),
        PlanError::Unfit { .. } => ("unfit_parameters", format!("{error}. Nothing was written")),
    }
}

/// The planned writes, in order.
pub(crate) fn plan_json(plan: &Plan, model: &'static Description) -> Value {
    let text = |mux: Mux, bytes: &[u8]| value_text(model, mux, bytes);
    let steps = plan.steps.iter().map(|step| {
        json!({
            "object": step.object.to_string(),
            "name": model.row(step.object).map(|row| row.name),
            "before": step.before.as_ref().map(|bytes| text(step.object, bytes)),
            "after": text(step.object, &step.value),
            "purpose": step.purpose.to_string(),
        })
    });
    let left = plan.left.iter().map(|(object, why)| {
        json!({ "object": object.to_string(), "name": model.row(*object).map(|row| row.name), "why": why.to_string() })
    });
    json!({ "steps": steps.collect::<Vec<_>>(), "left": left.collect::<Vec<_>>() })
}

/// The objects of a file for which default, file and drive are not all equal.
async fn compare(drive: &Drive, model: &'static Description, file: &str) -> Result<Value, Refusal> {
    let parameters = of_file(drive, model, file)?;
    let mut rows = Vec::new();
    for (mux, wanted) in &parameters.values {
        let found = match drive.node().upload(*mux).await {
            Ok(payload) => Ok(payload.as_bytes().to_vec()),
            Err(error) => match error.abort() {
                Some(code) => Err(code.to_string()),
                None => return Err((error.kind(), error.to_string())),
            },
        };
        let default = default_of_object(drive, model, *mux);
        let text = |bytes: &[u8]| value_text(model, *mux, bytes);
        rows.push(json!({
            "object": mux.to_string(),
            "name": model.row(*mux).map(|row| row.name),
            "default": default.as_deref().map(text),
            "file": text(wanted),
            "file_bytes": bytes_text(wanted),
            "drive": found.as_deref().map_or_else(Clone::clone, text),
            "file_is_default": default.as_deref().map(|default| is_same(*mux, default, wanted)),
            "drive_is_file": found.as_deref().is_ok_and(|found| is_same(*mux, wanted, found)),
        }));
    }
    Ok(json!({ "objects": rows }))
}

/// The file that `ferrodrive params backup` writes.
async fn back_up(drive: &Drive, model: &'static Description, form: FileForm) -> Result<Value, Refusal> {
    let backup = drive.back_up(|_, _, _| {}).await.map_err(|error| (error.kind(), error.to_string()))?;
    let refused: Vec<String> = backup.refused.iter().map(|(object, error)| format!("{object}: {error}")).collect();
    let file = match form {
        FileForm::Toml => sheet::print(&backup.parameters, Some(model)),
        FileForm::Dcf => {
            let bytes = to_dcf(&backup.parameters, model, &format!("node{}.dcf", drive.node().id()));
            // The data sheets that we write are ASCII.
            String::from_utf8_lossy(&bytes.map_err(|why| ("bad_parameters", why))?).into_owned()
        }
    };
    Ok(json!({ "file": file, "values": backup.parameters.values.len(), "refused": refused }))
}

pub(crate) fn busy(what: &str) -> Refusal {
    ("busy", format!("{what}: try again"))
}

pub(crate) fn refuse(asked: Asked, refusal: Refusal) {
    answer(asked, Err(refusal));
}

pub(crate) fn answer((seq, answer): Asked, outcome: Result<Value, Refusal>) {
    send(
        answer,
        match outcome {
            Ok(known) => Answer::known(seq, known),
            Err((kind, text)) => Answer::failed(Some(seq), kind, text),
        },
    );
}

//! `ferrodrive read` and `ferrodrive write`: one object of a node by SDO (CiA 301, clause 7.2.4).

use canopen::od::Entry;
use canopen::{AbortCode, Mux, NodeId};
use master::decode::{common_name, common_row, common_type};
use master::drive::Limits;
use master::{Drive, Error};
use serde::Serialize;

use crate::context::Context;
use crate::decode::{Decoded, decode};
use crate::failure::Failure;
use crate::output::Report;
use crate::paint::Paint;
use testbench::words::node::node;
use testbench::words::object::{ObjectArg, object};
use testbench::words::value::{typed_value, value};

/// Read an object of a node, decoded with unit and meaning
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Objects are hexadecimal indices or names:\n  6064, 0x6064, 6064h, 2026:01, position_actual_value"
)]
pub(crate) struct Read {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Index, index:sub-index or name
    #[arg(value_parser = object)]
    object: ObjectArg,
}

/// Write an object of a node
#[derive(Debug, clap::Args)]
#[command(after_help = "Values are decimal, 0x.., have a unit where the object has one, or are one of its words:\n  \
    ferrodrive write 4 60FF 60rpm\n  ferrodrive write 4 6060 'profile velocity'\n  ferrodrive write 4 6040 0x0F\n\
    An object that is in no known table takes its type with the value: u16:15")]
pub(crate) struct Write {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Index, index:sub-index or name
    #[arg(value_parser = object)]
    object: ObjectArg,
    /// The value
    #[arg(allow_hyphen_values = true)]
    value: String,
}

/// An object and its value.
#[derive(Debug, Serialize)]
pub(crate) struct ObjectReport {
    node: u8,
    object: String,
    name: Option<&'static str>,
    /// The model by whose table it is read, if that is a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    guess: Option<&'static str>,
    #[serde(flatten)]
    value: Decoded,
    /// What to know about what was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<String>,
    #[serde(skip)]
    written: bool,
}

impl Read {
    /// Reads and decodes.
    pub(crate) async fn run(&self, context: &Context) -> Result<ObjectReport, Failure> {
        // A number is asked for before the model, so that an absent node is blamed for the object that was wanted.
        let early = match self.object {
            ObjectArg::Mux(mux) => Some(context.node(self.node).upload(mux).await?),
            ObjectArg::Name(_) => None,
        };
        let drive = context.drive(self.node).await?;
        let (mux, row) = resolve(&drive, &self.object)?;
        let payload = match early {
            Some(payload) => payload,
            None => drive.node().upload(mux).await?,
        };
        let row = if drive.description().is_some() { row } else { common_row(mux) };
        let limits = moving_limits(&drive, row).await?;
        Ok(ObjectReport::new(&drive, mux, row, payload.as_bytes(), limits.as_ref(), false))
    }
}

impl Write {
    /// Reads what was typed, and writes it.
    pub(crate) async fn run(&self, context: &Context) -> Result<ObjectReport, Failure> {
        let drive = context.drive_untold(self.node).await?;
        let (mux, row) = resolve(&drive, &self.object)?;
        let limits = moving_limits(&drive, row).await?;
        let wrong = |reason| Failure::usage(reason).at_node(self.node).at_object(mux);
        let (data_type, number) = match row {
            Some(row) => (row.data_type, value(row, &self.value, counts_per_unit(limits.as_ref())).map_err(wrong)?),
            None => typed_value(&self.value).map_err(wrong)?,
        };
        drive.check_write(mux, number)?;
        context.tell_guess(&drive);
        let bytes = data_type.raw(number).to_le_bytes();
        let bytes = &bytes[..data_type.size()];
        if let Err(error) = drive.node().download(mux, bytes).await {
            return Err(with_limits(&drive, error, number).await);
        }
        let mut report = ObjectReport::new(&drive, mux, row, bytes, limits.as_ref(), true);
        report.note = note(&drive, mux, number, limits.as_ref());
        Ok(report)
    }
}

/// What the object takes now, where other objects have a say in it.
async fn moving_limits(drive: &Drive, row: Option<&Entry>) -> Result<Option<Limits>, Failure> {
    match row.filter(|row| drive.description().is_some() && (row.resolution.is_some() || row.held_to.is_some())) {
        Some(row) => Ok(Some(drive.limits(row.mux()).await?)),
        None => Ok(None),
    }
}

fn counts_per_unit(limits: Option<&Limits>) -> i64 {
    limits.map_or(1, Limits::counts_per_unit)
}

/// What to know about a value that the drive has taken.
fn note(drive: &Drive, mux: Mux, number: i64, limits: Option<&Limits>) -> Option<String> {
    let storage = drive.description().map(|profile| profile.storage);
    if storage.is_some_and(|storage| storage.effective_after_restart.contains(&mux)) {
        let node = drive.node().id();
        return Some(format!("it takes effect at the next restart, if it is stored by then: ferrodrive save {node}"));
    }
    let (limits, setting) = limits.and_then(|limits| Some((limits, limits.holding_back(number)?)))?;
    let most = limits.held_to.map_or(0, |(most, _)| most);
    Some(format!("the drive holds it to {most}, by {setting}"))
}

/// A refusal of a value, with what the object takes now and where that comes from.
async fn with_limits(drive: &Drive, error: Error, number: i64) -> Failure {
    let by_value = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW];
    let refused = error.object().filter(|_| error.abort().is_some_and(|code| by_value.contains(&code)));
    let failure = Failure::from(error);
    let Some(mux) = refused else { return failure };
    let Ok(limits) = drive.limits(mux).await else { return failure };
    let failure = failure.next(format!("{mux} {} takes {limits}", limits.name));
    match limits.resolution.filter(|setting| limits.take(number) && setting.since_restart) {
        Some(setting) => failure.next(format!(
            "{} has been written since the drive's last restart: until the next one its value before counts",
            setting.object
        )),
        None => failure,
    }
}

/// The multiplexor, and the row if the node's model is known and has it.
fn resolve(drive: &Drive, object: &ObjectArg) -> Result<(Mux, Option<&'static Entry>), Failure> {
    let found = object.resolve(drive.description().map(|model| model.dictionary));
    found.map_err(|reason| Failure::usage(reason).at_node(drive.node().id()))
}

impl ObjectReport {
    fn new(
        drive: &Drive,
        mux: Mux,
        row: Option<&'static Entry>,
        bytes: &[u8],
        limits: Option<&Limits>,
        written: bool,
    ) -> Self {
        let unknown = row.is_none() && drive.description().is_none();
        let data_type = common_type(mux, bytes.len()).filter(|_| unknown);
        let value = decode(drive.description(), row, bytes).typed(data_type);
        Self {
            node: drive.node().id().raw(),
            object: mux.to_string(),
            name: row.map(|row| row.name).or_else(|| common_name(mux).filter(|_| drive.description().is_none())),
            guess: guessed(drive),
            value: value.at_resolution(counts_per_unit(limits)),
            note: None,
            written,
        }
    }
}

/// The model that a drive is taken for on the evidence of its objects.
pub(super) fn guessed(drive: &Drive) -> Option<&'static str> {
    drive.guess().filter(|guess| guess.evidence().is_some()).map(|guess| guess.description().name)
}

impl Report for ObjectReport {
    fn text(&self, paint: Paint) -> String {
        let name = self.name.map(|name| format!(" {name}")).unwrap_or_default();
        let verb = if self.written { " written:" } else { " =" };
        let note = self.note.as_ref().map(|note| format!("\n  note    {note}")).unwrap_or_default();
        format!("node {} {}{name}{verb} {}{note}", self.node, self.object, self.value.text(paint))
    }
}

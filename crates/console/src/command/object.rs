//! Objects as they are read or have been written, for people and for programs.

use canopen::Mux;
use canopen::od::Entry;
use master::Drive;
use master::decode::{common_name, common_type};
use master::drive::Limits;
use plot::Paint;
use serde::Serialize;
use words::counted;
use words::decode::{Decoded, decode};
use words::object::ObjectArg;

use super::drive::guessed;
use crate::failure::Failure;

/// An object and its value.
#[derive(Debug, Serialize)]
pub struct ObjectReport {
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
    pub note: Option<String>,
    /// The file that the bytes went into or came from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Why it was not read, where several objects were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    #[serde(skip)]
    written: bool,
}

/// What the object takes now, where other objects have a say in it.
pub async fn moving_limits(drive: &Drive, row: Option<&Entry>) -> Result<Option<Limits>, Failure> {
    match row.filter(|row| drive.description().is_some() && drive.is_limited_elsewhere(row)) {
        Some(row) => Ok(Some(drive.limits(row.mux()).await?)),
        None => Ok(None),
    }
}

/// How many counts the object has per unit, 1 if it has no resolution.
pub fn counts_per_unit(limits: Option<&Limits>) -> i64 {
    limits.map_or(1, Limits::counts_per_unit)
}

/// The multiplexor, and the row if the node's model is known and has it.
pub fn resolve(drive: &Drive, object: &ObjectArg) -> Result<(Mux, Option<&'static Entry>), Failure> {
    let found = object.resolve(drive.description().map(|model| model.dictionary));
    found.map_err(|reason| {
        let node = drive.node().id();
        Failure::usage(reason)
            .at_node(node)
            .next(format!("look for it: ferrodrive objects {node} WORD, or give its index, e.g. 6064"))
    })
}

impl ObjectReport {
    /// The object's number.
    pub const fn number(&self) -> Option<i64> {
        self.value.value
    }

    /// Whether more was read than is shown.
    pub fn is_cut(&self) -> bool {
        self.value.is_cut() && !self.written && self.file.is_none()
    }

    /// What was read of an object, or has been written.
    pub fn new(
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
            file: None,
            refused: None,
            written,
        }
    }
}

impl ObjectReport {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let name = self.name.map(|name| format!(" {name}")).unwrap_or_default();
        if let Some(why) = &self.refused {
            return format!("node {} {}{name}: refused: {why}", self.node, self.object);
        }
        if let Some(file) = &self.file {
            let (bytes, to) = (self.value.length(), if self.written { "from" } else { "to" });
            return format!("node {} {}{name}: {} {to} {file}", self.node, self.object, counted(bytes, "byte"));
        }
        let verb = if self.written { " written:" } else { " =" };
        let note = self.note.as_ref().map(|note| format!("\n  note    {note}")).unwrap_or_default();
        format!("node {} {}{name}{verb} {}{note}", self.node, self.object, self.value.text(paint))
    }
}

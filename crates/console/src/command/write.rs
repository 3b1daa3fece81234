//! `ferrodrive write`: an object of a node by SDO download (CiA 301, clause 7.2.4).

use std::path::{Path, PathBuf};

use canopen::{AbortCode, Mux, NodeId};
use master::decode::standard_row;
use master::drive::Limits;
use master::{Drive, Error};
use words::document::read_bytes;
use words::node::node;
use words::object::{ObjectArg, object};
use words::value::{Typed, typed_alone, typed_for};

use super::effect::CommandEffect;
use super::object::{ObjectReport, counts_per_unit, moving_limits, resolve};
use crate::context::Context;
use crate::failure::Failure;

/// Write an object of a node
#[derive(Debug, clap::Args)]
#[command(after_help = "Values are decimal, 0x.., have a unit where the object has one, or are one of its words:\n  \
    ferrodrive write 4 60FF 60rpm\n  ferrodrive write 4 6060 'profile velocity'\n  ferrodrive write 4 6040 0x0F\n  \
    ferrodrive write 5 1008 'left wheel'\n  ferrodrive write 5 1F50:01 --from firmware.bin\n\
    An object of CiA 301 or CiA 402 has the standard's type where the model is not known:\n  ferrodrive write 32 6060 6\n\
    Any object that no known table has takes its type with the value: u16:15, i32:-100, text:'left wheel', hex:01AAFF")]
pub struct Write {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Index, index:sub-index or name
    #[arg(value_parser = object)]
    object: ObjectArg,
    /// The value
    #[arg(allow_hyphen_values = true, required_unless_present = "from")]
    value: Option<String>,
    /// Write the bytes of this file, as they are
    #[arg(long, value_name = "FILE", conflicts_with = "value")]
    from: Option<PathBuf>,
}

impl Write {
    /// What it does to drives.
    pub(crate) fn effect(&self) -> CommandEffect {
        let object = match &self.object {
            ObjectArg::Mux(mux) => format!("{mux:X}"),
            ObjectArg::Name(name) => name.clone(),
        };
        CommandEffect::Writes(self.node, object, self.value.clone().unwrap_or_default())
    }

    /// Whether the value is in a file.
    pub(crate) const fn is_from_file(&self) -> bool {
        self.from.is_some()
    }

    /// Reads what was typed, and writes it. A host has written it already, by its own rules: then it is read back.
    ///
    /// # Errors
    /// What was typed makes no sense; the drive refuses it; those of the master.
    pub async fn run(&self, context: &Context) -> Result<ObjectReport, Failure> {
        let content = self.from.as_deref().map(content).transpose()?;
        let drive = context.drive_without_note(self.node).await?;
        let (mux, row) = resolve(&drive, &self.object)?;
        let limits = moving_limits(&drive, row).await?;
        let advice = match row {
            Some(_) => {
                format!("ferrodrive objects {} {:04X} shows its type, range, unit and words", self.node, mux.index)
            }
            None => {
                format!("give its type with the value, e.g. ferrodrive write {} {mux:X} u16:15", self.node)
            }
        };
        let wrong = |reason| Failure::usage(reason).at_node(self.node).at_object(mux).next(&advice);
        let typed = self.value.as_deref().unwrap_or_default();
        let value = match (content, row) {
            (Some(bytes), _) => Typed::Bytes(bytes),
            (None, Some(row)) => typed_for(row, typed, counts_per_unit(limits.as_ref())).map_err(wrong)?,
            (None, None) => without_a_row(mux, drive.description().is_some(), typed).map_err(wrong)?,
        };
        // Bytes may be a number that means something else on another model.
        drive.check_write(mux, value.number().unwrap_or_else(|| low_bytes(&value.bytes())))?;
        context.note_guess(&drive);
        let is_written = context.in_control().is_some();
        if let Some(new) = new_node_id(&drive, mux, &value).filter(|new| *new != self.node && !is_written) {
            context.expect_free(new).await?;
        }
        let mut bytes = value.bytes();
        if bytes.len() > LONG {
            context.show(format!("node {}: writing {} bytes to {mux}", self.node, bytes.len()));
        }
        if is_written {
            bytes = drive.node().upload(mux).await?.as_bytes().to_vec();
        } else if let Err(error) = drive.node().download(mux, &bytes).await {
            return Err(with_limits(&drive, error, value.number()).await);
        }
        let mut report = ObjectReport::new(&drive, mux, row, &bytes, limits.as_ref(), true);
        report.note = note(&drive, mux, value.number(), limits.as_ref());
        report.file = self.from.as_ref().map(|path| path.display().to_string());
        Ok(report)
    }
}

/// The node-ID that a drive is given with this value.
fn new_node_id(drive: &Drive, mux: Mux, value: &Typed) -> Option<NodeId> {
    let chooses = drive.description()?.storage.address.first()?;
    value.number().filter(|_| *chooses == mux).and_then(|number| NodeId::new(u8::try_from(number).ok()?))
}

/// The value of an object that no row is known of: with its type, or of the standard's where the model is not known.
fn without_a_row(mux: Mux, model_known: bool, text: &str) -> Result<Typed, String> {
    match standard_row(mux).filter(|_| !model_known && !text.contains(':')) {
        Some(row) => typed_for(&row, text, 1),
        None => typed_alone(text),
    }
}

/// Longest content of a file that is written: what the master reads at most.
const MOST: u64 = 1 << 20;

/// What takes long enough to say that it goes on.
const LONG: usize = 1024;

fn content(path: &Path) -> Result<Vec<u8>, Failure> {
    let bytes = read_bytes(path, MOST).map_err(|reason| {
        Failure::bad_file(format!("cannot read {}", path.display()))
            .because(reason)
            .next("give the path of a file with the bytes to write, at most 1 MB")
    })?;
    if bytes.is_empty() {
        let empty = Failure::bad_file(format!("{} is empty", path.display()));
        return Err(empty.next("check whether this is the right file"));
    }
    Ok(bytes)
}

/// The low bytes as an unsigned number.
fn low_bytes(bytes: &[u8]) -> i64 {
    bytes.iter().take(4).rev().fold(0, |number, byte| number << 8 | i64::from(*byte))
}

/// What to know about a value that the drive has taken.
fn note(drive: &Drive, mux: Mux, number: Option<i64>, limits: Option<&Limits>) -> Option<String> {
    let storage = drive.description().map(|profile| profile.storage);
    if storage.is_some_and(|storage| storage.effective_after_restart.contains(&mux)) {
        let node = drive.node().id();
        if let Some(by_itself) = storage.and_then(|storage| storage.stores_each_write()) {
            let (object, value) = (by_itself.object, by_itself.value);
            return Some(format!(
                "it takes effect at the next restart; it is stored by then while {object} is {value}, as delivered, else: ferrodrive save {node}"
            ));
        }
        return Some(format!("it takes effect at the next restart, if it is stored by then: ferrodrive save {node}"));
    }
    in_effect(limits?, number?)
}

/// What a value effects in place of its own.
fn in_effect(limits: &Limits, number: i64) -> Option<String> {
    let (magnitude, setting) = limits.changed(number)?;
    let does = if magnitude.unsigned_abs() > number.unsigned_abs() { "raises" } else { "limits" };
    Some(format!("the drive {does} it to {magnitude}, by {setting}"))
}

/// A refusal of a value, with what the object takes now and where that comes from.
async fn with_limits(drive: &Drive, error: Error, number: Option<i64>) -> Failure {
    let by_value = [AbortCode::INVALID_VALUE, AbortCode::VALUE_TOO_HIGH, AbortCode::VALUE_TOO_LOW];
    let refused = error.object().filter(|_| error.abort().is_some_and(|code| by_value.contains(&code)));
    let failure = Failure::from(error);
    let Some(mux) = refused else { return failure };
    let Ok(limits) = drive.limits(mux).await else { return failure };
    let failure = failure.next(format!("{mux} {} takes {limits}", limits.name));
    match limits.resolution.filter(|setting| number.is_some_and(|number| limits.take(number)) && setting.since_restart)
    {
        Some(setting) => failure.next(format!(
            "{} has been written since the drive's last restart: until the next one, the value before it is in effect",
            setting.object
        )),
        None => failure,
    }
}

#[cfg(test)]
mod tests {
    use master::drive::{HeldBy, Setting};

    use super::*;

    #[test]
    fn objects_of_the_standard_need_no_type_where_the_model_is_not_known() {
        let bytes = |index, text: &str| without_a_row(Mux::new(index, 0), false, text).map(|typed| typed.bytes());
        assert_eq!(bytes(0x6060, "6"), Ok(vec![6]));
        assert_eq!(bytes(0x6060, "-1"), Ok(vec![0xFF]), "a maker's mode");
        assert_eq!(bytes(0x6060, "homing"), Ok(vec![6]));
        assert_eq!(bytes(0x6040, "0x0F"), Ok(vec![0x0F, 0]));
        assert_eq!(bytes(0x607A, "-2"), Ok(vec![0xFE, 0xFF, 0xFF, 0xFF]));
        assert_eq!(bytes(0x6060, "i16:6"), Ok(vec![6, 0]), "a type that is given goes before");
        assert!(bytes(0x6060, "200").is_err() && bytes(0x60FF, "60rpm").is_err() && bytes(0x2000, "6").is_err());
        assert!(without_a_row(Mux::new(0x6060, 0), true, "6").is_err(), "a model that does not have it");
    }

    /// vl velocity min max amount, 6046h: a smaller target is raised, a greater one limited (CiA 402-2).
    #[test]
    fn a_value_that_is_raised_is_not_called_limited() {
        let setting = |sub_index, value| {
            let object = Mux::new(0x6046, sub_index);
            Some((value, Setting { object, name: "amount", value, since_restart: false }))
        };
        let limits = Limits {
            object: Mux::new(0x6042, 0),
            name: "vl_target_velocity",
            unit: "r/min",
            low: -3000,
            high: 3000,
            listed: &[],
            resolution: None,
            held_to: setting(2, 1500).map(|(most, setting)| (most, HeldBy::Setting(setting))),
            raised_to: setting(1, 50),
        };
        let text = |number| in_effect(&limits, number);
        assert_eq!(text(-20).unwrap(), "the drive raises it to 50, by 6046h:01 amount = 50");
        assert_eq!(text(2000).unwrap(), "the drive limits it to 1500, by 6046h:02 amount = 1500");
        assert_eq!([text(0), text(700)], [None, None]);
    }
}

//! Parameters of a node in files: a DCF (CiA 306-1), TOML for people ([`sheet`]), a concise DCF (CiA 302-3), and the journal
//! of a transaction ([`journal`]).
//!
//! In: a file, and where names are to be looked up the model. Out: [`Parameters`], or everything that is wrong with the file.
//! Nothing of a file that is not whole is given out.

pub mod journal;
pub mod sheet;

use std::path::Path;

use canopen::NodeId;
use canopen::concise::{Concise, Entry, emit};
use devices::Description;
use eds::{Severity, parameter_values};
use master::identify::Identity;
use master::parameters::Parameters;

use crate::data_sheet::{self, Unread};
use crate::document::{LARGEST, read_text};

/// The forms that parameters are kept in, by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// `.dcf`, `.eds`.
    Dcf,
    /// `.toml`.
    Toml,
    /// `.bin`, `.cdcf`: concise.
    Concise,
}

impl Form {
    /// By the name of a file.
    ///
    /// # Errors
    /// That it says none.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        Ok(match extension.as_str() {
            "dcf" | "eds" => Self::Dcf,
            "toml" => Self::Toml,
            "bin" | "cdcf" => Self::Concise,
            _ => {
                return Err(format!(
                    "'{}' does not say what it is: parameters are in a file .dcf (CiA 306), .toml, or .bin (concise DCF)",
                    path.display()
                ));
            }
        })
    }
}

/// Reads the parameters in a file. `model` gives names and types, `node` is what the file is read for where it does not
/// say a node itself.
///
/// # Errors
/// Everything that is wrong with it, for people.
pub fn read(path: &Path, model: Option<&'static Description>, node: NodeId) -> Result<Parameters, String> {
    match Form::of(path)? {
        Form::Dcf => dcf(path, node),
        Form::Toml => {
            let text = read_text(path)?;
            sheet::parse(&text, model).map_err(|bad| bad.named(path.display().to_string()).to_string())
        }
        Form::Concise => concise(path, node),
    }
}

fn dcf(path: &Path, node: NodeId) -> Result<Parameters, String> {
    let reading = data_sheet::reading(path).map_err(|unread| match unread {
        Unread::File(error) => error.to_string(),
        Unread::Refused(refusal) if refusal.line > 0 => format!("line {}: {}", refusal.line, refusal.reason),
        Unread::Refused(refusal) => refusal.reason,
    })?;
    // What the reader had to guess or to leave out of values and of lists of objects: the file is not whole.
    let is_broken = |finding: &&eds::Finding| {
        finding.severity == Severity::Error
            && (finding.key.as_deref().is_some_and(|key| key.eq_ignore_ascii_case("ParameterValue"))
                || finding.section.ends_with("Value")
                || finding.section.ends_with("Objects"))
    };
    if let Some(first) = reading.findings.iter().find(is_broken) {
        let all = reading.findings.iter().filter(is_broken).count();
        return Err(format!(
            "it is not whole: line {first}{}. `ferrodrive eds lint {}` shows all",
            if all > 1 { format!(", and {} more", all - 1) } else { String::new() },
            path.display()
        ));
    }
    let eds = reading.eds;
    let of_file = eds.commissioning.as_ref().and_then(|device| NodeId::new(device.node_id?));
    let mut parameters = Parameters { node: of_file, ..Parameters::default() };
    let mut wrong = Vec::new();
    for value in parameter_values(&eds, of_file.unwrap_or(node).raw()) {
        match value {
            Ok((object, bytes)) => {
                parameters.values.insert(object, bytes);
            }
            Err(refusal) => wrong.push(format!("line {}: {refusal}", refusal.line)),
        }
    }
    if !wrong.is_empty() {
        return Err(wrong.join("; "));
    }
    if parameters.values.is_empty() && !eds.is_dcf() {
        return Err("it is a data sheet without values (no ParameterValue in it): a DCF has some".into());
    }
    let known = |number: Option<u32>| number.filter(|number| *number != 0);
    parameters.identity = Identity {
        device_type: None,
        vendor_id: known(eds.device.vendor_number),
        product_code: known(eds.device.product_number),
        revision_number: known(eds.device.revision_number),
    };
    Ok(parameters)
}

fn concise(path: &Path, node: NodeId) -> Result<Parameters, String> {
    let length = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !length.is_file() || length.len() > LARGEST {
        return Err("it is no file of less than 1 MB".into());
    }
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    of_concise(&bytes, node)
}

/// The values of a concise DCF. What is written to an object more than once counts as the last write: a stream empties
/// mappings and switches PDOs off before it sets them up.
///
/// # Errors
/// What is wrong with the stream, and where.
pub fn of_concise(bytes: &[u8], node: NodeId) -> Result<Parameters, String> {
    let stream = Concise::parse(bytes).map_err(|error| error.to_string())?;
    let values = stream.entries().map(|entry| (entry.mux, entry.data.to_vec())).collect();
    Ok(Parameters { node: Some(node), values, ..Parameters::default() })
}

/// A stream of these writes in this order.
pub fn to_concise(writes: &[(canopen::Mux, Vec<u8>)]) -> Vec<u8> {
    let mut stream = Vec::new();
    emit(writes.iter().map(|(mux, data)| Entry { mux: *mux, data }), |bytes| stream.extend_from_slice(bytes));
    stream
}

/// Bytes in the order of the wire, as pairs of digits; `nothing` for none.
pub fn hexadecimal(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "nothing".to_owned();
    }
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

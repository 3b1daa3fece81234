//! Parameters of a node in files: a DCF (CiA 306-1, [`of_dcf`]), TOML for people ([`sheet`]), a concise DCF (CiA 302-3), and the journal
//! of a transaction ([`journal`]).
//!
//! In: a file, and where names are to be looked up the model. Out: [`Parameters`], or everything that is wrong with the file.
//! Nothing of a file that is not whole is given out.

mod dcf;
pub mod journal;
pub mod sheet;

use std::path::Path;

use canopen::NodeId;
use canopen::concise::{Concise, Entry, emit};
use devices::Description;
use master::parameters::Parameters;

use words::data_sheet;
use words::document::{LARGEST, read_bytes, read_text};

pub use dcf::{of_dcf, to_dcf};

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
    /// It has no known extension.
    pub fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        Ok(match extension.as_str() {
            "dcf" | "eds" => Self::Dcf,
            "toml" => Self::Toml,
            "bin" | "cdcf" => Self::Concise,
            _ => {
                return Err(format!(
                    "'{}' has an unknown extension; expected .dcf (CiA 306), .toml, or .bin (concise DCF)",
                    path.display()
                ));
            }
        })
    }
}

/// Why a file gave no parameters, for people.
#[derive(Debug)]
pub enum Unread {
    /// Its name does not end as that of such a file.
    Name(String),
    /// It cannot be read.
    File(String),
    /// Everything that is wrong with it.
    Content(String),
}

/// Reads the parameters in a file. `model` gives names and types, `node` is what the file is read for where it does not
/// say a node itself.
///
/// # Errors
/// [`Unread`].
pub fn read(path: &Path, model: Option<&'static Description>, node: NodeId) -> Result<Parameters, Unread> {
    let read = match Form::of(path).map_err(Unread::Name)? {
        Form::Dcf => return dcf(path, node),
        Form::Toml => {
            let text = read_text(path).map_err(Unread::File)?;
            sheet::parse(&text, model).map_err(|bad| bad.named(path.display().to_string()).to_string())
        }
        Form::Concise => of_concise(&read_bytes(path, LARGEST).map_err(Unread::File)?, node),
    };
    read.map_err(Unread::Content)
}

fn dcf(path: &Path, node: NodeId) -> Result<Parameters, Unread> {
    let reading = data_sheet::reading(path).map_err(|unread| match unread {
        data_sheet::Unread::File(error) => Unread::File(error),
        data_sheet::Unread::Refused(refusal) => Unread::Content(dcf::refused(&refusal)),
    })?;
    dcf::of_reading(reading, node, &path.display().to_string()).map_err(Unread::Content)
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

//! The errors that a node remembers (1003h), and what they mean.

use canopen::Mux;
use canopen::emcy::EmcyErrorCode;
use canopen::object::PRE_DEFINED_ERROR_FIELD;
use devices::Description;
use devices::faults::FaultRow;
use master::{Drive, Error};
use serde::Serialize;

/// An error that a node remembers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RememberedError {
    /// The error code, as an EMCY has it.
    pub code: u16,
    /// The maker's two bytes, in hexadecimal.
    pub manufacturer: String,
    /// What it means: the model's fault, else the class of CiA 301.
    pub name: String,
    /// What to do, where the model says it.
    pub remedy: Option<&'static str>,
}

impl RememberedError {
    /// The low 16 bits are the error code, the high ones the maker's.
    fn new(raw: u32, model: Option<&'static Description>) -> Self {
        let code = EmcyErrorCode(raw as u16);
        let fault = model.and_then(|model| model.fault_reported_by(code));
        let manufacturer = hexadecimal(&((raw >> 16) as u16).to_le_bytes());
        Self { code: code.0, manufacturer, name: meaning(code, fault), remedy: fault.map(|fault| fault.remedy) }
    }
}

/// The errors that a node remembers, newest first.
///
/// # Errors
/// Those of SDO: a node without 1003h answers that there is no such object.
pub async fn remembered(drive: &Drive) -> Result<Vec<RememberedError>, Error> {
    let count = drive.node().upload(PRE_DEFINED_ERROR_FIELD).await?;
    let mut errors = Vec::new();
    for sub_index in 1..=count.raw().min(254) as u8 {
        match drive.node().upload(Mux::new(PRE_DEFINED_ERROR_FIELD.index, sub_index)).await {
            Ok(value) => errors.push(RememberedError::new(value.raw(), drive.description())),
            // Devices that count their places, and not the errors in them, refuse the empty ones.
            Err(Error::Aborted { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    // An empty place holds 0, by some devices.
    errors.retain(|error| error.code != 0 || error.manufacturer != "00 00");
    Ok(errors)
}

/// Bytes as people read them: `0A FF`.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

/// What an error code means: the model's fault, else the class of CiA 301.
pub fn meaning(code: EmcyErrorCode, fault: Option<&FaultRow>) -> String {
    match fault {
        Some(fault) => fault.name.to_owned(),
        // `2110h (current, CANopen device input side)`: the words are wanted.
        None => {
            let text = code.to_string();
            text.split_once(" (").map_or(text.clone(), |(_, words)| words.trim_end_matches(')').to_owned())
        }
    }
}

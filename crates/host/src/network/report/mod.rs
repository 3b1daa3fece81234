//! What is worth keeping about a node as it is now: its identity, what differs from delivery, PDOs, limits, guard, faults, and
//! records of runs, as one report. It only reads. The command line, the studio and Python make the same page of it
//! ([`NodeReport::to_html`]).

mod capture;
mod html;
#[cfg(test)]
mod tests;
mod tuning;

use std::collections::BTreeMap;

use canopen::object::{MANUFACTURER_DEVICE_NAME, MANUFACTURER_SOFTWARE_VERSION, SERIAL_NUMBER};
use canopen::{AbortCode, Mux};
use cia402::PowerState;
use devices::Description;
use devices::row::is_parameter;
use master::drive::{DriveState, HostLoss};
use master::parameters::{Parameters, default_of, diff};
use master::{Drive, Error};
use serde::Serialize;

use super::Progress;
use super::faults::{RememberedError, remembered};
use super::params::{DiffRow, Refused, Shown, back_up, name};
use super::pdos::PdoSetup;
use crate::test_motion::Figures;
use words::failure::Failure;

pub use tuning::{TunedGain, TunedLoop, Tuning};

/// Manufacturer hardware version (CiA 301, 7.5.2.9).
const MANUFACTURER_HARDWARE_VERSION: Mux = Mux::new(0x1009, 0);

/// Parts of the names of parameters that hold a drive back: CiA 402-2 calls them so (607Dh, 607Fh, 6080h, 6072h, 6073h, 60C5h,
/// 60C6h, 60E0h, 60E1h, 6065h), and makers do.
const LIMITING: [&str; 5] = ["limit", "max", "protection", "following_error", "position_range"];

/// What is worth keeping about a node.
#[derive(Debug, Serialize)]
pub struct NodeReport {
    /// Its node-ID.
    pub node: u8,
    /// Its model.
    pub model: &'static str,
    /// Its model in words.
    pub title: &'static str,
    /// The manual that says how it is delivered.
    pub manual: &'static str,
    /// When the report was made, and by whom.
    #[serde(flatten)]
    pub made: Made,
    /// Who it is, by its own objects.
    pub identity: Vec<Fact>,
    /// How it was then: state, mode, supply and so on.
    pub state: Vec<Fact>,
    /// Parameters that were compared with delivery.
    pub compared: usize,
    /// Parameters of which the manual does not say how they are delivered.
    pub not_compared: usize,
    /// In what it differs from delivery: `first` is the node's, `second` as delivered.
    pub differences: Vec<DiffRow>,
    /// Parameters that it refused to show.
    pub refused: Vec<Refused>,
    /// Its PDOs.
    pub pdos: Vec<PdoSetup>,
    /// What holds it back: limits and protections.
    pub limits: Vec<LimitRow>,
    /// What it does when the program that moves it dies.
    pub guard: Guard,
    /// The fault that it shows now; `None` if it was seen to have none, or `fault_not_known`.
    pub fault: Option<PresentFault>,
    /// Why it was not seen whether it has a fault.
    pub fault_not_known: Option<String>,
    /// The errors that it remembers (1003h), newest first; `None` if it has no such object, or `remembered_not_known`.
    pub remembered: Option<Vec<RememberedError>>,
    /// Why the errors that it remembers were not seen.
    pub remembered_not_known: Option<String>,
    /// Records of runs.
    pub captures: Vec<ReportedCapture>,
    /// Tunings, before and after.
    pub tunings: Vec<Tuning>,
}

/// When a report was made, and by whom: what the program that makes it knows.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Made {
    /// Date and time, with the zone.
    pub at: String,
    /// Who made it.
    pub by: Option<String>,
    /// The bus, as it was named.
    pub bus: String,
}

/// A name and what is said of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// What it is.
    pub name: String,
    /// For people, with its unit.
    pub value: String,
}

/// A parameter that holds a drive back.
#[derive(Debug, Serialize)]
pub struct LimitRow {
    /// The object, such as `6080h:00`.
    pub object: String,
    /// Its name.
    pub name: &'static str,
    /// What it has.
    pub value: Shown,
}

/// What a drive does when the program that moves it dies.
#[derive(Debug, Serialize)]
pub struct Guard {
    /// It stops by itself, if the program guards it; `None` where it refuses to show that.
    pub stops: Option<bool>,
    /// In words, with the object that sets it.
    pub text: String,
}

/// A fault that a drive shows.
#[derive(Debug, Serialize)]
pub struct PresentFault {
    /// In the drive's own codes; `None` where its state alone shows a fault.
    pub code: Option<u16>,
    /// What it may be.
    pub names: Vec<&'static str>,
    /// What to do.
    pub remedies: Vec<&'static str>,
}

/// A record of a run.
#[derive(Clone, Debug, Serialize)]
pub struct ReportedCapture {
    /// The file.
    pub file: String,
    /// What it has of this node.
    pub figures: Vec<CaptureFigure>,
    /// Figures of merit: of its steps, of what it followed, and of its current; `None` where it shows none of them.
    pub merit: Option<Figures>,
    /// The end of it is missing: it ends earlier than the run.
    #[serde(rename = "cut_off")]
    pub is_cut_off: bool,
    /// The picture of it, as SVG.
    #[serde(skip)]
    pub picture: String,
}

/// A signal of a record in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaptureFigure {
    /// The signal: `Velocity, actual`.
    pub name: String,
    /// Its unit; empty for none.
    pub unit: String,
    /// The least value.
    pub min: f64,
    /// The mean of the samples.
    pub mean: f64,
    /// The most.
    pub max: f64,
}

impl PresentFault {
    /// Its code and what it may be: `0004h over-current, or short circuit`.
    pub fn text(&self) -> String {
        match self.code {
            Some(code) => format!("{code:04X}h {}", self.names.join(", or ")).trim_end().to_owned(),
            None => "the state is a fault, and the drive shows no code of it".to_owned(),
        }
    }
}

impl NodeReport {
    /// Reads all of it, without captures.
    ///
    /// # Errors
    /// The model is not known; silence.
    pub async fn read(progress: &impl Progress, drive: &Drive, made: Made) -> Result<Self, Failure> {
        let (backup, parameters, model) = back_up(progress, drive).await?;
        progress.show(format!("node {}: reading identity, PDOs and faults", backup.node));
        let (compared, differences) = from_delivery(model, drive, &parameters);
        let pdos = drive.pdos().await?;
        let pdos = pdos.iter().map(|(config, cob_id)| PdoSetup::new(Some(model), config, *cob_id, &[])).collect();
        let (state, state_refused) = seen(drive.state().await)?;
        let (fault, fault_not_known) = present_fault(state.as_ref(), state_refused);
        let (remembered, remembered_not_known) = of_memory(remembered(drive).await)?;
        Ok(Self {
            node: backup.node,
            model: model.name,
            title: model.title,
            manual: model.manual,
            made,
            identity: identity(drive, model, &parameters).await?,
            fault,
            fault_not_known,
            state: state.as_ref().map(facts_of).unwrap_or_default(),
            compared,
            not_compared: parameters.values.len() - compared,
            differences,
            refused: backup.refused,
            pdos,
            limits: limits(model, &parameters),
            guard: guard(answered(drive.host_loss_if_guarded().await)?),
            remembered,
            remembered_not_known,
            captures: Vec::new(),
            tunings: Vec::new(),
        })
    }
}

/// What a node refuses is `None`; only silence is an error.
fn answered<T>(read: Result<T, Error>) -> Result<Option<T>, Failure> {
    seen(read).map(|(value, _)| value)
}

/// What was read, or why a node refuses it; only silence is an error.
fn seen<T>(read: Result<T, Error>) -> Result<(Option<T>, Option<String>), Failure> {
    match read {
        Ok(value) => Ok((Some(value), None)),
        Err(error @ (Error::Aborted { .. } | Error::UnknownModel { .. })) => Ok((None, Some(error.to_string()))),
        Err(error) => Err(error.into()),
    }
}

/// The errors that it remembers, or why they were not seen. A node without the object remembers none, which is known.
fn of_memory(
    read: Result<Vec<RememberedError>, Error>,
) -> Result<(Option<Vec<RememberedError>>, Option<String>), Failure> {
    match read {
        Err(Error::Aborted { code: AbortCode::NO_SUCH_OBJECT, .. }) => Ok((None, None)),
        read => seen(read),
    }
}

/// How many parameters have a value of delivery, and in which the node differs from it.
fn from_delivery(model: &'static Description, drive: &Drive, parameters: &Parameters) -> (usize, Vec<DiffRow>) {
    let node = drive.node().id();
    let delivered: BTreeMap<Mux, Vec<u8>> =
        parameters.values.keys().filter_map(|object| Some((*object, default_of(model.row(*object)?, node)?))).collect();
    let has = parameters.values.iter().filter(|(object, _)| delivered.contains_key(object));
    let has: BTreeMap<Mux, Vec<u8>> = has.map(|(object, value)| (*object, value.clone())).collect();
    let rows = diff(&has, &delivered).iter().map(|found| DiffRow::new(Some(model), found)).collect();
    (delivered.len(), rows)
}

async fn identity(drive: &Drive, model: &Description, parameters: &Parameters) -> Result<Vec<Fact>, Failure> {
    let mut facts = Vec::new();
    if let Some(guess) = drive.guess().filter(|guess| guess.evidence().is_some()) {
        facts.push(fact("Model not certain", format!("{guess}, which is assumed")));
    }
    let known = &parameters.identity;
    let numbers = [
        ("Device type 1000h", known.device_type),
        ("Vendor-ID", known.vendor_id),
        ("Product code", known.product_code),
        ("Revision", known.revision_number),
        ("Serial number", answered(drive.node().read::<u32>(SERIAL_NUMBER).await)?),
    ];
    for (name, number) in numbers {
        facts.extend(number.map(|number| fact(name, format!("{number:08X}h"))));
    }
    for (name, object) in [
        ("Device name", MANUFACTURER_DEVICE_NAME),
        ("Hardware version", MANUFACTURER_HARDWARE_VERSION),
        ("Software version", MANUFACTURER_SOFTWARE_VERSION),
    ] {
        // Who has an object that the model does not have is another device.
        if model.row(object).is_none() {
            continue;
        }
        if let Some(text) = answered(drive.node().upload(object).await)? {
            facts.push(fact(name, Shown::new(drive.description(), object, text.as_bytes()).text));
        }
    }
    Ok(facts)
}

fn fact(name: &str, value: String) -> Fact {
    Fact { name: name.to_owned(), value }
}

fn facts_of(state: &DriveState) -> Vec<Fact> {
    let facts = [
        ("State", state.power.map(|power| power.name().to_owned())),
        ("Mode of operation", state.mode.map(|mode| mode.to_string())),
        ("NMT state", state.nmt.map(|nmt| nmt.to_string())),
        ("Position", state.angle.map(|angle| format!("{:.1}°", angle.0))),
        ("Speed", state.velocity.map(|speed| format!("{:.1} r/min", speed.0))),
        ("Motor current", state.current.map(|current| format!("{:.2} A", current.0))),
        ("Supply", state.supply.map(|supply| format!("{:.1} V", supply.0))),
        ("Motor temperature", state.motor_temperature.map(|heat| format!("{:.0} °C", heat.0))),
        ("Power stage temperature", state.driver_temperature.map(|heat| format!("{:.0} °C", heat.0))),
    ];
    facts.into_iter().filter_map(|(name, value)| Some(fact(name, value?))).collect()
}

/// The fault that is shown by code or state, or why it is not known whether there is one.
fn present_fault(state: Option<&DriveState>, refused: Option<String>) -> (Option<PresentFault>, Option<String>) {
    let Some(state) = state else { return (None, refused) };
    let code = state.fault_code.filter(|code| *code != 0);
    if code.is_some() || matches!(state.power, Some(PowerState::Fault | PowerState::FaultReactionActive)) {
        let (names, remedies) = state.faults.iter().map(|fault| (fault.name, fault.remedy)).unzip();
        return (Some(PresentFault { code, names, remedies }), None);
    }
    // A code of 0 was seen, where there is one.
    (None, state.fault_code.is_none().then(|| "the drive refuses to show its fault code".to_owned()))
}

fn limits(model: &'static Description, parameters: &Parameters) -> Vec<LimitRow> {
    let limiting = |name: &str| LIMITING.iter().any(|part| name.to_ascii_lowercase().contains(part));
    let rows = parameters.values.iter().filter_map(|(object, value)| {
        let name = name(Some(model), *object)?;
        let is_limit = limiting(name) && model.row(*object).is_some_and(is_parameter);
        is_limit.then(|| LimitRow { object: object.to_string(), name, value: Shown::new(Some(model), *object, value) })
    });
    rows.collect()
}

fn guard(loss: Option<HostLoss>) -> Guard {
    match loss {
        Some(loss) => Guard { stops: Some(loss.stops_after().is_some()), text: loss.to_string() },
        None => Guard { stops: None, text: "the device refuses to show the object that sets its watch".into() },
    }
}

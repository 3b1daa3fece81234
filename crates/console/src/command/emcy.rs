//! Errors as they arrive (EMCY; CiA 301, 7.2.7), and those that a node remembers (1003h).

use canopen::emcy::Emcy;
use canopen::{AbortCode, NodeId};
use devices::faults::FaultRow;
use host::network::faults::{RememberedError, hexadecimal, meaning, remembered};
use master::Error;
use plot::Paint;
use serde::Serialize;
use words::node::node;

use crate::context::Context;
use crate::failure::Failure;

/// Show the errors that a node remembers (1003h), newest first
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive --bus can0 emcy show 4")]
pub struct ShowErrors {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

/// An error, as it arrived or is remembered.
#[derive(Debug, Serialize)]
pub struct ErrorEntry {
    /// When it came, in s since the command began; `null` of one that is remembered.
    t: Option<f64>,
    node: u8,
    /// The error code.
    code: u16,
    /// The error register; `null` of one that is remembered.
    error_register: Option<u8>,
    /// The five bytes of the maker, in hexadecimal; of one that is remembered two.
    manufacturer: String,
    /// What it means: the model's fault, else the class of CiA 301.
    name: String,
    remedy: Option<&'static str>,
    #[serde(skip)]
    stamp: String,
}

/// The errors of a node.
#[derive(Debug, Serialize)]
pub struct RememberedErrors {
    node: u8,
    errors: Vec<ErrorEntry>,
}

impl ShowErrors {
    /// Asks the node.
    ///
    /// # Errors
    /// It has no such field; those of SDO.
    pub async fn run(&self, context: &Context) -> Result<RememberedErrors, Failure> {
        let drive = context.drive(self.node).await?;
        let errors = remembered(&drive).await.map_err(|error| self.without_field(error))?;
        let errors = errors.into_iter().map(|error| ErrorEntry::remembered(self.node, error)).collect();
        Ok(RememberedErrors { node: self.node.raw(), errors })
    }

    fn without_field(&self, error: Error) -> Failure {
        let absent = error.abort() == Some(AbortCode::NO_SUCH_OBJECT);
        let failure = Failure::from(error);
        if !absent {
            return failure;
        }
        failure
            .because("the node has no 1003h, so that it remembers no errors")
            .next(format!("ferrodrive state {} shows the present fault", self.node))
    }
}

impl ErrorEntry {
    /// One that arrived, with the time before its line.
    pub fn message(t: f64, node: NodeId, message: &Emcy, fault: Option<&'static FaultRow>, stamp: String) -> Self {
        Self {
            t: Some(t),
            node: node.raw(),
            code: message.code.0,
            error_register: Some(message.error_register),
            manufacturer: hexadecimal(&message.manufacturer),
            name: meaning(message.code, fault),
            remedy: fault.map(|fault| fault.remedy),
            stamp,
        }
    }

    fn remembered(node: NodeId, error: RememberedError) -> Self {
        let RememberedError { code, manufacturer, name, remedy } = error;
        Self { t: None, node: node.raw(), code, error_register: None, manufacturer, name, remedy, stamp: String::new() }
    }
}

impl ErrorEntry {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let Self { node, code, name, manufacturer, .. } = self;
        let time = if self.stamp.is_empty() { String::new() } else { format!("{} ", paint.dim(&self.stamp)) };
        let register = self.error_register.map(|register| format!(", error register {register:02X}h"));
        let name = paint.bad(&format!("{code:04X}h {name}"));
        let remedy = self.remedy.map(|remedy| format!("\n  remedy  {remedy}")).unwrap_or_default();
        format!("{time}node {node}: {name}{}, manufacturer {manufacturer}{remedy}", register.unwrap_or_default())
    }
}

impl RememberedErrors {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        if self.errors.is_empty() {
            return format!("node {}: no error remembered", self.node);
        }
        self.errors.iter().map(|error| error.text(paint)).collect::<Vec<_>>().join("\n")
    }
}

//! `ferrodrive emcy`: emergency messages as they come (CiA 301, clause 7.2.7), and those that a node remembers (1003h).

use std::time::Duration;

use can::BusFrame;
use canopen::emcy::Emcy as Message;
use canopen::{AbortCode, NodeId};
use devices::faults::FaultRow;
use host::network::faults::{RememberedError, hexadecimal, meaning, remembered};
use master::Error;
use master::decode::Decoded;
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::frames::stamp::{Stamps, TimeForm};
use crate::output::{Format, Report};
use plot::Paint;
use words::node::{Nodes, node, nodes};
use words::time::some_time;

/// Show emergency messages as they arrive, or the errors that a node remembers
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 emcy watch\n  \
    ferrodrive emcy watch 4 --for 10s\n  ferrodrive --bus can0 emcy show 4")]
pub(crate) struct Emcy {
    #[command(subcommand)]
    what: EmcyCommand,
}

#[derive(Debug, clap::Subcommand)]
enum EmcyCommand {
    /// Show emergency messages as they arrive, with fault and remedy
    Watch(WatchEmcy),
    /// Show the errors that a node remembers (1003h), newest first
    Show(Show),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 emcy watch\n  ferrodrive --bus can0 emcy watch 4 --for 10s")]
struct WatchEmcy {
    /// Node-ID, or all
    #[arg(value_name = "NODE|all", value_parser = nodes, default_value = "all")]
    nodes: Nodes,
    /// End after this time (default on an embedded virtual bus: 1s)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    /// Form of the time before each line
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    time: TimeForm,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  ferrodrive --bus can0 emcy show 4")]
struct Show {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
}

/// Nothing happens on an embedded bus by itself.
const EMBEDDED_DURATION: Duration = Duration::from_secs(1);

/// An error, as it arrived or is remembered.
#[derive(Debug, Serialize)]
struct ErrorEntry {
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
struct Remembered {
    node: u8,
    errors: Vec<ErrorEntry>,
}

impl Emcy {
    /// Shows them.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        match &self.what {
            EmcyCommand::Watch(watch) => watch.run(context, format).await,
            EmcyCommand::Show(show) => format.print(&show.run(context).await?).map_err(Failure::of_stdout),
        }
    }
}

impl WatchEmcy {
    async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let mut decoder = context.decoder();
        let mut stamps = Stamps::new(self.time, context.traffic.unix_zero());
        let follow = async {
            loop {
                let BusFrame { at, frame, .. } = context.traffic.next().await;
                let Decoded::Emcy(node, message, fault) = decoder.decode(&frame) else { continue };
                if self.nodes == Nodes::All || self.nodes == Nodes::One(node) {
                    let entry = ErrorEntry::message(at.as_secs_f64(), node, &message, fault, stamps.text(at));
                    format.print(&entry).map_err(Failure::of_stdout)?;
                }
            }
        };
        context.traffic.listen();
        context.progress.show("listening; Ctrl-C ends it");
        context.listen_for(self.duration, EMBEDDED_DURATION, follow).await
    }
}

impl Show {
    async fn run(&self, context: &Context) -> Result<Remembered, Failure> {
        let drive = context.drive(self.node).await?;
        let errors = remembered(&drive).await.map_err(|error| self.without_field(error))?;
        let errors = errors.into_iter().map(|error| ErrorEntry::remembered(self.node, error)).collect();
        Ok(Remembered { node: self.node.raw(), errors })
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
    fn message(t: f64, node: NodeId, message: &Message, fault: Option<&'static FaultRow>, stamp: String) -> Self {
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

impl Report for ErrorEntry {
    fn text(&self, paint: Paint) -> String {
        let Self { node, code, name, manufacturer, .. } = self;
        let time = if self.stamp.is_empty() { String::new() } else { format!("{} ", paint.dim(&self.stamp)) };
        let register = self.error_register.map(|register| format!(", error register {register:02X}h"));
        let name = paint.bad(&format!("{code:04X}h {name}"));
        let remedy = self.remedy.map(|remedy| format!("\n  remedy  {remedy}")).unwrap_or_default();
        format!("{time}node {node}: {name}{}, manufacturer {manufacturer}{remedy}", register.unwrap_or_default())
    }
}

impl Report for Remembered {
    fn text(&self, paint: Paint) -> String {
        if self.errors.is_empty() {
            return format!("node {}: no error remembered", self.node);
        }
        self.errors.iter().map(|error| error.text(paint)).collect::<Vec<_>>().join("\n")
    }
}

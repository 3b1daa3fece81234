//! `ferrodrive pdo`: how the PDOs of a node are set up (CiA 301, clauses 7.5.2.35 to 7.5.2.38), and what they carry.

mod setup;

use std::time::Duration;

use can::BusFrame;
use canopen::pdo::Direction;
use canopen::{NmtState, NodeId};
use master::Drive;
use master::decode::{Decoded, DecodedValue};
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::frames::stamp::{Stamps, TimeForm};
use crate::output::{Format, Report};
use console::command::pdo::ShowPdos;
use plot::Paint;
use words::decode::{self, decode};
use words::node::node;
use words::time::some_time;

/// Show, watch and configure the PDOs of a node
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive pdo show 4\n  \
    ferrodrive --bus can0 pdo show\n  \
    ferrodrive --bus can0 pdo watch 4 --time delta\n  \
    ferrodrive pdo plan 4 tpdo1=statusword,position_actual_value --type 1\n  \
    ferrodrive pdo apply 4 tpdo1=statusword,6064 tpdo2=off --type 1 --save")]
pub(crate) struct Pdo {
    #[command(subcommand)]
    what: PdoCommand,
}

#[derive(Debug, clap::Subcommand)]
enum PdoCommand {
    Show(ShowPdos),
    /// Show the values in the PDOs of a node as they arrive, by its own mapping
    Watch(WatchPdo),
    Plan(setup::PlanPdos),
    Apply(setup::ApplyPdos),
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 pdo watch 4\n  \
    ferrodrive --bus can0 pdo watch 4 --for 10s --time delta")]
struct WatchPdo {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// End after this time (default on an embedded virtual bus: 1s)
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    /// Form of the time before each line
    #[arg(long, value_name = "FORM", value_enum, default_value_t)]
    time: TimeForm,
}

/// Nothing happens on an embedded bus by itself.
const EMBEDDED_DURATION: Duration = Duration::from_secs(1);

/// A PDO that came.
#[derive(Debug, Serialize)]
struct PdoLine {
    t: f64,
    node: u8,
    pdo: String,
    bytes: String,
    values: Vec<MappedField>,
    #[serde(skip)]
    stamp: String,
    #[serde(skip)]
    remark: Option<String>,
}

#[derive(Debug, Serialize)]
struct MappedField {
    object: String,
    name: Option<&'static str>,
    #[serde(flatten)]
    value: decode::Decoded,
}

impl Pdo {
    /// Shows them.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        match &self.what {
            PdoCommand::Show(show) => format.print(&show.run(context).await?).map_err(Failure::of_stdout),
            PdoCommand::Watch(watch) => watch.run(context, format).await,
            PdoCommand::Plan(plan) => format.print(&plan.run(context).await?).map_err(Failure::of_stdout),
            PdoCommand::Apply(apply) => format.print(&apply.run(context).await?).map_err(Failure::of_stdout),
        }
    }
}

impl WatchPdo {
    async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let drive = context.drive(self.node).await?;
        let mut decoder = context.decoder();
        if let Some(model) = drive.description() {
            decoder.set_model(self.node, model);
        }
        let mut sends = 0;
        for (config, cob_id) in drive.pdos().await? {
            if let Some(id) = cob_id.can_id().as_standard().filter(|_| cob_id.is_valid()) {
                sends += usize::from(config.pdo.direction == Direction::Tpdo && !config.is_empty());
                decoder.set_pdo(self.node, &config, id);
            }
        }
        self.note_why_silent(context, &drive, sends);
        context.traffic.listen();
        context.progress.show("listening; Ctrl-C ends it");
        let mut stamps = Stamps::new(self.time, context.traffic.unix_zero());
        let follow = async {
            loop {
                let BusFrame { at, frame, .. } = context.traffic.next().await;
                let Decoded::Pdo(pdo) = decoder.decode(&frame) else { continue };
                if pdo.node == self.node {
                    let line = PdoLine::new(&pdo, at.as_secs_f64(), stamps.text(at));
                    format.print(&line).map_err(Failure::of_stdout)?;
                }
            }
        };
        context.listen_for(self.duration, EMBEDDED_DURATION, follow).await
    }

    /// What keeps its PDOs away, as far as it is known.
    fn note_why_silent(&self, context: &Context, drive: &Drive, sends: usize) {
        let (node, state) = (self.node, context.network.facts(self.node).probable_state(drive.description()));
        if sends == 0 {
            context.note(&format!("node {node} has no valid TPDO with something mapped: ferrodrive pdo show {node}"));
        }
        if let Some(state @ (NmtState::PreOperational | NmtState::Stopped)) = state {
            context.note(&format!("node {node} is {state} and sends no PDOs: ferrodrive nmt {node} start"));
        }
    }
}

impl PdoLine {
    fn new(pdo: &master::decode::Pdo, t: f64, stamp: String) -> Self {
        let model = pdo.model();
        let values = pdo.fields.iter().map(|(record, raw)| {
            let bytes = raw.to_le_bytes();
            let length = usize::from(record.bits).div_ceil(8).min(bytes.len());
            let row = model.map_or_else(|| master::decode::common_row(record.mux), |model| model.row(record.mux));
            MappedField {
                object: record.mux.to_string(),
                name: DecodedValue::new(record.mux, &bytes[..length], model).name(),
                value: decode(model, row, &bytes[..length]),
            }
        });
        let mapped = pdo.mapped_bytes;
        let remark = match mapped {
            None => Some("mapping not known".into()),
            Some(mapped) if mapped > pdo.bytes.len() => {
                Some(format!("too short: {} of {mapped} bytes", pdo.bytes.len()))
            }
            Some(_) => None,
        };
        Self {
            t,
            node: pdo.node.raw(),
            pdo: pdo.pdo.to_string(),
            bytes: pdo.bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "),
            values: values.collect(),
            stamp,
            remark,
        }
    }
}

impl Report for PdoLine {
    fn text(&self, paint: Paint) -> String {
        let values = self.values.iter().map(|field| {
            let name = field.name.unwrap_or(&field.object);
            format!("{name} = {}", field.value.text(paint))
        });
        let what = match &self.remark {
            Some(remark) => format!("{} ({remark})", self.bytes),
            None => values.collect::<Vec<_>>().join(", "),
        };
        format!("{} {}  {what}", paint.dim(&self.stamp), self.pdo)
    }
}

//! `ferrodrive emcy`: emergency messages as they come (CiA 301, clause 7.2.7), and those that a node remembers (1003h).

use std::time::Duration;

use can::BusFrame;
use console::command::emcy::{ErrorEntry, ShowErrors};
use master::decode::Decoded;

use crate::context::Context;
use crate::failure::Failure;
use crate::frames::stamp::{Stamps, TimeForm};
use crate::output::Format;
use words::node::{Nodes, nodes};
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
    Show(ShowErrors),
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

/// Nothing happens on an embedded bus by itself.
const EMBEDDED_DURATION: Duration = Duration::from_secs(1);

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

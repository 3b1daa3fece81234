//! `ferrodrive explain`: why a drive does not move, why a PDO is silent, what is missing to reach Operation enabled.

use std::time::Duration;

use can::BusFrame;
use canopen::NodeId;
use master::Drive;
use master::explain::Overheard;
use master::units::parse_duration;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use host::network::explain::ExplainReport;
use plot::Paint;
use plot::Table;
use words::node::node;

/// Explain why a drive does not move, and why its PDOs are silent
///
/// Listens to the bus first, then reads objects of the drive; writes nothing, so that it can be used on a running
/// machine. Each finding states what a moving drive has, what this one has, what follows, and what to do. A cause keeps
/// the drive from moving; a warning does not, or not yet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive explain 4\n  \
    ferrodrive --bus can0 explain 4 --watch 5s\n  ferrodrive --bus can0 explain 4 --json")]
pub(crate) struct Explain {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// How long to listen first: longer than the longest period on the bus
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "1500ms")]
    watch: Duration,
}

impl Explain {
    /// Listens, reads, concludes.
    pub(crate) async fn run(&self, context: &Context) -> Result<ExplainReport, Failure> {
        let heard = self.listen(context).await;
        context.progress.show(format!("node {}: reading its objects", self.node));
        let drive = match context.drive(self.node).await {
            Ok(drive) => drive,
            // Silence is what has to be explained; the frames are still evidence.
            Err(failure) if failure.kind == "no_answer" => Drive::of_unknown_model(context.node(self.node)),
            Err(failure) => return Err(failure),
        };
        Ok(ExplainReport::from(drive.explain(&heard).await))
    }

    /// What others send; nothing is sent meanwhile.
    async fn listen(&self, context: &Context) -> Overheard {
        let network = &context.network;
        let mut heard = Overheard::from(network.now());
        context.traffic.listen();
        context.progress.show(format!("listening for {} ms", self.watch.as_millis()));
        let listening = async {
            loop {
                let BusFrame { at, frame, .. } = context.traffic.next().await;
                heard.note(&frame, at);
            }
        };
        tokio::select! {
            () = listening => {}
            () = network.sleep(self.watch) => {}
        }
        heard.until(network.now());
        heard
    }
}

impl Report for ExplainReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = vec![self.headline()];
        if self.causes == 0 {
            lines.push("Nothing found that keeps it from moving.".to_owned());
        }
        for row in &self.findings {
            lines.push(String::new());
            lines.push(paint.strong(&format!("{} ({}, {})", row.weight, row.topic, row.rule)));
            for (name, words) in
                [("expected", &row.expected), ("found", &row.found), ("follows", &row.follows), ("do", &row.remedy)]
            {
                lines.push(format!("  {}  {words}", paint.dim(&format!("{name:8}"))));
            }
        }
        if !self.pdos.is_empty() {
            let mut table = Table::new(&["pdo", "id", "heard", "silent because"]);
            for row in &self.pdos {
                let id = if row.valid { format!("{:03X}h", row.id) } else { "off".into() };
                let why = row.silent.clone().unwrap_or_else(|| "-".into());
                table.row([row.pdo.clone(), id, row.heard.to_string(), why]);
            }
            lines.extend([String::new(), table.plain(paint)]);
        }
        lines.join("\n")
    }
}

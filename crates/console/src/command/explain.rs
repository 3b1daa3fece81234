//! `ferrodrive explain`: why a drive does not move, why a PDO is silent, what is missing to reach Operation enabled.

use std::time::Duration;

use canopen::NodeId;
use master::Drive;
use master::units::parse_duration;

use crate::context::Context;
use crate::failure::Failure;
use host::network::explain::{ExplainReport, ExplainRow};
use plot::Paint;
use plot::Table;
use serde::Serialize;
use words::node::node;

/// Explain why a drive does not move, and why its PDOs are silent
///
/// Listens to the bus first, then reads objects of the drive; writes nothing, so that it can be used on a running
/// machine. Each finding states what a moving drive has, what this one has, what follows, and what to do. A cause keeps
/// the drive from moving; a warning does not, or not yet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive explain 4\n  \
    ferrodrive --bus can0 explain 4 --watch 5s\n  ferrodrive --bus can0 explain 4 --json")]
pub struct Explain {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// How long to listen first: longer than the longest period on the bus
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "1500ms")]
    watch: Duration,
}

impl Explain {
    /// Listens, reads, concludes.
    pub async fn run(&self, context: &Context) -> Result<Explanation, Failure> {
        context.show(format!("listening for {} ms", self.watch.as_millis()));
        let heard = context.shell.overhear(self.watch).await;
        context.show(format!("node {}: reading its objects", self.node));
        let drive = match context.drive(self.node).await {
            Ok(drive) => drive,
            // Silence is what has to be explained; the frames are still evidence.
            Err(failure) if failure.kind == "no_answer" => Drive::of_unknown_model(context.node(self.node)),
            Err(failure) => return Err(failure),
        };
        let report = ExplainReport::from(drive.explain(&heard).await);
        Ok(Explanation { ok: !report.findings.iter().any(is_silence), report })
    }
}

/// What was found, and whether the node answered.
#[derive(Debug, Serialize)]
pub struct Explanation {
    ok: bool,
    #[serde(flatten)]
    report: ExplainReport,
}

impl Explanation {
    /// That the node did not answer: as any command that asks it fails, though this one says more of it.
    pub fn failure(&self) -> Option<Failure> {
        let silence = self.report.findings.iter().find(|row| is_silence(row))?;
        let node = self.report.node;
        let failure = Failure::new(format!("node {node} did not answer")).of_kind("no_answer").next(&silence.remedy);
        Some(NodeId::new(node).into_iter().fold(failure, Failure::at_node))
    }
}

fn is_silence(row: &ExplainRow) -> bool {
    row.rule == "no_answer"
}

/// What was found, as lines for people.
pub fn text(Explanation { report, .. }: &Explanation, paint: Paint) -> String {
    let mut lines = vec![report.headline()];
    if report.causes == 0 {
        lines.push("Nothing found that keeps it from moving.".to_owned());
    }
    for row in &report.findings {
        lines.push(String::new());
        lines.push(paint.strong(&format!("{} ({}, {})", row.weight, row.topic, row.rule)));
        for (name, words) in
            [("expected", &row.expected), ("found", &row.found), ("follows", &row.follows), ("do", &row.remedy)]
        {
            lines.push(format!("  {}  {words}", paint.dim(&format!("{name:8}"))));
        }
    }
    if !report.pdos.is_empty() {
        let mut table = Table::new(&["pdo", "id", "heard", "silent because"]);
        for row in &report.pdos {
            let id = if row.valid { format!("{:03X}h", row.id) } else { "off".into() };
            let why = row.silent.clone().unwrap_or_else(|| "-".into());
            table.row([row.pdo.clone(), id, row.heard.to_string(), why]);
        }
        lines.extend([String::new(), table.plain(paint)]);
    }
    lines.join("\n")
}

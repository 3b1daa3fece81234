//! `ferrodrive explain`: why a drive does not move, why a PDO is silent, what is missing to reach Operation enabled.

use std::time::Duration;

use canopen::NodeId;
use master::Drive;
use master::explain::{Explained, Finding, Overheard, PdoSeen, Weight};
use master::units::parse_duration;
use serde::Serialize;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use plot::Table;
use testbench::words::node::node;

/// Explain why a drive does not move, and why its PDOs are silent
///
/// Listens to the bus first, then reads what the drive says of itself; writes nothing, so that it may be asked of a running
/// machine. Each finding says what a moving drive has, what this one has, what follows, and what to do. A cause keeps the
/// drive from moving; a warning does not, or not yet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive explain 4\n  \
    ferrodrive --bus can0 explain 4 --watch 5s\n  ferrodrive --bus can0 explain 4 --json")]
pub(crate) struct Explain {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// How long to listen before: longer than the longest period of what is looked for
    #[arg(long, value_name = "TIME", value_parser = parse_duration, default_value = "1500ms")]
    watch: Duration,
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct ExplainReport {
    node: u8,
    model: Option<&'static str>,
    nmt: Option<String>,
    state: Option<&'static str>,
    mode: Option<i8>,
    velocity_rpm: Option<f64>,
    supply_v: Option<f64>,
    listened_s: f64,
    causes: usize,
    findings: Vec<Row>,
    pdos: Vec<PdoRow>,
}

#[derive(Debug, Serialize)]
struct Row {
    rule: &'static str,
    topic: &'static str,
    weight: &'static str,
    expected: String,
    found: String,
    follows: String,
    remedy: String,
}

#[derive(Debug, Serialize)]
struct PdoRow {
    pdo: String,
    id: u32,
    valid: bool,
    heard: u64,
    silent: Option<String>,
}

impl Explain {
    /// Listens, reads, concludes.
    pub(crate) async fn run(&self, context: &Context) -> Result<ExplainReport, Failure> {
        let heard = self.listen(context).await;
        context.progress.show(format!("node {}: reading what it says of itself", self.node));
        let drive = match context.drive(self.node).await {
            Ok(drive) => drive,
            // Silence is what is to be explained; the frames still tell something.
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
                let (at, frame) = context.traffic.next().await;
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

impl From<Explained> for ExplainReport {
    fn from(explained: Explained) -> Self {
        let causes = explained.findings.iter().filter(|finding| finding.weight == Weight::Cause).count();
        Self {
            node: explained.node.raw(),
            model: explained.model,
            nmt: explained.nmt.map(|state| state.to_string()),
            state: explained.power.map(cia402::PowerState::name),
            mode: explained.mode.map(|mode| mode.0),
            velocity_rpm: explained.speed_rpm,
            supply_v: explained.supply_v,
            listened_s: explained.listened.as_secs_f64(),
            causes,
            findings: explained.findings.into_iter().map(Row::from).collect(),
            pdos: explained.pdos.into_iter().map(PdoRow::from).collect(),
        }
    }
}

impl From<Finding> for Row {
    fn from(finding: Finding) -> Self {
        let Finding { rule, topic, weight, expected, found, follows, remedy } = finding;
        Self { rule, topic: topic.name(), weight: weight.name(), expected, found, follows, remedy }
    }
}

impl From<PdoSeen> for PdoRow {
    fn from(seen: PdoSeen) -> Self {
        Self { pdo: seen.pdo.to_string(), id: seen.id, valid: seen.valid, heard: seen.heard, silent: seen.silent }
    }
}

impl ExplainReport {
    /// `node 4 (zlac8030l): Operation enabled, mode 3, operational, 0.0 r/min, 48.0 V; listened 1.5 s`.
    fn headline(&self) -> String {
        let model = self.model.map_or_else(String::new, |model| format!(" ({model})"));
        let parts = [
            self.state.map(str::to_owned),
            self.mode.map(|mode| format!("mode {mode}")),
            self.nmt.clone(),
            self.velocity_rpm.map(|speed| format!("{speed:.1} r/min")),
            self.supply_v.map(|volts| format!("{volts:.1} V")),
        ];
        let parts: Vec<_> = parts.into_iter().flatten().collect();
        let said = if parts.is_empty() { "no answer".to_owned() } else { parts.join(", ") };
        format!("node {}{model}: {said}; listened {:.1} s", self.node, self.listened_s)
    }
}

impl Report for ExplainReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = vec![self.headline()];
        if self.causes == 0 {
            lines.push("Nothing was found that keeps it from moving.".to_owned());
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

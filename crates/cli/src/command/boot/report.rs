//! What `ferrodrive boot` prints.

use canopen::NodeId;
use master::boot::{self, BootPlan, ErrorStatus, Step, Unconfigured, Verdict};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use plot::Table;

/// What came of a boot-up.
#[derive(Debug, Serialize)]
pub(crate) struct BootReport {
    ok: bool,
    nodes: Vec<BootedNode>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct BootedNode {
    node: u8,
    /// What it was taken for.
    model: Option<&'static str>,
    mandatory: bool,
    /// The standard's error status (CiA 302-2), A to O; `null` for none.
    letter: Option<char>,
    /// What it means.
    meaning: Option<&'static str>,
    state: Option<String>,
    /// Objects of its configuration that have another value, of a node that was operational and was left as it is.
    unconfigured: Vec<String>,
    steps: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    step: &'static str,
    object: Option<String>,
    expected: String,
    found: String,
    verdict: &'static str,
    /// What to do.
    next: Option<&'static str>,
}

impl BootReport {
    pub(crate) fn new(plan: &BootPlan, report: &boot::BootReport, unconfigured: &[Unconfigured]) -> Self {
        let of_node = |node: NodeId| unconfigured.iter().filter(move |it| it.node == node).flat_map(|it| &it.objects);
        let nodes = report.nodes.iter().map(|node| BootedNode {
            node: node.node.raw(),
            model: plan.nodes.get(&node.node).and_then(|expected| expected.description).map(|model| model.name),
            mandatory: node.mandatory,
            letter: node.status.map(ErrorStatus::letter),
            meaning: node.status.map(ErrorStatus::meaning),
            state: node.state.map(|state| state.to_string()),
            unconfigured: of_node(node.node).map(ToString::to_string).collect(),
            steps: node.steps.iter().map(Row::new).collect(),
        });
        Self { ok: report.is_whole() && unconfigured.is_empty(), nodes: nodes.collect(), notes: report.notes.clone() }
    }

    /// Why the command fails, if it does: a mandatory node has, or one does not have what is planned for it.
    pub(crate) fn failure(&self) -> Option<Failure> {
        let what = match self.nodes.iter().any(|node| !node.unconfigured.is_empty()) {
            _ if self.ok => return None,
            true => "a node is not configured as the file says",
            false => "a mandatory node has not booted",
        };
        Some(Failure { told: true, ..Failure::new(what) })
    }
}

impl Row {
    fn new(step: &Step) -> Self {
        Self {
            step: step.kind.name(),
            object: step.object.map(|object| object.to_string()),
            expected: step.expected.to_string(),
            found: step.found.to_string(),
            verdict: match step.verdict {
                Verdict::Passed => "passed",
                Verdict::Noted => "noted",
                Verdict::LeftOperational => "left",
                Verdict::Failed(_) => "failed",
            },
            next: step.advice(),
        }
    }
}

impl Report for BootReport {
    fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["node", "step", "object", "expected", "got", "verdict"]);
        for node in &self.nodes {
            for step in &node.steps {
                let object = step.object.as_deref().unwrap_or("");
                let mark = if step.verdict == "passed" { "" } else { step.verdict };
                table.row([&node.node.to_string(), step.step, object, &step.expected, &step.found, mark]);
            }
        }
        let coloured = |_, column, cell: &str| (column == 5 && cell == "failed").then(|| paint.bad(cell));
        let mut text = table.text(paint, coloured);
        for node in &self.nodes {
            text.push_str(&format!("\nnode {}: {}", node.node, node.outcome(paint)));
            if !node.unconfigured.is_empty() {
                let what = format!("not configured: {} has another value than the file", shown(&node.unconfigured));
                text.push_str(&format!("\n  {}", paint.bad(&what)));
                text.push_str(&format!(
                    "\n  ferrodrive boot FILE --node {} --reset configures it: a motor that turns may stop at once, or go on",
                    node.node
                ));
            }
            for next in node.steps.iter().filter_map(|step| step.next) {
                text.push_str(&format!("\n  {next}"));
            }
        }
        for note in &self.notes {
            text.push_str(&format!("\n{note}"));
        }
        text
    }
}

/// The first of some objects, and how many more there are.
fn shown(objects: &[String]) -> String {
    let first = objects.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(", ");
    let more = objects.len().saturating_sub(SHOWN);
    if more == 0 { first } else { format!("{first} and {more} more") }
}

/// Objects that are named to people.
const SHOWN: usize = 4;

impl BootedNode {
    fn outcome(&self, paint: Paint) -> String {
        let state = self.state.as_ref().map(|state| format!("; it is {state}")).unwrap_or_default();
        match (self.letter, self.meaning) {
            (Some('L'), Some(meaning)) => format!("L: {meaning}{state}"),
            (Some(letter), Some(meaning)) => {
                let need = if self.mandatory { "" } else { " (not mandatory)" };
                format!("{}: {meaning}{need}", paint.bad(&letter.to_string()))
            }
            _ => format!("{}{state}", paint.good("booted")),
        }
    }
}

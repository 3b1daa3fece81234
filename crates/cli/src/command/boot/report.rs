//! What `ferrodrive boot` prints.

use master::boot::{self, BootPlan, ErrorStatus, Step, Verdict};
use serde::Serialize;

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
    pub(crate) fn new(plan: &BootPlan, report: &boot::BootReport) -> Self {
        let nodes = report.nodes.iter().map(|node| BootedNode {
            node: node.node.raw(),
            model: plan.nodes.get(&node.node).and_then(|expected| expected.description).map(|model| model.name),
            mandatory: node.mandatory,
            letter: node.status.map(ErrorStatus::letter),
            meaning: node.status.map(ErrorStatus::meaning),
            state: node.state.map(|state| state.to_string()),
            steps: node.steps.iter().map(Row::new).collect(),
        });
        Self { ok: report.is_whole(), nodes: nodes.collect(), notes: report.notes.clone() }
    }

    /// No mandatory node has failed.
    pub(crate) const fn is_whole(&self) -> bool {
        self.ok
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

//! What `ferrodrive boot` prints.

use crate::output::Report;
use host::network::boot::{BootReport, BootedNode};
use plot::Paint;
use plot::Table;

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
            text.push_str(&format!("\nnode {}: {}", node.node, outcome(node, paint)));
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

fn outcome(node: &BootedNode, paint: Paint) -> String {
    let state = node.state.as_ref().map(|state| format!("; it is {state}")).unwrap_or_default();
    match (node.letter, node.meaning) {
        (Some('L'), Some(meaning)) => format!("L: {meaning}{state}"),
        (Some(letter), Some(meaning)) => {
            let need = if node.mandatory { "" } else { " (not mandatory)" };
            format!("{}: {meaning}{need}", paint.bad(&letter.to_string()))
        }
        _ => format!("{}{state}", paint.good("booted")),
    }
}

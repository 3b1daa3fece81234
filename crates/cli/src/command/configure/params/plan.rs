//! `ferrodrive params plan`.

use host::network::params::LeftOut;
pub(in crate::command) use host::network::params::{PlanReport, plan_of};
use words::counted;

use super::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use plot::Table;

impl super::PlanArguments {
    pub(super) async fn run(&self, context: &Context) -> Result<PlanReport, Failure> {
        let drive = context.drive(self.wanted.node).await?;
        let (wanted, file) = source::wanted(context, &self.wanted, drive.description())?;
        Ok(plan_of(&context.progress, &drive, &wanted, file, self.address).await?)
    }
}

impl Report for PlanReport {
    fn text(&self, paint: Paint) -> String {
        let mut lines = Vec::new();
        if self.steps.is_empty() {
            lines.push(format!("node {} has the values of {}: nothing to write", self.node, plain(&self.file)));
        } else {
            let mut table = Table::new(&["", "object", "name", "has", "gets", "what for"]);
            for (position, step) in self.steps.iter().enumerate() {
                table.row([
                    (position + 1).to_string(),
                    step.object.clone(),
                    step.name.unwrap_or_default().to_owned(),
                    step.before.as_ref().map_or_else(|| "?".to_owned(), |shown| plain(&shown.text)),
                    plain(&step.value.text),
                    step.purpose.clone(),
                ]);
            }
            lines.push(table.plain(paint));
            let are = if self.same == 1 { "is" } else { "are" };
            lines.push(format!("\n{} {are} already set", counted(self.same, "value")));
        }
        lines.extend(self.left.iter().map(LeftOut::text));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.join("\n")
    }
}

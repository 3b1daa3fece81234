//! `ferrodrive params rollback`, and the journal of an `apply`.

pub(in crate::command) use host::network::params::journal::{Kept, default_path};
use host::network::params::journal::{RollbackReport, read, roll_back_by};
use words::counted;

use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Report, print_error};
use crate::plain::plain;
use plot::Paint;

/// A note that a journal stays. The command may be ending by a signal.
pub(in crate::command) fn note_kept(text: &str) {
    print_error(&format!("note: {text}"));
}

impl super::Rollback {
    pub(super) async fn run(&self, context: &Context) -> Result<RollbackReport, Failure> {
        let path = self.journal.clone().unwrap_or_else(|| default_path(self.node));
        // Before the node is asked for: there may be nothing to go back to.
        let journal = read(&path, self.node)?;
        let drive = context.drive(self.node).await?;
        context.progress.show(format!("node {}: writing {} back", self.node, counted(journal.undo.len(), "value")));
        Ok(roll_back_by(&path, &drive).await?)
    }
}

impl Report for RollbackReport {
    fn text(&self, _: Paint) -> String {
        let read = if self.put_back == 1 { "reads" } else { "read" };
        let objects = counted(self.put_back, "object");
        let state = self.nmt_back_in_words.map(|words| format!("; {words}")).unwrap_or_default();
        format!("node {}: {objects} {read} as before{state}; {} is deleted", self.node, plain(&self.journal))
    }
}

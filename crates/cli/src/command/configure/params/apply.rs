//! `ferrodrive params apply`.

use canopen::NodeId;
use host::network::params::{ApplyReport, LeftOut, Proof, Transaction};
use master::Drive;
use master::parameters::Parameters;
use words::counted;

use super::journal::{default_path, note_kept};
use super::{Prove, source};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;

impl super::Apply {
    pub(super) async fn run(&self, context: &Context) -> Result<ApplyReport, Failure> {
        let drive = context.drive_without_note(self.wanted.node).await?;
        self.how.check(context, &drive).await?;
        context.note_guess(&drive);
        let (wanted, file) = source::wanted(context, &self.wanted, drive.description())?;
        let transaction = self.how.transaction(context, drive.node().id(), self.address)?;
        Ok(transaction.apply(&context.progress, &drive, &wanted, file).await?)
    }
}

impl super::Transaction {
    /// Writes these values, which `file` has, to a drive: all or none.
    pub(in crate::command) async fn run(
        &self,
        context: &Context,
        drive: &Drive,
        wanted: &Parameters,
        file: String,
    ) -> Result<ApplyReport, Failure> {
        self.check(context, drive).await?;
        let transaction = self.transaction(context, drive.node().id(), false)?;
        Ok(transaction.apply(&context.progress, drive, wanted, file).await?)
    }

    fn transaction(&self, context: &Context, node: NodeId, address: bool) -> Result<Transaction, Failure> {
        let journal = self.journal.clone().unwrap_or_else(|| default_path(node));
        Ok(Transaction {
            address,
            save: self.save,
            prove: self.prove.map(|prove| how(prove, context)).transpose()?,
            within: self.within,
            // A virtual bus of this command ends with it, and nothing is left to go back to.
            journal: (!context.is_embedded()).then_some(journal),
            on_kept: note_kept,
        })
    }

    /// What would fail after the writes, before them.
    async fn check(&self, context: &Context, drive: &Drive) -> Result<(), Failure> {
        self.prove.map(|prove| how(prove, context)).transpose()?;
        if self.save {
            // Parameters that no command can store were not requested.
            drive.check_save().await?;
        }
        Ok(())
    }
}

/// How a drive is started anew on this bus.
fn how(prove: Prove, context: &Context) -> Result<Proof, Failure> {
    match (prove, context.is_embedded()) {
        (Prove::Auto, true) => Ok(Proof::Reset),
        (Prove::Auto | Prove::PowerCycle, false) => Ok(Proof::PowerCycle),
        (Prove::PowerCycle, true) => {
            Err(Failure::usage("a drive on a virtual bus of this command alone cannot be switched off by hand")
                .next("--prove=reset, or serve the drive: ferrodrive sim, and ferrodrive world NODE power cycle"))
        }
        (Prove::Reset, _) => Ok(Proof::Reset),
    }
}

impl Report for ApplyReport {
    fn text(&self, paint: Paint) -> String {
        let file = plain(&self.file);
        let mut lines = vec![match self.writes {
            0 => format!("node {} already has the values of {file}: nothing was written", self.node),
            writes => format!(
                "node {}: {} done and read back; it has the values of {file}",
                self.node,
                counted(writes, "write")
            ),
        }];
        for rounded in &self.rounded {
            lines.push(format!(
                "{} {}: {} was written, the drive holds {}",
                rounded.object,
                rounded.name.unwrap_or_default(),
                plain(&rounded.asked.text),
                paint.strong(&plain(&rounded.found.text))
            ));
        }
        lines.extend(self.left.iter().map(LeftOut::text));
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        if self.saved {
            lines.push("stored in the drive's memory".to_owned());
        } else if self.writes > 0 {
            lines.push(format!("not stored by a command: ferrodrive save {}", self.node));
        }
        if let Some(how) = self.proved {
            lines.push(format!("after {how} all stored values read as written"));
        }
        lines.join("\n")
    }
}

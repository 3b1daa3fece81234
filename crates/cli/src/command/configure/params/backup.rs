//! `ferrodrive params backup`.

use console::command::params::{note_refused, text_of_parameters};
use host::network::params::{BackupReport, back_up, bytes_of, shown};
use machine::parameters::Form;
use words::counted;

use crate::command::configure::dcf::{keep, new_file, of_parameters};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Report, is_stdout};
use crate::plain::plain;
use plot::Paint;

impl super::Backup {
    pub(super) async fn run(&self, context: &Context) -> Result<BackupReport, Failure> {
        // Before anything is asked for: a file that cannot be kept is not worth waiting for.
        let output = self.output.as_deref().filter(|path| !is_stdout(path));
        let form = output.map(Form::of).transpose().map_err(Failure::usage)?;
        let output = new_file(output, self.force)?;
        let drive = context.known_drive(self.node).await?;
        let Some((path, form)) = output.zip(form) else {
            let report = shown(&context.progress, &drive).await?;
            context.progress.clear();
            note_refused(&report, |note| context.note(note));
            return Ok(report);
        };
        let (mut report, parameters, model) = back_up(&context.progress, &drive).await?;
        let bytes = match form {
            Form::Dcf => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                of_parameters(&context.node(self.node), model, &parameters, &name).await?
            }
            Form::Toml | Form::Concise => bytes_of(&parameters, model, path, form)?,
        };
        keep(path, &bytes, self.force)?;
        report.file = Some(path.display().to_string());
        Ok(report)
    }
}

impl Report for BackupReport {
    fn text(&self, _: Paint) -> String {
        if self.parameters.is_some() {
            return text_of_parameters(self).to_owned();
        }
        let file = self.file.as_deref().map(plain).unwrap_or_default();
        let mut text = format!("{file}: {} of node {}", counted(self.values, "value"), self.node);
        for refused in &self.refused {
            text += &format!(
                "\n  {} {} is not in the file: {}",
                refused.object,
                refused.name.unwrap_or_default(),
                refused.why
            );
        }
        text
    }
}

//! `ferrodrive params backup`.

use master::parameters::from_any_state;
use serde::Serialize;
use testbench::parameters::{Form, sheet, to_concise, to_dcf};

use super::shown::name;
use crate::command::dcf::{exists, keep};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;

/// What was read.
#[derive(Debug, Serialize)]
pub(super) struct BackupReport {
    node: u8,
    /// Where the file is; absent if it is [`parameters`](Self::parameters).
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// The file itself, as TOML, if it was not written anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<String>,
    /// Values in the file.
    values: usize,
    /// Objects that could not be read.
    refused: Vec<Refused>,
}

#[derive(Debug, Serialize)]
struct Refused {
    object: String,
    name: Option<&'static str>,
    why: String,
}

impl super::Backup {
    pub(super) async fn run(&self, context: &Context) -> Result<BackupReport, Failure> {
        // Before anything is asked for: nobody waits for what cannot be kept.
        let form = self.output.as_deref().map(Form::of).transpose().map_err(Failure::usage)?;
        if let Some(path) = self.output.as_deref().filter(|path| !self.force && path.exists()) {
            return Err(exists(path));
        }
        let drive = context.known_drive(self.node).await?;
        let model = drive.description().ok_or_else(|| Failure::new("the model is not known").at_node(self.node))?;
        let show = |number, of, object| context.progress.count(format!("{number} of {of}: {object}"));
        let backup = drive.back_up(show).await?;
        let refused = backup.refused.iter().map(|(object, error)| Refused {
            object: object.to_string(),
            name: name(Some(model), *object),
            why: error.abort().map_or_else(|| error.to_string(), |code| code.to_string()),
        });
        let values = backup.parameters.values.len();
        let mut report =
            BackupReport { node: self.node.raw(), file: None, parameters: None, values, refused: refused.collect() };
        let Some((path, form)) = self.output.as_deref().zip(form) else {
            report.parameters = Some(sheet::print(&backup.parameters, Some(model)));
            context.progress.clear();
            for refused in &report.refused {
                context.tell(&format!("{} is not in it: {}", refused.object, refused.why));
            }
            return Ok(report);
        };
        let bytes = match form {
            Form::Toml => sheet::print(&backup.parameters, Some(model)).into_bytes(),
            Form::Dcf => {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                to_dcf(&backup.parameters, model, &name).map_err(Failure::usage)?
            }
            Form::Concise => to_concise(&from_any_state(Some(model), self.node, &backup.parameters.values)),
        };
        keep(path, &bytes, self.force)?;
        report.file = Some(path.display().to_string());
        Ok(report)
    }
}

impl Report for BackupReport {
    fn text(&self, _: Paint) -> String {
        if let Some(parameters) = &self.parameters {
            return parameters.trim_end().to_owned();
        }
        let file = self.file.as_deref().map(plain).unwrap_or_default();
        let mut text = format!("{file}: {} values of node {}", self.values, self.node);
        for refused in &self.refused {
            text +=
                &format!("\n  {} {} is not in it: {}", refused.object, refused.name.unwrap_or_default(), refused.why);
        }
        text
    }
}

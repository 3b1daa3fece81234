//! `ferrodrive eds MODEL`: the data sheet of a model, written from its description.

use std::path::PathBuf;

use canopen::NodeId;
use clap::ValueEnum;
use devices::variant::Preset;
use eds::{Flavour, Sheet, write};
use serde::Serialize;

use crate::command::configure::dcf::{keep, new_file};
use crate::failure::Failure;
use crate::output::Report;
use crate::plain::plain;
use plot::Paint;
use words::drive::DriveSpec;
use words::models::{Description, resolve};
use words::node::node;

/// Which model's, and what is special about it.
#[derive(clap::Args)]
pub(super) struct SheetArgs {
    /// Model, e.g. zlac8030l: write its EDS
    #[arg(value_parser = resolve)]
    model: Option<&'static Description>,
    /// Variations of the device, as in `sim --drive`: defaults=eds, firmware=2.01, 6060=3
    #[arg(value_name = "KEY=VALUE")]
    choices: Vec<String>,
    /// Write the EDS for this node: identifiers as numbers, without $NODEID
    #[arg(long, value_name = "NODE", value_parser = node)]
    node: Option<NodeId>,
    /// Adapt the EDS to a program that needs more than the device has
    #[arg(long)]
    variant: Option<Variant>,
    /// Write to this file and print its name (default, and -: write to standard output)
    #[arg(long, short, value_name = "FILE.eds", value_parser = eds_path)]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "output")]
    force: bool,
}

fn eds_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".eds") {
        Ok(text.into())
    } else {
        Err("expected FILE.eds, or - for standard output".into())
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Variant {
    /// Add 6502h and 6061h, and give objects the types with which they are mapped
    #[value(name = "ros2_canopen")]
    Ros2Canopen,
}

/// The sheet.
#[derive(Debug, Serialize)]
pub(super) struct SheetReport {
    model: &'static str,
    file_name: String,
    /// Where the file is; absent if it is [`eds`](Self::eds).
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// The file itself, if it was not written anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    eds: Option<String>,
}

/// Where a user finds what a sheet is written of.
const OPTIONS: &str = "ferrodrive objects lists the models, ferrodrive readings MODEL the options of one";

impl SheetArgs {
    /// Writes it.
    pub(super) fn run(&self) -> Result<SheetReport, Failure> {
        let model = self.model.ok_or_else(|| Failure::usage("no model given").next(OPTIONS))?;
        let output = new_file(self.output.as_deref(), self.force)?;
        // Which node it is does not matter to the choices.
        let mut spec = DriveSpec::new(model, self.node.unwrap_or(NodeId::MIN));
        for choice in &self.choices {
            let (key, value) = choice.split_once('=').ok_or_else(|| {
                Failure::usage(format!("expected an option of a drive, KEY=VALUE, e.g. defaults=eds, got '{choice}'"))
                    .next(OPTIONS)
            })?;
            spec.set(key.trim(), value.trim()).map_err(|reason| Failure::usage(reason).next(OPTIONS))?;
        }
        check(spec.description(), spec.presets())?;
        let sheet = Sheet {
            description: spec.description(),
            variant: spec.variant(),
            presets: spec.presets(),
            node_id: self.node,
            flavour: self.variant.map_or(Flavour::Standard, |Variant::Ros2Canopen| Flavour::Ros2Canopen),
        };
        let eds = sheet.eds();
        let mut report =
            SheetReport { model: model.name, file_name: eds.file.file_name.clone(), file: None, eds: None };
        let text = write(&eds);
        match output {
            Some(path) => {
                keep(path, text.as_bytes(), self.force)?;
                report.file = Some(path.display().to_string());
            }
            None => report.eds = Some(text),
        }
        Ok(report)
    }
}

/// Refuses defaults that the device would refuse.
fn check(model: &Description, presets: &[Preset]) -> Result<(), Failure> {
    for Preset { object, value } in presets {
        let refused = model.row(*object).and_then(|row| row.check_value(*value).err());
        if let Some(code) = refused {
            let failure = Failure::usage(format!("{object} of a {} cannot be {value}: {code}", model.name));
            let advice = format!("ferrodrive objects {} {:04X} shows what it takes", model.name, object.index);
            return Err(failure.at_object(*object).next(advice));
        }
    }
    Ok(())
}

impl Report for SheetReport {
    fn text(&self, _: Paint) -> String {
        match (&self.eds, &self.file) {
            (Some(eds), _) => eds.trim_end().to_owned(),
            (None, file) => format!("{}: the EDS of a {}", plain(file.as_deref().unwrap_or_default()), self.model),
        }
    }
}

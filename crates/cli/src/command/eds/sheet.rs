//! `ferrodrive eds MODEL`: the data sheet of a model, written from its description.

use canopen::NodeId;
use clap::ValueEnum;
use devices::variant::Preset;
use eds::{Flavour, Sheet, write};
use serde::Serialize;

use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;
use testbench::models::{Description, resolve};
use testbench::words::drive::DriveSpec;
use testbench::words::node::node;

/// Which model's, and what is special about it.
#[derive(clap::Args)]
pub(super) struct SheetArgs {
    /// Model whose EDS is written to standard output, e.g. zlac8030l
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
    eds: String,
}

impl SheetArgs {
    /// Writes it.
    pub(super) fn run(&self) -> Result<SheetReport, Failure> {
        let model = self.model.ok_or_else(|| Failure::usage("no model given"))?;
        // Which node it is does not matter to the choices.
        let mut spec = DriveSpec::new(model, self.node.unwrap_or(NodeId::MIN));
        for choice in &self.choices {
            let (key, value) = choice.split_once('=').ok_or_else(|| {
                Failure::usage(format!("expected an option of a drive, KEY=VALUE, e.g. defaults=eds, got '{choice}'"))
            })?;
            spec.set(key.trim(), value.trim()).map_err(Failure::usage)?;
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
        Ok(SheetReport { model: model.name, file_name: eds.file.file_name.clone(), eds: write(&eds) })
    }
}

/// Values that the device would refuse are none to be delivered with.
fn check(model: &Description, presets: &[Preset]) -> Result<(), Failure> {
    for Preset { object, value } in presets {
        let refused = model.row(*object).and_then(|row| row.check_value(*value).err());
        if let Some(code) = refused {
            return Err(
                Failure::usage(format!("{object} of a {} cannot be {value}: {code}", model.name)).at_object(*object)
            );
        }
    }
    Ok(())
}

impl Report for SheetReport {
    fn text(&self, _: Paint) -> String {
        self.eds.trim_end().to_owned()
    }
}

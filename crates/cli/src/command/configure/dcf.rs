//! `ferrodrive dcf`: what a device's parameters are, as a device configuration file (CiA 306-1, clause 5).

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use canopen::NodeId;
use canopen::object::SERIAL_NUMBER;
use eds::document::Document;
use eds::{Commissioning, Configuration, Refusal, Sheet, write};
use master::parameters::Parameters;
use master::{Error, Node};
use serde::Serialize;

use crate::command::tools::eds::source;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Report, is_stdout};
use crate::plain::plain;
use plot::Paint;
use plot::Table;
use words::counted;
use words::models::Description;
use words::node::node;

/// Read a device's parameters into a device configuration file (DCF)
///
/// The file is the data sheet with the values of the device's parameters, as `params backup` writes it; with --eds it
/// has only the values that differ from that sheet. Read-only objects are left out, and so are commands and set-points,
/// which are not configuration.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive dcf 4 -o left-wheel.dcf\n  \
    ferrodrive --bus can0 dcf 5 --eds vendor.eds -o axis.dcf\n  ferrodrive dcf 4 --model 4=zlac8030l > left-wheel.dcf")]
pub(crate) struct Dcf {
    /// Node-ID
    #[arg(value_parser = node)]
    node: NodeId,
    /// Data sheet of the device (default: that of its model)
    #[arg(long, value_name = "FILE")]
    eds: Option<PathBuf>,
    /// Write to this file and report what was read (default, and -: write to standard output)
    #[arg(long, short, value_name = "FILE.dcf", value_parser = dcf_path)]
    output: Option<PathBuf>,
    /// Include every writable object, not only parameters or what differs from the data sheet
    #[arg(long)]
    all: bool,
    /// Overwrite an existing file
    #[arg(long, requires = "output")]
    force: bool,
    /// Name of the node in the file
    #[arg(long, value_name = "NAME", default_value = "")]
    name: String,
}

/// What was read.
#[derive(Debug, Serialize)]
pub(crate) struct DcfReport {
    node: u8,
    /// Where the file is; absent if it is [`dcf`](Self::dcf).
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// The file itself, if it was not written anywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    dcf: Option<String>,
    /// Objects that were read.
    read: usize,
    /// Values in the file.
    values: usize,
    /// Objects that could not be read.
    refused: Vec<RefusedValue>,
    /// Commands and set-points.
    left_out: Vec<String>,
}

#[derive(Debug, Serialize)]
struct RefusedValue {
    object: String,
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    abort: Option<u32>,
    why: String,
}

impl Dcf {
    /// Reads the values and writes the file.
    pub(crate) async fn run(&self, context: &Context) -> Result<DcfReport, Failure> {
        // Before anything is asked for: a file that cannot be kept is not worth waiting for.
        let output = new_file(self.output.as_deref(), self.force)?;
        let (mut made, model) = self.sheet(context).await?;
        let node = context.node(self.node);
        let (values, read, refused) = match &self.eds {
            None if !self.all => self.back_up(context, &mut made).await?,
            _ => self.read_values(context, &node, &mut made).await?,
        };
        let left_out = made.left_out().iter().map(ToString::to_string).collect();
        let device = commissioning(&node, model, &self.name).await;
        let file_name = output.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
        let file_name = file_name.unwrap_or_else(|| format!("node{}.dcf", self.node));
        made.commission(&device, &file_name).map_err(|error| not_commissioned(&error))?;
        let document = made.into_document();
        let mut report = DcfReport { node: self.node.raw(), file: None, dcf: None, read, values, refused, left_out };
        match output {
            Some(path) => {
                keep(path, &document.to_bytes(), self.force)?;
                report.file = Some(path.display().to_string());
            }
            None => {
                report.dcf = Some(document.text().to_owned());
                context.progress.clear();
                context.note(&report.summary(Paint::OFF));
            }
        }
        Ok(report)
    }

    /// The data sheet to begin with.
    async fn sheet(&self, context: &Context) -> Result<(Configuration, Option<&'static Description>), Failure> {
        let (document, model) = match &self.eds {
            Some(path) => (source::document(path)?, None),
            None => {
                let drive = context.known_drive(self.node).await?;
                let model = drive.description().ok_or_else(|| Failure::unknown_model(self.node))?;
                (sheet_of(model)?, Some(model))
            }
        };
        let made = Configuration::new(document, self.node.raw());
        Ok((made.map_err(|refusal| not_an_eds(&refusal))?, model))
    }

    /// Reads all requested objects. An object that the device refuses is noted; a device that does not answer ends it.
    async fn read_values(
        &self,
        context: &Context,
        node: &Node,
        made: &mut Configuration,
    ) -> Result<(usize, usize, Vec<RefusedValue>), Failure> {
        let wanted = made.wanted();
        let (mut values, mut read, mut refused) = (0, 0, Vec::new());
        for (number, place) in wanted.iter().enumerate() {
            context.progress.count(format!("{} of {}: {place}", number + 1, wanted.len()));
            let name = made.eds().variable(place.index, place.sub_index).map(|variable| variable.name.clone());
            let name = name.unwrap_or_default();
            let mut refuse = |why: String, abort: Option<u32>| {
                refused.push(RefusedValue { object: place.to_string(), name: name.clone(), abort, why });
            };
            match node.upload(*place).await {
                Ok(payload) => {
                    read += 1;
                    match made.set(*place, payload.as_bytes(), self.all) {
                        Ok(is_there) => values += usize::from(is_there),
                        Err(error) => refuse(error.to_string(), None),
                    }
                }
                Err(error @ Error::Aborted { .. }) => {
                    let abort = error.abort();
                    let why = abort.map_or_else(|| error.to_string(), |code| code.to_string());
                    refuse(why, abort.map(|code| code.0));
                }
                Err(error) => return Err(error.into()),
            }
        }
        Ok((values, read, refused))
    }

    /// Reads the parameters of the device's model, as `params backup` does.
    async fn back_up(
        &self,
        context: &Context,
        made: &mut Configuration,
    ) -> Result<(usize, usize, Vec<RefusedValue>), Failure> {
        let drive = context.known_drive(self.node).await?;
        let show = |number, of, object| context.progress.count(format!("{number} of {of}: {object}"));
        let backup = drive.back_up(show).await?;
        put(made, &backup.parameters)?;
        let refused = backup.refused.iter().map(|(object, error)| RefusedValue {
            object: object.to_string(),
            name: made.eds().variable(object.index, object.sub_index).map(|row| row.name.clone()).unwrap_or_default(),
            abort: error.abort().map(|code| code.0),
            why: error.abort().map_or_else(|| error.to_string(), |code| code.to_string()),
        });
        let (refused, values) = (refused.collect(), backup.parameters.values.len());
        Ok((values, values, refused))
    }
}

/// The parameters of a device as a DCF, for `params backup`.
pub(in crate::command) async fn of_parameters(
    node: &Node,
    model: &'static Description,
    parameters: &Parameters,
    file_name: &str,
) -> Result<Vec<u8>, Failure> {
    let mut made = Configuration::new(sheet_of(model)?, node.id().raw()).map_err(|refusal| not_an_eds(&refusal))?;
    put(&mut made, parameters)?;
    let device = commissioning(node, Some(model), "").await;
    made.commission(&device, file_name).map_err(|error| not_commissioned(&error))?;
    Ok(made.into_document().to_bytes())
}

fn put(made: &mut Configuration, parameters: &Parameters) -> Result<(), Failure> {
    for (object, bytes) in &parameters.values {
        made.set(*object, bytes, true).map_err(|error| {
            Failure::new(format!("{object}: {error}")).next("give the data sheet of this device: --eds FILE.eds")
        })?;
    }
    Ok(())
}

/// The data sheet of a model.
fn sheet_of(model: &'static Description) -> Result<Document, Failure> {
    let sheet = Document::parse(write(&Sheet::of(model).eds()).as_bytes());
    sheet.map_err(|refusal| not_an_eds(&refusal))
}

fn not_an_eds(refusal: &Refusal) -> Failure {
    let at = if refusal.line > 0 { format!("line {}: ", refusal.line) } else { String::new() };
    let failure = Failure::new(format!("the data sheet is not read as an EDS: {at}{}", refusal.reason));
    failure.of_kind("not_an_eds").next(&refusal.next)
}

/// The name of the file or of the node cannot be in a DCF.
fn not_commissioned(error: &impl std::fmt::Display) -> Failure {
    Failure::usage(error.to_string())
        .next("give a short --name and file name, on one line, with letters of the data sheet's encoding")
}

fn dcf_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".dcf") {
        Ok(text.into())
    } else {
        Err("expected FILE.dcf, or - for standard output; `params backup` writes .toml and .bin too".into())
    }
}

/// Which device it is: its serial number and its bit rate, where it says them.
async fn commissioning(node: &Node, model: Option<&'static Description>, name: &str) -> Commissioning {
    let bit_rate = match model {
        Some(model) => bit_rate(node, model).await,
        None => None,
    };
    Commissioning {
        node_id: Some(node.id().raw()),
        node_name: name.to_owned(),
        bit_rate,
        net_number: Some(1),
        lss_serial_number: node.read::<u32>(SERIAL_NUMBER).await.ok(),
        ..Commissioning::default()
    }
}

/// In kbit/s, by the object that chooses it; of a model without one, that of the model.
async fn bit_rate(node: &Node, model: &Description) -> Option<u16> {
    let Some(row) = model.dictionary.rows().iter().find(|row| row.name == "can_custom_communication_baud_rate") else {
        return model.bitrate.map(|rate| (rate.bits_per_second() / 1_000) as u16);
    };
    let value = node.read::<u16>(row.mux()).await.ok()?;
    row.meaning(value.into())?.strip_suffix(" kbit/s")?.parse().ok()
}

/// The file of `--output`; `None` for standard output, which has no such option or `-`.
///
/// # Errors
/// The file exists, and `force` does not allow replacing it; or it is a folder, a pipe or a device, which nothing replaces.
pub(in crate::command) fn new_file(output: Option<&Path>, force: bool) -> Result<Option<&Path>, Failure> {
    let path = output.filter(|path| !is_stdout(path));
    if let Some(path) = path.filter(|path| path.metadata().is_ok_and(|there| !there.is_file())) {
        return Err(Failure::of_writing(
            "the file",
            path,
            &std::io::Error::other("it exists and is not a regular file"),
        ));
    }
    match path.filter(|path| !force && path.exists()) {
        Some(path) => Err(exists(path)),
        None => Ok(path),
    }
}

fn exists(path: &Path) -> Failure {
    Failure::new(format!("{} already exists", path.display()))
        .of_kind("file_exists")
        .next("--force overwrites it, or give another --output")
}

/// Writes the file at once or not at all: beside its place, then to it.
pub(in crate::command) fn keep(path: &Path, bytes: &[u8], force: bool) -> Result<(), Failure> {
    let cannot = |error: std::io::Error| Failure::of_writing("the file", path, &error);
    if !force {
        // Created only if no other program has done so.
        let mut file = OpenOptions::new().write(true).create_new(true).open(path).map_err(cannot)?;
        return file.write_all(bytes).map_err(cannot);
    }
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let mut file = File::create(&beside).map_err(cannot)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        // Half a file is of no use to anyone; why it is half is in the error.
        let _ = std::fs::remove_file(&beside);
        cannot(error)
    })
}

impl DcfReport {
    fn summary(&self, paint: Paint) -> String {
        let (read, kept) = (counted(self.read, "object"), counted(self.values, "value"));
        let mut text = format!("node {}: {read} read, {kept} in the file", self.node);
        if !self.left_out.is_empty() {
            text += &format!("; left out, being commands or set-points: {}", self.left_out.join(", "));
        }
        if self.refused.is_empty() {
            return text;
        }
        let mut table = Table::new(&["object", "name", "not read"]);
        for row in &self.refused {
            table.row([row.object.clone(), plain(&row.name), row.why.clone()]);
        }
        format!("{text}\n\n{}", table.plain(paint))
    }
}

impl Report for DcfReport {
    fn text(&self, paint: Paint) -> String {
        match (&self.dcf, &self.file) {
            (Some(dcf), _) => dcf.trim_end().to_owned(),
            (None, Some(file)) => format!("{}: {}", plain(file), self.summary(paint)),
            (None, None) => self.summary(paint),
        }
    }
}

//! `ferrodrive init`: a machine file to begin with, of the drives on a bus or of those that are named.

mod ask;

use std::collections::BTreeSet;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use can::Bitrate;
use host::network::init::{InitNode, InitReport};
use plot::Paint;
use transport::BusSpec;
use words::counted;
use words::drive::{DriveSpec, drive_spec};
use words::unresolved::Unresolved;

use super::dcf::{keep, new_file};
use crate::embedded::ordered_drive;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::Report;
use crate::plain::plain;
use crate::session;
use console::command::scan::look;

/// Write a first machine file, from the drives on a bus or those that --drive names
///
/// With --bus it asks all node-IDs who they are, by reads alone, as `scan` does; without one, --drive names the drives. The file has of
/// each drive its model, node-ID and heartbeat, and as comments what a user adds next: units, load, limits, groups, a base.
///
/// Where several models answer alike, --model NODE=MODEL decides. At a terminal it is asked for; else an object that only one of them has
/// decides, with that evidence in a comment, and where there is none the drive is commented out with the alternatives, and the exit status
/// is 1.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus can0 init -o machine.toml\n  \
    ferrodrive --bus can0 init --bitrate 1M --model 4=zlac8030l -o machine.toml\n  \
    ferrodrive init --drive zlac8030l@4 --drive m4230e17b50@1 -o machine.toml")]
pub(crate) struct Init {
    /// A drive and its node-ID, as for `sim`, e.g. zlac8030l@4, instead of asking a bus; may be repeated
    #[arg(long = "drive", value_name = "MODEL@NODE[,KEY=VALUE..]", value_parser = named_drive)]
    drives: Vec<NamedDrive>,
    /// Bit rate of the bus, where it does not show it, as a CAN interface or a server (default: that of a drive that has one
    /// alone, and 500k with --drive)
    #[arg(long, value_name = "RATE")]
    bitrate: Option<Bitrate>,
    /// Write to this file (default, and -: write to standard output)
    #[arg(long, short, value_name = "FILE.toml", value_parser = machine_path)]
    output: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "output")]
    force: bool,
}

/// That of drives that are named, as of the world that `sim` makes of them.
const BITRATE: Bitrate = Bitrate::K500;

/// A drive as it was typed, and what that means.
#[derive(Clone)]
struct NamedDrive {
    text: String,
    spec: DriveSpec,
}

fn named_drive(text: &str) -> Result<NamedDrive, Unresolved> {
    drive_spec(text).map(|spec| NamedDrive { text: text.to_owned(), spec })
}

fn machine_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".toml") {
        Ok(text.into())
    } else {
        Err("expected FILE.toml, or - for standard output".into())
    }
}

impl Init {
    /// True if drives are named, and no bus is looked at.
    pub(crate) fn is_without_bus(&self) -> bool {
        !self.drives.is_empty()
    }

    /// Finds the drives, and writes the file. `is_bus_typed` is whether the command line names a bus, be it that of every command.
    pub(crate) fn run(&self, global: &Global, is_bus_typed: bool) -> Result<InitReport, Failure> {
        // Before anything is asked for: what cannot be kept is not worth the wait.
        let output = new_file(self.output.as_deref(), self.force)?;
        let (mut nodes, bitrate) = if self.is_without_bus() {
            (self.named()?, Some(self.own_bitrate()))
        } else if is_bus_typed || global.bus != (BusSpec::Sim { file: None }) {
            let nodes = session::run(global, async |context| {
                let (found, _) = look(context).await?;
                let mut nodes = Vec::new();
                for found in &found {
                    nodes.push(InitNode::found(&context.network, context.stated_model(found.node), found).await);
                }
                Ok(nodes)
            })?;
            (nodes, bitrate_of(&global.bus)?)
        } else {
            return Err(Failure::usage("neither a bus nor a drive is named")
                .next("ferrodrive --bus can0 init looks at a bus")
                .next("ferrodrive init --drive zlac8030l@4 names the drives"));
        };
        // Programs are asked nothing.
        if !global.json && io::stdin().is_terminal() && io::stderr().is_terminal() {
            nodes = ask::all(nodes, &mut io::stdin().lock(), &mut io::stderr()).map_err(|error| {
                let failure = Failure::new("cannot ask which models they are").because(error);
                failure.next("give --model NODE=MODEL for each, or --json: then nothing is asked")
            })?;
        }
        nodes.iter_mut().for_each(|node| node.with_file(|path| seen_from(path, output)));
        let mut report = InitReport::new(nodes, self.bitrate.or(bitrate));
        if let Some(path) = output {
            keep(path, report.toml.as_bytes(), self.force)?;
            report.file = Some(path.display().to_string());
        }
        Ok(report)
    }

    /// The bit rate of the drives of `--drive` as far as one has no other.
    fn own_bitrate(&self) -> Bitrate {
        self.drives.iter().find_map(|drive| drive.spec.model.only_bitrate()).unwrap_or(BITRATE)
    }

    /// The drives of `--drive`.
    fn named(&self) -> Result<Vec<InitNode>, Failure> {
        let mut seen = BTreeSet::new();
        if let Some(twice) = self.drives.iter().find(|drive| !seen.insert(drive.spec.node)) {
            let (model, node) = (twice.spec.model.name, twice.spec.node);
            return Err(Failure::usage(format!("two drives at node {node}"))
                .because("a node-ID may be used once on a bus")
                .next(format!("give the second --drive {model}@... another node-ID")));
        }
        // What a drive does not take is refused here, and not by the first command that reads the file.
        for drive in &self.drives {
            ordered_drive(drive.spec.model, &drive.spec.order(self.bitrate.unwrap_or_else(|| self.own_bitrate())))?;
        }
        Ok(self.drives.iter().map(|drive| InitNode::named(&drive.text, &drive.spec)).collect())
    }
}

/// The bit rate, where the bus has one that is known here.
fn bitrate_of(bus: &BusSpec) -> Result<Option<Bitrate>, Failure> {
    Ok(match bus {
        BusSpec::Sim { file } => Some(session::virtual_world(file.as_deref())?.0.bitrate()),
        BusSpec::SlcanSerial { bitrate, .. } | BusSpec::SlcanTcp { bitrate, .. } => *bitrate,
        _ => None,
    })
}

/// The path of a data sheet as a machine file at `output` names it: data sheets are looked for beside it.
fn seen_from(path: &str, output: Option<&Path>) -> String {
    let is_elsewhere = output.and_then(Path::parent).is_some_and(|folder| !folder.as_os_str().is_empty());
    let absolute = is_elsewhere.then(|| std::path::absolute(path).ok()).flatten();
    absolute.map_or_else(|| path.to_owned(), |path| path.display().to_string())
}

impl Report for InitReport {
    fn text(&self, _: Paint) -> String {
        match &self.file {
            None => self.toml.trim_end().to_owned(),
            Some(file) => {
                let drives = counted(self.nodes.len(), "drive");
                format!("{}: {drives}; next: ferrodrive check {0}", plain(file))
            }
        }
    }
}

//! `ferrodrive fmu`: virtual drives and a bus for other people's simulators.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use can::Bitrate;
use fmu::config::{AxisConfig, BusConfig, Config, ConfigError, DriveConfig, MAX_NODES, TargetKind, TxClock};
use fmu::package::{Entry, entries, platform, platform_of_fmi2};
use plot::Paint;
use serde::Serialize;
use sim::Rule;
use words::counted;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::command::configure::dcf::{keep, new_file};
use crate::failure::Failure;
use crate::output::{Report, is_stdout, print, refuse_json_beside};
use crate::plain::plain;

/// The library without what systems add to its name.
const LIBRARY: &str = "ferrodrive_fmu";

/// Pack a virtual drive, or a CAN bus, as an FMU for co-simulation (FMI 3.0 or 2.0)
///
/// The drive has its firmware, motor, load and supply; it talks to other FMUs over a CAN terminal by the layered standard for buses
/// (fmi-ls-bus), and takes the torque of its load and its supply voltage as inputs. `bus` is a CAN bus with arbitration, exact
/// lengths of frames and errors. With `--fmi 2` the drive has a master of its own in place of the terminal: enable and a target come in
/// as numbers, actual values go out. The library that an FMU carries is built by `cargo build --release -p ferrodrive-fmu`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive fmu zlac8030l@4 -o wheel.fmu\n  \
    ferrodrive fmu vendor.eds@5 -o servo.fmu\n  \
    ferrodrive fmu zlac8030l@4 --rule integrate -o wheel.fmu\n  \
    ferrodrive fmu zlac8030l@4 --fmi 2 --mode torque -o wheel.fmu\n  \
    ferrodrive fmu bus --nodes 3 --bitrate 500k -o bus.fmu")]
pub(crate) struct Fmu {
    /// The drive, as `sim --drive` takes it, or `bus`
    #[arg(value_name = "MODEL@NODE[,KEY=VALUE..]")]
    what: String,
    /// Write to this file, or with - to standard output
    #[arg(long, short, value_name = "FILE.fmu", value_parser = fmu_path)]
    output: PathBuf,
    /// Version of FMI: 3 with a CAN terminal, or 2 with a master inside
    #[arg(long, value_name = "VERSION", default_value = "3", value_parser = clap::value_parser!(u8).range(2..=3))]
    fmi: u8,
    /// With --fmi 2, what the drive follows: velocity, position or torque (its motor current) [default: velocity]
    #[arg(long, value_name = "MODE", value_parser = mode)]
    mode: Option<TargetKind>,
    /// What crosses the drive's shaft: torque, its load's, for its motion; or with integrate, hold or interpolate the motion of the
    /// importer's joint for the drive's torque, by the rules of a body of the kind external [default: torque]
    #[arg(long, value_name = "RULE", value_parser = rule)]
    rule: Option<Rule>,
    /// How many nodes can be joined to the bus
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=i64::from(MAX_NODES)))]
    nodes: Option<u8>,
    /// Bit rate of the bus, or of the drive at its first start
    #[arg(long, value_name = "RATE", default_value = "500k")]
    bitrate: Bitrate,
    /// How it announces what it sends: countdown for exact times, triggered at the end of each step for importers that know no
    /// countdown [default: countdown]
    #[arg(long, value_name = "KIND", value_parser = clock)]
    clock: Option<TxClock>,
    /// The library that it carries (default: the one beside this program)
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

fn fmu_path(text: &str) -> Result<PathBuf, String> {
    if text == "-" || text.to_ascii_lowercase().ends_with(".fmu") {
        Ok(text.into())
    } else {
        Err("expected FILE.fmu, or - for standard output".into())
    }
}

fn clock(text: &str) -> Result<TxClock, String> {
    match text {
        "countdown" => Ok(TxClock::Countdown),
        "triggered" => Ok(TxClock::Triggered),
        _ => Err("expected countdown or triggered".into()),
    }
}

fn rule(text: &str) -> Result<Rule, String> {
    text.parse().map_err(|()| format!("expected {}", Rule::NAMES))
}

fn mode(text: &str) -> Result<TargetKind, String> {
    let known = TargetKind::ALL.into_iter().find(|kind| kind.word() == text);
    known.ok_or_else(|| "expected velocity, position or torque".to_owned())
}

/// What was packed.
#[derive(Debug, Serialize)]
pub(crate) struct FmuReport {
    file: String,
    /// `drive`, `bus`, or `axis` for a drive with its master.
    kind: &'static str,
    /// Variables beside those of the terminals.
    variables: usize,
    /// The names of its networks.
    terminals: Vec<String>,
    bytes: usize,
}

impl Report for FmuReport {
    fn text(&self, _: Paint) -> String {
        // The file is there already, and nothing else is to be in it.
        if is_stdout(Path::new(&self.file)) {
            return String::new();
        }
        let variables = counted(self.variables, "variable");
        let terminals = match self.terminals.as_slice() {
            [] => "with a master".to_owned(),
            terminals => format!("CAN at {}", terminals.join(", ")),
        };
        format!("{}: {variables}, {terminals}; {}", plain(&self.file), counted(self.bytes, "byte"))
    }
}

impl Fmu {
    /// Packs it.
    pub(crate) fn run(&self, json: bool) -> Result<FmuReport, Failure> {
        refuse_json_beside("an FMU", Some(&self.output), json)?;
        let path = new_file(Some(&self.output), self.force)?;
        let (config, folder) = self.config()?;
        let library = self.library()?;
        let named = if self.fmi == 2 { platform_of_fmi2() } else { platform() };
        let (place, ending) = named.ok_or_else(|| {
            Failure::new("FMI has no name for this system")
                .next("pack on Linux, macOS or Windows with a 64-bit processor")
        })?;
        let name = format!("{place}/{LIBRARY}.{ending}");
        let unit = fmu::unit::Unit::new(&config, folder).map_err(not_packed)?;
        let files = entries(&config, folder, (&name, library)).map_err(not_packed)?;
        let archive = archived(&files).map_err(|error| Failure::new("cannot pack the archive").because(error))?;
        match path {
            Some(path) => keep(path, &archive, self.force)?,
            None => print(&archive).map_err(Failure::of_stdout)?,
        }
        Ok(FmuReport {
            file: self.output.display().to_string(),
            kind: match config {
                Config::Bus(_) => "bus",
                Config::Drive(_) => "drive",
                Config::Axis(_) => "axis",
            },
            variables: unit.variables().len(),
            terminals: unit.terminals().into_iter().map(|terminal| terminal.name).collect(),
            bytes: archive.len(),
        })
    }

    /// What is packed, and the folder of the files that it names.
    fn config(&self) -> Result<(Config, &Path), Failure> {
        if self.fmi == 2 && self.clock.is_some() {
            return Err(Failure::usage("--clock is about a CAN terminal, which FMI 2.0 does not have").next("omit it"));
        }
        if self.fmi == 3 && self.mode.is_some() {
            return Err(Failure::usage("--mode needs a master inside the FMU, which FMI 3 does not have")
                .next("add --fmi 2, or omit --mode"));
        }
        if self.fmi == 2 && self.what == "bus" {
            return Err(Failure::usage("a bus needs FMI 3.0: FMI 2.0 has neither clocks nor binary variables")
                .next("omit --fmi 2"));
        }
        if let (Some(rule), "bus") = (self.rule, self.what.as_str()) {
            let word = rule.word();
            return Err(Failure::usage(format!("--rule {word} is about the shaft of a drive, and a bus has none"))
                .next("omit it"));
        }
        let (bitrate, clock) = (self.bitrate.bits_per_second(), self.clock.unwrap_or_default());
        if self.what == "bus" {
            let nodes = self.nodes.ok_or_else(|| {
                Failure::usage("a bus needs the number of its nodes").next("ferrodrive fmu bus --nodes 3 -o bus.fmu")
            })?;
            return Ok((Config::Bus(BusConfig { nodes, bitrate, clock }), Path::new("")));
        }
        if self.nodes.is_some() {
            return Err(Failure::usage("--nodes is the number of nodes of a bus, and this is a drive")
                .next("omit it, or give `bus` in place of the drive"));
        }
        let (place, options) =
            self.what.split_once(',').map_or((self.what.as_str(), None), |(it, rest)| (it, Some(rest)));
        let (model, node) = place.rsplit_once('@').unwrap_or((place, ""));
        let (folder, drive) = match Path::new(model).file_name().and_then(|name| name.to_str()) {
            Some(name) if Path::new(model).extension().is_some() => {
                let folder = Path::new(model).parent().unwrap_or(Path::new(""));
                (folder, options.map_or(format!("{name}@{node}"), |options| format!("{name}@{node},{options}")))
            }
            _ => (Path::new(""), self.what.clone()),
        };
        let drive = DriveConfig { drive, bitrate, clock, rule: self.rule.unwrap_or(Rule::Torque) };
        Ok(match self.fmi {
            2 => (Config::Axis(AxisConfig { mode: self.mode.unwrap_or_default(), drive }), folder),
            _ => (Config::Drive(drive), folder),
        })
    }

    /// The library: what was named, or what stands beside this program or among what was built with it.
    fn library(&self) -> Result<Vec<u8>, Failure> {
        let missing = |path: &Path, error: std::io::Error| {
            Failure::bad_file(format!("cannot read the library {}", path.display()))
                .because(error)
                .next("cargo build --release -p ferrodrive-fmu builds it in a clone; --library names it")
        };
        if let Some(path) = &self.library {
            return std::fs::read(path).map_err(|error| missing(path, error));
        }
        let name = format!("{}{LIBRARY}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let program = std::env::current_exe().unwrap_or_default();
        let beside = program.parent().unwrap_or(Path::new("")).join(&name);
        let places = [beside.clone(), beside.with_file_name("deps").join(&name)];
        let found = places.iter().find_map(|path| std::fs::read(path).ok());
        found.ok_or_else(|| missing(&beside, std::io::ErrorKind::NotFound.into()))
    }
}

/// The archive, whose bytes depend on nothing but what is in it.
fn archived(files: &[Entry]) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, content) in files {
        archive.start_file(path.as_str(), SimpleFileOptions::default())?;
        archive.write_all(content)?;
    }
    Ok(archive.finish()?.into_inner())
}

fn not_packed(error: ConfigError) -> Failure {
    let failure = Failure::new("cannot pack this FMU").because(&error);
    match error {
        ConfigError::NoMode(..) => failure.next("choose another --mode: velocity, position or torque"),
        ConfigError::Drive(_) => failure.next("ferrodrive help sim describes --drive, which takes the same"),
        _ => failure,
    }
}

//! `ferrodrive check`: what goes wrong with a described bus, before it is started.

use std::path::{Path, PathBuf};

use host::network::check::{CheckReport, read};
use machine::check::{LiveNode, Prediction, Severity};
use words::counted;

use crate::failure::Failure;
use crate::global::Global;
use crate::output::Report;
use crate::plain::plain;
use crate::session;
use plot::Paint;
use plot::Table;
use transport::BusSpec;

/// Check the description of a bus: a bus.yml of ros2_canopen, or a machine file
///
/// A bus.yml (also read by Lely's dcfgen) is compared with its data sheets (EDS files) and with what is known of the drives that they
/// describe: node-IDs, heartbeats, boot times, PDOs, drivers. A machine file is read and its machine built. Then the
/// bus that the file describes is booted in virtual time, which gives for each node the letter of CiA 302-2 with which
/// its boot-up ends, and the frames that are sent afterwards with the load of the bus. Nothing is sent on a real bus
/// unless one is named: with --bus the drives there are asked for their identities and contents, by reads alone. Ends
/// with status 1 if there is an error, with --strict also for a warning.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive check config/bus.yml\n  \
    ferrodrive check machine.toml\n  \
    ferrodrive --bus can0 check config/bus.yml          # and the drives on it\n  \
    ferrodrive --json check bus.yml")]
pub(crate) struct Check {
    /// NAME.yml, NAME.yaml or NAME.toml (default: the file of --machine)
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Fail on warnings too
    #[arg(long)]
    strict: bool,
}

impl Check {
    /// Looks into the file, and where a bus is named at its drives.
    pub(crate) fn run(&self, global: &Global) -> Result<CheckReport, Failure> {
        let path = self.path(global)?;
        let mut checked = read(path)?;
        let predicted = checked.predict();
        // The own bus of this command has none of the nodes that the file describes.
        let live = match global.bus {
            BusSpec::Sim { file: None } => None,
            _ => Some(session::run(global, async |context| {
                let asked = checked.ask(&context.network, |node| context.node(node)).await;
                context.settle().await;
                Ok(asked)
            })?),
        };
        Ok(CheckReport::new(path, checked, predicted, live, self.strict))
    }

    /// Whether the command is to fail for warnings.
    pub(crate) const fn strict(&self) -> bool {
        self.strict
    }

    /// The file that is checked.
    fn path<'a>(&'a self, global: &'a Global) -> Result<&'a Path, Failure> {
        if let Some(file) = &self.file {
            return global.refuse_another(file).map(|()| file.as_path());
        }
        let by_option = global.machine_file.as_ref().map(|file| file.path.as_path());
        by_option.ok_or_else(|| Failure::usage("no file to check").next("ferrodrive check machine.toml"))
    }
}

impl Report for CheckReport {
    fn text(&self, paint: Paint) -> String {
        let mut nodes = Table::new(&["node", "name", "device"]);
        for row in &self.nodes {
            let node = row.node.map_or_else(|| "-".to_owned(), |node| node.to_string());
            nodes.row([node, plain(&row.name), row.device.as_deref().map_or_else(|| "-".to_owned(), plain)]);
        }
        let mut text = if self.nodes.is_empty() { "no nodes".to_owned() } else { nodes.plain(paint) };
        for finding in &self.findings {
            let word = finding.severity.word();
            let word = match finding.severity {
                Severity::Error => paint.bad(word),
                Severity::Warning => paint.strong(word),
                Severity::Note => word.to_owned(),
            };
            let (place, what, next) = (finding.at, plain(&finding.what), plain(&finding.next));
            let node = finding.node.map(|node| format!("node {node}: ")).unwrap_or_default();
            text += &format!(
                "\n{}:{}:{}: {word}: {node}{what} [{}]\n  next: {next}",
                plain(&self.file),
                place.line,
                place.column,
                finding.rule
            );
        }
        if let Some(predicted) = &self.predicted {
            text += &foretold(predicted, paint);
        }
        if let Some(live) = &self.live {
            text += &asked(live, paint);
        }
        let counts = [(self.errors, "error"), (self.warnings, "warning"), (self.notes, "note")];
        let counts = counts.map(|(count, what)| counted(count, what)).join(", ");
        let counts = if self.errors > 0 { paint.bad(&counts) } else { paint.good(&counts) };
        format!("{text}\n{counts}")
    }
}

/// How the bus boots, and what is sent then.
fn foretold(predicted: &Prediction, paint: Paint) -> String {
    let mut text = format!("\n\n{}", paint.strong("boot-up, as predicted in virtual time"));
    for node in &predicted.nodes {
        let outcome = match (node.letter, node.meaning) {
            (Some('L'), Some(meaning)) => format!("L: {meaning}"),
            (Some(letter), Some(meaning)) => format!("{}: {meaning}", paint.bad(&letter.to_string())),
            _ => paint.good("boots"),
        };
        let state = node.state.as_ref().map(|state| format!("; it is {state}")).unwrap_or_default();
        text += &format!(
            "\nnode {} ({}): {outcome}{state}; {}",
            node.node,
            plain(&node.name),
            counted(node.writes, "write")
        );
    }
    let mut frames = Table::new(&["frame", "node", "id", "bytes", "every", "at most", "carries"]);
    let time = |us: f64| if us >= 10_000.0 { format!("{:.1} ms", us / 1e3) } else { format!("{us:.0} us") };
    for row in &predicted.frames {
        let node = row.node.map_or_else(String::new, |node| node.to_string());
        let worst = row.worst_us.map_or_else(|| "no bound".to_owned(), time);
        let worst = if row.in_time { worst } else { format!("{worst}, late") };
        let (every, carries) = (time(row.every_us), plain(&row.carries.join(", ")));
        frames.row([row.frame.clone(), node, format!("{}h", row.id), row.bytes.to_string(), every, worst, carries]);
    }
    let (rate, cycle) = (predicted.bitrate / 1000, time(predicted.cycle_us as f64));
    let load = 100.0 * predicted.load;
    text +=
        &format!("\n\n{}\nbus load {load:.1} % of {rate} kbit/s at most, at a cycle of {cycle}\n", frames.plain(paint));
    text
}

/// Who is on the bus.
fn asked(live: &[LiveNode], paint: Paint) -> String {
    let mut table = Table::new(&[
        "node",
        "name",
        "type",
        "vendor",
        "product",
        "revision",
        "software",
        "heartbeat",
        "as in the file",
    ]);
    let hex = |number: Option<u32>| number.map_or_else(|| "-".to_owned(), |number| format!("{number:X}h"));
    for node in live {
        let same = format!("{} of {}", node.compared - node.deviations.len().min(node.compared), node.compared);
        table.row([
            node.node.to_string(),
            plain(&node.name),
            hex(node.device_type),
            hex(node.vendor_id),
            hex(node.product_code),
            hex(node.revision_number),
            node.software.as_deref().map_or_else(|| "-".to_owned(), plain),
            node.heartbeat_ms.map_or_else(|| "-".to_owned(), |ms| format!("{ms} ms")),
            if node.answers { same } else { paint.bad("no answer") },
        ]);
    }
    format!("\n\n{}\n{}\n", paint.strong("on the bus"), table.plain(paint))
}

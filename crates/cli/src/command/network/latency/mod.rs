//! `ferrodrive latency`: how long answers take on this bus, and how evenly SYNC comes.

mod measure;
mod spread;

use std::path::PathBuf;
use std::time::Duration;

use canopen::NodeId;
use plot::{Colour, Figure, Panel, Poster, Style, Trace};
use serde::Serialize;
use words::node::node;

use crate::command::record_and_replay::plot::{svg_path, write_svg};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use console::numbers::whole;
use measure::Measurement;
use plot::Paint;
use plot::Table;
use spread::{Bin, Spread};
use words::time::some_time;

/// Measure response times on this bus, and the regularity of SYNC
///
/// Times from an SDO request (1000h, read only) to its answer, from a SYNC to each synchronous TPDO of the node, and
/// from one SYNC to the next are shown as a table, a histogram and a picture. If another node produces SYNC, that one
/// is measured. Otherwise this command produces it, unless the motor of a node on the bus is switched on: SYNC would
/// activate what its synchronous RPDOs hold. Nothing is written to any node.
///
/// On a real bus the time of a frame is when it is handed to the connection, or received from it. On a virtual bus it
/// is the end of its last bit: what the wire and the device take.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    ferrodrive --bus socketcand://HOST:29536/can0 latency 4\n  \
    ferrodrive --bus can0 latency 4 --count 10000 -o latency.svg\n  \
    ferrodrive --bus can0 latency --sync 5ms --for 1min")]
pub(crate) struct Latency {
    /// Node to measure (default: only SYNC is measured)
    #[arg(value_parser = node)]
    node: Option<NodeId>,
    /// Number of requests, and of SYNCs
    #[arg(long, value_name = "N", default_value = "1000", value_parser = |text: &str| whole(text, 2..=10_000_000_u32))]
    count: u32,
    /// End each of the two measurements after this time, if it has not reached its count
    #[arg(long = "for", value_name = "TIME", value_parser = some_time)]
    duration: Option<Duration>,
    /// Period of the SYNC that this command produces
    #[arg(long, value_name = "TIME", value_parser = master::units::parse_duration, default_value = "10ms")]
    sync: Duration,
    /// Draw the histograms to this file
    #[arg(long = "output", short = 'o', alias = "svg", value_name = "FILE.svg", value_parser = svg_path)]
    svg: Option<PathBuf>,
}

/// What was measured. Times in µs.
#[derive(Debug, Serialize)]
pub(crate) struct LatencyReport {
    node: Option<u8>,
    /// From an SDO request to its answer.
    sdo: Option<Spread>,
    /// From a SYNC to a synchronous TPDO.
    pdo: Option<Spread>,
    /// From one SYNC to the next.
    sync: Option<Spread>,
    /// Who produced SYNC: `this` or `another`.
    producer: Option<&'static str>,
    /// What was not measured, and why.
    notes: Vec<String>,
    svg: Option<PathBuf>,
    /// The picture, if it goes to standard output.
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

impl Latency {
    /// Measures.
    pub(crate) async fn run(&self, context: &Context) -> Result<LatencyReport, Failure> {
        if self.sync < Duration::from_micros(500) {
            return Err(Failure::usage("--sync is too short")
                .because("a SYNC and its answers need 500us at least")
                .next("give the period of SYNC, e.g. --sync 10ms"));
        }
        let measurement = Measurement::new(context, self.node, self.count, self.duration);
        let measured = measurement.run(self.sync).await?;
        let mut report = LatencyReport {
            node: self.node.map(NodeId::raw),
            sdo: measured.sdo.spread(),
            pdo: measured.pdo.spread(),
            sync: measured.sync.spread(),
            producer: measured.producer,
            notes: measured.notes,
            svg: None,
            picture: None,
        };
        if report.sdo.is_none() && report.pdo.is_none() && report.sync.is_none() {
            let failure = report.notes.iter().fold(Failure::new("nothing could be measured"), Failure::because);
            return Err(failure.next("ferrodrive scan shows the nodes on the bus"));
        }
        if let Some(path) = &self.svg {
            report.picture = write_svg(path, drawn(&report))?;
            report.svg = report.picture.is_none().then(|| path.clone());
        }
        Ok(report)
    }
}

impl LatencyReport {
    fn spreads(&self) -> impl Iterator<Item = (&'static str, &Spread)> {
        let named = [("SDO answer", &self.sdo), ("SYNC to TPDO", &self.pdo), ("SYNC period", &self.sync)];
        named.into_iter().filter_map(|(name, spread)| spread.as_ref().map(|spread| (name, spread)))
    }
}

impl Report for LatencyReport {
    fn text(&self, paint: Paint) -> String {
        if let Some(picture) = &self.picture {
            return picture.trim_end().to_owned();
        }
        let mut table = Table::new(&["us", "count", "lost", "min", "median", "99 %", "99.9 %", "max"]);
        for (name, spread) in self.spreads() {
            let times = [spread.min_us, spread.median_us, spread.p99_us, spread.p999_us, spread.max_us];
            let times = times.map(|time| format!("{time:.0}"));
            let counts = [name.to_owned(), spread.count.to_string(), spread.lost.to_string()];
            table.row(counts.into_iter().chain(times));
        }
        let mut lines = vec![table.plain(paint)];
        for (name, spread) in self.spreads() {
            lines.push(String::new());
            lines.push(format!("{} {}", paint.strong(name), paint.dim("us, count")));
            lines.extend(spread.histogram.iter().map(|bin| bar(bin, spread.count)));
        }
        lines.extend(self.notes.iter().map(|note| format!("note: {note}")));
        lines.extend(self.svg.iter().map(|path| format!("drawn in {}", path.display())));
        lines.join("\n")
    }
}

/// `   1200 ..   1250    812 ########################`
fn bar(bin: &Bin, of: u64) -> String {
    const WIDTH: u64 = 50;
    // The least that is there is seen.
    let length = (bin.count * WIDTH).div_ceil(of.max(1)) as usize;
    format!("{:>8.0} .. {:>8.0}  {:>8} {}", bin.from_us, bin.to_us, bin.count, "#".repeat(length)).trim_end().to_owned()
}

/// The picture.
fn drawn(report: &LatencyReport) -> String {
    let figures = report.spreads().zip(Colour::ALL).map(|((name, spread), colour)| {
        let points = spread.histogram.iter().flat_map(|bin| {
            let count = bin.count as f64;
            [(bin.from_us, count), (bin.to_us, count)]
        });
        let trace = Trace { label: "".into(), style: Style::Actual(colour), points: points.collect() };
        let panel =
            Panel { title: "count".into(), unit: "1".into(), height: 140.0, traces: vec![trace], ..Panel::default() };
        let subtitle = format!(
            "{} measured, {} lost; median {:.0} µs, 99.9 % {:.0} µs, most {:.0} µs",
            spread.count, spread.lost, spread.median_us, spread.p999_us, spread.max_us
        );
        vec![Figure {
            title: name.into(), subtitle, time: "time, µs".into(), panels: vec![panel], ..Figure::default()
        }]
    });
    let title = report.node.map_or("SYNC".to_owned(), |node| format!("Node {node}: answers and SYNC"));
    Poster { title, subtitle: report.notes.join("; "), rows: figures.collect() }.to_svg()
}

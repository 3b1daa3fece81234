//! `--record` and what goes with it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use devices::AxisId;
use recording::{Channels, Column, Kind, Record, columns_of_drives, select};
use sim::coupling::BodyState;
use sim::recorder::{Channel, Recorder, Signal};
use sim::{Place, World};

use crate::failure::Failure;
use master::units::parse_duration;
use serve::files::create_record;
use serve::messages::Messages;
use serve::writing::{Pace, RecordFile, RecordOutput};

use super::viewers::ViewerOptions;

/// Sample rate and choice of signals of a record.
#[derive(clap::Args, Clone, Debug, Default)]
#[command(group = clap::ArgGroup::new("sampled").args(["record", "foxglove"]).multiple(true))]
pub(crate) struct RecordOptions {
    /// Record motion, values and events to this file, .mcap or .csv
    ///
    /// The file is new, empty, or an earlier record, which is replaced. What is older than a second is on the disk,
    /// whatever happens to this program. `ferrodrive plot FILE` draws it.
    #[arg(long, value_name = "FILE", value_parser = record_path)]
    record: Option<PathBuf>,
    /// Time between two samples, at least 50us
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = record_period, hide_short_help = true, requires = "sampled")]
    record_period: Option<Duration>,
    /// Signals, e.g. velocity,4.current_a,5.* (default: all)
    #[arg(long, value_name = "SIGNAL,..", value_delimiter = ',', hide_short_help = true, requires = "sampled")]
    record_signals: Vec<String>,
    #[command(flatten)]
    viewers: ViewerOptions,
}

/// The shortest control period of a drive: nothing that is sampled changes faster.
const SHORTEST: Duration = Duration::from_micros(50);

fn record_period(text: &str) -> Result<Duration, String> {
    let period = parse_duration(text).map_err(|error| error.to_string())?;
    if period < SHORTEST {
        Err("expected 50us or more: a control period, within which nothing changes".into())
    } else {
        Ok(period)
    }
}

fn record_path(text: &str) -> Result<PathBuf, String> {
    match Kind::of_name(text) {
        Some(_) => Ok(text.into()),
        None => Err("a record is called NAME.mcap or NAME.csv; for the frames alone there is --log".into()),
    }
}

impl RecordOptions {
    /// The file, if one is asked for.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.record.as_deref()
    }

    /// Viewers are asked for.
    pub(crate) fn is_live(&self) -> bool {
        self.viewers.is_asked_for()
    }

    /// Begins to record the drives of `world` as asked for; `None` if it is not.
    pub(crate) fn start(
        &self,
        world: &mut World,
        pace: Pace,
        messages: Messages,
    ) -> Result<Option<RecordOutput>, Failure> {
        if self.path().is_none() && !self.is_live() {
            return Ok(None);
        }
        let mut places = Vec::new();
        let numbers: Vec<u8> = world.drive_numbers().collect();
        for node in numbers {
            let axes = world.with_drive(node, |drive, _| drive.axes()).unwrap_or(0);
            places.extend((0..axes).map(|axis| Place { node, axis: AxisId(axis) }));
        }
        let signals = |place: &Place| Signal::ALL.map(|signal| Channel { place: *place, signal });
        let mut channels: Vec<Channel> = places.iter().flat_map(signals).collect();
        let names: Vec<String> = world.body_names().map(str::to_owned).collect();
        let mut bodies: Vec<BodyState> = names.iter().filter_map(|name| world.body(name)).collect();
        if !self.record_signals.is_empty() {
            let of_drives = columns_of_drives(places);
            let all = of_drives.into_iter().chain(bodies.iter().flat_map(Column::of_body));
            let names: Vec<String> = all.map(|column| column.name()).collect();
            let chosen = select(&names, &self.record_signals).map_err(|reason| {
                Failure::usage("cannot record what --record-signals asks for")
                    .because(reason)
                    .next("name signals as velocity, 4.current_a or 5.*, or omit it to record all")
            })?;
            let is_chosen = |name: &str| chosen.iter().any(|i| names[*i] == name);
            channels.retain(|channel| is_chosen(&Column::of_axis(*channel).name()));
            // A body is recorded as a whole.
            bodies.retain(|body| Column::of_body(body).iter().any(|column| is_chosen(&column.name())));
        }
        let of_axes = channels.iter().map(|channel| Column::of_axis(*channel));
        let columns: Vec<Column> = of_axes.chain(bodies.iter().flat_map(Column::of_body)).collect();
        let period = self.record_period.unwrap_or(Duration::from_millis(1));
        let viewers = self.viewers.start(Channels::of(&columns), |note| messages.say(&format!("note: {note}")))?;
        let begin = |path: &Path| {
            let record = create(path).and_then(|(kind, file)| Record::begin(kind, Box::new(file), &columns));
            record.map_err(|error| cannot_write(path, &error))
        };
        let file = self.path().map(begin).transpose()?.map(|record| RecordFile::start(record, pace, messages));
        world.start_recording(Recorder::new(period, channels).with_bodies(&bodies));
        world.watch(true);
        Ok(Some(RecordOutput { file, viewers }))
    }
}

/// The file of a record, to be written.
fn create(path: &Path) -> std::io::Result<(Kind, std::fs::File)> {
    let kind = Kind::of_name(&path.to_string_lossy()).unwrap_or(Kind::Csv);
    create_record(path, kind).map(|file| (kind, file))
}

fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    Failure::of_writing("the record", path, error)
}

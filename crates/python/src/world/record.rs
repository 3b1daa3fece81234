//! What is kept of a world as it moves: a record in a file, the last seconds for a picture, or both. The world has one
//! recorder; while a file is written its signals and its period count, and the picture gets what it needs of them.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::Duration;

use can::Instant;
use devices::AxisId;
use recording::{Batch, Column, Kind, Record, Trail, picture};
use sim::Place;
use sim::events::Event;
use sim::recorder::{Channel, Recorder, Signal};
use sim::wire::WireEvent;

use super::happened::Happened;

/// How much virtual time may pass between two looks at what was sampled: less than fills the world's log of frames.
const WRITE_PERIOD: Duration = Duration::from_millis(100);

/// What is kept of a world.
#[derive(Default)]
pub(super) struct Recordings {
    file: Option<Writing>,
    trail: Option<PeriodicTrail>,
    /// What the world's recorder samples, in its order.
    columns: Vec<Column>,
    next_at: Instant,
}

/// A file that is being written.
struct Writing {
    record: Record,
    /// Time of the last frame that was written.
    frames_until: Instant,
    /// What went wrong with the file; nothing is written after that.
    failed: Option<io::Error>,
}

/// A trail, and how often it wants a sample.
struct PeriodicTrail {
    trail: Trail,
    period: Duration,
}

impl Recordings {
    /// True while a file is written.
    pub(super) fn has_file(&self) -> bool {
        self.file.is_some()
    }

    /// Begins to record every signal of every drive and body that is in the world.
    ///
    /// # Errors
    /// What the system says of the file; a name that ends in neither `.mcap` nor `.csv`.
    pub(super) fn begin_file(
        &mut self,
        world: &mut sim::World,
        happened: &mut Happened,
        path: &Path,
        period: Duration,
    ) -> io::Result<()> {
        let no_kind = || io::Error::new(io::ErrorKind::InvalidInput, "a record is a file .mcap or .csv");
        let kind = Kind::of_name(&path.to_string_lossy()).ok_or_else(no_kind)?;
        let file = File::options().read(true).write(true).create(true).truncate(true).open(path)?;
        self.look(world, happened);
        self.sample(world, &Signal::ALL, period);
        let record = Record::begin(kind, Box::new(file), &self.columns)?;
        happened.record(world, true);
        self.file = Some(Writing { record, frames_until: world.now(), failed: None });
        Ok(())
    }

    /// Writes the rest and ends the file, if there is one.
    ///
    /// # Errors
    /// What the system said of the file at any time.
    pub(super) fn end_file(&mut self, world: &mut sim::World, happened: &mut Happened) -> io::Result<()> {
        self.look(world, happened);
        world.stop_recording();
        happened.record(world, false);
        let ended = self.file.take();
        self.follow(world, happened);
        match ended {
            Some(Writing { failed: Some(error), .. }) => Err(error),
            Some(writing) => writing.record.finish(),
            None => Ok(()),
        }
    }

    /// Keeps the last of what moves from now on; what was kept before is lost.
    pub(super) fn keep_trail(
        &mut self,
        world: &mut sim::World,
        happened: &mut Happened,
        keep: Duration,
        period: Duration,
    ) {
        self.trail = Some(PeriodicTrail { trail: Trail::new(keep, period), period });
        self.follow(world, happened);
    }

    /// What was kept, as SVG.
    ///
    /// # Errors
    /// A sentence: nothing was kept.
    pub(super) fn picture(
        &mut self,
        world: &mut sim::World,
        happened: &mut Happened,
        title: &str,
    ) -> Result<String, String> {
        self.look(world, happened);
        let following = self.trail.as_ref().ok_or("nothing of this world was kept; keep_trail() before it moves")?;
        let poster = picture(title, &following.trail.recorded(), &[], 0.0..=f64::INFINITY)?;
        Ok(poster.to_svg())
    }

    /// The world has other drives now, or was another: its recorder is put in order.
    pub(super) fn follow(&mut self, world: &mut sim::World, happened: &mut Happened) {
        if self.file.is_some() {
            return;
        }
        if let Some(PeriodicTrail { period, .. }) = self.trail {
            self.look(world, happened);
            let signals: Vec<Signal> = Trail::signals().collect();
            self.sample(world, &signals, period);
        }
    }

    /// Takes what has come, if that is due.
    pub(super) fn keep_up(&mut self, world: &mut sim::World, happened: &mut Happened) {
        if world.now() >= self.next_at {
            self.look(world, happened);
        }
    }

    /// Has the world sample these signals of every drive, and every body.
    fn sample(&mut self, world: &mut sim::World, signals: &[Signal], period: Duration) {
        let mut channels = Vec::new();
        let numbers: Vec<u8> = world.drive_numbers().collect();
        for node in numbers {
            let axes = world.with_drive(node, |drive, _| drive.axes()).unwrap_or(0);
            let places = (0..axes).map(|axis| Place { node, axis: AxisId(axis) });
            channels
                .extend(places.flat_map(|place| signals.iter().map(move |signal| Channel { place, signal: *signal })));
        }
        let names: Vec<String> = world.body_names().map(str::to_owned).collect();
        let bodies: Vec<_> = names.iter().filter_map(|name| world.body(name)).collect();
        self.columns = channels.iter().map(|channel| Column::of_axis(*channel)).collect();
        self.columns.extend(bodies.iter().flat_map(Column::of_body));
        self.next_at = world.now() + WRITE_PERIOD;
        world.start_recording(Recorder::new(period, channels).with_bodies(&bodies));
    }

    /// Hands on what was sampled and carried since the last look.
    fn look(&mut self, world: &mut sim::World, happened: &mut Happened) {
        self.next_at = world.now() + WRITE_PERIOD;
        let Some(recorded) = world.take_recorded() else { return };
        if let Some(PeriodicTrail { trail, .. }) = &mut self.trail {
            trail.take(&self.columns, recorded.rows());
        }
        if let Some(writing) = self.file.as_mut().filter(|writing| writing.failed.is_none()) {
            let events = happened.take_for_record(world);
            writing.failed = writing.write(world, recorded, &events).err();
        }
    }
}

impl Writing {
    fn write(&mut self, world: &sim::World, recorded: Recorder, events: &[Event]) -> io::Result<()> {
        let last = self.frames_until;
        let frames = world.log().iter().filter_map(|event| match event {
            WireEvent::Frame { end, frame, .. } if *end > last => Some((*end, *frame)),
            _ => None,
        });
        let frames: Vec<_> = frames.collect();
        self.frames_until = frames.last().map_or(last, |(end, _)| *end);
        Batch::of_world(Some(recorded), frames, events).give(|entry| self.record.put(entry))?;
        self.record.flush()
    }
}

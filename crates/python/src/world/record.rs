//! A recording of a world, written to its file as the world moves.

use std::fs::File;
use std::io;
use std::path::Path;
use std::time::Duration;

use can::Instant;
use devices::AxisId;
use sim::Place;
use sim::recorder::{Channel, Recorder, Signal};
use sim::wire::WireEvent;
use testbench::recording::{Kind, Record, columns_of_drives};

/// How much virtual time may pass between two writes: less than fills the world's log of frames.
const WRITE_PERIOD: Duration = Duration::from_millis(100);

/// A record that is being written.
pub(super) struct Recording {
    record: Record,
    next_at: Instant,
    /// Time of the last frame that was written.
    frames_until: Instant,
    /// What went wrong with the file; nothing is written after that.
    failed: Option<io::Error>,
}

impl Recording {
    /// Begins to record every signal of every drive that is in the world.
    ///
    /// # Errors
    /// What the system says of the file; a name that ends in neither `.mcap` nor `.csv`.
    pub(super) fn begin(world: &mut sim::World, path: &Path, period: Duration) -> io::Result<Self> {
        let no_kind = || io::Error::new(io::ErrorKind::InvalidInput, "a record is a file .mcap or .csv");
        let kind = Kind::of_name(&path.to_string_lossy()).ok_or_else(no_kind)?;
        let mut places = Vec::new();
        let numbers: Vec<u8> = world.drive_numbers().collect();
        for node in numbers {
            let axes = world.with_drive(node, |drive, _| drive.axes()).unwrap_or(0);
            places.extend((0..axes).map(|axis| Place { node, axis: AxisId(axis) }));
        }
        let record = Record::begin(kind, Box::new(File::create(path)?), &columns_of_drives(places.iter().copied()))?;
        let all = |place: Place| Signal::ALL.map(|signal| Channel { place, signal });
        world.start_recording(Recorder::new(period, places.into_iter().flat_map(all)));
        let now = world.now();
        Ok(Self { record, next_at: now + WRITE_PERIOD, frames_until: now, failed: None })
    }

    /// Writes what has come, if that is due.
    pub(super) fn keep_up(&mut self, world: &mut sim::World) {
        if world.now() >= self.next_at {
            self.next_at = world.now() + WRITE_PERIOD;
            self.write(world);
        }
    }

    /// Writes the rest and ends the file.
    ///
    /// # Errors
    /// What the system said of the file at any time.
    pub(super) fn finish(mut self, world: &mut sim::World) -> io::Result<()> {
        self.write(world);
        world.stop_recording();
        match self.failed {
            Some(error) => Err(error),
            None => self.record.finish(),
        }
    }

    fn write(&mut self, world: &mut sim::World) {
        if self.failed.is_none() {
            self.failed = self.try_to_write(world).err();
        }
    }

    fn try_to_write(&mut self, world: &mut sim::World) -> io::Result<()> {
        if let Some(recorded) = world.take_recorded() {
            for (at, values) in recorded.rows() {
                self.record.row(at, values)?;
            }
        }
        let last = self.frames_until;
        for event in world.log().iter() {
            if let WireEvent::Frame { end, frame, .. } = event
                && *end > last
            {
                self.record.frame(*end, frame)?;
                self.frames_until = *end;
            }
        }
        self.record.flush()
    }
}

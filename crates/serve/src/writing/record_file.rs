//! A record: of a world (`--record`), or of objects of nodes on any bus (`ferrodrive record`).

use std::io;
use std::time::Duration;

use recording::{Batch, Record};

use super::background::{Background, Output, Pace, WaitingRules};
use crate::messages::Messages;
use words::failure::Failure;

/// A record that a thread of its own writes.
pub struct RecordFile(Background<Batch>);

impl RecordFile {
    /// Writes this record from now on. Later errors are reported to `messages`.
    pub fn start(record: Record, pace: Pace, messages: Messages) -> Self {
        Self(Background::start(record, WaitingRules::of(pace), Some(messages)))
    }

    /// Takes a batch; one that the disk has no time for is left out and reported, where the clock does not wait.
    pub fn write(&mut self, batch: Batch) {
        let samples = batch.samples() as u64;
        self.0.write(batch, samples);
    }

    /// Waits until everything is written, at most for `patience`.
    ///
    /// # Errors
    /// The file is not whole.
    pub fn finish(self, patience: Duration) -> Result<(), Failure> {
        self.0.finish(patience)
    }
}

impl Output<Batch> for Record {
    const FILE: &'static str = "the record";
    const PIECES: &'static str = "samples";

    /// Writes it, and hands it to the system.
    fn write(&mut self, batch: Batch) -> io::Result<()> {
        batch.give(|entry| self.put(entry))?;
        self.flush()
    }

    fn end(self) -> io::Result<()> {
        self.finish()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use recording::{Kind, columns_of_drives};
    use scenario::{Runner, Scenario};
    use sim::Place;
    use sim::recorder::{Channel, Recorder, Signal};

    use super::*;

    /// An hour of one drive that turns, all of its signals each millisecond, is to fit into 200 MB.
    const MOST_A_SECOND: f64 = 200e6 / 3600.0;

    /// Steps of the world between two batches, as `ferrodrive run` makes them.
    const STEPS_A_BATCH: usize = 1000;

    #[test]
    fn a_second_of_a_drive_that_turns_takes_its_share_of_200_mb_an_hour() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = scratch.path();
        for realism in ["ideal", "full"] {
            let text = format!(
                "end = \"4s\"\n[machine]\nrealism = \"{realism}\"\ndrive = [{{ model = \"zlac8030l\", node = 4 }}]\n\
                 [[host]]\ndo = [\"4 write 2000 0\", \"4 velocity 60rpm\"]\n"
            );
            let scenario = Scenario::parse(&text, Path::new("")).expect("a scenario");
            let mut runner = Runner::new(&scenario, None).expect("a machine");
            let place = Place::node(4);
            let channels = Signal::ALL.map(|signal| Channel { place, signal });
            runner.world_mut().start_recording(Recorder::new(Duration::from_millis(1), channels));
            runner.world_mut().watch(true);
            runner.keep();
            let path = folder.join(format!("{realism}.mcap"));
            let file = crate::files::create_record(&path, Kind::Mcap).expect("a file");
            let columns = columns_of_drives([place]);
            let messages = Messages::silent();
            let record = Record::begin(Kind::Mcap, Box::new(file), &columns).expect("begun");
            let mut record = RecordFile::start(record, Pace::Free, messages);
            let mut goes_on = true;
            while goes_on {
                goes_on = (0..STEPS_A_BATCH).all(|_| runner.step());
                let kept = runner.take_kept();
                record.write(Batch::of_world(runner.world_mut().take_recorded(), kept.frames, &kept.events));
            }
            record.finish(Duration::MAX).expect("whole");
            let bytes = std::fs::read(&path).expect("it is there");
            let recorded = recording::read(Kind::Mcap, &bytes).expect("a record");
            let speed = recorded.series.iter().find(|series| series.column.signal == "velocity_rpm").expect("a speed");
            let (until, last) = speed.points.last().copied().expect("samples");
            assert!(last > 50.0 && speed.points.len() as f64 > until * 1000.0, "{last} r/min after {until} s");
            let a_second = bytes.len() as f64 / until;
            assert!(a_second < MOST_A_SECOND, "{realism}: {a_second:.0} bytes a second");
        }
    }
}

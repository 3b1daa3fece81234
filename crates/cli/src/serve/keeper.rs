//! Brings EEPROM contents to the disk while the simulation runs.
//!
//! The world is looked at every now and then; a drive whose memory has changed has its image handed to a thread of its
//! own, so that a slow disk does not hold up the bus. What cannot be written (disk full) is reported and tried again.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use sim::World;

use super::eeprom::{EepromError, Eeproms};

/// How long after a failed attempt the next one is made.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);

/// Images by drive, newest only.
type Images = BTreeMap<String, Image>;

struct Image {
    model: &'static str,
    bytes: Vec<u8>,
}

/// See the [module](self).
pub(crate) struct Keeper {
    /// The generation last handed over, by drive number.
    generations: BTreeMap<u8, u64>,
    images: Sender<(String, Image)>,
    writer: JoinHandle<Result<(), EepromError>>,
}

impl Keeper {
    /// Begins with the drives of `world` as kept: their images come from `eeproms` or are factory-fresh.
    pub(crate) fn start(eeproms: Eeproms, world: &mut World) -> Self {
        let (images, incoming) = channel();
        let writer = std::thread::spawn(move || write_all(&eeproms, &incoming));
        let numbers: Vec<u8> = world.drive_numbers().collect();
        let generation = |number| world.with_drive(number, |drive, _| drive.nvm_generation()).unwrap_or(0);
        let generations = numbers.iter().copied().zip(numbers.iter().copied().map(generation)).collect();
        Self { generations, images, writer }
    }

    /// Hands over what has changed since the last look.
    pub(crate) fn look(&mut self, world: &mut World) {
        for (number, known) in &mut self.generations {
            let changed = world.with_drive(*number, |drive, now| {
                drive.advance(now);
                let generation = drive.nvm_generation();
                let model = drive.model();
                (generation != *known).then(|| (generation, Image { model, bytes: drive.nvm_image() }))
            });
            if let Ok(Some((generation, image))) = changed {
                *known = generation;
                // The writer ends only after this sender.
                let _ = self.images.send((file_name(image.model, *number), image));
            }
        }
    }

    /// Returns when everything is on the disk, or with the reason why it cannot be.
    pub(crate) fn finish(self) -> Result<(), EepromError> {
        drop(self.images);
        // A panic of the writer has been reported by itself.
        self.writer.join().unwrap_or(Ok(()))
    }
}

/// The name under which a drive's image is kept.
pub(crate) fn file_name(model: &str, number: u8) -> String {
    format!("{model}@{number}")
}

fn write_all(eeproms: &Eeproms, incoming: &Receiver<(String, Image)>) -> Result<(), EepromError> {
    let mut waiting = Images::new();
    let mut reported = String::new();
    loop {
        let received = if waiting.is_empty() {
            incoming.recv().map_err(|_| RecvTimeoutError::Disconnected)
        } else {
            incoming.recv_timeout(RETRY_INTERVAL)
        };
        let over = matches!(received, Err(RecvTimeoutError::Disconnected));
        waiting.extend(received.into_iter().chain(incoming.try_iter()));
        match write_waiting(eeproms, &mut waiting) {
            Some(error) if over => return Err(error),
            // Said once for each reason, not twice a second.
            Some(error) if error.to_string() != reported => {
                reported = error.to_string();
                let text = format!("warning: {reported}; the file keeps its old contents, trying again");
                // Without standard error there is nobody to tell.
                let _ = writeln!(io::stderr(), "{text}");
            }
            Some(_) => {}
            None if over => return Ok(()),
            None => reported.clear(),
        }
    }
}

fn write_waiting(eeproms: &Eeproms, waiting: &mut Images) -> Option<EepromError> {
    let mut failed = None;
    waiting.retain(|drive, image| match eeproms.store(drive, image.model, &image.bytes) {
        Ok(()) => false,
        Err(error) => {
            failed = Some(error);
            true
        }
    });
    failed
}

//! Brings EEPROM contents to the disk while the simulation runs.
//!
//! A thread of its own writes what it is handed, so that a slow disk does not hold up the bus; of several contents of one
//! drive only the newest. What is on the disk is reported back, so that the drive's answer may go out. What cannot be written
//! (disk full) is reported and tried again; the answer then goes out all the same.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use sim::StoredImage;

use super::eeprom::{EepromError, Eeproms};
use super::messages::Messages;

/// How long after a failed attempt the next one is made.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);

/// See the [module](self).
pub struct StoreWriter {
    shared: Arc<WriterQueue>,
    /// How the last attempts went, when it is over.
    outcome: Receiver<Result<(), EepromError>>,
}

#[derive(Default)]
struct WriterQueue {
    state: Mutex<WriterState>,
    changed: Condvar,
}

#[derive(Default)]
struct WriterState {
    /// To be written, by drive number.
    waiting: BTreeMap<u8, StoredImage>,
    /// Written, or reported as unwritable: drive number and which store.
    settled: Vec<(u8, u64)>,
    over: bool,
}

impl StoreWriter {
    /// Writes to `eeproms` from now on. `settled` is called when there is something for [`take_settled`](Self::take_settled).
    pub fn start(eeproms: Eeproms, messages: Messages, settled: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(WriterQueue::default());
        let (done, outcome) = channel();
        let served = Arc::clone(&shared);
        std::thread::spawn(move || done.send(served.write_all(&eeproms, &messages, settled)));
        Self { shared, outcome }
    }

    /// One whose disk is the holder of the other value, which gets what is kept, by drive number and store.
    #[cfg(test)]
    pub fn by_hand() -> (Self, impl Fn(u8, u64)) {
        let shared = Arc::new(WriterQueue::default());
        let (_, outcome) = channel();
        let held = Arc::clone(&shared);
        (Self { shared, outcome }, move |number, generation| held.lock().settled.push((number, generation)))
    }

    /// Has an image brought to the disk.
    pub fn hand_over(&self, image: StoredImage) {
        self.shared.lock().waiting.insert(image.number, image);
        self.shared.changed.notify_one();
    }

    /// The stores that need not be waited for any more, by drive number.
    pub fn take_settled(&self) -> Vec<(u8, u64)> {
        std::mem::take(&mut self.shared.lock().settled)
    }

    /// Returns when everything is on the disk, or with the reason why it is not, at most after `patience`; `None` if nothing
    /// is known by then.
    pub fn finish(self, patience: Duration) -> Option<Result<(), EepromError>> {
        self.shared.lock().over = true;
        self.shared.changed.notify_one();
        self.outcome.recv_timeout(patience).ok()
    }
}

/// The name under which a drive's image is kept.
pub fn file_name(model: &str, number: u8) -> String {
    format!("{model}@{number}")
}

impl WriterQueue {
    fn lock(&self) -> MutexGuard<'_, WriterState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn write_all(&self, eeproms: &Eeproms, messages: &Messages, settled: impl Fn()) -> Result<(), EepromError> {
        let mut failed = None;
        let mut reported = String::new();
        loop {
            let images = match self.next(failed.is_some()) {
                Some(images) => images,
                None => return failed.map_or(Ok(()), Err),
            };
            failed = None;
            for (number, image) in images {
                let generation = image.generation;
                if let Err(error) = eeproms.store(&file_name(image.model, number), image.model, &image.bytes) {
                    // Said once for each reason, not twice a second.
                    if error.to_string() != reported {
                        reported = error.to_string();
                        messages.say(&format!(
                            "warning: {reported}; the file keeps its old contents, trying again. The drive acknowledges \
                             the store all the same"
                        ));
                    }
                    failed = Some(error);
                    self.lock().waiting.entry(number).or_insert(image);
                }
                self.lock().settled.push((number, generation));
                settled();
            }
            if failed.is_none() {
                reported.clear();
            }
        }
    }

    /// Waits for something to write, after a failure for some time in any case; `None` when it is over: after a failure
    /// that is one last attempt later.
    fn next(&self, after_failure: bool) -> Option<BTreeMap<u8, StoredImage>> {
        let mut state = self.lock();
        let was_over = state.over;
        if after_failure {
            if was_over {
                return None;
            }
            let waited = self.changed.wait_timeout_while(state, RETRY_INTERVAL, |state| !state.over);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let idle = |state: &mut WriterState| state.waiting.is_empty() && !state.over;
        state = self.changed.wait_while(state, idle).unwrap_or_else(PoisonError::into_inner);
        let images = std::mem::take(&mut state.waiting);
        (!images.is_empty()).then_some(images)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_secs(600);

    fn image(generation: u64) -> StoredImage {
        StoredImage { number: 1, model: "a", generation, bytes: vec![generation as u8; 8] }
    }

    #[test]
    fn what_is_settled_is_on_the_disk() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let eeproms = Eeproms::open(place).unwrap();
        let (wake, woken) = channel();
        let store_writer =
            StoreWriter::start(eeproms, Messages::of_warnings(), move || wake.send(()).expect("the test waits"));
        for generation in 1..20 {
            store_writer.hand_over(image(generation));
            woken.recv_timeout(SOON).unwrap();
            assert_eq!(store_writer.take_settled(), [(1, generation)]);
            let kept = std::fs::read(place.join("a@1.eeprom")).unwrap();
            assert_eq!(kept[kept.len() - 8..], [generation as u8; 8]);
        }
        assert!(matches!(store_writer.finish(SOON), Some(Ok(()))));
    }

    #[test]
    fn the_last_image_handed_over_is_on_the_disk_at_the_end() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let store_writer = StoreWriter::start(Eeproms::open(place).unwrap(), Messages::of_warnings(), || {});
        (1..=100).for_each(|generation| store_writer.hand_over(image(generation)));
        assert!(matches!(store_writer.finish(SOON), Some(Ok(()))));
        assert!(std::fs::read(place.join("a@1.eeprom")).unwrap().ends_with(&[100; 8]));
    }

    #[test]
    fn what_cannot_be_written_is_settled_and_reported_at_the_end() {
        let scratch = tempfile::tempdir().unwrap();
        let place = scratch.path();
        let (wake, woken) = channel();
        let store_writer = StoreWriter::start(Eeproms::open(place).unwrap(), Messages::of_warnings(), move || {
            wake.send(()).expect("the test waits")
        });
        std::fs::create_dir(place.join("a@1.new")).unwrap();
        store_writer.hand_over(image(3));
        woken.recv_timeout(SOON).unwrap();
        assert_eq!(store_writer.take_settled(), [(1, 3)]);
        assert!(matches!(store_writer.finish(SOON), Some(Err(EepromError::File(..)))));
    }
}

//! The order of a store: into the drive's memory, onto the disk, and only then the answer that acknowledges it.
//!
//! The world holds SDO answers back until a store is confirmed; Modbus answers are held here. A disk that takes longer than
//! clients wait for an answer is not waited for: the answer goes out, and that is reported. The time is measured by the wall clock,
//! however fast the time of the bus passes.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use can::Instant;
use sim::World;
use transport::{ModbusRequest, RegisterAnswer};

use super::eeprom::EepromError;
use super::messages::Messages;
use super::registers;
use super::store_writer::StoreWriter;

/// How long an answer waits for the disk. Less than the 300 ms after which canopen-python stops waiting for an SDO answer.
const DISK_PATIENCE: Duration = Duration::from_millis(250);

/// See the [module](self).
pub(crate) struct Stores {
    store_writer: StoreWriter,
    held: VecDeque<HeldAnswer>,
    /// What is waited for, by drive and store, and what the clock showed when that began.
    since: BTreeMap<(u8, u64), Instant>,
    /// The disk was slow at the last store: said once.
    slow: bool,
    messages: Messages,
}

/// A Modbus answer that waits for a store.
struct HeldAnswer {
    number: u8,
    needs: u64,
    request: ModbusRequest,
    answer: RegisterAnswer,
}

impl Stores {
    /// Begins with the drives of `world` as kept.
    pub(crate) fn guard(world: &mut World, store_writer: StoreWriter, messages: Messages) -> Self {
        world.guard_stores();
        Self { store_writer, held: VecDeque::new(), since: BTreeMap::new(), slow: false, messages }
    }

    /// Has a Modbus request answered, at once or when the store that the answer stands for is on the disk; the clock shows
    /// `clock`.
    pub(crate) fn answer(&mut self, world: &mut World, request: ModbusRequest, clock: Instant) {
        let (answer, number) = registers::answer(world, &request);
        let store = number.and_then(|number| Some((number, world.unconfirmed_store(number)?)));
        match store {
            Some((number, needs)) => {
                self.held.push_back(HeldAnswer { number, needs, request, answer });
                self.settle(world, clock);
            }
            None => request.answer(answer),
        }
    }

    /// Hands new contents to the disk, and lets out the answers that need wait no longer; the clock shows `clock`.
    pub(crate) fn settle(&mut self, world: &mut World, clock: Instant) {
        while let Some(image) = world.poll_store() {
            self.store_writer.hand_over(image);
        }
        for (number, generation) in self.store_writer.take_settled() {
            world.confirm_store(number, generation);
            self.slow &= self.is_waiting(world);
        }
        self.release(world);
        self.note_what_waits(world, clock);
        while let Some((number, needs)) = self.overdue(clock) {
            if !self.slow {
                self.messages.say(&format!(
                    "warning: the disk of --state is slow: drive {number} acknowledges a store that has not reached it \
                     after {} ms",
                    DISK_PATIENCE.as_millis()
                ));
            }
            self.slow = true;
            world.confirm_store(number, needs);
            self.release(world);
            self.note_what_waits(world, clock);
        }
    }

    /// What the clock shows when [`settle`](Self::settle) has to be called at the latest.
    pub(crate) fn wakes_at(&self) -> Option<Instant> {
        self.since.values().min().map(|since| *since + DISK_PATIENCE)
    }

    /// An answer waits for the disk.
    pub(crate) fn is_waiting(&self, world: &World) -> bool {
        !self.held.is_empty() || world.held_answers().next().is_some()
    }

    /// Returns when everything is on the disk, at most after `patience`; see [`StoreWriter::finish`].
    pub(crate) fn finish(self, world: &mut World, patience: Duration) -> Option<Result<(), EepromError>> {
        while let Some(image) = world.poll_store() {
            self.store_writer.hand_over(image);
        }
        self.store_writer.finish(patience)
    }

    /// What has begun to wait does so since now; what waits no longer is forgotten.
    fn note_what_waits(&mut self, world: &World, clock: Instant) {
        let registers = self.held.iter().map(|held| (held.number, held.needs));
        let before = std::mem::take(&mut self.since);
        let waiting = world.held_answers().chain(registers);
        self.since = waiting.map(|store| (store, before.get(&store).copied().unwrap_or(clock))).collect();
    }

    /// What has waited for longer than clients do.
    fn overdue(&self, clock: Instant) -> Option<(u8, u64)> {
        self.since.iter().find(|(_, since)| **since + DISK_PATIENCE <= clock).map(|(store, _)| *store)
    }

    fn release(&mut self, world: &World) {
        let all = std::mem::take(&mut self.held);
        for held in all {
            if world.is_store_confirmed(held.number, held.needs) {
                held.request.answer(held.answer);
            } else {
                self.held.push_back(held);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use can::Bitrate;
    use sim::machine::zlac8030l;

    use super::*;

    /// 2000h, which is stored with each write, becomes 700.
    const WRITE_700: &str = "604#2B002000BC020000";

    /// A world in which a drive's answer waits for the disk.
    fn waiting() -> (World, sim::StationId) {
        let mut world = World::new(Bitrate::K500, 1);
        let probe = world.add_probe();
        world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
        world.run_for(Duration::from_millis(500));
        (world, probe)
    }

    fn answers(world: &mut World, probe: sim::StationId) -> usize {
        world.run_for(Duration::from_millis(2));
        std::iter::from_fn(|| world.poll_received(probe)).filter(|(_, frame)| frame.id().raw() == 0x584).count()
    }

    #[test]
    fn a_disk_has_its_time_by_the_clock_however_fast_the_bus_goes() {
        let at = Instant::from_millis;
        let (mut world, probe) = waiting();
        let (store_writer, kept) = StoreWriter::by_hand();
        let mut stores = Stores::guard(&mut world, store_writer, Messages::silent());
        let write = |world: &mut World| world.send(probe, WRITE_700.parse().unwrap()).unwrap();
        write(&mut world);
        world.run_for(Duration::from_millis(5));
        stores.settle(&mut world, at(1000));
        assert!(stores.is_waiting(&world));
        assert_eq!(stores.wakes_at(), Some(at(1250)));
        // Ten seconds of the bus are 249 ms of the disk's.
        world.run_for(Duration::from_secs(10));
        stores.settle(&mut world, at(1249));
        assert!(stores.is_waiting(&world) && answers(&mut world, probe) == 0);
        stores.settle(&mut world, at(1250));
        assert!(!stores.is_waiting(&world) && stores.wakes_at().is_none());
        assert_eq!(answers(&mut world, probe), 1);
        // One that is kept goes out at once.
        write(&mut world);
        world.run_for(Duration::from_millis(5));
        stores.settle(&mut world, at(2000));
        let (number, generation) = world.held_answers().next().unwrap();
        kept(number, generation);
        stores.settle(&mut world, at(2001));
        assert_eq!((answers(&mut world, probe), stores.wakes_at()), (1, None));
    }
}

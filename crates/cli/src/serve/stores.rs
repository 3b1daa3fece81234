//! The order of a store: into the drive's memory, onto the disk, and only then the answer that acknowledges it.
//!
//! The world holds SDO answers back until a store is confirmed; Modbus answers are held here. A disk that takes longer than
//! clients wait for an answer is not waited for: the answer goes out, and that is said.

use std::collections::VecDeque;
use std::time::Duration;

use can::Instant;
use sim::World;
use transport::{ModbusRequest, RegisterAnswer};

use super::eeprom::EepromError;
use super::keeper::Keeper;
use super::registers;
use super::speaker::Speaker;

/// How long an answer waits for the disk. Less than the 300 ms after which canopen-python gives up on an SDO answer.
const DISK_PATIENCE: Duration = Duration::from_millis(250);

/// See the [module](self).
pub(crate) struct Stores {
    keeper: Keeper,
    held: VecDeque<HeldAnswer>,
    /// The disk was slow at the last store: said once.
    slow: bool,
    speaker: Speaker,
}

/// A Modbus answer that waits for a store.
struct HeldAnswer {
    number: u8,
    needs: u64,
    since: Instant,
    request: ModbusRequest,
    answer: RegisterAnswer,
}

impl Stores {
    /// Begins with the drives of `world` as kept.
    pub(crate) fn guard(world: &mut World, keeper: Keeper, speaker: Speaker) -> Self {
        world.guard_stores();
        Self { keeper, held: VecDeque::new(), slow: false, speaker }
    }

    /// Has a Modbus request answered, at once or when the store that the answer stands for is on the disk.
    pub(crate) fn answer(&mut self, world: &mut World, request: ModbusRequest) {
        let (answer, number) = registers::answer(world, &request);
        let store = number.and_then(|number| Some((number, world.unconfirmed_store(number)?)));
        match store {
            Some((number, needs)) => {
                self.held.push_back(HeldAnswer { number, needs, since: world.now(), request, answer });
                self.settle(world);
            }
            None => request.answer(answer),
        }
    }

    /// Hands new contents to the disk, and lets out the answers that need wait no longer.
    pub(crate) fn settle(&mut self, world: &mut World) {
        while let Some(image) = world.poll_store() {
            self.keeper.hand_over(image);
        }
        for (number, generation) in self.keeper.take_settled() {
            world.confirm_store(number, generation);
            self.slow &= self.longest_held(world).is_some();
        }
        while let Some((number, needs, _)) = self.longest_held(world).filter(|held| overdue_at(held) <= world.now()) {
            if !self.slow {
                self.speaker.say(&format!(
                    "warning: the disk of --state is slow: drive {number} acknowledges a store that has not reached it \
                     after {} ms",
                    DISK_PATIENCE.as_millis()
                ));
            }
            self.slow = true;
            world.confirm_store(number, needs);
            self.release(world);
        }
        self.release(world);
    }

    /// When [`settle`](Self::settle) has to be called at the latest.
    pub(crate) fn next_deadline(&self, world: &World) -> Option<Instant> {
        self.longest_held(world).map(|held| overdue_at(&held))
    }

    /// Returns when everything is on the disk, at most after `patience`; see [`Keeper::finish`].
    pub(crate) fn finish(mut self, world: &mut World, patience: Duration) -> Option<Result<(), EepromError>> {
        self.settle(world);
        self.keeper.finish(patience)
    }

    fn longest_held(&self, world: &World) -> Option<(u8, u64, Instant)> {
        let register = self.held.front().map(|held| (held.number, held.needs, held.since));
        world.longest_held().into_iter().chain(register).min_by_key(|(_, _, since)| *since)
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

fn overdue_at((_, _, since): &(u8, u64, Instant)) -> Instant {
    *since + DISK_PATIENCE
}

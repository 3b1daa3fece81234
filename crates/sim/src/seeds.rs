//! What a world's seed gives to each drive: the same numbers to a drive that stands alone as to one in a world.

use crate::Prng;

/// Distinguishes the seeds of a drive's timing from those of its noise.
const TIMING: u64 = 0x7469_6D69_6E67;

/// The seed of the jitter of the drive under `number` in a world of this seed
/// ([`set_timing`](crate::VirtualDrive::set_timing)).
pub fn timing_seed(world: u64, number: u8) -> u64 {
    seed_of(world, number, TIMING)
}

/// The seed of its noise ([`set_realism`](crate::VirtualDrive::set_realism)).
pub fn noise_seed(world: u64, number: u8) -> u64 {
    seed_of(world, number, 0)
}

fn seed_of(world: u64, number: u8, purpose: u64) -> u64 {
    Prng::new(world ^ purpose ^ u64::from(number) << 32).next_u64()
}

//! What another master does to a drive while this program moves it: neither success nor a kept motion is reported, and the cause
//! is named.

use std::time::Duration;

use master::Network;
use master::drive::MotionOptions;
use master::units::{Rpm, Turns};
use sim::block_on;

use super::{Bench, models, options};
use crate::support::mux;

/// The outcome of `first`, while `second` goes on beside it.
async fn beside<T>(first: impl Future<Output = T>, second: impl Future<Output = ()>) -> T {
    type Part<'a, T> = std::pin::Pin<Box<dyn Future<Output = Option<T>> + 'a>>;
    let first: Part<'_, T> = Box::pin(async { Some(first.await) });
    let second: Part<'_, T> = Box::pin(async {
        second.await;
        None
    });
    let ended = master::join_all([first, second]).await.into_iter().flatten().next();
    ended.expect("the first one has ended")
}

/// What another master does to a drive that is moved, and the words that report it.
type Meddling = (&'static str, &'static [(canopen::Mux, i64, u8)], &'static str);

/// Halt (bit 8), and another target.
const HALT: Meddling = ("halt", &[(mux(0x6040, 0), 0x010F, 2)], "another master has halted it");
const TARGET: Meddling = (
    "another target",
    // A joint follows the target as soon as it is written and bit 4 rises; so do the others with bits 4 and 5.
    &[(mux(0x6040, 0), 0x0F, 2), (mux(0x607A, 0), 0, 4), (mux(0x6040, 0), 0x3F, 2)],
    "another master gave it another target",
);

#[test]
fn a_move_that_another_master_stops_is_not_reported_as_reached() {
    for name in models() {
        for (what, frames, says) in [HALT, TARGET] {
            let mut bench = Bench::new(name);
            let other = Network::new();
            bench.world.add_station(other.clone());
            let [drive, _] = bench.drives.clone();
            let id = drive.node().id();
            let meddle = async {
                bench.network.sleep(Duration::from_secs(2)).await;
                for (object, value, size) in frames {
                    other.node(id).download(*object, &value.to_le_bytes()[..usize::from(*size)]).await.unwrap();
                }
            };
            let to = MotionOptions { wait: true, ..options() };
            let moved = beside(drive.move_absolute(Turns(10.0), to), meddle);
            let outcome = block_on(&mut bench.world, moved).unwrap();
            let error = outcome.expect_err(&format!("{name}, {what}"));
            assert!(error.to_string().contains(says), "{name}, {what}: {error}");
            assert!(bench.network.moved().contains(id), "{name}, {what}: it was not seen to stand");
        }
    }
}

#[test]
fn a_speed_that_another_master_takes_away_is_not_reported_as_kept() {
    for name in models() {
        let mut bench = Bench::new(name);
        let other = Network::new();
        bench.world.add_station(other.clone());
        let [drive, _] = bench.drives.clone();
        let id = drive.node().id();
        bench.run(drive.velocity(Rpm(60.0), MotionOptions { wait: true, ..options() })).unwrap();
        let target = drive.axis_description().unwrap().units.target_velocity.unwrap().object;
        let began = bench.world.now();
        let meddle = async {
            bench.network.sleep(Duration::from_secs(1)).await;
            other.node(id).write(target, 0_i32).await.unwrap();
        };
        let kept = beside(drive.supervise(Duration::from_secs(6)), meddle);
        let error = block_on(&mut bench.world, kept).unwrap().unwrap_err();
        assert!(error.to_string().contains("another master gave it another target"), "{name}: {error}");
        // Not at the end of the six seconds.
        assert!(bench.world.now() - began < Duration::from_secs(2), "{name}");
    }
}

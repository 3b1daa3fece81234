//! A thousand worlds of one ZLAC8030L in one process and one thread, as tests, sweeps and learning need them: what it takes to
//! start one, to take a snapshot of it, and to go back to that, and how large it is.
//!
//! ```text
//! cargo run --profile dist -p ferrodrive-benches --example many_worlds
//! ```
//!
//! Times are the least of the thousand: those of a machine with nothing else to do. The worlds then take turns of 10 ms each,
//! and end with one digest, since they are the same.

#![allow(clippy::print_stdout, reason = "a program that people run")]

use std::time::{Duration, Instant};

use can::Bitrate;
use sim::World;
use sim::machine::zlac8030l;

const WORLDS: usize = 1_000;
const TURN: Duration = Duration::from_millis(10);
const TURNS: u32 = 10;

/// A world of one drive that has power.
fn started() -> World {
    let mut world = World::new(Bitrate::M1, 1);
    world.add_probe();
    world.add_drive(4, Box::new(zlac8030l(4, 0))).expect("the first of its number");
    world
}

fn main() {
    let before_kb = resident_kb();
    let (mut worlds, starts): (Vec<World>, Vec<Duration>) = (0..WORLDS).map(|_| timed(started)).unzip();
    println!("start: {:.1} us", least_us(starts));
    for _ in 0..TURNS {
        worlds.iter_mut().for_each(|world| world.run_for(TURN));
    }
    if let Some((before, after)) = before_kb.zip(resident_kb()) {
        println!("memory: {:.1} kB each", (after - before) / WORLDS as f64);
    }
    let first = worlds[0].digest();
    let same = worlds.iter_mut().map(World::digest).filter(|digest| *digest == first).count();
    println!("{WORLDS} worlds, {same} of them the same");
    let (snapshots, took): (Vec<World>, Vec<Duration>) = worlds.iter().map(|world| timed(|| world.snapshot())).unzip();
    println!("snapshot: {:.1} us", least_us(took));
    let back = worlds.iter_mut().zip(&snapshots).map(|(world, snapshot)| timed(|| world.clone_from(snapshot)).1);
    println!("back to it: {:.1} us", least_us(back));
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let begin = Instant::now();
    (work(), begin.elapsed())
}

fn least_us(times: impl IntoIterator<Item = Duration>) -> f64 {
    times.into_iter().min().unwrap_or_default().as_secs_f64() * 1e6
}

/// What of this process is in memory, from `/proc`; `None` where there is none.
fn resident_kb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.split_whitespace().next()?.parse().ok()
}

//! Runs a world of the benchmark `drives` for so many virtual milliseconds, for a profiler, an instruction counter or a
//! training run to look at. The digest on the last line shows whether two builds did the same.
//!
//! Arguments: the number of a world (from 0; without arguments they are listed), milliseconds, and threads (1 if not given).
//! Where threads are given, a line says how fast the fastest fifth of the milliseconds was. The difference between
//! two runs, divided by the difference of their lengths, is what a virtual millisecond takes:
//!
//! ```text
//! cargo build --profile dist -p ferrodrive-benches --example run_world
//! for ms in 1000 2000; do
//!     valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!         target/dist/examples/run_world 0 $ms 2>&1 | grep Collected
//! done
//! ```

#![allow(clippy::print_stdout, reason = "a program that people run")]

#[path = "../workload/worlds.rs"]
mod workload;

use std::error::Error;
use std::time::{Duration, Instant};

use sim::World;
use workload::{WORLDS, world};

/// The least time of so many is that of a machine with nothing else to do, nearly.
const PIECES: u32 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (number, ms, threads) = match arguments.as_slice() {
        [number, ms] => (number, ms, 1),
        [number, ms, threads] => (number, ms, threads.parse()?),
        _ => {
            WORLDS.iter().enumerate().for_each(|(number, name)| println!("{number} {name}"));
            return Ok(());
        }
    };
    let name = *WORLDS.get(number.parse::<usize>()?).ok_or("no world of this number")?;
    let mut world = world(name).ok_or("a world that is listed and not made")?;
    world.set_threads(threads);
    let piece = Duration::from_millis(ms.parse()?) / PIECES;
    let timed = |world: &mut World| {
        let begin = Instant::now();
        world.run_for(piece);
        begin.elapsed()
    };
    let least = (0..PIECES).map(|_| timed(&mut world)).min().unwrap_or_default();
    let times = piece.as_secs_f64() / least.as_secs_f64();
    if arguments.len() == 3 {
        println!("{times:.2} times real time on {threads} threads");
    }
    println!("{name}: {ms} ms more, {:?}", world.digest());
    Ok(())
}

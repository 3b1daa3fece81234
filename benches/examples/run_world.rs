//! Runs a world of the benchmark `drives` for so many virtual milliseconds, for a profiler, an instruction counter or a
//! training run to look at. The digest on the last line shows whether two builds did the same.
//!
//! Arguments: the number of a world (from 0; without arguments they are listed) and milliseconds. The difference between
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
use std::time::Duration;

use workload::{WORLDS, world};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [number, ms] = arguments.as_slice() else {
        WORLDS.iter().enumerate().for_each(|(number, name)| println!("{number} {name}"));
        return Ok(());
    };
    let name = *WORLDS.get(number.parse::<usize>()?).ok_or("no world of this number")?;
    let mut world = world(name).ok_or("a world that is listed and not made")?;
    world.run_for(Duration::from_millis(ms.parse()?));
    println!("{name}: {ms} ms more, {:?}", world.digest());
    Ok(())
}

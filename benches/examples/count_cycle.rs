//! Runs so many cycles of six drives in the master (without an argument: 1000), for a counter of instructions or of
//! allocations to look at. The difference between two runs, divided by the difference of their lengths, is what one cycle
//! takes:
//!
//! ```text
//! cargo build --profile dist -p ferrodrive-benches --example count_cycle
//! for cycles in 10000 20000; do
//!     valgrind --tool=callgrind --callgrind-out-file=/dev/null target/dist/examples/count_cycle $cycles 2>&1 | grep Collected
//!     valgrind target/dist/examples/count_cycle $cycles 2>&1 | grep "total heap usage"
//! done
//! ```

#[path = "../workload/cycle.rs"]
mod workload;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let cycles: u32 = std::env::args().nth(1).map_or(Ok(1000), |text| text.parse())?;
    let mut line = workload::Line::new();
    for _ in 0..cycles {
        line.cycle();
    }
    Ok(())
}

//! Makes the same exchange many times, for an instruction counter to look at: a count does not depend on what else the
//! machine does, as a time does.
//!
//! Arguments: `node`, `firmware` or `idle`, the number of a frame of the workload (from 0), and how many exchanges
//! (without arguments: `node 0 10000`). The difference between two runs, divided by the difference of their lengths, is
//! what one exchange takes:
//!
//! ```text
//! cargo build --profile dist -p ferrodrive-benches --example count_instructions
//! for exchanges in 10000 20000; do
//!     valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!         target/dist/examples/count_instructions node 0 $exchanges 2>&1 | grep Collected
//! done
//! ```

#[path = "../workload/firmware.rs"]
mod workload;

use std::error::Error;
use std::hint::black_box;

use workload::{FRAMES, exchange_with_firmware, exchange_with_node, firmware, frame, idle, node};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.is_empty() {
        arguments = ["node", "0", "10000"].map(String::from).to_vec();
    }
    let [subject, number, exchanges] = arguments.as_slice() else {
        return Err("arguments: node, firmware or idle; number of the frame; exchanges".into());
    };
    let (_, text) = FRAMES.get(number.parse::<usize>()?).ok_or("no frame of this number")?;
    let (frame, exchanges) = (frame(text), 0..exchanges.parse::<u32>()?);
    let (mut node, mut drive) = (node(), firmware());
    match subject.as_str() {
        "node" => exchanges.for_each(|_| _ = black_box(exchange_with_node(&mut node, &frame))),
        "firmware" => exchanges.for_each(|_| _ = black_box(exchange_with_firmware(&mut drive, &frame))),
        "idle" => exchanges.for_each(|_| _ = black_box(idle(&mut node))),
        _ => return Err("subjects: node, firmware, idle".into()),
    }
    Ok(())
}

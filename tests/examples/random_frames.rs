//! So many random frames (the first argument; 1000000 without one) over every kind of node, from a seed (the second; 1).

use std::error::Error;
use std::io::Write;

use ferrodrive_tests::random_frames::{kinds, survives};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let frames: u64 = arguments.next().map_or(Ok(1_000_000), |text| text.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let kinds = kinds();
    let each = frames.div_ceil(kinds.len() as u64);
    for model in kinds {
        let seen = survives(model, each, seed);
        writeln!(
            std::io::stdout(),
            "{:14} {:>10} frames, {:>10} SDO answers, {:>10} other frames",
            model.name,
            seen.frames,
            seen.answers,
            seen.others
        )?;
    }
    Ok(())
}

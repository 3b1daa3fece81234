//! The lights of a drive, watched as a person would: flashes, and the longer darkness between two rounds of them.

use std::time::Duration;

use super::bench::Bench;

/// Darkness that lasts this long ends a round. No manual prints times.
const PAUSE: Duration = Duration::from_millis(800);

const LOOK: Duration = Duration::from_millis(20);

/// Longest time to watch; the longest round of the three drives takes about 5 s.
const LIMIT: Duration = Duration::from_secs(15);

/// How long each flash of one whole round lasts. Empty if it does not flash.
pub(super) fn red_flashes(bench: &mut Bench) -> Vec<Duration> {
    bench.unseen(|bench| {
        let begin = bench.now();
        let (mut lit, mut dark, mut seen, mut in_round) = (Duration::ZERO, Duration::ZERO, Vec::new(), false);
        while bench.now() - begin < LIMIT && (seen.is_empty() || dark < PAUSE) {
            bench.run(LOOK);
            if bench.output("RED") {
                (lit, dark) = (lit + LOOK, Duration::ZERO);
                continue;
            }
            if !lit.is_zero() && in_round {
                seen.push(lit);
            }
            (lit, dark) = (Duration::ZERO, dark + LOOK);
            // A round is counted from its start only.
            in_round |= dark >= PAUSE;
        }
        seen
    })
}

/// How often an output changes in a second.
pub(super) fn changes(bench: &mut Bench, output: &str) -> u32 {
    const LOOKS: u32 = 200;
    let mut lit = bench.output(output);
    let mut changes = 0;
    for _ in 0..LOOKS {
        bench.unseen(|bench| bench.run_ms(5));
        let now = bench.output(output);
        changes += u32::from(now != lit);
        lit = now;
    }
    changes
}

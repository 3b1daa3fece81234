//! A host that writes anything anywhere, while the world of the machine changes at random.

use crate::bench::{Bench, BenchSubject};
use crate::manual::ObjectRow;
use crate::seeded::Seeded;

/// Writes of a conversation.
const WRITES: usize = 120;

/// What a host writes to move a drive: a third of all writes, or it would hardly ever be enabled.
const COMMANDS: [u16; 5] = [0x6040, 0x6060, 0x607A, 0x60FF, 0x6071];

/// What is different from drive to drive.
#[derive(Debug)]
pub struct Play<S> {
    /// How many conversations.
    pub seeds: u64,
    /// Objects that are not written: they would end the conversation by themselves.
    pub spared: &'static [u16],
    /// What hands do to the machine now and then, and what undoes it, as world commands without their node; nothing undoes
    /// what is over by itself, and `> ` begins a frame.
    pub hands: &'static [(&'static str, &'static str)],
    /// The bits of the state, and their values in each; none where any will do.
    pub states: (u16, &'static [u16]),
    /// Asserts that the drive, mended and restarted, is as delivered; with the seed, for the message.
    pub recovers: fn(&mut Bench<S>, u64),
}

/// Every write is answered, every number that can be measured stays finite, every statusword is one of a state, and in
/// the end the drive recovers.
pub fn is_answered_and_breaks_nothing<S: BenchSubject>(play: &Play<S>) {
    let writable = |row: &&ObjectRow| row.writable && !play.spared.contains(&row.index);
    let rows: Vec<_> = S::rows().all().iter().filter(writable).collect();
    let commands: Vec<_> = rows.iter().copied().filter(|row| COMMANDS.contains(&row.index)).collect();
    for seed in 0..play.seeds {
        let mut seeded = Seeded::new(seed);
        let mut bench = Bench::new();
        for step in 0..WRITES {
            let among = if seeded.below(3) == 0 { &commands } else { &rows };
            let row = among[seeded.below(among.len())];
            let value = any_value(&mut seeded, row);
            // Taken or refused, but answered: `write` panics without an answer.
            let _ = bench.write((row.index, row.sub), value);
            if seeded.below(5) == 0 {
                let (done, undone) = play.hands[seeded.below(play.hands.len())];
                act(&mut bench, if seeded.below(3) == 0 { undone } else { done });
            }
            bench.run_ms(seeded.below(20) as u64);
            let report = bench.report();
            let at =
                format!("seed {seed}, step {step}, after {:04X}h:{:02X} = {value}: {report:?}", row.index, row.sub);
            let finite = [report.velocity_rpm, report.current_a, report.supply_v, report.shaft_angle_rad];
            assert!(finite.iter().all(|value| value.is_finite()) && report.supply_v < 500.0, "{at}");
            let state = report.statusword.unwrap_or_default() & play.states.0;
            assert!(play.states.1.is_empty() || play.states.1.contains(&state), "{at}");
        }
        play.hands.iter().for_each(|(_, undone)| act(&mut bench, undone));
        (play.recovers)(&mut bench, seed);
    }
}

fn act<S: BenchSubject>(bench: &mut Bench<S>, line: &str) {
    match line.strip_prefix("> ") {
        Some(frame) => bench.send(frame),
        None if line.is_empty() => bench,
        None => bench.world(&format!("{} {line}", S::NODE)),
    };
}

/// A legal value mostly, sometimes any.
fn any_value(seeded: &mut Seeded, row: &ObjectRow) -> i64 {
    match (row.limits, seeded.below(4)) {
        (_, 0) => seeded.bits() as i64 >> (64 - row.size * 8),
        (Some((low, high)), _) => low + (seeded.bits() % (high - low + 1) as u64) as i64,
        (None, _) if row.index == 0x6040 => [0x06, 0x07, 0x0F, 0x1F, 0x5F, 0x02, 0x80, 0x10F, 0x00][seeded.below(9)],
        (None, _) => row.default.unwrap_or_default(),
    }
}

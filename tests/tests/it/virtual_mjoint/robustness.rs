//! Whatever is sent and done, the joint goes on living, and its numbers stay numbers.

use ferrodrive_tests::bench::mjoint::MJoint;
use ferrodrive_tests::random_host::{self, Play};
use ferrodrive_tests::seeded::Seeded;

use crate::virtual_mjoint::bench::Bench;

/// Node-ID and COB-IDs end the conversation by themselves.
const SPARED: [u16; 9] = [0x2615, 0x1400, 0x1401, 0x1402, 0x1403, 0x1800, 0x1801, 0x1802, 0x1803];

#[test]
fn a_host_that_writes_anything_anywhere_is_answered_and_breaks_nothing() {
    random_host::is_answered_and_breaks_nothing(&Play::<MJoint> {
        seeds: 40,
        spared: &SPARED,
        hands: &[
            ("pulses 5000 400000", ""),
            ("quadrature -5000 100000", ""),
            ("duty 73", ""),
            ("load torque 40", "load torque 0"),
            ("load torque -40", "load torque 0"),
            ("load inertia 0.5", "load inertia 0"),
            ("rotor lock", "rotor free"),
            ("battery off", "battery on"),
            ("switch DIR -1000 1000", ""),
            ("supply 60", "supply 36"),
            ("> 201#2F000150C30000", "> 201#0F0007"),
            ("> 301#A0860100E8030000", ""),
            ("> 401#0F0003F4010000", ""),
            ("> 501#10270000", ""),
            ("> 080#", "> 77F#05"),
        ],
        // It has no power states; bits 0 to 5, 10, 12 and 13 are all that the statusword has.
        states: (!0x343F, &[0]),
        recovers: |bench, _| _ = bench.power_cycle().reads(0x1000, 0x0002_0192),
    });
}

/// What a host may write, all of it lawful: an object and its values.
const WRITES: [(u16, &[i64]); 10] = [
    (0x6040, &[0x0F, 0x2F, 0x5F, 0x10F, 0x0B, 0, 0x80]),
    (0x6060, &[1, 3, 6, 7]),
    (0x607A, &[50_000, -50_000]),
    (0x60FF, &[1000, -1000]),
    (0x260C, &[10_000]),
    (0x6083, &[60_000, 2000]),
    (0x2601, &[0, 1]),
    (0x2600, &[0, 1]),
    (0x260A, &[60_006, 60_016]),
    (0x261C, &[1, 255, 0]),
];
const FRAMES: &str = "201#2F000150C30000 401#0F0003F4010000 501#10270000 080# 77F#05 000#8001 000#0101";
/// What hands may do, and in the end undo.
const HANDS: [(&str, &str); 13] = [
    ("pulses 3000 50000", ""),
    ("pulses -3000 50000", ""),
    ("duty 50", "duty 0"),
    ("clock 10000", ""),
    ("switch DIR min -3000", "input DIR 0"),
    ("input DIR 0", ""),
    ("load torque 15", "load torque 0"),
    ("load torque -15", "load torque 0"),
    ("rotor lock", "rotor free"),
    ("supply 54", "supply 36"),
    ("supply 30", "supply 36"),
    ("battery off", ""),
    ("fault encoder on", "fault encoder off"),
];

#[test]
fn after_any_lawful_mess_a_host_that_begins_anew_reaches_its_target() {
    let writes: Vec<_> =
        WRITES.iter().flat_map(|(index, values)| values.iter().map(|value| (*index, *value))).collect();
    let frames: Vec<_> = FRAMES.split(' ').collect();
    for seed in 0..30 {
        let mut seeded = Seeded::new(seed);
        let mut bench = Bench::new();
        let mut heard = Vec::new();
        for _ in 0..60 {
            if seeded.below(4) == 0 {
                let (done, undone) = HANDS[seeded.below(HANDS.len())];
                let line = if undone.is_empty() || seeded.below(4) > 0 { done } else { undone };
                bench.world(&format!("1 {line}"));
                heard.push(line.to_owned());
            } else if let Some((index, value)) = writes.get(seeded.below(writes.len() + frames.len())) {
                // Taken or refused.
                let _ = bench.write(*index, *value);
                heard.push(format!("{index:04X}h = {value}"));
            } else {
                let frame = frames[seeded.below(frames.len())];
                bench.send(frame);
                heard.push(frame.to_owned());
            }
            bench.run_ms(seeded.below(60) as u64);
        }
        for (_, undone) in HANDS.iter().filter(|(_, undone)| !undone.is_empty()) {
            bench.world(&format!("1 {undone}"));
        }
        bench.send("000#0101");
        // A bus that the load has charged empties slowly.
        bench.run_ms(3000);
        bench.set((0x1016, 1), 0).set(0x6040, 0).set(0x2601, 0).set(0x2601, 1).set(0x6083, 20_000).set(0x6060, 1);
        bench.set(0x6040, 0x80).set(0x6040, 0x0F).set(0x6040, 0x2F);
        bench.run_ms(300);
        let target = bench.position() + 100_000;
        bench.set(0x607A, target).run_ms(3000);
        let (position, statusword) = (bench.position(), bench.statusword());
        let away = position - target;
        assert!(away.abs() <= 30, "seed {seed}: {away} away, {statusword:04X}h: {heard:?}");
        assert_eq!(statusword & !0x0008, 0x0437, "seed {seed}: {heard:?}");
    }
}

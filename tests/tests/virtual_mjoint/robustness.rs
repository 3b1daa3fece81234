//! Whatever is sent and done, the joint goes on living, and its numbers stay numbers.

use ferrodrive_tests::bench::mjoint::MJoint;
use ferrodrive_tests::random_host::{self, Play};
use sim::Prng;

use crate::bench::Bench;

/// Node-ID and COB-IDs end the conversation by themselves.
const SPARED: [u16; 9] = [0x2615, 0x1400, 0x1401, 0x1402, 0x1403, 0x1800, 0x1801, 0x1802, 0x1803];

#[test]
fn a_host_that_writes_anything_anywhere_is_answered_and_breaks_nothing() {
    random_host::is_answered_and_breaks_nothing(&Play::<MJoint> {
        seeds: 40,
        spared: &SPARED,
        hands: &[
            "pulses 5000 400000",
            "quadrature -5000 100000",
            "duty 73",
            "load torque 40",
            "load torque -40",
            "load inertia 0.5",
            "rotor lock",
            "rotor free",
            "battery off",
            "battery on",
            "switch DIR -1000 1000",
            "supply 60",
            "supply 36",
            "> 201#2F000150C30000",
            "> 301#A0860100E8030000",
            "> 401#0F0003F4010000",
            "> 501#10270000",
            "> 201#0F0007",
            "> 080#",
            "> 77F#05",
        ],
        mended: &["supply 36", "rotor free", "load torque 0"],
        // It has no power states; bits 0 to 5, 10, 12 and 13 are all that the statusword has.
        states: (!0x343F, &[0]),
        recovers: |bench, _| _ = bench.power_cycle().reads(0x1000, 0x0002_0192),
    });
}

/// What a host may send and hands may do, all of it lawful.
const MESS: &[&str] = &[
    "601#2B4060000F000000",
    "601#2B4060002F000000",
    "601#2B4060005F000000",
    "601#2B4060000F010000",
    "601#2B4060000B000000",
    "601#2B40600000000000",
    "601#2B40600080000000",
    "601#2F60600001000000",
    "601#2F60600003000000",
    "601#2F60600006000000",
    "601#2F60600007000000",
    "601#237A600050C30000",
    "601#237A6000B03CFFFF",
    "601#23FF6000E8030000",
    "601#23FF600018FCFFFF",
    "601#230C260010270000",
    "601#2383600060EA0000",
    "601#23836000D0070000",
    "601#2B01260000000000",
    "601#2B01260001000000",
    "601#2B00260001000000",
    "601#2B00260000000000",
    "601#2B0A260066EA0000",
    "601#2B0A260070EA0000",
    "601#2B1C260001000000",
    "601#2B1C2600FF000000",
    "601#2B1C260000000000",
    "201#2F000150C30000",
    "401#0F0003F4010000",
    "501#10270000",
    "080#",
    "77F#05",
    "000#8001",
    "000#0101",
];
const HANDS: &[&str] = &[
    "1 pulses 3000 50000",
    "1 pulses -3000 50000",
    "1 duty 50",
    "1 clock 10000",
    "1 switch DIR min -3000",
    "1 input DIR 0",
    "1 load torque 15",
    "1 load torque -15",
    "1 rotor lock",
    "1 rotor free",
    "1 supply 54",
    "1 supply 30",
    "1 battery off",
    "1 fault encoder on",
    "1 fault encoder off",
];

#[test]
fn after_any_lawful_mess_a_host_that_begins_anew_reaches_its_target() {
    for seed in 0..30 {
        let mut random = Prng::new(seed);
        let mut bench = Bench::new();
        let mut told = Vec::new();
        for _ in 0..60 {
            let line = if random.below(4) == 0 {
                let line = HANDS[random.below(HANDS.len() as u64) as usize];
                bench.tell(line);
                line
            } else {
                let line = MESS[random.below(MESS.len() as u64) as usize];
                bench.send(line);
                line
            };
            told.push(line);
            bench.run_ms(random.below(60));
        }
        let hands =
            ["1 rotor free", "1 load torque 0", "1 supply 36", "1 fault encoder off", "1 input DIR 0", "1 duty 0"];
        for line in hands {
            bench.tell(line);
        }
        bench.send("000#0101");
        // A bus that the load has charged empties slowly.
        bench.run_ms(3000);
        for (index, value) in [
            (0x1016, 0),
            (0x6040, 0),
            (0x2601, 0),
            (0x2601, 1),
            (0x6083, 20_000),
            (0x6060, 1),
            (0x6040, 0x80),
            (0x6040, 0x0F),
            (0x6040, 0x2F),
        ] {
            bench.set((index, u8::from(index == 0x1016)), value);
        }
        bench.run_ms(300);
        let target = bench.position() + 100_000;
        bench.set(0x607A, target).run_ms(3000);
        let (position, statusword) = (bench.position(), bench.statusword());
        assert!(
            (position - target).abs() <= 30,
            "seed {seed}: {} away, {statusword:04X}h: {told:?}",
            position - target
        );
        assert_eq!(statusword & !0x0008, 0x0437, "seed {seed}: {told:?}");
    }
}

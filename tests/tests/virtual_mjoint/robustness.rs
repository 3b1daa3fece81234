//! Whatever is sent and done, the joint goes on living, and its numbers stay numbers.

use can::{CanId, Frame};
use ferrodrive_tests::mjoint::objects;
use sim::Prng;

use crate::bench::{Bench, head};

const SEEDS: u64 = 12;
const STEPS: u32 = 400;

#[test]
fn random_writes_pdos_and_hands_at_the_machine_break_nothing() {
    let writable: Vec<(u16, u8, usize)> = objects()
        .iter()
        .filter(|joint| joint.row.writable && !matches!(joint.row.index, 0x1400..=0x1BFF | 0x2615))
        .map(|joint| (joint.row.index, joint.row.sub, joint.row.size))
        .collect();
    for seed in 0..SEEDS {
        let mut random = Prng::new(seed);
        let mut bench = Bench::new();
        for _ in 0..STEPS {
            let frame = match random.below(8) {
                0..=3 => {
                    let (index, sub, size) = writable[random.below(writable.len() as u64) as usize];
                    let mut request = head(0x23 | (4 - size as u8) << 2, index, sub);
                    let value = if random.below(2) == 0 { random.below(64) } else { random.next_u64() };
                    request[4..].copy_from_slice(&(value as u32).to_le_bytes());
                    Frame::full(CanId::standard(0x601), request)
                }
                4..=5 => {
                    let id = 0x201 + 0x100 * random.below(4) as u16;
                    Frame::new(CanId::standard(id), &random.next_u64().to_le_bytes()[..random.below(9) as usize])
                }
                6 => Frame::new(CanId::standard(0x080), &[]),
                _ => Frame::new(CanId::standard(0x77F), &[0x05]),
            };
            bench.world.send(bench.host, frame).expect("room at the host");
            bench.run_ms(1 + random.below(8));
            if random.below(20) == 0 {
                let lines = [
                    "1 pulses 5000 400000",
                    "1 quadrature -5000 100000",
                    "1 duty 73",
                    "1 load torque 40",
                    "1 load torque -40",
                    "1 rotor lock",
                    "1 rotor free",
                    "1 battery off",
                    "1 battery on",
                    "1 switch DIR -1000 1000",
                    "1 supply 60",
                    "1 supply 36",
                    "1 power cycle",
                    "1 load inertia 0.5",
                ];
                bench.tell(lines[random.below(lines.len() as u64) as usize]);
            }
            let report = bench.report();
            assert!(report.velocity_rpm.is_finite() && report.current_a.is_finite(), "seed {seed}: {report:?}");
            assert!(report.supply_v.is_finite() && report.supply_v < 500.0, "seed {seed}: {report:?}");
        }
        // A power cycle and it answers.
        bench.tell("1 supply 36");
        bench.power_cycle();
        bench.get(0x1000, 0);
    }
}

//! Units that are coarser or finer than the increments of the encoder: whatever 607Dh, 608Fh, 6091h and 6092h say, the shaft
//! turns in the commanded direction, and stands with "target reached" only at its target.

use devices::Description;
use devices::servo::objects;
use ferrodrive_tests::seeded::Seeded;

use crate::virtual_cia402::bench::{Bench, TURN, changed};

/// Increments within which friction holds a shaft near its target.
const NEAR: i64 = 150;
const REACHED: u16 = 0x0400;
const LIMITED: u16 = 0x0800;
/// Values of 607Dh that makers have for no limit, and one the wrong way round.
const NO_LIMITS: [[i64; 2]; 5] =
    [[-0x8000_0000, 0x7FFF_FFFF], [-0x7FFF_FFFF, 0x7FFF_FFFF], [-0x8000_0000, 0x7FFF_FFFF], [0, 0], [1, -1]];

/// The standard's servo with an encoder of so many increments in so many turns in 608Fh.
fn with_encoder(resolution: [u32; 2]) -> &'static Description {
    changed(|row| match (row.index, row.sub_index) {
        (0x608F, sub @ 1..=2) => row.default(i64::from(resolution[usize::from(sub) - 1])),
        _ => row,
    })
}

/// Units of one drive: increments of its motor in a unit, as a fraction.
#[derive(Clone, Copy, Debug)]
struct Units {
    gear: [i64; 2],
    feed: [i64; 2],
    increments: i128,
    units: i128,
}

impl Units {
    fn any(seeded: &mut Seeded) -> Self {
        let gear = [[1, 1], [10, 1], [1, 7], [65_536, 1], [3, 1000]][seeded.below(5)];
        let feeds = [1, 360, 3600, 4096, 8192, 10_000, 32_768, 65_536, 131_072, 36_000_000, 0x8000_0000, 0xFFFF_FFFF];
        let feed = [feeds[seeded.below(feeds.len())], [1, 3][seeded.below(2)]];
        let increments = i128::from(objects::INCREMENTS_PER_TURN) * i128::from(gear[0]) * i128::from(feed[1]);
        Self { gear, feed, increments, units: i128::from(gear[1]) * i128::from(feed[0]) }
    }

    /// To the nearest whole, half away from zero.
    fn increments(&self, user: i64) -> i128 {
        let twice = 2 * i128::from(user.unsigned_abs()) * self.increments + self.units;
        i128::from(user.signum()) * (twice / (2 * self.units))
    }

    /// The units for so many increments, limited to 31 bits.
    fn user(&self, increments: f64) -> i64 {
        let user = increments * self.units as f64 / self.increments as f64;
        user.round().clamp(-2_147_483_647.0, 2_147_483_647.0) as i64
    }

    /// 32 bits of them cannot tell a ramp worth the name.
    fn are_too_fine(&self) -> bool {
        self.user(400.0 * TURN as f64) == 0x7FFF_FFFF
    }

    fn bench(&self, seeded: &mut Seeded, limits: [i64; 2]) -> Bench {
        let resolution = [[131_072, 1], [10_000, 1], [8_388_608, 3]][seeded.below(3)];
        let mut bench = Bench::of(with_encoder(resolution));
        let rate = self.user(400.0 * TURN as f64).max(1);
        bench.set(&[(0x6091, 1, self.gear[0]), (0x6091, 2, self.gear[1])]);
        bench.set(&[(0x6092, 1, self.feed[0]), (0x6092, 2, self.feed[1])]);
        bench.set(&[(0x607D, 1, limits[0]), (0x607D, 2, limits[1]), (0x6065, 0, 0xFFFF_FFFF)]);
        bench.set(&[(0x6067, 0, self.user(NEAR as f64))]);
        bench.set(&[(0x607F, 0, 0xFFFF_FFFF), (0x6081, 0, self.user(40.0 * TURN as f64).max(1))]);
        bench.set(&[(0x6083, 0, rate), (0x6084, 0, rate)]);
        bench
    }
}

#[test]
fn a_velocity_in_any_units_turns_the_motor_that_fast_and_that_way() {
    let mut turned = 0;
    for seed in 1..=150 {
        let seeded = &mut Seeded::new(seed);
        let units = Units::any(seeded);
        let wanted_rpm = [-2400.0, -600.0, 90.0, 1500.0][seeded.below(4)];
        let target = units.user(wanted_rpm / 60.0 * TURN as f64);
        let rpm = target as f64 * units.increments as f64 / units.units as f64 / TURN as f64 * 60.0;
        // Units may be too coarse for any speed of this motor.
        if !(30.0..3000.0).contains(&rpm.abs()) || units.are_too_fine() {
            continue;
        }
        let limits = NO_LIMITS[seeded.below(NO_LIMITS.len())];
        let mut bench = units.bench(seeded, limits);
        bench.enable(3);
        bench.set(&[(0x60FF, 0, target)]);
        bench.run_ms(600);
        let case = format!("{units:?} {limits:?} 60FFh = {target}: {rpm} r/min");
        assert!((bench.rpm() - rpm).abs() < 3.0 + 0.01 * rpm.abs(), "{case}, seen {}", bench.rpm());
        assert_eq!(bench.status() & LIMITED, 0, "{case}");
        turned += 1;
    }
    assert!(turned > 60, "{turned} cases of 150 could turn");
}

#[test]
fn a_position_in_any_units_is_gone_to_the_right_way_round_and_never_reached_without_going_there() {
    let targets = [1, 7, 1000, 60_000_000, 70_000_000, 134_217_728, 0x7FFF_FFFF];
    let (mut moved, mut out_of_reach) = (0, 0);
    for seed in 1..=200 {
        let seeded = &mut Seeded::new(seed);
        let units = Units::any(seeded);
        let target = targets[seeded.below(targets.len())] * [1, -1][seeded.below(2)];
        let wanted = units.increments(target);
        let limits = NO_LIMITS[seeded.below(NO_LIMITS.len())];
        let mut bench = units.bench(seeded, limits);
        bench.enable(1);
        bench.set(&[(0x607A, 0, target)]);
        let relative = [0x00, 0x40][seeded.below(2)];
        bench.control(0x1F | relative);
        bench.control(0x0F | relative);
        bench.run_ms(200);
        let case = format!("{units:?} {limits:?} 607Ah = {target}: {wanted} increments, bits 4 and {relative:02X}h");
        let at = bench.machine.firmware().increments(0).unwrap();
        let status = bench.status();
        if wanted.abs() > i128::from(NEAR) && !units.are_too_fine() {
            assert_eq!(i128::from(at.signum()), wanted.signum(), "{case}: at {at}, {status:04X}");
            moved += 1;
        }
        if status & REACHED != 0 {
            assert!((i128::from(at) - wanted).abs() <= 2 * i128::from(NEAR), "{case}: reached at {at}");
        }
        let fits = wanted.abs() <= i128::from(i32::MAX);
        assert_eq!(status & LIMITED == 0, fits, "{case}: {status:04X}");
        out_of_reach += u32::from(!fits);
    }
    assert!(moved > 100 && out_of_reach > 20, "{moved} {out_of_reach}");
}

#[test]
fn software_limits_in_any_units_hold_the_shaft_between_them() {
    for seed in 1..=60 {
        let seeded = &mut Seeded::new(seed);
        let units = Units::any(seeded);
        let limit = units.user(3.0 * TURN as f64);
        let limits = [[-limit, limit], [-0x8000_0000, limit], [-limit, 0x7FFF_FFFF]][seeded.below(3)];
        let end = units.increments(limit);
        // A unit of many turns has no limit three turns away.
        if limit == 0 || units.are_too_fine() || end > 5 * i128::from(TURN) {
            continue;
        }
        let mut bench = units.bench(seeded, limits);
        bench.enable(1);
        let sign = if limits[1] == limit { 1 } else { -1 };
        bench.set(&[(0x6081, 0, 0x7FFF_FFFF), (0x6083, 0, 0x7FFF_FFFF), (0x6084, 0, 0x7FFF_FFFF)]);
        bench.set(&[(0x607A, 0, sign * 0x7FFF_FFFF)]);
        bench.control(0x1F);
        bench.run_ms(1200);
        let case = format!("{units:?} {limits:?}: {end} increments");
        let at = i128::from(bench.machine.firmware().increments(0).unwrap());
        assert!((at - end * i128::from(sign)).abs() <= i128::from(NEAR), "{case}: {at}");
        assert_eq!(bench.status() & LIMITED, LIMITED, "{case}: bit 11");
    }
}

#[test]
fn a_way_of_more_than_half_the_counter_is_not_gone_the_other_way_round() {
    // Increments as units: from -1.5e9 to 1.5e9 is more than 2^31 to the right.
    for (mode, object, sub_index) in [(1, 0x607A, 0), (7, 0x60C1, 1), (8, 0x607A, 0)] {
        let mut bench = Bench::new();
        bench.set(&[(0x6098, 0, 37), (0x607C, 0, 1_500_000_000), (0x6065, 0, 0xFFFF_FFFF)]);
        bench.enable(6);
        bench.control(0x1F);
        bench.run_ms(5);
        assert_eq!(bench.position(), -1_500_000_000);
        bench.control(0x0F);
        bench.enable(mode);
        bench.control(0x0F);
        bench.set(&[(object, sub_index, 1_500_000_000)]);
        bench.control(0x1F);
        bench.set(&[(object, sub_index, 1_500_000_000)]);
        bench.run_ms(100);
        assert!(bench.rpm() > 100.0, "mode {mode}: {} r/min", bench.rpm());
        let status = bench.status();
        assert_eq!(status & LIMITED, LIMITED, "mode {mode}: it will end short of its target");
        assert!(mode != 1 || status & REACHED == 0, "{status:04X}");
    }
}

//! Profile position and profile velocity on the running drive: what CiA 402-2 has of them, and both makers' manuals.

use crate::bench::Bench;
use crate::power_states::PowerSubject;

/// An object that clears the position reads 0 again, and the shaft stays where it is. 0 is invalid.
pub fn clearing_the_position_reads_zero_again_and_zeroes_the_position<S: PowerSubject>() {
    for index in S::CLEARS_POSITION {
        let mut bench = Bench::<S>::new();
        bench.turn(60).set(0x60FF, 0).run_ms(1000).set(*index, 0);
        let (before, turned) = (bench.get(0x6064), bench.report().shaft_angle_rad);
        assert!(before > 1000, "{index:04X}h = 0 is invalid: {before}");
        bench.set(*index, 1).reads(0x6064, 0).reads(*index, 0).run_ms(100).reads(0x6064, 0);
        assert!((bench.report().shaft_angle_rad - turned).abs() < 0.01, "the numbers move, not the shaft");
    }
}

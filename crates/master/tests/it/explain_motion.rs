//! What the explanation says of a drive that has just moved, was stopped, or cannot move: its first cause is the true one, and its
//! remedy sets nothing going that is over. Sources: CiA 402-2, 10.1 to 10.3 (profile position), and the manuals where they are named.

use std::time::Duration;

use crate::explain::{Bench, rules};
use crate::support::mux;
use master::drive::MotionOptions;
use master::explain::Weight;
use master::units::Turns;

/// CiA 402-2, 10.1: a relative set-point stays in 607Ah when it has been gone, and bit 4 would start it again.
#[test]
fn after_a_relative_move_the_drive_is_said_to_be_there_and_its_distance_is_not_to_be_started_again() {
    for name in ["zlac8030l", "zlim42c", "m4230e17b50", "cia402"] {
        let mut bench = Bench::new(name);
        // A watch by silence would end while the bus is listened to.
        if name == "zlac8030l" {
            bench.write(mux(0x2000, 0), 0);
        }
        let drive = bench.drive.clone();
        bench.done(drive.move_relative(Turns(0.5), MotionOptions::default()));
        let explained = bench.explain();
        let first = explained.findings.iter().find(|finding| finding.weight == Weight::Cause);
        let first = first.unwrap_or_else(|| panic!("{name}: {explained:?}"));
        assert_eq!(first.rule, "at_target", "{name}: {:?}", rules(&explained));
        for finding in &explained.findings {
            assert!(!finding.remedy.contains("5Fh") && !finding.remedy.contains("1Fh"), "{name}: {finding:?}");
        }
    }
}

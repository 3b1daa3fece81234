//! The same seed and the same script give the same run: every frame at its nanosecond, every shaft at its bit.
//!
//! The golden digest is our own output and judges nothing but change; its file says when it may change.

use std::time::Duration;

use can::{Bitrate, Instant};
use sim::command;
use sim::fault::Corruption;
use sim::machine::zlac8030l;
use sim::{Digest, StationId, World};

use crate::virtual_zlac8030l::bench::RATE_500K;

const GOLDEN: &str = include_str!("../../../golden/zlac8030l_ten_seconds.txt");
const SEED: u64 = 8030;
const END: Duration = Duration::from_secs(10);
const COARSE: Duration = Duration::from_secs(1);

/// Ten seconds of two drives: frames (`>`) and what happens around the machines, at milliseconds.
const SCRIPT: &[(u64, &str)] = &[
    (20, "> 604#2F00180201000000"),
    (25, "> 604#2F001A0000000000"),
    (30, "> 604#23001A0120006460"),
    (35, "> 604#2F001A0001000000"),
    (40, "> 604#2B171000C8000000"),
    (45, "> 000#0100"),
    (60, "> 604#2F60600003000000"),
    (65, "> 605#2F60600001000000"),
    (70, "> 604#2B40600006000000"),
    (75, "> 605#2B40600006000000"),
    (80, "> 604#2B40600007000000"),
    (85, "> 605#2B4060000F000000"),
    (90, "> 604#2B4060000F000000"),
    (95, "> 604#2B00200000000000"),
    (100, "> 605#2B00200000000000"),
    (150, "> 604#23FF600078000000"),
    (155, "> 605#237A600000200000"),
    (160, "> 605#2B4060005F000000"),
    (900, "4 load torque 2.5"),
    (1500, "4 load torque 0"),
    (2000, "4 load inertia 0.03"),
    (2500, "> 604#23FF6000C4FFFFFF"),
    (3000, "5 rotor lock"),
    (3100, "> 605#2B4060004F000000"),
    (3110, "> 605#2B4060005F000000"),
    (3900, "5 rotor free"),
    (4200, "> 080#"),
    (4500, "4 supply 36"),
    (5000, "4 fault hall on"),
    (5400, "4 fault hall off"),
    (5500, "> 604#2B40600080000000"),
    (5600, "> 604#2B40600006000000"),
    (5610, "> 604#2B40600007000000"),
    (5620, "> 604#2B4060000F000000"),
    (6500, "5 power cycle"),
    (6700, "> 605#4041600000000000"),
    (7000, "4 cable cut"),
    (7400, "4 cable join"),
    (7500, "4 input X0 1"),
    (8500, "4 input X0 0"),
    (8600, "> 604#23FF600032000000"),
    (9000, "> 000#8104"),
    (9500, "> 604#4029200000000000"),
];

struct Run {
    world: World,
    host: StationId,
    played: usize,
}

impl Run {
    fn new(seed: u64) -> Self {
        let mut world = World::new(Bitrate::K500, seed);
        let host = world.add_probe();
        for node in [4, 5] {
            world.add_drive(node, Box::new(zlac8030l(node, RATE_500K))).expect("another drive");
        }
        world.set_corruption(Corruption::with_probability(0.02));
        Self { world, host, played: 0 }
    }

    /// Plays the script up to `end`, in steps of `stride`.
    fn play(&mut self, end: Duration, stride: Duration) {
        let end = Instant::ZERO + end;
        while let Some((ms, line)) = SCRIPT.get(self.played).filter(|(ms, _)| Instant::from_millis(*ms) <= end) {
            self.run(Instant::from_millis(*ms), stride);
            self.act(line);
            self.played += 1;
        }
        self.run(end, stride);
    }

    fn run(&mut self, end: Instant, stride: Duration) {
        while self.world.now() + stride < end {
            self.world.run_for(stride);
        }
        self.world.run_until(end);
    }

    fn act(&mut self, line: &str) {
        match line.strip_prefix("> ") {
            Some(frame) => {
                // While the cable is cut or the host is busy a frame may find no room: that is part of the run.
                let _ = self.world.send(self.host, frame.parse().expect("a frame"));
            }
            None => {
                let answer = command::answer(&mut self.world, line).expect("a line");
                assert!(answer.json.contains("\"ok\":true"), "{line}: {}", answer.json);
            }
        }
    }
}

fn digest_of(seed: u64, stride: Duration) -> Digest {
    let mut run = Run::new(seed);
    run.play(END, stride);
    run.world.digest()
}

#[test]
fn two_runs_of_one_seed_are_one_run_and_another_seed_is_another() {
    let once = digest_of(SEED, COARSE);
    assert_eq!(once, digest_of(SEED, COARSE));
    assert_ne!(once, digest_of(SEED + 1, COARSE));
}

#[test]
fn a_run_does_not_depend_on_how_often_time_is_moved_on() {
    let coarse = digest_of(SEED, COARSE);
    for stride_us in [37, 50, 1000, 7777] {
        assert_eq!(digest_of(SEED, Duration::from_micros(stride_us)), coarse, "in steps of {stride_us} us");
    }
}

#[test]
fn a_run_does_not_depend_on_who_looks_at_it() {
    let mut watched = Run::new(SEED);
    for ms in (0..10_000).step_by(7) {
        watched.play(Duration::from_millis(ms), COARSE);
        for node in [4, 5] {
            watched.world.report(node).expect("the drive is there");
        }
        watched.world.digest();
    }
    watched.play(END, COARSE);
    assert_eq!(watched.world.digest(), digest_of(SEED, COARSE));
}

#[test]
fn a_snapshot_taken_at_any_instant_goes_on_as_the_run_itself() {
    let whole = digest_of(SEED, COARSE);
    for at_ns in [1, 33_333_333, 1_234_567_891, 3_105_000_001, 5_000_000_000, 7_200_123_456, 9_999_999_999] {
        let mut run = Run::new(SEED);
        run.play(Duration::from_nanos(at_ns), COARSE);
        let mut resumed = Run { world: run.world.snapshot(), host: run.host, played: run.played };
        run.play(END, COARSE);
        resumed.play(END, Duration::from_micros(500));
        assert_eq!(run.world.digest(), whole, "interrupted at {at_ns} ns");
        assert_eq!(resumed.world.digest(), whole, "resumed at {at_ns} ns");
    }
}

#[test]
fn the_script_reaches_what_it_is_meant_to_reach() {
    let mut run = Run::new(SEED);
    run.play(Duration::from_millis(2400), COARSE);
    assert!(run.world.report(4).is_ok_and(|drive| drive.velocity_rpm > 100.0));
    assert!(run.world.report(5).is_ok_and(|drive| drive.position > 8000));
    run.play(Duration::from_millis(5300), COARSE);
    assert!(run.world.report(4).is_ok_and(|drive| drive.error_code == 0x0200));
    run.play(END, COARSE);
    assert!(run.world.statistics().errors > 0, "the noise struck");
}

#[test]
fn the_run_is_the_golden_one() {
    let digest = format!("{:016X}", digest_of(SEED, COARSE).value());
    let golden = GOLDEN.lines().find(|line| !line.starts_with('#')).unwrap_or_default();
    assert_eq!(digest, golden, "read tests/golden/zlac8030l_ten_seconds.txt before you change it");
}

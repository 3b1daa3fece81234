//! A data sheet may be wrong in every line and still make a device: it boots, answers, is enabled and moved, and measures
//! numbers. What cannot be is refused with a word; nothing panics, whatever the file says.

use can::{Bitrate, Frame, Instant};
use canopen::NodeId;
use devices::servo;
use eds::{Eds, Sheet, keep, write};
use ferrodrive_tests::seeded::Seeded;
use sim::VirtualDrive;
use sim::machine::{Order, order};

const NODE: u8 = 5;
const RUNS: u64 = 1_000;

/// Values that a file gives by mistake: out of range, of another type, of nothing.
const WRONG: [&str; 16] = [
    "",
    "0",
    "1",
    "-1",
    "0xFFFFFFFF",
    "0x7FFFFFFF",
    "-2147483648",
    "0xFFFFFFFFFFFFFFFF",
    "1e30",
    "$NODEID+0xFFFFFFFF",
    "text",
    "0x60640020",
    "0x00050008",
    "65536",
    "0x8",
    "254",
];

/// The sheet of the standard's servo with some values replaced and some lines left out.
fn damaged(text: &str, random: &mut Seeded) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..1 + random.below(60) {
        let at = random.below(lines.len());
        let key = lines[at].split_once('=').map(|(key, _)| key.to_owned());
        match (key, random.below(8)) {
            (Some(_), 0) => drop(lines.remove(at)),
            (Some(key), _) => lines[at] = format!("{key}={}", WRONG[random.below(WRONG.len())]),
            // A section's name: its objects stand elsewhere, or twice.
            (None, 0) => lines[at] = format!("[{:04X}]", 0x1000 + random.below(0x6000)),
            (None, _) => {}
        }
    }
    lines.join("\n")
}

fn send(machine: &mut dyn VirtualDrive, frame: &str, now: Instant) {
    let frame: Frame = frame.parse().expect("a frame of this test");
    machine.handle_frame(&frame, now);
    drain(machine, now);
}

fn drain(machine: &mut dyn VirtualDrive, now: Instant) {
    // A file may ask for a frame in every round; no round may be endless.
    for _ in 0..2_000 {
        let Some(frame) = machine.poll_transmit() else { return };
        machine.handle_transmitted(&frame, now);
    }
    panic!("it sends without end");
}

fn run_ms(machine: &mut dyn VirtualDrive, now: &mut Instant, ms: u64) {
    for _ in 0..ms {
        *now = now.plus_nanos(1_000_000);
        machine.handle_timeout(*now);
        machine.advance(*now);
        drain(machine, *now);
    }
}

/// Boots, starts the node, and asks for motion in each mode, by SDO and by SYNC. True if it moved.
fn use_it(machine: &mut dyn VirtualDrive) -> bool {
    let mut moved = false;
    let mut now = Instant::ZERO;
    machine.set_power(true, now);
    run_ms(machine, &mut now, 20);
    send(machine, "000#0105", now);
    for mode in [1_u8, 3, 4, 6, 7, 8, 9, 10] {
        send(machine, &format!("605#2F606000{mode:02X}000000"), now);
        for word in ["06", "07", "0F", "1F"] {
            send(machine, &format!("605#2B406000{word}000000"), now);
            run_ms(machine, &mut now, 2);
        }
        for target in ["23FF60000A000000", "237A6000E8030000", "2B71600064000000", "40646000", "40416000"] {
            send(machine, &format!("605#{target}"), now);
        }
        send(machine, "205#0F00010000000000", now);
        send(machine, "080#", now);
        run_ms(machine, &mut now, 10);
        moved |= machine.report().velocity_rpm.abs() > 1.0;
    }
    send(machine, "605#2310100173617665", now);
    run_ms(machine, &mut now, 5);
    send(machine, "000#8105", now);
    run_ms(machine, &mut now, 5);
    let report = machine.report();
    assert!(report.velocity_rpm.is_finite() && report.current_a.is_finite(), "{report:?}");
    moved
}

#[test]
fn a_sheet_that_is_wrong_anywhere_makes_a_device_that_runs_or_is_refused() {
    let text = write(&Sheet::of(&servo::CIA402).eds());
    let node = NodeId::new(NODE).expect("a node-ID");
    let (mut built, mut turned) = (0, 0);
    for seed in 0..RUNS {
        let mut random = Seeded::new(seed);
        let file = damaged(&text, &mut random);
        let outcome = std::panic::catch_unwind(|| {
            let reading = Eds::load(file.as_bytes()).ok()?;
            let description = keep(&reading.eds).ok()?;
            let mut machine = order(description, &Order::new(description, node, Bitrate::K500)).ok()?;
            Some(use_it(&mut *machine))
        });
        match outcome {
            Ok(ran) => {
                built += u64::from(ran.is_some());
                turned += u64::from(ran == Some(true));
            }
            Err(_) => panic!("seed {seed}"),
        }
    }
    // Nearly all of them make a device, and most of these turn: a reader that refuses would pass for nothing.
    assert!(built * 10 >= RUNS * 9 && turned * 2 >= RUNS, "{built} made and {turned} turned of {RUNS}");
}

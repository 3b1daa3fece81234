//! The same script on a drive of fidelity full and on one of fidelity mechanical, and how far apart they are.

use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use cia402::PowerState;
use sim::{Fidelity, Place, Report, Stimulus, VirtualDrive, World};

/// A drive as delivered, at [`NODE`].
pub(super) trait Subject {
    const BITRATE: Bitrate;
    fn machine() -> Box<dyn VirtualDrive>;
}

pub(super) const NODE: u8 = 4;

/// Before the script begins.
const BOOT_MS: u64 = 50;

/// What is done at a time, ms.
pub(super) type Script = Vec<(u64, Act)>;

/// What is done.
#[derive(Clone, Debug)]
pub(super) enum Act {
    /// A frame of the host.
    Frame(Frame),
    /// A hand at the machine.
    Hand(Stimulus),
}

/// An SDO download of so many bytes.
pub(super) fn write(index: u16, size: usize, value: i64) -> Act {
    write_entry((index, 0), size, value)
}

/// The same to an entry of an array or a record.
pub(super) fn write_entry((index, sub_index): (u16, u8), size: usize, value: i64) -> Act {
    let command = [0, 0x2F, 0x2B, 0, 0x23][size];
    let [low, high] = index.to_le_bytes();
    let mut data = [command, low, high, sub_index, 0, 0, 0, 0];
    data[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
    Act::Frame(Frame::full(CanId::standard(0x600 + u16::from(NODE)), data))
}

/// A world command to the drive.
pub(super) fn hand(words: &str) -> Act {
    Act::Hand(words.parse().expect("a stimulus"))
}

/// What one of them did: a report each millisecond, and each frame.
#[derive(Debug, PartialEq)]
pub(super) struct Trace {
    pub(super) samples: Vec<Report>,
    pub(super) heard: Vec<(Instant, Frame)>,
}

/// How far the two may be apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Speed of the motor, r/min, root mean square.
    pub(super) speed_rms_rpm: f64,
    /// The same, at most.
    pub(super) speed_most_rpm: f64,
    /// Position on the way, counts.
    pub(super) on_the_way: f64,
    /// Position where it ends, counts, or a thousandth of the way.
    pub(super) at_the_end: f64,
    /// Current as the drive shows it, A, root mean square.
    pub(super) current_rms_a: f64,
}

/// How far the two are apart.
#[derive(Debug)]
pub(super) struct Apart {
    pub(super) speed_rms_rpm: f64,
    pub(super) speed_most_rpm: f64,
    pub(super) on_the_way: f64,
    pub(super) at_the_end: f64,
    pub(super) way: f64,
    pub(super) current_rms_a: f64,
}

/// Runs a script for so many milliseconds on both, and holds them to a bound. Power states, error codes and frames are the same,
/// in the same order, each within 2 ms.
#[track_caller]
#[allow(clippy::print_stdout, reason = "docs/fidelity.md has these figures")]
pub(super) fn hold<S: Subject>(name: &str, script: &Script, ms: u64, bound: Bound) {
    let [full, mechanical] = [Fidelity::Full, Fidelity::Mechanical].map(|fidelity| trace::<S>(fidelity, script, ms));
    let apart = apart(&full, &mechanical);
    println!("{name}: {apart:.3?}");
    let end = bound.at_the_end.max(1e-3 * apart.way);
    assert!(
        apart.speed_rms_rpm <= bound.speed_rms_rpm && apart.speed_most_rpm <= bound.speed_most_rpm,
        "{name}: {apart:?}"
    );
    assert!(apart.on_the_way <= bound.on_the_way.max(1e-3 * apart.way), "{name}: {apart:?}");
    assert!(apart.at_the_end <= end, "{name}: {apart:?}");
    assert!(apart.current_rms_a <= bound.current_rms_a, "{name}: {apart:?}");
    let (states, others) = (changes(&full), changes(&mechanical));
    let (seen, heard) = (|(_, change): &(usize, _)| *change, |trace: &Trace| trace.heard.clone());
    assert_eq!(states.iter().map(seen).collect::<Vec<_>>(), others.iter().map(seen).collect::<Vec<_>>(), "{name}");
    for ((at, change), (other, _)) in states.iter().zip(&others) {
        assert!(at.abs_diff(*other) <= 2, "{name}: {change:?} at {at} and {other} ms");
    }
    let (frames, others) = (heard(&full), heard(&mechanical));
    let text = |frames: &[(Instant, Frame)]| frames.iter().map(|(_, frame)| frame.to_string()).collect::<Vec<_>>();
    assert_eq!(text(&frames), text(&others), "{name}");
    for ((at, frame), (other, _)) in frames.iter().zip(&others) {
        let ms = (at.as_secs_f64() - other.as_secs_f64()).abs() * 1e3;
        assert!(ms <= 2.0, "{name}: {frame} {ms} ms apart");
    }
}

fn apart(full: &Trace, mechanical: &Trace) -> Apart {
    let pairs = || full.samples.iter().zip(&mechanical.samples);
    let rms = |of: &dyn Fn(&Report) -> f64| {
        (pairs().map(|(a, b)| (of(b) - of(a)).powi(2)).sum::<f64>() / full.samples.len() as f64).sqrt()
    };
    let most = |of: &dyn Fn(&Report) -> f64| pairs().map(|(a, b)| (of(b) - of(a)).abs()).fold(0.0, f64::max);
    let positions = || full.samples.iter().map(|report| report.position);
    let last = |trace: &Trace| trace.samples.last().map_or(0, |report| report.position);
    Apart {
        speed_rms_rpm: rms(&|report| report.velocity_rpm),
        speed_most_rpm: most(&|report| report.velocity_rpm),
        on_the_way: most(&|report| report.position as f64),
        at_the_end: (last(full) - last(mechanical)).abs() as f64,
        way: (positions().max().unwrap_or(0) - positions().min().unwrap_or(0)) as f64,
        current_rms_a: rms(&|report| report.current_a),
    }
}

/// Power states and error codes, each with the millisecond in which it is there.
fn changes(trace: &Trace) -> Vec<(usize, (Option<PowerState>, u32))> {
    let mut changes: Vec<(usize, (Option<PowerState>, u32))> = Vec::new();
    for (ms, report) in trace.samples.iter().enumerate() {
        let now = (report.state, report.error_code);
        if changes.last().is_none_or(|(_, before)| *before != now) {
            changes.push((ms, now));
        }
    }
    changes
}

/// A world of one drive of this fidelity and a host, past its boot.
pub(super) fn world<S: Subject>(fidelity: Fidelity) -> (World, sim::StationId) {
    let mut machine = S::machine();
    machine.set_fidelity(fidelity, Instant::ZERO).expect("a model that has both");
    let mut world = World::new(S::BITRATE, 1);
    let host = world.add_probe();
    world.add_drive(NODE, machine).expect("a free number");
    world.run_for(Duration::from_millis(BOOT_MS));
    while world.poll_received(host).is_some() {}
    (world, host)
}

pub(super) fn trace<S: Subject>(fidelity: Fidelity, script: &Script, ms: u64) -> Trace {
    let (mut world, host) = world::<S>(fidelity);
    let mut script = script.clone();
    script.sort_by_key(|(at, _)| *at);
    let (mut samples, mut heard) = (Vec::new(), Vec::new());
    let mut acts = script.iter().peekable();
    // A machine of fidelity full is a control period ahead of the world: what is looked at is the same moment.
    let ahead = Duration::from_micros(if fidelity == Fidelity::Full { 50 } else { 0 });
    for at in 0..ms {
        while let Some((_, act)) = acts.next_if(|(due, _)| *due <= at) {
            match act {
                Act::Frame(frame) => world.send(host, *frame).expect("room at the host"),
                Act::Hand(stimulus) => {
                    world.apply(Place::node(NODE), stimulus).expect("a drive").expect("what it takes");
                }
            }
        }
        world.run_for(Duration::from_millis(1) - ahead);
        samples.push(world.report(NODE).expect("a drive"));
        world.run_for(ahead);
        heard.extend(std::iter::from_fn(|| world.poll_received(host)));
    }
    Trace { samples, heard }
}

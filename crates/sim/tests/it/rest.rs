//! Control periods that change nothing are left out, and it makes no difference: a world whose drives compute all of theirs
//! does the same, frame by frame at its nanosecond and shaft by shaft at its bit.

use std::time::Duration;

use can::{Bitrate, Frame};
use canopen::NodeId;
use devices::AxisId;
use sim::machine::{Order, TimingMode, order};
use sim::stimulus::{Place, Stimulus};
use sim::{Prng, StationId, World};

/// Two of each kind of motor, and a described servo.
const MODELS: [(u8, &str); 7] = [
    (1, "zlac8030l"),
    (2, "zlac8030l"),
    (3, "m4230e17b50"),
    (4, "m8025e25b80"),
    (5, "zlim42c"),
    (6, "zlim42c-82"),
    (7, "cia402"),
];

struct Run {
    world: World,
    host: StationId,
    frames: Vec<String>,
}

impl Run {
    fn new(seed: u64, timing: TimingMode, all_computed: bool) -> Self {
        let mut world = World::new(Bitrate::M1, seed);
        world.set_timing(timing);
        let host = world.add_probe();
        for (node, model) in MODELS {
            let id = NodeId::new(node).expect("a node-ID");
            let description = devices::model(model).expect("a model");
            let drive = order(description, &Order::new(description, id, Bitrate::M1)).expect("a machine");
            world.add_drive(node, drive).expect("numbers differ");
            if all_computed {
                world.with_drive(node, |drive, _| drive.keep_awake()).expect("it was added");
            }
        }
        Self { world, host, frames: Vec::new() }
    }

    fn act(&mut self, act: &Act) {
        match act {
            Act::Wait(ns) => self.world.run_for(Duration::from_nanos(*ns)),
            Act::Send(text) => {
                let frame: Frame = text.parse().expect("a frame");
                self.world.send(self.host, frame).expect("a probe");
            }
            Act::Do(node, words) => {
                let stimulus: Stimulus = words.parse().expect("a stimulus");
                let _ = self.world.apply(Place { node: *node, axis: AxisId::FIRST }, &stimulus).expect("it was added");
            }
        }
        while let Some(frame) = self.world.poll_received(self.host) {
            self.frames.push(format!("{frame:?}"));
        }
    }

    /// All that can be measured, to the last bit.
    fn state(&mut self) -> Vec<String> {
        let mut state: Vec<String> =
            MODELS.iter().map(|(node, _)| format!("{:?}", self.world.report(*node).expect("it was added"))).collect();
        state.push(format!("{:?}", self.world.digest()));
        state
    }
}

/// What happens to the drives.
#[derive(Clone, Debug)]
enum Act {
    Wait(u64),
    Send(String),
    Do(u8, &'static str),
}

const HANDS: [&str; 22] = [
    "load torque 0.4",
    "load torque -3",
    "load torque 0",
    "load inertia 0.01",
    "rotor lock",
    "rotor free",
    "supply 40",
    "supply 30",
    "supply 24",
    "power cycle",
    "power off",
    "power on",
    "power cut",
    "temperature driver 84.9",
    "temperature driver 95",
    "temperature driver auto",
    "fault encoder on",
    "fault encoder off",
    "fault eeprom on",
    "fault eeprom off",
    "battery off",
    "battery on",
];

/// Long waits, in which drives come to rest, and anything between them.
fn random_acts(prng: &mut Prng) -> Vec<Act> {
    let mut acts = vec![Act::Wait(1_500_000_000)];
    let word = |prng: &mut Prng| prng.below(1 << 16);
    for _ in 0..60 {
        let node = 1 + prng.below(MODELS.len() as u64) as u8;
        acts.push(match prng.below(9) {
            0 | 1 => Act::Do(node, HANDS[prng.below(HANDS.len() as u64) as usize]),
            2 => Act::Send(format!("000#{:02X}{node:02X}", [1, 2, 0x80, 0x81, 0x82][prng.below(5) as usize])),
            // Controlwords on the way to OPERATION ENABLED and back, a mode, a target velocity, a heartbeat.
            3 => Act::Send(format!(
                "{:03X}#2B406000{:02X}000000",
                0x600 + u16::from(node),
                [0, 6, 7, 0xF, 0x80][prng.below(5) as usize]
            )),
            4 => Act::Send(format!(
                "{:03X}#2F606000{:02X}000000",
                0x600 + u16::from(node),
                [1, 3, 4][prng.below(3) as usize]
            )),
            5 => Act::Send(format!("{:03X}#2B171000{:04X}0000", 0x600 + u16::from(node), word(prng))),
            6 => Act::Send("080#".to_owned()),
            // How long a window asks for: 6068h, 606Eh, 6070h.
            7 => {
                let object = [0x68, 0x6E, 0x70][prng.below(3) as usize];
                let time_ms = word(prng) >> prng.below(16);
                Act::Send(format!(
                    "{:03X}#2B{object:02X}6000{:02X}{:02X}0000",
                    0x600 + u16::from(node),
                    time_ms & 0xFF,
                    time_ms >> 8
                ))
            }
            _ => Act::Send(format!("{:03X}#4041600000000000", 0x600 + u16::from(node))),
        });
        // On the grid of tasks and off it, within a round of control periods and over many.
        acts.push(Act::Wait(match prng.below(4) {
            0 => 500_000 * prng.below(40),
            1 => prng.below(2_000_000),
            2 => prng.below(100_000_000),
            _ => prng.below(600_000_000),
        }));
    }
    acts
}

#[test]
fn what_is_left_out_makes_no_difference_to_the_last_bit() {
    for seed in 0..12 {
        let timing = if seed % 2 == 0 { TimingMode::Ideal } else { TimingMode::Device };
        let mut prng = Prng::new(seed);
        let acts = random_acts(&mut prng);
        let (mut resting, mut computed) = (Run::new(seed, timing, false), Run::new(seed, timing, true));
        for (number, act) in acts.iter().enumerate() {
            resting.act(act);
            computed.act(act);
            // Looking is not touching: every few acts, so that long rests are among what is compared.
            if number % 7 == 0 {
                assert_eq!(resting.state(), computed.state(), "seed {seed}, after act {number}: {act:?}");
            }
        }
        assert_eq!(resting.state(), computed.state(), "seed {seed}, in the end");
        assert_eq!(resting.frames, computed.frames, "seed {seed}");
        assert!(resting.frames.len() > 20, "seed {seed}: only {} frames", resting.frames.len());
    }
}

#[test]
fn drives_at_rest_have_the_world_wait_for_what_happens() {
    let mut run = Run::new(1, TimingMode::Device, false);
    // Boot-up, and the first way of the thermometers.
    run.act(&Act::Wait(10_000_000_000));
    let (end, mut events) = (run.world.now() + Duration::from_secs(2), 0);
    while run.world.next_event().is_some_and(|at| at <= end) {
        run.world.step();
        events += 1;
    }
    // 28,000 with each run of a communication task. Ten looks ahead a second and drive, and some periods after each reading that
    // has changed.
    assert!(events < 2 * MODELS.len() * 100, "{events} events in 2 s");
}

/// Does the same to drives that rest and to drives that compute all, and compares what comes of it, frame by frame.
fn both(acts: &[Act]) -> Vec<String> {
    let [resting, computed] = [false, true].map(|all_computed| {
        let mut run = Run::new(1, TimingMode::Ideal, all_computed);
        acts.iter().for_each(|act| run.act(act));
        run
    });
    let differs = resting.frames.iter().zip(&computed.frames).find(|(one, other)| one != other);
    assert_eq!(differs, None);
    assert_eq!(resting.frames.len(), computed.frames.len());
    resting.frames
}

fn send(text: &str) -> Act {
    Act::Send(text.to_owned())
}

#[test]
fn a_reading_that_changes_in_a_rest_is_sent_when_the_task_finds_it() {
    let mut acts = vec![Act::Wait(500_000_000)];
    // TPDO1 of a ZLAC8030L carries 2026h:01, its motor's temperature in 0.1 degrees, and is sent when that changes.
    for frame in [
        "601#2300180181010080",
        "601#2F001A0000000000",
        "601#23001A0110012620",
        "601#2F001A0001000000",
        "601#2F001802FF000000",
        "601#2300180181010000",
        "000#0101",
    ] {
        acts.extend([send(frame), Act::Wait(3_000_000)]);
    }
    // A motor that was hot cools down.
    acts.extend([Act::Do(1, "temperature motor 60"), Act::Wait(5_000_000), Act::Do(1, "temperature motor auto")]);
    acts.push(Act::Wait(60_000_000_000));
    let frames = both(&acts);
    let sent = frames.iter().filter(|frame| frame.contains("181")).count();
    assert!(sent > 10, "{sent} of {frames:#?}");
}

#[test]
fn a_window_counts_on_over_a_rest() {
    // A described servo in profile velocity mode stands: bit 12 of 6041h, once for the time in 6070h.
    let mut acts = vec![Act::Wait(500_000_000), send("607#2F60600003000000"), Act::Wait(3_000_000)];
    acts.extend([send("607#2B706000D0070000"), Act::Wait(5_000_000_000), send("607#2B70600010270000")]);
    for _ in 0..200 {
        acts.extend([Act::Wait(50_000_000), send("607#4041600000000000")]);
    }
    acts.push(Act::Wait(3_000_000));
    let frames = both(&acts);
    let words = frames.iter().filter_map(|frame| frame.split_once("587#4B416000"));
    let bits: Vec<bool> = words.map(|(_, word)| word.starts_with("7016")).collect();
    // It stands since it booted, at 0 s, so the 10 s are over 4.5 s after they were asked for: 90 answers of 200.
    let off = bits.iter().filter(|bit| !**bit).count();
    assert!(bits.len() == 200 && (88..=91).contains(&off) && bits.is_sorted(), "{bits:?}");
}

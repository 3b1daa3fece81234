//! What a device takes for itself: to boot, to reset, to answer, to store; and what a supply does that is switched.

use core::time::Duration;

use can::{Bitrate, Frame, Instant};
use canopen::NodeId;
use devices::{Description, PowerStyle, Span};
use sim::machine::{Order, TimingMode, models, order};
use sim::{PowerPhase, StationId, World};

const NODE: u8 = 5;
const BUS_CYCLE_NS: u64 = 50_000;

/// One drive in a world, and an adapter beside it.
struct Bench {
    world: World,
    adapter: StationId,
}

impl Bench {
    fn new(model: &'static Description, timing: TimingMode, seed: u64) -> Self {
        let bitrate = Bitrate::K500;
        let mut world = World::new(bitrate, seed);
        let adapter = world.add_probe();
        // Another node acknowledges frames while the drive does not listen.
        world.add_probe();
        world.set_timing(timing);
        let node = NodeId::new(NODE).unwrap();
        world.add_drive(NODE, order(model, &Order::new(model, node, bitrate)).unwrap()).unwrap();
        Self { world, adapter }
    }

    fn booted(model: &'static Description, seed: u64) -> Self {
        let mut bench = Self::new(model, TimingMode::Device, seed);
        bench.wait(&boot_up(), 2000);
        bench.world.run_for(Duration::from_millis(100));
        bench.heard();
        bench
    }

    fn send(&mut self, frame: &str) {
        self.world.send(self.adapter, frame.parse().unwrap()).unwrap();
    }

    /// What was heard since the last time, each with the time of its last bit.
    fn heard(&mut self) -> Vec<(Instant, Frame)> {
        std::iter::from_fn(|| self.world.poll_received(self.adapter)).collect()
    }

    /// The time of the next frame that begins so.
    #[track_caller]
    fn wait(&mut self, beginning: &str, within_ms: u64) -> Instant {
        let end = self.world.now() + Duration::from_millis(within_ms);
        while self.world.now() < end {
            self.world.run_for(Duration::from_micros(200));
            while let Some((at, frame)) = self.world.poll_received(self.adapter) {
                if frame.to_string().starts_with(beginning) {
                    return at;
                }
            }
        }
        panic!("no {beginning} within {within_ms} ms");
    }

    /// When a request has been sent, and when its answer has: ns from the last bit of one to the first bit of the other.
    fn answer_time(&mut self, request: &str) -> (String, u64) {
        self.send(request);
        let sent = self.world.now();
        self.world.run_for(Duration::from_millis(40));
        let answers: Vec<_> =
            self.heard().into_iter().filter(|(_, frame)| frame.id().raw() == 0x580 + u32::from(NODE)).collect();
        let [(at, answer)] = answers[..] else { panic!("{request}: {answers:?}") };
        let frame: Frame = request.parse().unwrap();
        let on_wire = |frame: &Frame| u64::from(can::frame_bits(frame)) * Bitrate::K500.bit_nanos();
        (answer.to_string(), at.nanos_since(sent) - on_wire(&frame) - on_wire(&answer))
    }

    fn power(&mut self) -> PowerPhase {
        self.world.report(NODE).unwrap().power
    }
}

fn boot_up() -> String {
    format!("70{NODE}#00")
}

/// That a time is within a span, and what the bus and the grid of control periods add.
#[track_caller]
fn assert_within(span: Span, ns: u64, what: &str) {
    let (least, most) = (u64::from(span.least_us) * 1000, u64::from(span.most_us) * 1000 + 2 * BUS_CYCLE_NS + 200_000);
    assert!((least..=most).contains(&ns), "{what}: {ns} ns, expected {span}");
}

#[test]
fn every_model_boots_within_its_time_and_is_deaf_until_then() {
    for model in models() {
        let mut bench = Bench::new(model, TimingMode::Device, 1);
        assert_eq!(bench.power(), PowerPhase::Booting, "{}", model.name);
        bench.world.run_for(Duration::from_micros(u64::from(model.timing.boot.least_us) - 1000));
        bench.send("605#4000100000000000");
        bench.world.run_for(Duration::from_micros(900));
        let report = bench.world.report(NODE).unwrap();
        assert_eq!((report.statusword, report.powered), (Some(0), true), "{}: not ready to switch on", model.name);
        assert_eq!(bench.heard(), [], "{}", model.name);
        let at = bench.wait(&boot_up(), 1000);
        assert_within(model.timing.boot, at.as_nanos(), model.name);
        assert_eq!(bench.power(), PowerPhase::On, "{}", model.name);
        bench.world.run_for(Duration::from_millis(20));
        let answers = bench.heard().iter().filter(|(_, frame)| frame.id().raw() == 0x585).count();
        assert_eq!(answers, 0, "{}: what came before the boot-up message is lost", model.name);
        // Of CiA 402's states only NOT READY TO SWITCH ON may read 0; an echo of the controlword may too.
        let has_states = model.first_axis().is_none_or(|axis| axis.power == PowerStyle::Cia402);
        let statusword = bench.world.report(NODE).unwrap().statusword;
        assert!(!has_states || statusword != Some(0), "{}", model.name);
    }
}

#[test]
fn a_seed_gives_the_same_times_to_the_nanosecond_and_another_gives_others() {
    let boots =
        |seed| models().map(|model| Bench::new(model, TimingMode::Device, seed).wait(&boot_up(), 2000)).collect();
    let (first, again, other): (Vec<_>, Vec<_>, Vec<_>) = (boots(1), boots(1), boots(2));
    assert_eq!(first, again);
    assert!(first.iter().zip(&other).all(|(one, other)| one != other));
}

#[test]
fn without_it_a_drive_boots_and_answers_at_once() {
    for model in models() {
        let mut bench = Bench::new(model, TimingMode::Ideal, 1);
        assert!(bench.wait(&boot_up(), 1).as_nanos() < 1_000_000);
        bench.world.run_for(Duration::from_millis(100));
        bench.heard();
        let (_, ns) = bench.answer_time("605#4000100000000000");
        assert!(ns <= BUS_CYCLE_NS, "{}: {ns} ns", model.name);
    }
}

#[test]
fn an_sdo_answer_takes_its_time_each_time_another() {
    for model in models() {
        let mut bench = Bench::booted(model, 1);
        let mut times = Vec::new();
        for _ in 0..20 {
            let (answer, ns) = bench.answer_time("605#4000100000000000");
            assert!(answer.starts_with("585#43001000"), "{}: {answer}", model.name);
            assert_within(model.timing.sdo_answer, ns, model.name);
            times.push(ns);
        }
        times.dedup();
        assert!(times.len() > 15, "{}: {times:?}", model.name);
    }
}

#[test]
fn two_requests_in_one_time_are_answered_in_their_order_and_a_flood_has_an_end() {
    for model in models() {
        let mut bench = Bench::booted(model, 1);
        bench.send("605#4000100000000000");
        bench.send("605#4018100000000000");
        bench.world.run_for(Duration::from_millis(10));
        let answers: Vec<String> = bench.heard().iter().map(|(_, frame)| frame.to_string()).collect();
        let answers: Vec<&str> =
            answers.iter().filter(|text| text.starts_with("585")).map(|text| &text[6..12]).collect();
        assert_eq!(answers, ["001000", "181000"], "{}", model.name);
        (0..2000).for_each(|_| bench.send("605#4000100000000000"));
        bench.world.run_for(Duration::from_secs(2));
        bench.heard();
        let (answer, _) = bench.answer_time("605#4018100000000000");
        assert_eq!(&answer[6..12], "181000", "{}: it still works", model.name);
    }
}

/// A CAN controller filters what its node does not listen to: a scan of all other nodes takes no place and no time of it.
#[test]
fn frames_for_others_neither_fill_its_mailboxes_nor_delay_it() {
    for model in models() {
        let mut bench = Bench::booted(model, 1);
        for _ in 0..3 {
            for other in (0x601..=0x67F).filter(|id| *id != 0x600 + u32::from(NODE)) {
                bench.send(&format!("{other:X}#8000100000000405"));
            }
            bench.send("605#4018100100000000");
            // 126 frames and an answer are 32 ms at 500 kbit/s.
            bench.world.run_for(Duration::from_millis(60));
            let answers = bench.heard().into_iter().filter(|(_, frame)| frame.to_string().starts_with("585#43181001"));
            assert_eq!(answers.count(), 1, "{}", model.name);
        }
    }
}

#[test]
fn resets_by_nmt_take_their_time_in_which_the_drive_is_silent_and_deaf() {
    for model in models() {
        let mut bench = Bench::booted(model, 1);
        for (command, span) in [("000#8200", model.timing.reset_communication), ("000#8100", model.timing.reset_node)] {
            bench.send(command);
            let sent = bench.world.now();
            bench.world.run_for(Duration::from_micros(u64::from(span.least_us) / 2));
            bench.send("605#4000100000000000");
            bench.world.run_for(Duration::from_micros(u64::from(span.least_us) / 2 - 100));
            assert_eq!(bench.heard(), [], "{}: {command}", model.name);
            let booting = bench.power() == PowerPhase::Booting;
            assert_eq!(booting, command == "000#8100", "{}: {command}", model.name);
            let at = bench.wait(&boot_up(), 1000);
            assert_within(span, at.nanos_since(sent), command);
            bench.world.run_for(Duration::from_millis(200));
            bench.heard();
            let (answer, _) = bench.answer_time("605#4000100000000000");
            assert!(answer.starts_with("585#43001000"), "{}: {answer}", model.name);
        }
    }
}

#[test]
fn what_is_asked_of_a_drive_that_resets_is_never_answered_also_right_before_its_end() {
    for model in models() {
        for command in ["000#8200", "000#8100"] {
            let mut bench = Bench::booted(model, 1);
            // When it ends: the same world, without a later question.
            let mut alone = Bench { world: bench.world.snapshot(), adapter: bench.adapter };
            alone.send("605#4000100000000000");
            alone.send(command);
            let end = alone.wait(&boot_up(), 1000);
            bench.send("605#4000100000000000");
            bench.send(command);
            // The last request is on the wire before the boot-up message is.
            let last = Instant::from_nanos(end.as_nanos() - 600_000);
            bench.world.run_until(last);
            bench.send("605#4000100000000000");
            bench.world.run_for(Duration::from_millis(100));
            let heard = bench.heard();
            assert!(heard.iter().any(|(_, frame)| frame.to_string() == boot_up()), "{}: {heard:?}", model.name);
            let answers = heard.iter().filter(|(at, frame)| frame.id().raw() == 0x585 && *at > last).count();
            assert_eq!(answers, 0, "{} after {command}: {heard:?}", model.name);
        }
    }
}

/// A stored parameter of each maker's, with a value that is not its default: written with this, read with that, and what is
/// answered before and after.
const STORED: [(&str, &str, &str, &str, &str); 2] = [
    ("zlac8030l", "605#2B14200064000000", "605#4014200000000000", "585#4B142000", "585#4B14200064000000"),
    ("zlim42c", "605#2B0B200001000000", "605#400B200000000000", "585#4B0B2000", "585#4B0B200001000000"),
];

#[test]
fn a_store_takes_its_time_its_answer_waits_for_it_and_a_cut_in_it_leaves_the_old_value() {
    for (name, write, read, beginning, new) in STORED {
        let model = devices::model(name).unwrap();
        let span = model.timing.store;
        let bench = Bench::booted(model, 1);

        let mut cut = Bench { world: bench.world.snapshot(), adapter: bench.adapter };
        let (delivered, _) = cut.answer_time(read);
        assert!(delivered.starts_with(beginning) && delivered != new, "{name}: {delivered}");
        cut.send(write);
        // Longer than the request takes, shorter than the store.
        cut.world.run_for(Duration::from_micros(u64::from(model.timing.sdo_answer.most_us + span.least_us / 2)));
        let answers = cut.heard().iter().filter(|(_, frame)| frame.id().raw() == 0x585).count();
        assert_eq!(answers, 0, "{name}: not acknowledged before it is stored");
        cut.world.cut_power(NODE).unwrap();
        cut.world.set_power(NODE, true).unwrap();
        cut.wait(&boot_up(), 2000);
        cut.world.run_for(Duration::from_millis(100));
        cut.heard();
        assert_eq!(cut.answer_time(read).0, delivered, "{name}: cut in the store");

        let mut kept = bench;
        let (answer, ns) = kept.answer_time(write);
        assert!(answer.starts_with("585#60"), "{name}: {answer}");
        assert!(ns >= u64::from(span.least_us) * 1000, "{name}: {ns} ns");
        assert!(ns <= u64::from(span.most_us + model.timing.sdo_answer.most_us) * 1000 + 700_000, "{name}: {ns} ns");
        kept.world.cut_power(NODE).unwrap();
        kept.world.set_power(NODE, true).unwrap();
        kept.wait(&boot_up(), 2000);
        kept.world.run_for(Duration::from_millis(100));
        kept.heard();
        assert_eq!(kept.answer_time(read).0, new, "{name}: cut after the answer");
    }
}

/// A joint stores with the next run of its communication task, after it has taken 2614h = 1.
#[test]
fn the_answer_to_a_save_of_a_joint_waits_for_its_store() {
    let model = devices::model("m4230e17b50").unwrap();
    let span = model.timing.store;
    for seed in 1..=8 {
        let (answer, ns) = Bench::booted(model, seed).answer_time("605#2B14260001000000");
        assert!(answer.starts_with("585#601426"), "{answer}");
        assert!(ns >= u64::from(span.least_us) * 1000, "seed {seed}: {ns} ns");
    }
}

#[test]
fn an_answer_that_waits_for_its_store_is_not_sent_after_a_reset() {
    for (name, write, _, _, _) in STORED {
        let model = devices::model(name).unwrap();
        for command in ["81", "82"] {
            let mut bench = Bench::booted(model, 1);
            bench.send(write);
            // The firmware has answered, the chip is at work.
            bench.world.run_for(Duration::from_micros(u64::from(model.timing.sdo_answer.most_us + 1_000)));
            assert_eq!(bench.heard(), [], "{name}");
            bench.send(&format!("000#{command}05"));
            bench.world.run_for(Duration::from_secs(2));
            let heard: Vec<String> = bench.heard().iter().map(|(_, frame)| frame.to_string()).collect();
            assert_eq!(heard.first(), Some(&boot_up()), "{name}, {command}");
            assert!(!heard.iter().any(|frame| frame.starts_with("585#")), "{name}, {command}: {heard:?}");
        }
    }
}

#[test]
fn a_supply_that_is_switched_off_drains_and_a_cycle_waits_for_that() {
    for name in ["zlac8030l", "zlim42c", "m4230e17b50", "cia402"] {
        let mut bench = Bench::booted(devices::model(name).unwrap(), 1);
        let mut off = Bench { world: bench.world.snapshot(), adapter: bench.adapter };
        off.world.set_power(NODE, false).unwrap();
        let mut phases = vec![off.power()];
        let mut last_v = off.world.report(NODE).unwrap().supply_v;
        for _ in 0..20_000 {
            off.world.run_for(Duration::from_millis(1));
            let report = off.world.report(NODE).unwrap();
            assert!(report.supply_v <= last_v, "{name}: it drains");
            last_v = report.supply_v;
            if phases.last() != Some(&report.power) {
                phases.push(report.power);
            }
        }
        assert_eq!(phases, [PowerPhase::Draining, PowerPhase::Off], "{name}");

        let place = format!("{NODE}").parse().unwrap();
        let cycle = "power cycle".parse().unwrap();
        bench.world.apply(place, &cycle).unwrap().unwrap();
        let mut phases = vec![bench.power()];
        let start = bench.world.now();
        while phases.last() != Some(&PowerPhase::On) {
            assert!(bench.world.now() < start + Duration::from_secs(20), "{name}: {phases:?}");
            bench.world.run_for(Duration::from_millis(1));
            let phase = bench.power();
            if phases.last() != Some(&phase) {
                phases.push(phase);
            }
        }
        assert_eq!(phases, [PowerPhase::Cycling, PowerPhase::Booting, PowerPhase::On], "{name}");
    }
}

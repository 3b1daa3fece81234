//! The bus as an FMU, to the bit: lengths, priorities, arbitration that is lost, errors and bus-off, as its nodes are notified of them.

use can::Frame;
use ferrodrive_fmu::config::TxClock;
use ferrodrive_fmu::instance::{Instance, Interval};
use ferrodrive_fmu::operation::{BusError, ErrorCode, LostFrame, Operation, operations};
use ferrodrive_fmu::variable::Value;

use crate::importer::{binary, bus, instance, named};

/// At 500 kbit/s.
const BIT_NS: u64 = 2_000;
const NODES: usize = 3;

/// A bus of three nodes, stepped from countdown to countdown.
struct Wire {
    bus: Instance,
    now_ns: u64,
    /// When which node was notified of what.
    heard: Vec<(u64, usize, Operation)>,
}

impl Wire {
    /// At 1 ms: each node has seen the bus idle.
    fn new(corrupted: f64) -> Self {
        let mut bus = instance(bus(NODES as u8, TxClock::Countdown));
        let reference = named(&bus, "corrupted");
        bus.set(reference, Value::Float64(corrupted)).unwrap();
        bus.exit_initialization().unwrap();
        let mut wire = Self { bus, now_ns: 0, heard: Vec::new() };
        wire.run(1_000_000);
        wire
    }

    /// Has nodes say something at this instant; nodes are counted from 1.
    fn say(&mut self, said: &[(usize, Operation)]) {
        for node in 1..=NODES {
            let mut bytes = Vec::new();
            said.iter().filter(|(of, _)| *of == node).for_each(|(_, operation)| operation.write(&mut bytes));
            self.bus.set(rx_data(node), Value::Binary(bytes)).unwrap();
        }
        self.bus.update().unwrap();
    }

    fn run(&mut self, until_ns: u64) {
        loop {
            while self.take() {}
            if self.now_ns == until_ns {
                return;
            }
            let next = match self.bus.interval(tx_clock(1)).unwrap() {
                Interval::In(nanos) => until_ns.min(self.now_ns + nanos),
                Interval::NotKnown => until_ns,
            };
            self.bus.enter_step().unwrap();
            let (from_s, to_s) = (self.now_ns as f64 / 1e9, next as f64 / 1e9);
            self.bus.step(from_s, to_s - from_s).unwrap();
            self.bus.enter_event().unwrap();
            self.now_ns = next;
        }
    }

    /// A round of an event, if one is due: takes what is there for each node.
    fn take(&mut self) -> bool {
        let is_due = self.bus.interval(tx_clock(1)).unwrap() == Interval::In(0);
        for node in (1..=NODES).filter(|_| is_due) {
            self.bus.set_clock(tx_clock(node), true).unwrap();
            let bytes = binary(&mut self.bus, tx_clock(node) + 1);
            self.heard.extend(operations(&bytes).map(|operation| (self.now_ns, node, operation.unwrap())));
        }
        self.bus.update().unwrap();
        is_due
    }

    /// What a node was notified of, without the frames that it received.
    fn of(&self, node: usize) -> Vec<(u64, Operation)> {
        let own =
            self.heard.iter().filter(|(_, of, operation)| *of == node && !matches!(operation, Operation::Transmit(_)));
        own.map(|(at, _, operation)| (*at, operation.clone())).collect()
    }
}

const fn rx_data(node: usize) -> u32 {
    1001 + 5 * (node as u32 - 1)
}

const fn tx_clock(node: usize) -> u32 {
    rx_data(node) + 1
}

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

fn transmit(text: &str) -> Operation {
    Operation::Transmit(frame(text))
}

/// `555#AAAAAAAAAAAAAAAA` alternates but for three zeros (RTR, IDE, r0), and its CRC is 111110111001110: 44 + 64 bits and one stuff bit.
/// Eight bytes take 111 bits with the space behind them, and with as many stuff bits as there can be 135.
#[test]
fn frames_take_their_exact_bits_and_the_lowest_identifier_is_first() {
    let mut wire = Wire::new(0.0);
    let zeros = "000#0000000000000000";
    wire.say(&[(1, transmit("704#05")), (2, transmit("555#AAAAAAAAAAAAAAAA")), (3, transmit(zeros))]);
    wire.say(&[(1, transmit("181#1122334455667788")), (1, transmit("182#0102030405060708"))]);
    wire.run(3_000_000);
    let received = wire.heard.iter().filter_map(|(at, node, operation)| match operation {
        Operation::Transmit(frame) if *node == 1 || frame.id().raw() & 0x80 != 0 && *node == 2 => Some((*at, *frame)),
        Operation::Confirm(0x704) if *node == 1 => Some((*at, frame("704#05"))),
        _ => None,
    });
    let received: Vec<_> = received.collect();
    let ids: Vec<_> = received.iter().map(|(_, frame)| frame.id().raw()).collect();
    assert_eq!(ids, [0x000, 0x181, 0x182, 0x555, 0x704]);
    let ends: Vec<_> = std::iter::once(1_000_000 - 3 * BIT_NS).chain(received.iter().map(|(at, _)| *at)).collect();
    let bits: Vec<_> = ends.windows(2).map(|pair| (pair[1] - pair[0]) / BIT_NS).collect();
    assert!(bits[..4].iter().all(|bits| (111..=135).contains(bits)), "{bits:?}");
    assert_eq!(bits[3], 109 + 3);
    assert_eq!(wire.of(2), [(received[3].0, Operation::Confirm(0x555))]);
}

/// By its configuration a node's frame waits for the bus, or is dropped and its node notified.
#[test]
fn a_frame_that_loses_arbitration_waits_or_is_dropped_as_its_node_has_said() {
    for lost in [LostFrame::Buffer, LostFrame::Discard] {
        let mut wire = Wire::new(0.0);
        wire.say(&[(2, Operation::ArbitrationLostBehavior(lost))]);
        wire.say(&[(1, transmit("100#")), (2, transmit("200#"))]);
        wire.run(2_000_000);
        let [(ended_ns, Operation::Confirm(0x100))] = wire.of(1)[..] else { panic!("{:?}", wire.of(1)) };
        let heard = wire.of(2);
        match lost {
            // Its node is notified with the next event of the bus, the end of the other frame.
            LostFrame::Discard => assert_eq!(heard, [(ended_ns, Operation::ArbitrationLost(0x200))]),
            LostFrame::Buffer => assert!(matches!(heard[..], [(_, Operation::Confirm(0x200))]), "{heard:?}"),
        }
    }
}

/// Of a frame that is destroyed each node that was sending it is notified as its sender, and one node alone as the one that saw it first
/// (fmi-ls-bus 1.0, "Bus Error").
#[test]
fn each_node_that_sends_a_frame_is_notified_as_its_sender_when_it_is_destroyed() {
    // The same frame and a wire that destroys it; and two contents of one identifier.
    for (corrupted, other) in [(1.0, "123#11"), (0.0, "123#22")] {
        let mut wire = Wire::new(corrupted);
        wire.say(&[(1, transmit("123#11")), (2, transmit(other))]);
        wire.run(1_000_000 + 100 * BIT_NS);
        let first: Vec<_> = (1..=NODES).map(|node| wire.of(node)[0].clone()).collect();
        let error = |is_primary, is_sender| {
            Operation::BusError(BusError { id: 0x123, code: ErrorCode::Bit, is_primary, is_sender })
        };
        let seen: Vec<_> = first.iter().map(|(_, operation)| operation.clone()).collect();
        let is_first = seen[1] == error(true, true);
        assert_eq!(seen, [error(!is_first, true), error(is_first, true), error(false, false)], "{other}");
        assert!(first.iter().all(|(at, _)| *at == first[0].0), "{first:?}");
    }
}

/// Each failure counts 8: at 256 a sender is off, and back after 128 times 11 recessive bits (ISO 11898-1, fault confinement).
#[test]
fn a_sender_that_always_fails_is_off_after_32_attempts_and_comes_back() {
    let mut wire = Wire::new(1.0);
    wire.say(&[(1, transmit("123#1122"))]);
    wire.run(20_000_000);
    let failed: Vec<_> = wire.of(1).iter().map(|(at, _)| *at).collect();
    let gaps: Vec<_> = failed.windows(2).map(|pair| (pair[1] - pair[0]) / BIT_NS).collect();
    assert!(gaps.len() > 32, "{gaps:?}");
    // An error frame of 17 bits with its space, 8 bits more when passive, and at most the frame's 44 + 16 bits with 14 stuff bits.
    for gap in &gaps[..31] {
        assert!((17..17 + 8 + 74).contains(gap), "{gaps:?}");
    }
    // The flag's six bits are not recessive.
    let off = 6 + 128 * 11;
    assert!((off..off + 74).contains(&gaps[31]), "{gaps:?}");
    let attempts = Value::UInt64(failed.len() as u64);
    let reference = named(&wire.bus, "errors");
    assert_eq!(wire.bus.get(reference).unwrap(), attempts);
}

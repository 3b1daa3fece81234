//! Joints, a host and the bus between them.

use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant};
use drives::mjoint::Model;
use ferrodrive_tests::mjoint::objects;
use sim::machine::mjoint;
use sim::{Report, StationId, World};

/// Counts in one turn of the motor.
pub(crate) const TURN: i64 = 32_768;

/// The joint answers within about 1 ms; its users wait for 20 ms.
const ANSWER_WITHIN_MS: u64 = 20;

/// How long the host waits before it looks again.
const LOOK_EVERY: Duration = Duration::from_micros(50);

pub(crate) struct Bench {
    pub(crate) world: World,
    pub(crate) host: StationId,
    heard: Vec<(Instant, Frame)>,
}

impl Bench {
    /// One joint as delivered, node 1, that has just booted on a bus of 1 Mbit/s.
    pub(crate) fn new() -> Self {
        Self::of(1, &Model::M4230E17B50)
    }

    /// Joints of a model at the nodes 1 to `count`.
    pub(crate) fn of(count: u8, model: &'static Model) -> Self {
        let mut world = World::new(Bitrate::M1, 1);
        let host = world.add_tap();
        for node in 1..=count {
            world.add_drive(node, Box::new(mjoint(model, node, Bitrate::M1))).expect("a drive of this number");
        }
        let mut bench = Self { world, host, heard: Vec::new() };
        bench.run_ms(10);
        bench
    }

    pub(crate) fn run_ms(&mut self, ms: u64) {
        self.run(Duration::from_millis(ms));
    }

    pub(crate) fn run(&mut self, duration: Duration) {
        self.world.run_for(duration);
        self.listen();
    }

    fn listen(&mut self) {
        while let Some(heard) = self.world.poll_received(self.host) {
            self.heard.push(heard);
        }
    }

    /// Everything that the host heard since the last call, in candump notation.
    pub(crate) fn heard(&mut self) -> Vec<String> {
        self.listen();
        std::mem::take(&mut self.heard).into_iter().map(|(_, frame)| frame.to_string()).collect()
    }

    /// Sends a frame in candump notation and lets it arrive.
    pub(crate) fn send(&mut self, frame: &str) {
        self.world.send(self.host, frame.parse().expect("a frame")).expect("room at the host");
        self.run(Duration::from_micros(500));
    }

    /// Sends a frame; the first frame heard with an identifier within the time of an answer.
    pub(crate) fn ask(&mut self, frame: Frame, answers: u16) -> Option<Frame> {
        self.world.send(self.host, frame).expect("room at the host");
        self.listen();
        let from = self.heard.len();
        let end = self.world.now() + Duration::from_millis(ANSWER_WITHIN_MS);
        while self.world.now() < end {
            self.run(LOOK_EVERY);
            let answer = self.heard[from..].iter().find(|(_, frame)| frame.standard_data_id() == Some(answers));
            if let Some((_, frame)) = answer {
                return Some(*frame);
            }
        }
        None
    }

    /// Writes `value` with the object's width to node 1; the abort code if it is refused.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        self.write_to(1, index, sub, value)
    }

    pub(crate) fn write_to(&mut self, node: u16, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let size = size_of(index, sub);
        let mut request = head(0x23 | (4 - size as u8) << 2, index, sub);
        request[4..4 + size].copy_from_slice(&value.to_le_bytes()[..size]);
        let answer = self.sdo(node, request);
        if answer[0] == 0x60 { Ok(()) } else { Err(last_four(&answer)) }
    }

    /// Writes a value that the joint must take.
    #[track_caller]
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: i64) {
        assert_eq!(self.write(index, sub, value), Ok(()), "{index:04X}h:{sub:02X} = {value}");
    }

    /// The value of an object of node 1.
    #[track_caller]
    pub(crate) fn get(&mut self, index: u16, sub: u8) -> i64 {
        self.get_from(1, index, sub)
    }

    #[track_caller]
    pub(crate) fn get_from(&mut self, node: u16, index: u16, sub: u8) -> i64 {
        let answer = self.sdo(node, head(0x40, index, sub));
        let unused = match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => u32::from(answer[0] >> 2 & 3) * 8,
            _ => panic!("{index:04X}h:{sub:02X} of node {node}: {:08X}h", last_four(&answer)),
        };
        let raw = last_four(&answer) << unused;
        let signed = objects().iter().any(|joint| (joint.row.index, joint.row.sub) == (index, sub) && joint.row.signed);
        if signed { i64::from(raw as i32 >> unused) } else { i64::from(raw >> unused) }
    }

    fn sdo(&mut self, node: u16, request: [u8; 8]) -> [u8; 8] {
        let frame = Frame::full(CanId::standard(0x600 + node), request);
        let answer = self.ask(frame, 0x580 + node).unwrap_or_else(|| panic!("no answer to {frame}"));
        *answer.padded()
    }

    pub(crate) fn statusword(&mut self) -> u16 {
        self.get(0x6041, 0) as u16
    }

    pub(crate) fn position(&mut self) -> i64 {
        self.get(0x6064, 0)
    }

    /// Milliseconds until a statusword bit is set; panics after `limit_ms`.
    #[track_caller]
    pub(crate) fn until(&mut self, limit_ms: u64, mut done: impl FnMut(&mut Self) -> bool) -> u64 {
        for ms in 0..limit_ms {
            if done(self) {
                return ms;
            }
            self.run_ms(1);
        }
        panic!("not within {limit_ms} ms: statusword {:04X}h, {:?}", self.statusword(), self.report());
    }

    #[track_caller]
    pub(crate) fn until_reached(&mut self, limit_ms: u64) -> u64 {
        self.until(limit_ms, |bench| bench.statusword() & 0x0400 != 0)
    }

    /// A line for the world, as a person at the machine types it; it must be taken.
    #[track_caller]
    pub(crate) fn tell(&mut self, line: &str) -> String {
        let answer = sim::command::answer(&mut self.world, line).expect("a line is answered").json;
        assert!(answer.starts_with("{\"ok\":true"), "{line}: {answer}");
        answer
    }

    /// What a person beside the machine could measure now.
    pub(crate) fn report(&mut self) -> Report {
        self.world.report(1).expect("the joint is there")
    }

    /// Off for 0.1 s, and on again until it has booted.
    pub(crate) fn power_cycle(&mut self) {
        self.tell("1 power off");
        self.run_ms(100);
        self.tell("1 power on");
        self.run_ms(10);
    }

    /// 2614h = 1, and its 2.
    pub(crate) fn save(&mut self) {
        self.set(0x2614, 0, 1);
        self.run_ms(5);
        assert_eq!(self.get(0x2614, 0), 2);
    }
}

pub(crate) fn size_of(index: u16, sub: u8) -> usize {
    let rows = objects();
    let row = rows.iter().find(|joint| (joint.row.index, joint.row.sub) == (index, sub));
    row.map_or(4, |joint| joint.row.size)
}

pub(crate) fn head(command: u8, index: u16, sub: u8) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [command, low, high, sub, 0, 0, 0, 0]
}

pub(crate) fn last_four(answer: &[u8; 8]) -> u32 {
    u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
}

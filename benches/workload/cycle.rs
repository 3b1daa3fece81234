//! A line of six drives that are moved cycle by cycle at 1 ms, and answer each SYNC: what the benchmark times and what the
//! instruction count counts is the master's part.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Waker};
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use canopen::connection_set::Service;
use canopen::{Mux, NodeId};
use cia402::{Controlword, ModeOfOperation, PowerCommand};
use devices::model;
use master::cyclic::{CyclicDrive, CyclicOptions, Demand};
use master::units::Rpm;
use master::{Drive, Network};

const DRIVES: u8 = 6;
const PERIOD: Duration = Duration::from_millis(1);

/// Six drives with the ZLAC8030L's objects, in profile velocity, and the master that moves them.
pub(crate) struct Line {
    network: Network,
    drives: Vec<CyclicDrive>,
    now: Instant,
    answers: Vec<Frame>,
}

impl Line {
    /// Opened, and enabled.
    pub(crate) fn new() -> Self {
        let network = Network::new();
        let mut line = Self { network, drives: Vec::new(), now: Instant::ZERO, answers: Vec::new() };
        for id in NodeId::all().take(DRIVES.into()) {
            let drive = Drive::new(line.network.node(id), model("zlac8030l").expect("the model is known"));
            let mode = ModeOfOperation::PROFILE_VELOCITY;
            let opened = line.serve(drive.cyclic(mode, CyclicOptions::default()));
            line.drives.push(opened.expect("mapped as needed"));
        }
        line.answers = (1..=u16::from(DRIVES))
            .map(|node| Frame::new(CanId::standard(0x180 + node), &[0x37, 2, 0, 0, 0, 0]))
            .collect();
        line.network.sync(Some(PERIOD));
        for _ in 0..10 {
            line.cycle();
        }
        line
    }

    /// SYNC, a step of each drive, their RPDOs out, and the TPDOs of all in.
    pub(crate) fn cycle(&mut self) {
        let next = self.network.next_sync();
        let mut next = pin!(next);
        let mut context = Context::from_waker(Waker::noop());
        assert!(next.as_mut().poll(&mut context).is_pending(), "the cycle has not begun");
        self.network.handle_timeout(self.now);
        assert!(next.as_mut().poll(&mut context).is_ready(), "the cycle has begun");
        let drives = &mut self.drives;
        self.network.exchange(|io| {
            for drive in drives.iter_mut() {
                drive.step(io, Demand::Velocity(Rpm(60.0)));
            }
        });
        while self.network.poll_transmit().is_some() {}
        let later = self.now.plus_nanos(500_000);
        for answer in &self.answers {
            self.network.handle_frame(answer, later);
        }
        self.now = self.now.plus_nanos(1_000_000);
    }

    /// Runs the future with nodes that answer each SDO request at once.
    fn serve<F: Future>(&mut self, future: F) -> F::Output {
        let mut future = pin!(future);
        let mut context = Context::from_waker(Waker::noop());
        loop {
            if let std::task::Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return output;
            }
            self.network.handle_timeout(self.now);
            while let Some(frame) = self.network.poll_transmit() {
                if let Some(reply) = reply_to(&frame) {
                    self.network.handle_frame(&reply, self.now);
                }
            }
            self.now = self.network.poll_timeout().map_or(self.now, |due| self.now.max(due));
        }
    }
}

/// What a drive answers that has RPDO1 6040h and 60FFh, TPDO1 6041h and 6064h with each SYNC, and mode 3.
fn reply_to(request: &Frame) -> Option<Frame> {
    let Some(Service::SdoRequest(node)) = Service::of(request.id()) else { return None };
    let [command, low, high, sub_index, ..] = *request.padded();
    let index = u16::from_le_bytes([low, high]);
    let mut data = [0x60, low, high, sub_index, 0, 0, 0, 0];
    if command == 0x40 {
        let (value, length) = value_of(Mux::new(index, sub_index), node)?;
        data[0] = 0x43 | (4 - length) << 2;
        data[4..].copy_from_slice(&value.to_le_bytes());
    }
    Some(Frame::full(CanId::standard(0x580 + u16::from(node.raw())), data))
}

fn value_of(mux: Mux, node: NodeId) -> Option<(u32, u8)> {
    let id = u32::from(node.raw());
    let row = model("zlac8030l")?.row(mux)?;
    let length = row.data_type.size() as u8;
    let value = match (mux.index, mux.sub_index) {
        (0x1400, 1) => 0x200 + id,
        (0x1800, 1) => 0x180 + id,
        (0x1401..=0x1403 | 0x1801..=0x1803, 1) => 0x8000_0000,
        (0x1400..=0x1403 | 0x1800..=0x1803, 2) => 1,
        (0x1600 | 0x1A00, 0) => 2,
        (0x1600, 1) => 0x6040_0010,
        (0x1600, 2) => 0x60FF_0020,
        (0x1A00, 1) => 0x6041_0010,
        (0x1A00, 2) => 0x6064_0020,
        (0x6060 | 0x6061, 0) => 3,
        (0x200B, 0) => 1024,
        (0x200A, 0) => 1000,
        (0x202F, 5) => 1,
        (0x6041, 0) => 0x0237,
        (0x6040, 0) => u32::from(PowerCommand::EnableOperation.controlword().0 & !Controlword::HALT),
        _ => 0,
    };
    Some((value, length))
}

//! Random frames, commands and times into the core: nothing panics, queues stay bounded, every request ends.

use std::collections::BTreeSet;
use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use canopen::nmt::NmtTarget;
use canopen::object::{DEVICE_TYPE, MANUFACTURER_DEVICE_NAME};
use canopen::pdo::{MappingRecord, PdoNumber};
use canopen::{NmtCommand, NodeId};
use cia402::object::STATUSWORD;
use master::core::{Command, Core, Cycle, Payload, PdoMap, Request, RpdoTrigger, Transfer};

/// Marsaglia's xorshift32.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    fn below(&mut self, bound: u32) -> u32 {
        self.next() % bound
    }

    fn node(&mut self) -> NodeId {
        // Few nodes, so that frames meet transfers.
        NodeId::new(1 + self.below(3) as u8).unwrap()
    }

    fn frame(&mut self) -> Frame {
        let length = self.below(9) as usize;
        let mut data: Vec<u8> = (0..length).map(|_| self.next() as u8).collect();
        let node = u16::from(self.node().raw());
        let id = match self.below(8) {
            0 if self.below(2) == 0 => 0x080,
            0 => self.next() as u16,
            1 => 0x700 + node,
            2 => 0x80 + node,
            3 => 0x180 + node,
            _ => {
                // Often an answer about the object that is asked for.
                if length >= 4 && self.below(2) == 0 {
                    data[1..4].copy_from_slice(&[0x08, 0x10, 0]);
                }
                0x580 + node
            }
        };
        match self.below(20) {
            0 => Frame::remote(CanId::standard(id), length as u8),
            1 => Frame::new(CanId::extended(u32::from(id)), &data),
            _ => Frame::new(CanId::standard(id), &data),
        }
    }

    fn allowed(&mut self) -> Option<Duration> {
        (self.below(2) == 0).then(|| Duration::from_micros(self.below(20_000).into()))
    }

    fn command(&mut self, core: &mut Core) -> Command {
        let ticket = core.ticket();
        let node = self.node();
        match self.below(11) {
            10 => Command::FollowSync((self.below(2) == 0).then(|| Duration::from_micros(self.below(10_000).into()))),
            8 => Command::Heartbeat(node, Some(Duration::from_micros(self.below(10_000).into())), self.allowed()),
            9 => Command::KeepFed(node, Some(Duration::from_micros(self.below(10_000).into())), self.allowed()),
            0 => Command::Timer(ticket, Duration::from_micros(self.below(5_000).into())),
            1 => Command::Nmt(NmtTarget::All, NmtCommand::Start),
            2 => Command::Sync((self.below(2) == 0).then(|| Duration::from_micros(self.below(10_000).into()))),
            3 => Command::WatchHeartbeat(node, Some(Duration::from_micros(self.below(10_000).into()))),
            _ => {
                let length = self.below(30);
                let upload = self.below(2) == 0;
                let bytes: Vec<u8> = (0..length).map(|_| self.next() as u8).collect();
                let transfer = if upload { Transfer::Upload } else { Transfer::Download(Payload::new(&bytes)) };
                let timeout = Duration::from_micros(self.below(20_000).into());
                Command::Request(ticket, Request { node, mux: MANUFACTURER_DEVICE_NAME, transfer, timeout })
            }
        }
    }
}

#[test]
fn random_traffic_never_panics_and_every_request_ends_once() {
    for seed in 1..=40 {
        let mut random = Random(0x9E37_79B9_u32.wrapping_mul(seed));
        let mut core = Core::new();
        let map = PdoMap(vec![MappingRecord::from_raw(random.next()), MappingRecord::from_raw(0x6041_0010)]);
        core.image_mut().set_tpdo(NodeId::MIN, PdoNumber::FIRST, 0x181, map.clone());
        core.image_mut().set_rpdo(NodeId::MIN, PdoNumber::FIRST, 0x201, map, RpdoTrigger::Sync);
        let mut now = Instant::ZERO;
        let mut open = BTreeSet::new();
        let mut before: Option<Cycle> = None;
        for _ in 0..4_000 {
            now += Duration::from_micros(random.below(300).into());
            match random.below(6) {
                0 => {
                    let command = random.command(&mut core);
                    if let Command::Request(ticket, _) | Command::Timer(ticket, _) = &command {
                        open.insert(*ticket);
                    }
                    core.execute(command, now);
                }
                1 => core.handle_timeout(now),
                2 => {
                    core.image_mut().write(NodeId::MIN, STATUSWORD, random.next().into());
                }
                _ => core.handle_frame(&random.frame(), now),
            }
            // Cycles only go on, for any producer.
            if let (Some(before), Some(cycle)) = (before, core.cycle()) {
                assert!(
                    cycle.number >= before.number && cycle.at >= before.at,
                    "seed {seed}: {before:?} then {cycle:?}"
                );
            }
            before = core.cycle();
            while core.poll_transmit().is_some() {}
            while let Some(finished) = core.poll_finished() {
                assert!(open.remove(&finished.ticket), "seed {seed}: {:?} ended twice", finished.ticket);
            }
        }
        // With time alone everything ends.
        while let Some(due) = core.poll_timeout().filter(|_| !open.is_empty()) {
            now = now.max(due);
            core.handle_timeout(now);
            while core.poll_transmit().is_some() {}
            while let Some(finished) = core.poll_finished() {
                assert!(open.remove(&finished.ticket), "seed {seed}: {:?} ended twice", finished.ticket);
            }
        }
        assert!(open.is_empty(), "seed {seed}: {} requests never ended", open.len());
    }
}

#[test]
fn a_core_that_is_given_no_time_does_not_time_out() {
    let mut core = Core::new();
    let start = Instant::from_secs(100);
    core.upload(NodeId::MIN, DEVICE_TYPE, Duration::from_millis(100), start);
    for _ in 0..1_000 {
        core.handle_timeout(start);
    }
    assert!(core.poll_finished().is_none());
    assert_eq!(core.poll_timeout(), Some(start + Duration::from_millis(100)));
    core.handle_timeout(start + Duration::from_millis(100));
    assert!(core.poll_finished().unwrap().outcome.is_err());
}

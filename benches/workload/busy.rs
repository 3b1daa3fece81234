//! Drives under a host that sends SYNC and process data in a fixed cycle, so that 1 Mbit/s is about three quarters full.

use std::time::Duration;

use can::{CanId, Frame, Instant, Station};
use sim::{StationId, World};

use super::{assert_turning, hub_servos, request, turning};

/// How full the wire may be for the figures to be called those of a busy bus.
const BUSY: std::ops::Range<f64> = 0.70..0.80;

/// Objects of 1600h and 1A00h: index, sub-index, bits.
const CONTROLWORD: u32 = 0x6040_0010;
const STATUSWORD: u32 = 0x6041_0010;
const POSITION_ACTUAL_VALUE: u32 = 0x6064_0020;
const VELOCITY_ACTUAL_VALUE: u32 = 0x606C_0020;
const TARGET_TORQUE: u32 = 0x6071_0010;
const TORQUE_ACTUAL_VALUE: u32 = 0x6077_0010;
const TARGET_POSITION: u32 = 0x607A_0020;
const PROFILE_VELOCITY: u32 = 0x6081_0020;
const TORQUE_SLOPE: u32 = 0x6087_0020;
const TARGET_VELOCITY: u32 = 0x60FF_0020;
const MOTOR_TEMPERATURE: u32 = 0x2026_0110;
const DRIVER_TEMPERATURE: u32 = 0x2026_0210;
const MOTOR_STATUS: u32 = 0x2027_0010;
const HALL_STATUS: u32 = 0x2028_0010;
const BUS_VOLTAGE: u32 = 0x2029_0010;

/// "Go on at 100 r/min", as 6040h and 60FFh.
const DRIVE_ON: [u8; 6] = [0x0F, 0, 100, 0, 0, 0];

/// One drive whose host sends SYNC and three RPDOs each millisecond and gets four TPDOs.
pub(super) fn controlled_each_millisecond() -> World {
    let (mut world, probe) = turning(hub_servos(1));
    for (record, objects) in [
        (0x1600, &[CONTROLWORD, TARGET_VELOCITY][..]),
        (0x1601, &[TARGET_POSITION, PROFILE_VELOCITY]),
        (0x1602, &[TARGET_TORQUE, TORQUE_SLOPE]),
        (0x1A00, &[STATUSWORD, POSITION_ACTUAL_VALUE]),
        (0x1A01, &[VELOCITY_ACTUAL_VALUE, TORQUE_ACTUAL_VALUE]),
        (0x1A02, &[BUS_VOLTAGE, MOTOR_TEMPERATURE, DRIVER_TEMPERATURE]),
        (0x1A03, &[MOTOR_STATUS, HALL_STATUS]),
    ] {
        map(&mut world, probe, 1, record, objects);
    }
    let rpdos = [
        Frame::new(CanId::standard(0x201), &DRIVE_ON),
        Frame::new(CanId::standard(0x301), &[0x00, 0x10, 0, 0, 120, 0, 0, 0]),
        Frame::new(CanId::standard(0x401), &[0, 0, 0x2C, 0x01, 0, 0]),
    ];
    under_a_host(world, probe, Duration::from_millis(1), &rpdos, 1)
}

/// 127 drives with one RPDO and one TPDO each in a cycle of 40 ms.
pub(super) fn many_in_one_cycle() -> World {
    let (mut world, probe) = turning(hub_servos(127));
    for node in 1..=127 {
        map(&mut world, probe, node, 0x1600, &[CONTROLWORD, TARGET_VELOCITY]);
        map(&mut world, probe, node, 0x1A00, &[POSITION_ACTUAL_VALUE, VELOCITY_ACTUAL_VALUE]);
    }
    let rpdos: Vec<Frame> = (1..=127).map(|node| Frame::new(CanId::standard(0x200 + node), &DRIVE_ON)).collect();
    under_a_host(world, probe, Duration::from_millis(40), &rpdos, 127)
}

/// Maps objects into a PDO; a TPDO is to be sent at each SYNC.
fn map(world: &mut World, probe: StationId, node: u8, record: u16, objects: &[u32]) {
    let [low, high] = record.to_le_bytes();
    request(world, probe, node, [0x2F, low, high, 0, 0, 0, 0, 0], false);
    for (sub, object) in (1..).zip(objects) {
        let [a, b, c, d] = object.to_le_bytes();
        request(world, probe, node, [0x23, low, high, sub, a, b, c, d], false);
    }
    request(world, probe, node, [0x2F, low, high, 0, objects.len() as u8, 0, 0, 0], false);
    if record >= 0x1A00 {
        request(world, probe, node, [0x2F, low, 0x18, 2, 1, 0, 0, 0], false);
    }
}

fn under_a_host(mut world: World, probe: StationId, cycle: Duration, rpdos: &[Frame], drives: u8) -> World {
    world.send(probe, Frame::new(CanId::standard(0), &[1, 0])).expect("the probe has room"); // NMT start, all
    let sync = Frame::new(CanId::standard(0x080), &[]);
    let frames = [&[sync], rpdos].concat();
    world.run_for(Duration::from_millis(2));
    world.add_station(Host { sent: frames.len(), frames, cycle, next: world.now() });
    world.run_for(Duration::from_millis(200));
    let before = world.statistics();
    world.run_for(Duration::from_secs(1));
    let load = world.statistics().load_since(&before);
    assert!(BUSY.contains(&load), "bus load {load}");
    assert_turning(&mut world, &(1..=drives).collect::<Vec<_>>());
    world
}

/// Sends its frames, one after the other, at the beginning of each cycle.
#[derive(Clone)]
struct Host {
    frames: Vec<Frame>,
    sent: usize,
    cycle: Duration,
    next: Instant,
}

impl Station for Host {
    fn ignores(&self, _: &Frame) -> bool {
        true
    }

    fn handle_frame(&mut self, _: &Frame, _: Instant) {}

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.next {
            self.sent = 0;
            self.next += self.cycle;
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let frame = self.frames.get(self.sent).copied();
        self.sent += usize::from(frame.is_some());
        frame
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.next)
    }
}

//! The M joint's firmware under frames and sensors that nobody sane would give it.

use can::{CanId, Frame, Instant, Station};
use drives::Firmware;
use drives::mjoint::objects::{DATA_SAVE_FLAG, STATUSWORD, TABLE};
use drives::mjoint::{Hardware, MJoint, Model, PowerStage, Sensors};

use super::selected_frame::selected_frame;

/// A chunk is a selector, a length and eight bytes, see [`selected_frame`], and two for what the sensors read, see [`sensors`].
pub(super) const SAMPLES: &[&[u8]] = &[
    // 0Fh, mode 3 and 600 r/min by SDO.
    b"\0\x06\x2B\x40\x60\x00\x0F\x00\0\0\x10\x40\0\x05\x2F\x60\x60\x00\x03\0\0\0\x10\x40\0\x08\x23\xFF\x60\x00\x58\x02\0\0\x10\x40",
    // RPDO1: a move; RPDO4 and SYNC.
    b"\x01\x07\x2F\x00\x01\x50\xC3\0\0\0\x20\x33\x04\x04\x50\xC3\0\0\0\0\0\0\x20\x33\x05\0\0\0\0\0\0\0\0\0\x20\x33",
    // Homing, the zero-setting sequence, a save.
    b"\0\x05\x2F\x60\x60\x00\x06\0\0\0\x08\x01\0\x06\x2B\x0A\x26\x00\x66\xEA\0\0\x08\x01\0\x06\x2B\x0A\x26\x00\x70\xEA\0\0\x08\x01\0\x06\x2B\x14\x26\x00\x01\0\0\0\x08\x01",
    // The host's heartbeat, a reset by NMT, the DIR clock.
    b"\x06\x01\x05\0\0\0\0\0\0\0\x08\x01\x07\x02\x81\x01\0\0\0\0\0\0\x08\x01\0\x06\x2B\x1C\x26\x00\xFF\0\0\0\xF8\x01",
];

const CHUNK: usize = 12;

/// What a selector picks: SDO, the four RPDOs, SYNC, the host's heartbeat, NMT.
const IDS: [u16; 8] = [0x601, 0x201, 0x301, 0x401, 0x501, 0x080, 0x77F, 0x000];

/// Bits 0 to 5, 10, 12 and 13 are all that the statusword has.
const STATUSWORD_BITS: u16 = 0x343F;

/// Any frames and sensor values leave a joint that answers an SDO request with at most one frame of eight bytes, whose
/// objects lie within their limits, whose identity and mappings have not changed, and whose duty cycles are shares.
pub(super) fn joint(data: &[u8]) {
    let mut joint = MJoint::new(&Model::M4230E17B50);
    let mut now = Instant::ZERO;
    joint.power_on(&Hardware::default(), now);
    let first = fixed(&joint);
    for chunk in data.chunks(CHUNK) {
        let frame = selected_frame(chunk, &IDS);
        joint.handle_frame(&frame, now);
        let answers = drain(&mut joint).iter().filter(|sent| sent.id() == CanId::standard(0x581)).count();
        let asked = frame.id() == CanId::standard(0x601) && !frame.is_remote();
        assert!(answers <= usize::from(asked), "{frame} was answered {answers} times");
        let sensors = sensors(chunk);
        for _ in 0..chunk.get(10).copied().unwrap_or(0) >> 3 {
            let actuation = joint.tick(&sensors, now);
            if let PowerStage::Modulate { duty } = actuation.power_stage {
                assert!(duty.iter().all(|share| (0.0..=1.0).contains(share)), "{frame}, {sensors:?}: {duty:?}");
            }
            now = now.plus_nanos(MJoint::CONTROL_PERIOD_NS);
            joint.handle_timeout(now);
            drain(&mut joint);
        }
        assert_eq!(fixed(&joint), first, "{frame} changed what is fixed");
        judge(&joint, &frame);
    }
}

/// Each bit of the second byte spoils something; the first gives the angle.
fn sensors(chunk: &[u8]) -> Sensors {
    let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
    let (place, bits) = (byte(10), byte(11));
    let has = |bit: u8| bits & 1 << bit != 0;
    let mut sensors = Sensors {
        angle_count: u16::from(place) << 8 | u16::from(bits),
        position_counts: if has(0) { i32::MIN + i32::from(place) } else { i32::from(place) * 128 },
        turns_lost: has(1),
        phase_current_a: if has(2) { [40.0, -40.0] } else { [0.5, 0.25] },
        bus_v: if has(3) { 60.0 } else { 36.0 },
        driver_c: if has(4) { f32::INFINITY } else { 30.0 },
        pu: has(5),
        dir: has(6),
        eeprom_fails: has(7),
        ..Sensors::default()
    };
    sensors.pulses.falls = u16::from(bits) << 8 | u16::from(place);
    sensors.pulses.quadrature = sensors.pulses.falls;
    sensors.pulses.duty = has(0).then(|| f32::from(place) / 200.0);
    sensors
}

fn drain(joint: &mut MJoint) -> Vec<Frame> {
    let sent: Vec<Frame> = std::iter::from_fn(|| joint.poll_transmit()).take(64).collect();
    assert!(sent.len() < 64, "it never stops sending");
    sent
}

/// Communication objects that can only be read, but for the error register.
fn fixed(joint: &MJoint) -> Vec<i64> {
    let rows = TABLE.iter().filter(|(_, row)| row.index < 0x2000 && row.index != 0x1001 && !row.access.is_writable());
    rows.map(|(slot, _)| joint.values().value(slot)).collect()
}

fn judge(joint: &MJoint, frame: &Frame) {
    let statusword = joint.values().get(STATUSWORD);
    assert_eq!(statusword & !STATUSWORD_BITS, 0, "{frame}: {statusword:04X}h");
    for (slot, row) in TABLE.iter().filter(|(slot, row)| row.access.is_writable() && *slot != DATA_SAVE_FLAG.slot()) {
        let value = joint.values().value(slot);
        assert_eq!(row.check_value(value), Ok(()), "{frame} put {value} into {}", row.mux());
    }
    assert!(joint.values().get(DATA_SAVE_FLAG) <= 2, "{frame}");
}

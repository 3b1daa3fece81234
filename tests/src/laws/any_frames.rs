//! The firmwares under absurd frames, sensors and gaps in time.

use can::{CanId, Frame, Instant};
use canopen::AbortCode;
use canopen::sdo::wire::Reply;
use drives::{mjoint, zlac8030l, zlim42c};

use super::firmware::LawSubject;
use super::selected_frame::selected_frame;

/// A chunk is a selector, a length and eight bytes, see [`selected_frame`], one byte for how long it lasts, see [`wait`],
/// and two for what the sensors read.
pub(super) const ZLAC8030L_SAMPLES: &[&[u8]] = &[
    // Enable by SDO, mode 3, 100 r/min.
    b"\0\x08\x2F\x60\x60\0\x03\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x06\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x07\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x0F\0\0\0\x20\0\0\0\x08\x23\xFF\x60\0\x64\0\0\0\x20\x40\0",
    // Start by NMT, 6040h by RPDO0, SYNC, a reset.
    b"\x01\x02\x01\x01\0\0\0\0\0\0\x10\0\0\x03\x02\x06\0\0\0\0\0\0\0\x10\0\0\x03\x02\x0F\0\0\0\0\0\0\0\x10\0\0\x02\0\0\0\0\0\0\0\0\0\x10\0\0\x01\x02\x81\x01\0\0\0\0\0\0\x10\0\0",
    // An event-driven TPDO of 6064h every 10 ms; a save; ten seconds.
    b"\0\x08\x23\0\x1A\x01\x20\0\x64\x60\x08\0\0\0\x08\x2F\0\x1A\0\x01\0\0\0\x08\0\0\0\x08\x2B\0\x18\x05\x14\0\0\0\x08\0\0\0\x08\x2B\x09\x20\0\x01\0\0\0\x07\x10\0",
];

/// The same for the ZLIM42-C.
pub(super) const ZLIM42C_SAMPLES: &[&[u8]] = &[
    // Enable by SDO, mode 1, a turn on.
    b"\0\x08\x2F\x60\x60\0\x01\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x06\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x07\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x0F\0\0\0\x20\0\0\0\x08\x23\x7A\x60\0\xA0\x0F\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x1F\0\0\0\xF8\0\0",
    // Homing to a switch; the stall of time; a fault by a short circuit and its reset.
    b"\0\x08\x2F\x60\x60\0\x06\0\0\0\x20\0\0\0\x08\x2F\x98\x60\0\x11\0\0\0\x20\0\0\0\x08\x2B\x40\x60\0\x1F\0\0\0\xF8\x01\0\0\x08\x2B\x11\x20\0\x01\0\0\0\x10\0\x04",
];

/// The same for a joint.
pub(super) const MJOINT_SAMPLES: &[&[u8]] = &[
    // 0Fh, mode 3 and 600 r/min by SDO.
    b"\0\x06\x2B\x40\x60\0\x0F\0\0\0\x10\x10\x40\0\x05\x2F\x60\x60\0\x03\0\0\0\x10\x10\x40\0\x08\x23\xFF\x60\0\x58\x02\0\0\x10\x10\x40",
    // RPDO1: a move; RPDO4 and SYNC.
    b"\x01\x07\x2F\0\x01\x50\xC3\0\0\0\x20\x20\x33\x04\x04\x50\xC3\0\0\0\0\0\0\x20\x20\x33\x05\0\0\0\0\0\0\0\0\0\x20\x20\x33",
    // Homing, the zero-setting sequence, a save.
    b"\0\x05\x2F\x60\x60\0\x06\0\0\0\x08\x08\x01\0\x06\x2B\x0A\x26\0\x66\xEA\0\0\x08\x08\x01\0\x06\x2B\x0A\x26\0\x70\xEA\0\0\x08\x08\x01\0\x06\x2B\x14\x26\0\x01\0\0\0\x08\x08\x01",
    // The host's heartbeat, a reset by NMT, the DIR clock.
    b"\x06\x01\x05\0\0\0\0\0\0\0\x08\x08\x01\x07\x02\x81\x01\0\0\0\0\0\0\x08\x08\x01\0\x06\x2B\x1C\x26\0\xFF\0\0\0\xF8\xF8\x01",
];

const CHUNK: usize = 13;

/// Each is node 1, those with switches by them, so that no write can take them out of hearing.
const NODE: u8 = 1;

/// Any frames, sensor values and gaps leave a ZLAC8030L lawful: see [`drive`].
pub(super) fn zlac8030l(data: &[u8]) {
    let hardware = zlac8030l::hardware::Hardware { dip_address: NODE, ..Default::default() };
    drive(data, zlac8030l::Zlac8030l::new(), &hardware);
}

/// The same for a ZLIM42-C.
pub(super) fn zlim42c(data: &[u8]) {
    let hardware = zlim42c::hardware::Hardware { dip_address: NODE, ..Default::default() };
    drive(data, zlim42c::Zlim42c::new(), &hardware);
}

/// The same for a joint.
pub(super) fn mjoint(data: &[u8]) {
    drive(data, mjoint::MJoint::new(&mjoint::Model::M4230E17B50), &mjoint::Hardware::default());
}

/// Every SDO request gets at most one well-formed answer, every writable object lies within its limits, read-only
/// communication objects do not change, what the drive reports is finite, and the duty cycles are shares.
fn drive<F: LawSubject>(data: &[u8], mut firmware: F, hardware: &F::Hardware) {
    let mut now = Instant::ZERO;
    firmware.power_on(hardware, now);
    let first = fixed(&firmware);
    let (mut asked, mut answered) = (0, 0);
    for chunk in data.chunks(CHUNK) {
        let frame = selected_frame(chunk, &F::IDS);
        asked += usize::from(frame.id() == CanId::standard(F::IDS[0]) && !frame.is_remote());
        firmware.handle_frame(&frame, now);
        answered += drain(&mut firmware, &frame);
        let byte = |at: usize| chunk.get(at).copied().unwrap_or(0);
        let sensors = F::sensors(byte(11), byte(12));
        let (periods, gap_ns) = wait(byte(10), F::CONTROL_PERIOD_NS);
        for _ in 0..periods {
            let actuation = firmware.tick(&sensors, now);
            assert!(F::is_possible(&actuation), "an impossible actuation after {frame}");
            now = now.plus_nanos(gap_ns);
            firmware.handle_timeout(now);
            answered += drain(&mut firmware, &frame);
        }
        assert!(answered <= asked, "{answered} answers to {asked} requests, the last {frame}");
        judge(&firmware, &first, &frame);
    }
}

/// How many control periods a chunk lasts, and how far apart they are: as they should be, or once ten seconds late.
fn wait(byte: u8, period_ns: u64) -> (u8, u64) {
    match byte & 7 {
        7 => (1, 10_000_000_000),
        _ => (byte >> 3, period_ns),
    }
}

/// Takes what is sent: SDO answers are counted, and all is of the form that CiA 301 gives it.
fn drain<F: LawSubject>(firmware: &mut F, after: &Frame) -> usize {
    let mut answers = 0;
    for count in 0.. {
        assert!(count < 64, "it never stops sending after {after}");
        let Some(sent) = firmware.poll_transmit() else { break };
        if sent.id() == CanId::standard(0x580 + u16::from(NODE)) {
            let raw = sent.data().first_chunk::<8>().expect("an SDO answer has eight bytes");
            let reply = Reply::parse(raw);
            assert!(!matches!(reply, Reply::Unknown { .. }), "{sent} after {after}");
            // A server that aborts a transfer reports it without a request.
            answers += usize::from(!matches!(reply, Reply::Abort(_, AbortCode::TIMED_OUT)));
        }
        if sent.id() == CanId::standard(0x700 + u16::from(NODE)) {
            assert_eq!(sent.dlc(), 1, "{sent} after {after}");
        }
    }
    answers
}

/// Communication objects that can only be read, but for the error register.
fn fixed<F: LawSubject>(firmware: &F) -> Vec<i64> {
    let rows = F::table().iter();
    let rows = rows.filter(|(_, row)| row.index < 0x2000 && row.index != 0x1001 && !row.access.is_writable());
    rows.map(|(slot, _)| firmware.value(slot)).collect()
}

fn judge<F: LawSubject>(firmware: &F, first: &[i64], frame: &Frame) {
    let ruled = |index| !F::OWN_RULE.contains(&index);
    for (slot, row) in F::table().iter().filter(|(_, row)| row.access.is_writable() && ruled(row.index)) {
        let value = firmware.value(slot);
        let fits = match row.resolution.map(|object| F::table().find(object).expect("a row's resolution is an object"))
        {
            // Which resolution is in effect is the firmware's business; the finest is the widest.
            Some(resolution) => row.check_value_at(value, F::table().row(resolution).limits_at(1).1),
            None => row.check_value(value),
        };
        assert_eq!(fits, Ok(()), "{frame} put {value} into {}", row.mux());
    }
    assert!(firmware.keeps_its_own_rules(), "after {frame}");
    assert_eq!(fixed(firmware), first, "{frame} changed what is fixed");
    let report = firmware.report(devices::AxisId::FIRST);
    assert!(report.velocity_rpm.is_finite() && report.current_a.is_finite(), "{frame}: {report:?}");
}

//! 5.08 and 5.10: the PDOs' parameters, SYNC, and the worked examples of position and speed mode.

use can::Frame;

use super::steps::{IN_PLACE_COUNTS, TARGET_REACHED, idle, move_time_s, until_reached};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;

/// COB-ID base, communication parameter, mapping parameter, transmission type, mapped objects of a PDO.
type Parameters = (&'static str, u32, u16, u16, u32, &'static [u32]);

#[rustfmt::skip]
const PDOS: [Parameters; 8] = [
    ("RPDO1", 0x200, 0x1400, 0x1600, 255, &[0x6040_0010, 0x6060_0008, 0x607A_0020]),
    ("RPDO2", 0x300, 0x1401, 0x1601, 255, &[0x607A_0020, 0x6081_0020]),
    ("RPDO3", 0x400, 0x1402, 0x1602, 255, &[0x6040_0010, 0x6060_0008, 0x60FF_0020]),
    ("RPDO4", 0x500, 0x1403, 0x1603, 1, &[0x607A_0020]),
    ("TPDO1", 0x180, 0x1800, 0x1A00, 255, &[0x6064_0020, 0x6041_0010]),
    ("TPDO2", 0x280, 0x1801, 0x1A01, 255, &[0x6064_0020, 0x6041_0010]),
    // The frame layout and 5.10.2 have the speed here; the mapping table repeats TPDO2's.
    ("TPDO3", 0x380, 0x1802, 0x1A02, 255, &[0x606C_0020, 0x6041_0010]),
    ("TPDO4", 0x480, 0x1803, 0x1A03, 255, &[0x6064_0020, 0x6041_0010]),
];

/// 5.08.2 and 5.08.3: COB-IDs, transmission types and mappings as the tables have them.
pub(super) fn parameters(bench: &mut Bench) {
    bench.section("5.08", "PDO parameters");
    for (name, base, communication, mapping, transmission_type, objects) in PDOS {
        bench.step(format!("{name}: {communication:04X}h, {mapping:04X}h"));
        bench.expect_object(communication, 1, Expect::Bits(base + 1), "");
        bench.expect_object(communication, 2, Expect::Near(transmission_type.into(), 0.0), "");
        bench.expect_object(mapping, 0, Expect::Near(objects.len() as f64, 0.0), "");
        for (object, sub_index) in objects.iter().zip(1..) {
            bench.expect_object(mapping, sub_index, Expect::Bits(*object), "");
        }
    }
    bench.ask("the mapping cannot be changed", "2F 00 16 00 02", "80 00 16 00 02 00 01 06");
}

/// 5.08.4: a position by RPDO4 waits for SYNC.
pub(super) fn synchronised(bench: &mut Bench) {
    bench.section("5.08.4", "SYNC");
    bench.write("enable", 0x6040, 0, 0x0F);
    bench.run_ms(20);
    let from = bench.report().position as f64;
    let target = from as i32 + 20_000;
    let data = target.to_le_bytes().map(|byte| format!("{byte:02X}")).join(" ");
    let step = format!("RPDO4: target {target:+}");
    bench.exchange_pdo(step, &format!("501 {data}"), "481 .. .. .. .. 37 04");
    bench.run_ms(50);
    let waits = bench.report().position as f64;
    bench.expect("waits at", Expect::Near(from, 5.0), "counts", waits);
    bench.step("SYNC");
    bench.send(frame("80"));
    until_reached(bench, f64::from(target), from, move_time_s(20_000.0, 1000.0, 20_000.0));
    idle(bench);
}

/// 5.10.1.
pub(super) fn absolute(bench: &mut Bench) {
    bench.section("5.10.1", "PDO position");
    const TO_50000: &str = "301 50 C3 00 00 E8 03 00 00";
    const TO_10000: &str = "301 10 27 00 00 E8 03 00 00";
    let from = bench.report().position as f64;
    let answer = bench.exchange_pdo("RPDO2: 50000 at 1000 r/min", TO_50000, "281 .. .. .. .. 04 04");
    position(bench, answer, from);
    let answer = bench.exchange_pdo("RPDO1: 2Fh, mode 1, 50000", "201 2F 00 01 50 C3 00 00", "181 .. .. .. .. 37 00");
    position(bench, answer, from);
    until_reached(bench, 50_000.0, from, move_time_s(50_000.0 - from, 1000.0, 20_000.0));
    let answer = bench.exchange_pdo("RPDO2: 50000 again, reached", TO_50000, "281 .. .. .. .. 37 04");
    position(bench, answer, 50_000.0);
    let answer = bench.exchange_pdo("RPDO2: 10000", TO_10000, "281 .. .. .. .. 37 00");
    position(bench, answer, 50_000.0);
    until_reached(bench, 10_000.0, 50_000.0, move_time_s(40_000.0, 1000.0, 20_000.0));
    let answer = bench.exchange_pdo("RPDO2: 10000 again, reached", TO_10000, "281 .. .. .. .. 37 04");
    position(bench, answer, 10_000.0);
    idle(bench);
}

/// 5.10.2: TPDO3 has the speed in r/min.
pub(super) fn speed(bench: &mut Bench) {
    bench.section("5.10.2", "PDO speed");
    const MINUS_600: &str = "401 0F 00 03 A8 FD FF FF";
    let rows = [
        ("RPDO3: 0Fh, mode 3, 600 r/min", "401 0F 00 03 58 02 00 00", "381 .. .. .. .. 37 00", 0.0),
        ("RPDO3: 0Fh, mode 3, -600 r/min", MINUS_600, "381 .. .. .. .. 37 00", 600.0),
        ("RPDO3: -600 r/min again, reached", MINUS_600, "381 .. .. .. .. 37 04", -600.0),
    ];
    for (step, request, reply, speed_rpm) in rows {
        let answer = bench.exchange_pdo(step, request, reply);
        bench.expect("speed", Expect::Near(speed_rpm, 6.0), "r/min", first_number(answer));
        bench.run_ms(500);
        let speed = bench.report().velocity_rpm;
        bench.moved(format!("{speed:.1} r/min"));
    }
    bench.expect_status("bit 10", TARGET_REACHED, TARGET_REACHED);
    bench.write("speed 0", 0x60FF, 0, 0);
    bench.run_ms(200);
    idle(bench);
}

/// The position that a TPDO carries.
fn position(bench: &mut Bench, answer: Option<Frame>, expected: f64) {
    let near = Expect::Near(expected, IN_PLACE_COUNTS + 10.0);
    bench.expect("position", near, "counts", first_number(answer));
}

fn first_number(answer: Option<Frame>) -> f64 {
    answer.map_or(f64::NAN, |frame| {
        let [a, b, c, d, ..] = *frame.padded();
        f64::from(i32::from_le_bytes([a, b, c, d]))
    })
}

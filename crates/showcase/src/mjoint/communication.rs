//! 5.04, 5.05 and 5.11: device information, SDO format, heartbeats both ways, and the address.

use std::time::Duration;

use can::Instant;

use super::steps::{ALARM, idle, move_time_s, power_cycle, restart_as, save, until_reached};
use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;
use crate::timing::largest_gap_ms;
use plot::EventKind;

/// 5.11.1: "Plug in the motor and receive one heartbeat pack every second"; 05 is normal operation.
pub(super) fn boot_up(bench: &mut Bench) {
    bench.section("5.11.1", "heartbeat");
    bench.step("power on");
    bench.unseen(|bench| bench.run_silently(Duration::from_millis(3_500)));
    let heard = bench.heard_since(Instant::ZERO, 0x701);
    let first = heard.first().map_or_else(|| "nothing".into(), |(_, frame)| frame.to_string());
    bench.compare("701#00", &first, first == "701#00");
    let beats = heard.get(1..).unwrap_or_default();
    bench.expect("heartbeats in 3.5 s", Expect::Near(3.0, 0.0), "", beats.len() as f64);
    let normal = beats.iter().filter(|(_, beat)| beat.data() == [0x05]).count();
    bench.expect("of them 05", Expect::Near(beats.len() as f64, 0.0), "", normal as f64);
    bench.expect("apart", Expect::Near(1000.0, 2.0), "ms", largest_gap_ms(beats));
    bench.ask("interval 500 ms", "2B 17 10 00 F4 01", "60 17 10 00");
    let begin = bench.now();
    bench.unseen(|bench| bench.run_silently(Duration::from_millis(2_200)));
    let beats = bench.heard_since(begin, 0x701);
    bench.expect("apart", Expect::Near(500.0, 2.0), "ms", largest_gap_ms(&beats));
    bench.ask("no heartbeat (0)", "2B 17 10 00 00 00", "60 17 10 00");
    let begin = bench.now();
    bench.unseen(|bench| bench.run_silently(Duration::from_millis(1_200)));
    let beats = bench.heard_since(begin, 0x701).len();
    bench.expect("heartbeats in 1.2 s", Expect::Near(0.0, 0.0), "", beats as f64);
    bench.ask("interval 1000 ms", "2B 17 10 00 E8 03", "60 17 10 00");
}

/// 5.04: the parameter list of the device information class, and the heartbeats' defaults.
pub(super) fn device_information(bench: &mut Bench) {
    bench.section("5.04", "objects");
    bench.ask("device type", "40 00 10 00", "43 00 10 00 92 01 02 00");
    bench.ask("1018h has four sub-indexes", "40 18 10 00", "4F 18 10 00 04");
    bench.ask("vendor ID 331h", "40 18 10 01", "43 18 10 01 31 03 00 00");
    bench.ask("product code 1", "40 18 10 02", "43 18 10 02 01 00 00 00");
    bench.ask("version 100h", "40 18 10 03", "43 18 10 03 00 01 00 00");
    bench.ask("serial number 1", "40 18 10 04", "43 18 10 04 01 00 00 00");
    bench.ask("SYNC identifier 80h", "40 05 10 00", "43 05 10 00 80 00 00 00");
    bench.ask("host heartbeat: node 7Fh, 2000 ms", "40 16 10 01", "43 16 10 01 D0 07 7F 00");
}

/// 5.05: reading and writing one, two and four bytes, and the error.
pub(super) fn sdo_format(bench: &mut Bench) {
    bench.section("5.05", "SDO format");
    bench.ask("write one byte: homing method 17", "2F 98 60 00 11 00 00 00", "60 98 60 00");
    bench.ask("read one byte", "40 98 60 00 00 00 00 00", "4F 98 60 00 11");
    bench.ask("write two bytes: position KP 3000", "2B FB 60 01 B8 0B 00 00", "60 FB 60 01");
    bench.ask("read two bytes", "40 FB 60 01 00 00 00 00", "4B FB 60 01 B8 0B");
    bench.ask("write four bytes: acceleration 20000", "23 83 60 00 20 4E 00 00", "60 83 60 00");
    bench.ask("read four bytes", "40 83 60 00 00 00 00 00", "43 83 60 00 20 4E");
    bench.ask("read what is not there (603Fh)", "40 3F 60 00 00 00 00 00", "80 3F 60 00 00 00 02 06");
    bench.ask("write what can only be read (1000h)", "23 00 10 00 01 00 00 00", "80 00 10 00 02 00 01 06");
}

/// 5.11.2: the joint stops when the heartbeats of node 7Fh, once heard, stay away for 2 s; alarm 20h clears itself.
pub(super) fn host_heartbeat(bench: &mut Bench) {
    bench.section("5.11.2", "host heartbeat");
    bench.write("speed mode", 0x6060, 0, 3);
    bench.write("300 r/min", 0x60FF, 0, 300);
    bench.write("enable", 0x6040, 0, 0x0F);
    bench.run_ms(2_500);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    bench.step("the host's first heartbeat, then silence");
    bench.send(frame("77F 05"));
    let begin = bench.now();
    bench.run_until(Duration::from_secs(4), |word| word & ALARM != 0);
    let after_s = (bench.now() - begin).as_secs_f64();
    bench.mark("heartbeat lost (20h)", EventKind::Fault);
    bench.expect("alarm after", Expect::Near(2.0, 0.02), "s", after_s);
    bench.expect_object(0x260E, 0, Expect::Bits(0x20), "");
    bench.run_ms(100);
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("motor stops", Expect::Near(0.0, 1.0), "r/min", speed);
    super::alarms::expect_flashes(bench, 2, 0);
    super::alarms::expect_heartbeat_04(bench);
    bench.step("the host's heartbeat again");
    bench.send(frame("77F 05"));
    bench.mark("heartbeat back", EventKind::Note);
    bench.run_ms(300);
    bench.expect_object(0x260E, 0, Expect::Bits(0), "");
    let speed = bench.report().velocity_rpm;
    bench.moved(format!("{speed:.1} r/min"));
    bench.expect("motor resumes", Expect::Near(300.0, 5.0), "r/min", speed);
    // The watch stays armed: it is switched off, as the table of 1016h says.
    bench.ask("no monitoring (1016h:01 time 0)", "23 16 10 01 00 00 7F 00", "60 16 10 01");
    bench.write("0 r/min", 0x60FF, 0, 0);
    bench.run_ms(200);
    idle(bench);
}

/// 5.08.1 has no row for NMT; the commands of CiA 301 act, and the heartbeat carries the state.
pub(super) fn nmt(bench: &mut Bench) {
    bench.section("5.08.1", "NMT");
    bench.ask("interval 100 ms", "2B 17 10 00 64 00", "60 17 10 00");
    let commands = [
        ("stop", "000 02 01", 0x04),
        ("pre-operational", "000 80 01", 0x7F),
        ("start", "000 01 01", 0x05),
        ("start all nodes", "000 01 00", 0x05),
    ];
    for (name, command, state) in commands {
        bench.step(format!("NMT {name}"));
        bench.send(frame(command));
        let begin = bench.now();
        bench.run_ms(110);
        let beats = bench.heard_since(begin, 0x701);
        let seen = beats.last().map_or(f64::NAN, |(_, beat)| f64::from(beat.padded()[0]));
        bench.expect("heartbeat", Expect::Bits(state), "", seen);
    }
    for (name, command) in [("reset node", "000 81 01"), ("reset communication", "000 82 01")] {
        bench.step(format!("NMT {name}"));
        let begin = bench.now();
        bench.send(frame(command));
        bench.run_ms(50);
        let heard = bench.heard_since(begin, 0x701);
        let first = heard.first().map_or_else(|| "nothing".into(), |(_, frame)| frame.to_string());
        bench.compare("701#00", &first, first == "701#00");
    }
    bench.ask("interval 1000 ms", "2B 17 10 00 E8 03", "60 17 10 00");
}

/// 5.04, column "Modbus address": the same values as registers, those of 32 bits in two, the low word first.
pub(super) fn registers(bench: &mut Bench) {
    bench.section("5.04", "Modbus");
    bench.write("enable", 0x6040, 0, 0x0F);
    let values = [
        ("system voltage (13h)", 0x13, 1, 0x6079),
        ("alarm code (10h)", 0x10, 1, 0x260E),
        ("actual position (18h)", 0x18, 2, 0x6064),
        ("status word (24h)", 0x24, 1, 0x6041),
    ];
    for (name, address, words, index) in values {
        bench.step(format!("read {name}, {index:04X}h"));
        let object = bench.read_f64(index, 0);
        let register = bench.read_registers(address, words);
        bench.expect("register", Expect::Near(object, 40.0 * f64::from(u8::from(index == 0x6079))), "", register);
    }
    let from = bench.report().position as f64;
    bench.step("Modbus enable (00h)");
    bench.write_registers(0x00, &[1]);
    bench.step("write incremental position 10000 (0Eh)");
    bench.write_registers(0x0E, &[10_000, 0]);
    until_reached(bench, from + 10_000.0, from, move_time_s(10_000.0, 1000.0, 20_000.0));
    bench.write("Modbus forbid", 0x2600, 0, 0);
    idle(bench);
}

/// 5.04, "device location": another address takes effect after saving and power-on.
pub(super) fn address(bench: &mut Bench) {
    bench.section("5.04", "address");
    bench.ask("device location 5", "2B 15 26 00 05 00", "60 15 26 00");
    save(bench);
    restart_as(bench, 5);
    // The new address answers.
    bench.exchange_pdo("address 1 again", "605 2B 15 26 00 01 00", "585 60 15 26 00 00 00 00 00");
    bench.exchange_pdo("save", "605 2B 14 26 00 01 00", "585 60 14 26 00 00 00 00 00");
    bench.run_ms(5);
    power_cycle(bench);
}

//! Every datagram that the manual prints, sent to one drive in the manual's order (chapters 3 to 6).

use can::Frame;
use ferrodrive_tests::zlac8030l::{Datagram, datagrams};

use crate::virtual_zlac8030l::bench::Bench;

#[test]
fn every_datagram_of_the_manual_is_answered_as_the_manual_prints_it() {
    let mut conversation = Conversation { bench: Bench::new(), heartbeat_on: false };
    let datagrams = datagrams();
    assert_eq!(datagrams.len(), 98);
    for (n, datagram) in datagrams.iter().enumerate() {
        if let Err(wrong) = conversation.hold(datagram) {
            panic!("datagram {}, section {}, {}: {wrong}", n + 1, datagram.section, datagram.meaning);
        }
    }
}

struct Conversation {
    bench: Bench,
    heartbeat_on: bool,
}

impl Conversation {
    fn hold(&mut self, datagram: &Datagram) -> Result<(), String> {
        match (&datagram.request, &datagram.response) {
            (Some((0x604, request)), _) => self.request(request, &datagram.answer),
            (Some((0x000, command)), None) => self.command_nmt(command),
            (Some((0x304, data)), None) => self.write_target_velocity_by_rpdo(data),
            (None, Some((0x704, state))) => self.hear_state(state[0]),
            (None, Some((0x184, shape))) => self.hear_velocity_by_tpdo(shape.len()),
            other => Err(format!("unknown step {other:X?}")),
        }
    }

    fn request(&mut self, request: &[u8], expected: &[Option<u8>]) -> Result<(), String> {
        let answer = self.bench.sdo(request).ok_or("no answer")?;
        let agrees =
            expected.len() == 8 && expected.iter().zip(answer).all(|(known, byte)| known.is_none_or(|k| k == byte));
        self.heartbeat_on |= request[1..3] == [0x17, 0x10];
        if agrees { Ok(()) } else { Err(format!("answered {answer:02X?}, expected {expected:02X?}")) }
    }

    /// 3.2 and 3.4: the boot-up message, and the state in the heartbeat of 1000 ms.
    fn hear_state(&mut self, state: u8) -> Result<(), String> {
        if self.heartbeat_on {
            let command = match state {
                0x00 => "000#8104",
                0x04 => "000#0204",
                0x05 => "000#0104",
                _ => "000#8004",
            };
            self.bench.heard();
            self.bench.send(command);
            self.bench.run_ms(1100);
        }
        let expected = format!("704#{state:02X}");
        let heard = self.bench.heard();
        let last = heard.iter().filter(|frame| frame.starts_with("704#")).find(|frame| **frame == expected);
        last.map(|_| ()).ok_or(format!("{expected} is not among {heard:?}"))
    }

    /// 6.1 and 6.2: the state that follows shows in the next heartbeat.
    fn command_nmt(&mut self, command: &[u8]) -> Result<(), String> {
        let state = if command[0] == 0x01 { 0x05 } else { 0x7F };
        self.bench.send(&format!("000#{:02X}{:02X}", command[0], command[1]));
        self.bench.heard();
        self.bench.run_ms(1100);
        let heard = self.bench.heard();
        let expected = format!("704#{state:02X}");
        let pdos = heard.iter().filter(|frame| frame.starts_with("184#")).count();
        if !heard.contains(&expected) {
            return Err(format!("{expected} is not among {heard:?}"));
        }
        // The event timer is 500 ms: two or three in 1.1 s, and none once they are closed.
        match (state, pdos) {
            (0x05, 2 | 3) | (0x7F, 0) => Ok(()),
            _ => Err(format!("{pdos} TPDOs in 1.1 s: {heard:?}")),
        }
    }

    /// 6.1: four bytes, little-endian, the value of 606Ch; a shaft that is turned by hand makes it differ from zero.
    fn hear_velocity_by_tpdo(&mut self, length: usize) -> Result<(), String> {
        self.bench.set((0x2030, 0x0E), 0);
        self.turn_by_hand(-1.5);
        self.bench.run_ms(2000);
        self.bench.heard();
        self.bench.run_ms(600);
        let tpdo = |(_, frame): &(_, Frame)| (frame.standard_data_id() == Some(0x184)).then(|| frame.data().to_vec());
        let data = self.bench.heard_at().iter().find_map(tpdo).ok_or("no TPDO")?;
        let velocity = self.bench.get(0x606C);
        self.turn_by_hand(0.0);
        let sent = i64::from(i32::from_le_bytes(data[..].try_into().map_err(|_| format!("data {data:02X?}"))?));
        // It turns at its own steady speed by then.
        let same = data.len() == length && velocity != 0 && (sent - velocity).abs() <= velocity.abs() / 10;
        if same { Ok(()) } else { Err(format!("the TPDO carries {sent}, 606Ch reads {velocity}")) }
    }

    fn turn_by_hand(&mut self, torque_nm: f64) {
        self.bench.set_load_torque(torque_nm);
    }

    /// 6.2: the bytes reach 60FFh in their order. The printed ones, 04030201h, are outside its range and are not stored.
    fn write_target_velocity_by_rpdo(&mut self, printed: &[u8]) -> Result<(), String> {
        let bytes: String = printed.iter().map(|byte| format!("{byte:02X}")).collect();
        for (data, expected) in [("2C010000", 300), (&bytes, 300), ("D4FEFFFF", -300), ("00000000", 0)] {
            self.bench.send(&format!("304#{data}"));
            let target = self.bench.get(0x60FF);
            if target != expected {
                return Err(format!("after 304#{data} 60FFh reads {target}, expected {expected}"));
            }
        }
        Ok(())
    }
}

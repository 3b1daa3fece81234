//! Modbus under bytes that no client should send: "MODBUS Application Protocol Specification V1.1b3", "MODBUS over Serial
//! Line V1.02".

use transport::{ModbusException, ModbusMedium, ModbusSession, RegisterAccess};

/// A byte that picks where the bytes are cut, then the bytes: over TCP, on a line, and as a request without either.
pub(super) const SAMPLES: &[&[u8]] = &[
    b"\x05\0\x01\0\0\0\x06\x07\x03\0\0\0\x01\0\x02\0\0\0\x0B\x07\x10\0\0\0\x02\x04\0\x01\0\x02",
    b"\x03\x07\x03\0\0\0\x01\x84\x6C\x07\x06\0\x01\0\x02\x59\xAD",
    b"\x01\x10\0\0\0\x02\x04\0\x01\0\x02",
    b"\x02\x0F\0\0\xFF\xFF\x01\x00",
    b"\x07\x17\0\0\0\x01\0\0\x80\x01\x02\0\0",
];

const UNIT: u8 = 7;
/// Registers of the unit; a value of FFFFh is refused.
const REGISTERS: usize = 200;
/// The longest request over TCP, and what is received at once here.
const MOST_KEPT: usize = 512;

/// Any bytes get responses of the standard's form or silence, the same however they are cut, and no more than one per
/// request; afterwards the next request is answered.
pub(super) fn modbus(data: &[u8]) {
    let Some((&cut, bytes)) = data.split_first() else { return };
    let cut = usize::from(cut) + 1;
    over_tcp(bytes, cut);
    on_a_line(bytes, cut);
    as_a_request(bytes);
}

fn over_tcp(bytes: &[u8], cut: usize) {
    let whole = ServerUnderTest::new(ModbusMedium::Tcp).heard(bytes, bytes.len().max(1));
    assert_eq!(whole, ServerUnderTest::new(ModbusMedium::Tcp).heard(bytes, cut), "{bytes:02X?} cut to {cut}");
    let mut rest = &whole[..];
    while let Some((head, after)) = rest.split_first_chunk::<6>() {
        let length = usize::from(head[4]) << 8 | usize::from(head[5]);
        assert!(head[2..4] == [0, 0] && (3..=254).contains(&length) && length <= after.len(), "{rest:02X?}");
        judge(&after[1..length]);
        rest = &after[length..];
    }
    assert!(rest.is_empty(), "half a response to {bytes:02X?}: {rest:02X?}");
}

fn on_a_line(bytes: &[u8], cut: usize) {
    let mut server = ServerUnderTest::new(ModbusMedium::SerialLine);
    let heard = server.heard(bytes, cut);
    assert_eq!(heard, ServerUnderTest::new(ModbusMedium::SerialLine).heard(bytes, bytes.len().max(1)), "{bytes:02X?}");
    let mut silences = 0;
    while server.session.awaits_silence() {
        server.session.handle_silence();
        server.answer();
        silences += 1;
        assert!(silences <= bytes.len(), "{bytes:02X?} never end");
    }
    // Address, 03h, address 0, one register; the check is that of the standard's algorithm.
    let answer = server.heard(&[UNIT, 3, 0, 0, 0, 1, 0x84, 0x6C], 8);
    assert!(answer.len() == 7 && answer[..3] == [UNIT, 3, 2], "{answer:02X?} after {bytes:02X?}");
}

/// The bytes as the contents of a valid frame.
fn as_a_request(pdu: &[u8]) {
    if !(1..=253).contains(&pdu.len()) {
        return;
    }
    let mut server = ServerUnderTest::new(ModbusMedium::Tcp);
    let answer = server.heard(&[&[1, 2, 0, 0, 0, 1 + pdu.len() as u8, UNIT], pdu].concat(), 300);
    if pdu[0] < 0x80 {
        assert!(answer.len() > 8 && answer[..4] == [1, 2, 0, 0] && answer[7] & 0x7F == pdu[0], "{pdu:02X?}");
        let served = [3, 4, 6, 0x10].contains(&pdu[0]);
        assert!(served || answer[7..] == [pdu[0] | 0x80, 1], "{pdu:02X?} was answered {answer:02X?}");
    } else {
        assert!(answer.is_empty(), "{pdu:02X?}");
    }
    let next = server.heard(&[0, 9, 0, 0, 0, 6, UNIT, 4, 0, 0, 0, 1], 12);
    assert!(next.len() == 11 && next[..9] == [0, 9, 0, 0, 0, 5, UNIT, 4, 2], "{next:02X?} after {pdu:02X?}");
}

/// A response is an exception of the standard, or as long as its function wants it.
fn judge(pdu: &[u8]) {
    let sound = match pdu {
        [0x80..=0xFF, code] => [1, 2, 3, 0x0B].contains(code),
        [3 | 4, count, words @ ..] => *count >= 2 && count % 2 == 0 && words.len() == usize::from(*count),
        [6 | 0x10, echo @ ..] => echo.len() == 4,
        _ => false,
    };
    assert!(sound, "no response has the form {pdu:02X?}");
}

/// A session and the registers behind it.
struct ServerUnderTest {
    session: ModbusSession,
    registers: [u16; REGISTERS],
    out: Vec<u8>,
}

impl ServerUnderTest {
    fn new(medium: ModbusMedium) -> Self {
        Self { session: ModbusSession::new(medium), registers: [0; REGISTERS], out: Vec::new() }
    }

    /// What it answers to `bytes`, received in pieces.
    fn heard(&mut self, bytes: &[u8], piece: usize) -> Vec<u8> {
        self.out.clear();
        for piece in bytes.chunks(piece.min(MOST_KEPT)) {
            self.session.receive(piece);
            self.answer();
        }
        self.out.clone()
    }

    fn answer(&mut self) {
        while let Some(inquiry) = self.session.next_request() {
            let answer = match inquiry.access() {
                _ if inquiry.unit() != UNIT => None,
                Err(exception) => Some(Err(*exception)),
                Ok(access) => Some(self.carry_out(access)),
            };
            inquiry.respond(answer, &mut self.out);
        }
    }

    fn carry_out(&mut self, access: &RegisterAccess) -> Result<Vec<u16>, ModbusException> {
        let (address, count) = match access {
            RegisterAccess::Read { address, count } => (usize::from(*address), usize::from(*count)),
            RegisterAccess::Write { address, words } => (usize::from(*address), words.len()),
        };
        let place = self.registers.get_mut(address..address + count).ok_or(ModbusException::IllegalDataAddress)?;
        if let RegisterAccess::Write { words, .. } = access {
            if words.contains(&0xFFFF) {
                return Err(ModbusException::IllegalDataValue);
            }
            place.copy_from_slice(words);
            return Ok(Vec::new());
        }
        Ok(place.to_vec())
    }
}

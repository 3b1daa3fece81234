//! Modbus requests of other programs, in the frames of TCP and of a serial line.
//!
//! The client's side is written here from the specification: what the server understood, written again, is what came.

use transport::modbus::wire::{self, Header, MAX_PDU_LENGTH};
use transport::{ModbusException, RegisterAccess};

pub(super) const PDU_SAMPLES: &[&[u8]] = &[
    b"\x03\x00\x18\x00\x02",
    b"\x04\x00\x00\x00\x27",
    b"\x06\x00\x23\x00\x0F",
    b"\x10\x00\x1C\x00\x02\x04\xC3\x50\x00\x00",
    b"\x2B\x0E\x01\x00",
];

pub(super) const RTU_SAMPLES: &[&[u8]] = &[
    b"\x01\x03\x00\x18\x00\x02\x44\x0C",
    b"\x01\x06\x00\x23\x00\x0F\x38\x04",
    b"\x00\x10\x00\x1C\x00\x02\x04\xC3\x50\x00\x00\xCA\x5F",
];

pub(super) const TCP_SAMPLES: &[&[u8]] =
    &[b"\x00\x01\x00\x00\x00\x06\x01", b"\xFF\xFF\x00\x00\x00\xFE\xFF", b"\x00\x01\x00\x00\x00\x01\x01"];

/// Clause 6: the request of an access, under the function code that asked for it.
fn request(function: u8, access: &RegisterAccess) -> Vec<u8> {
    let words = |words: &[u16]| words.iter().flat_map(|word| word.to_be_bytes()).collect::<Vec<u8>>();
    match access {
        RegisterAccess::Read { address, count } => [vec![function], words(&[*address, *count])].concat(),
        RegisterAccess::Write { address, words: data } if function == 0x06 => {
            [vec![function], words(&[*address]), words(data)].concat()
        }
        RegisterAccess::Write { address, words: data } => {
            let count = u16::try_from(data.len()).expect("a request's words");
            [vec![function], words(&[*address, count]), vec![2 * data.len() as u8], words(data)].concat()
        }
    }
}

/// A request is understood, and then is the request of what was understood, or has an exception; and every result has a
/// response that fits.
pub(super) fn pdu(data: &[u8]) {
    let Some(function) = data.first().copied() else {
        assert!(wire::parse(data).is_err());
        return;
    };
    let parsed = wire::parse(data);
    match &parsed {
        Ok(access) => assert_eq!(request(function, access), data),
        Err(exception) => {
            let served = matches!(function, 0x03 | 0x04 | 0x06 | 0x10);
            let expected = if served { ModbusException::IllegalDataValue } else { ModbusException::IllegalFunction };
            assert_eq!(*exception, expected, "{data:02X?}");
        }
    }
    let answer = match parsed {
        Ok(RegisterAccess::Read { count, .. }) => Ok(vec![0x1234; usize::from(count)]),
        Ok(RegisterAccess::Write { .. }) => Ok(Vec::new()),
        Err(exception) => Err(exception),
    };
    let response = wire::response(data, &answer);
    assert!((2..=MAX_PDU_LENGTH).contains(&response.len()), "{data:02X?}: {} bytes", response.len());
    match &answer {
        Ok(words) if !words.is_empty() => {
            assert_eq!(response[..2], [function, 2 * words.len() as u8]);
            assert_eq!(response.len(), 2 + 2 * words.len());
        }
        Ok(_) => assert_eq!(response, data[..5]),
        Err(exception) => assert_eq!(response, [function | 0x80, *exception as u8]),
    }
}

/// A frame of a serial line is whole, and then closes to itself, or is passed over; and what is closed opens.
pub(super) fn rtu(data: &[u8]) {
    if let Some((unit, pdu)) = wire::open(data) {
        assert_eq!(wire::close(unit, pdu), data);
        assert!((1..=MAX_PDU_LENGTH).contains(&pdu.len()));
    }
    if let Some((unit, pdu)) = data.split_first().filter(|(_, pdu)| (1..=MAX_PDU_LENGTH).contains(&pdu.len())) {
        let mut frame = wire::close(*unit, pdu);
        assert_eq!(wire::open(&frame), Some((*unit, pdu)));
        let bit = usize::from(*unit) % (8 * frame.len());
        frame[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(wire::open(&frame), None, "one wrong bit");
    }
}

/// A header of TCP reads back as it was written, or ends its connection.
pub(super) fn tcp(data: &[u8]) {
    let Some(bytes) = data.first_chunk::<{ Header::SIZE }>() else { return };
    let protocol = u16::from_be_bytes([bytes[2], bytes[3]]);
    let length = u16::from_be_bytes([bytes[4], bytes[5]]);
    // A function code at least, and a unit identifier before it.
    let sound = protocol == 0 && (2..=1 + MAX_PDU_LENGTH).contains(&usize::from(length));
    match Header::parse(*bytes) {
        Some(header) => {
            assert!(sound, "{bytes:02X?}");
            assert_eq!(header.emit(), *bytes);
        }
        None => assert!(!sound, "{bytes:02X?}"),
    }
}

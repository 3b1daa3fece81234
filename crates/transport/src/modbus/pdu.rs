//! The protocol data unit: function code and data, without the frame around it (MODBUS Application Protocol V1.1b3,
//! clauses 6 and 7).

/// What a request wants of the registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RegisterAccess {
    /// 03h, 04h.
    Read {
        /// First address.
        address: u16,
        /// 1 to 125 registers.
        count: u16,
    },
    /// 06h, 10h.
    Write {
        /// First address.
        address: u16,
        /// 1 to 123 words.
        words: Vec<u16>,
    },
}

/// Exception codes (clause 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModbusException {
    /// 01: the function code is not served.
    IllegalFunction = 0x01,
    /// 02: no such register, or none that can be written.
    IllegalDataAddress = 0x02,
    /// 03: a value or a quantity that is not taken, or a request of the wrong length.
    IllegalDataValue = 0x03,
    /// 04: the server cannot answer.
    ServerDeviceFailure = 0x04,
    /// 0Bh: the gateway got no answer from the unit.
    GatewayTargetFailedToRespond = 0x0B,
}

const READ_HOLDING_REGISTERS: u8 = 0x03;
const READ_INPUT_REGISTERS: u8 = 0x04;
const WRITE_SINGLE_REGISTER: u8 = 0x06;
const WRITE_MULTIPLE_REGISTERS: u8 = 0x10;

/// Bit 7 of the function code marks an exception.
const EXCEPTION: u8 = 0x80;

/// Longest PDU (clause 4.1): what an RTU frame of 256 bytes has room for.
pub const MAX_PDU_LENGTH: usize = 253;

const MAX_READ: u16 = 125;
const MAX_WRITTEN: u16 = 123;

/// Function code and data of a request -> what it wants.
///
/// # Errors
/// The exception to answer.
pub fn parse(pdu: &[u8]) -> Result<RegisterAccess, ModbusException> {
    match *pdu {
        [READ_HOLDING_REGISTERS | READ_INPUT_REGISTERS, a, b, c, d] => {
            let (address, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            let valid = (1..=MAX_READ).contains(&count);
            valid.then_some(RegisterAccess::Read { address, count }).ok_or(ModbusException::IllegalDataValue)
        }
        [WRITE_SINGLE_REGISTER, a, b, c, d] => {
            Ok(RegisterAccess::Write { address: u16::from_be_bytes([a, b]), words: vec![u16::from_be_bytes([c, d])] })
        }
        [WRITE_MULTIPLE_REGISTERS, a, b, c, d, length, ref data @ ..] => {
            let (address, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            let (pairs, rest) = data.as_chunks::<2>();
            let agree = rest.is_empty() && pairs.len() == usize::from(count) && usize::from(length) == data.len();
            if !agree || !(1..=MAX_WRITTEN).contains(&count) {
                return Err(ModbusException::IllegalDataValue);
            }
            Ok(RegisterAccess::Write { address, words: pairs.iter().map(|pair| u16::from_be_bytes(*pair)).collect() })
        }
        [READ_HOLDING_REGISTERS | READ_INPUT_REGISTERS | WRITE_SINGLE_REGISTER | WRITE_MULTIPLE_REGISTERS, ..] => {
            Err(ModbusException::IllegalDataValue)
        }
        _ => Err(ModbusException::IllegalFunction),
    }
}

/// The response to `request`: the words read, none after a write, or an exception.
pub fn response(request: &[u8], result: &Result<Vec<u16>, ModbusException>) -> Vec<u8> {
    let function = request.first().copied().unwrap_or_default();
    match result {
        Err(exception) => vec![function | EXCEPTION, *exception as u8],
        Ok(words) if matches!(function, READ_HOLDING_REGISTERS | READ_INPUT_REGISTERS) => {
            let mut pdu = vec![function, (2 * words.len()) as u8];
            pdu.extend(words.iter().flat_map(|word| word.to_be_bytes()));
            pdu
        }
        // Both writes repeat the beginning of the request.
        Ok(_) => request.iter().copied().take(5).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of clauses 6.3, 6.6 and 6.12.
    #[test]
    fn the_examples_of_the_specification_are_read_and_answered() {
        let read = [0x03, 0x00, 0x6B, 0x00, 0x03];
        assert_eq!(parse(&read), Ok(RegisterAccess::Read { address: 0x6B, count: 3 }));
        assert_eq!(response(&read, &Ok(vec![0x022B, 0, 0x64])), [0x03, 0x06, 0x02, 0x2B, 0, 0, 0, 0x64]);
        let single = [0x06, 0x00, 0x01, 0x00, 0x03];
        assert_eq!(parse(&single), Ok(RegisterAccess::Write { address: 1, words: vec![3] }));
        assert_eq!(response(&single, &Ok(vec![])), single);
        let multiple = [0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02];
        assert_eq!(parse(&multiple), Ok(RegisterAccess::Write { address: 1, words: vec![0x0A, 0x0102] }));
        assert_eq!(response(&multiple, &Ok(vec![])), [0x10, 0x00, 0x01, 0x00, 0x02]);
        assert_eq!(response(&read, &Err(ModbusException::IllegalDataAddress)), [0x83, 0x02]);
    }

    #[test]
    fn quantities_and_lengths_that_disagree_are_illegal_values() {
        let long: Vec<u8> = [0x10, 0, 0, 0, 124, 248].into_iter().chain([0; 248]).collect();
        let requests: [&[u8]; 12] = [
            &[0x03, 0, 0, 0, 0],
            &[0x03, 0, 0, 0, 126],
            &[0x04, 0, 0, 0xFF, 0xFF],
            &[0x03, 0, 0, 0],
            &[0x03, 0, 0, 0, 1, 0],
            &[0x06, 0, 0, 1],
            &[0x10],
            &[0x10, 0, 0, 0, 0, 0],
            &[0x10, 0, 0, 0, 1, 2, 1],
            &[0x10, 0, 0, 0, 1, 3, 1, 2],
            &[0x10, 0, 0, 0x80, 0, 0],
            &long,
        ];
        for request in requests {
            assert_eq!(parse(request), Err(ModbusException::IllegalDataValue), "{request:02X?}");
        }
    }

    #[test]
    fn other_functions_are_illegal() {
        for function in (0..=u8::MAX).filter(|function| ![0x03, 0x04, 0x06, 0x10].contains(function)) {
            assert_eq!(parse(&[function, 0, 0, 0, 1]), Err(ModbusException::IllegalFunction));
        }
    }
}

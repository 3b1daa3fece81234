//! Requests and responses without what a medium puts around them ("MODBUS Application Protocol Specification V1.1b3",
//! chapters 4, 6 and 7). Any bytes are a request, a refusal with the exception of the standard, or nothing to answer.

use super::request::{ModbusException, RegisterAccess};

/// Longest request or response (4.1).
pub(super) const MAX_LENGTH: usize = 253;

/// Functions that are served (6.3, 6.4, 6.6, 6.12).
const READ_HOLDING_REGISTERS: u8 = 0x03;
const READ_INPUT_REGISTERS: u8 = 0x04;
const WRITE_SINGLE_REGISTER: u8 = 0x06;
const WRITE_MULTIPLE_REGISTERS: u8 = 0x10;

/// Set in the function code of an exception response (4.1); no request has it.
const EXCEPTION: u8 = 0x80;

/// Most registers of one read (6.3).
const MAX_READ: u16 = 125;
/// Most registers of one write (6.12).
const MAX_WRITTEN: u16 = 123;

/// A request: its function code, and what it asks for or why it is refused.
#[derive(Clone, Debug)]
pub(super) struct Request {
    pub(super) function: u8,
    pub(super) access: Result<RegisterAccess, ModbusException>,
}

/// Reads a request. `None` for what is a response, or nothing at all.
pub(super) fn parse(pdu: &[u8]) -> Option<Request> {
    let (&function, data) = pdu.split_first()?;
    (function & EXCEPTION == 0).then(|| Request { function, access: access(function, data) })
}

/// What a request wants of the registers.
///
/// # Errors
/// The exception to answer: 01 for another function, 03 for a length or a quantity that no such request has (7: "the
/// structure of the remainder of a complex request").
fn access(function: u8, data: &[u8]) -> Result<RegisterAccess, ModbusException> {
    const ILLEGAL: ModbusException = ModbusException::IllegalDataValue;
    match function {
        READ_HOLDING_REGISTERS | READ_INPUT_REGISTERS => {
            let [address, count] = words(data).ok_or(ILLEGAL)?;
            let read = RegisterAccess::Read { address, count };
            (1..=MAX_READ).contains(&count).then_some(read).ok_or(ILLEGAL)
        }
        WRITE_SINGLE_REGISTER => {
            let [address, word] = words(data).ok_or(ILLEGAL)?;
            Ok(RegisterAccess::Write { address, words: vec![word] })
        }
        WRITE_MULTIPLE_REGISTERS => {
            let ([head @ .., byte_count], values) = data.split_first_chunk::<5>().ok_or(ILLEGAL)?;
            let [address, count] = words(head).ok_or(ILLEGAL)?;
            // Count, byte count and what is there have to be of one mind.
            let bytes = 2 * usize::from(count);
            let sound = (1..=MAX_WRITTEN).contains(&count) && bytes == usize::from(*byte_count);
            if !sound || bytes != values.len() {
                return Err(ILLEGAL);
            }
            let words = values.chunks_exact(2).map(|word| u16::from_be_bytes([word[0], word[1]])).collect();
            Ok(RegisterAccess::Write { address, words })
        }
        _ => Err(ModbusException::IllegalFunction),
    }
}

/// Two words that are all of `data`.
fn words(data: &[u8]) -> Option<[u16; 2]> {
    let bytes: &[u8; 4] = data.try_into().ok()?;
    Some([u16::from_be_bytes([bytes[0], bytes[1]]), u16::from_be_bytes([bytes[2], bytes[3]])])
}

/// Appends the response to `request`: the words that were read, to a write its beginning, or an exception.
pub(super) fn emit(request: &Request, answer: &Result<Vec<u16>, ModbusException>, out: &mut Vec<u8>) {
    let refused = answer.as_ref().err().or(request.access.as_ref().err());
    if let Some(exception) = refused {
        out.extend([request.function | EXCEPTION, *exception as u8]);
        return;
    }
    out.push(request.function);
    match (&request.access, answer) {
        (Ok(RegisterAccess::Write { address, words }), _) => {
            let second = match (request.function, &words[..]) {
                (WRITE_SINGLE_REGISTER, [word]) => *word,
                (_, words) => words.len() as u16,
            };
            out.extend(address.to_be_bytes().into_iter().chain(second.to_be_bytes()));
        }
        (_, Ok(read)) => {
            // No more than a response holds, whatever the registers gave.
            let read = &read[..read.len().min(usize::from(MAX_READ))];
            out.push(2 * read.len() as u8);
            out.extend(read.iter().flat_map(|word| word.to_be_bytes()));
        }
        (_, Err(_)) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(pdu: &[u8]) -> Result<RegisterAccess, ModbusException> {
        parse(pdu).expect("a request").access
    }

    /// The examples of 6.3, 6.4, 6.6 and 6.12, requests with their responses.
    #[test]
    fn the_examples_of_the_standard_are_read_and_answered_as_printed() {
        let examples: [(&[u8], Vec<u16>, &[u8]); 4] = [
            (&[0x03, 0, 0x6B, 0, 3], vec![0x022B, 0, 0x64], &[0x03, 6, 0x02, 0x2B, 0, 0, 0, 0x64]),
            (&[0x04, 0, 8, 0, 1], vec![0x0A], &[0x04, 2, 0, 0x0A]),
            (&[0x06, 0, 1, 0, 3], vec![], &[0x06, 0, 1, 0, 3]),
            (&[0x10, 0, 1, 0, 2, 4, 0, 0x0A, 0x01, 0x02], vec![], &[0x10, 0, 1, 0, 2]),
        ];
        for (pdu, read, response) in examples {
            let request = parse(pdu).unwrap();
            let mut out = Vec::new();
            emit(&request, &Ok(read), &mut out);
            assert_eq!(out, response, "{pdu:02X?}");
        }
        let write = RegisterAccess::Write { address: 1, words: vec![0x0A, 0x0102] };
        assert_eq!(asked(&[0x10, 0, 1, 0, 2, 4, 0, 0x0A, 0x01, 0x02]), Ok(write));
        assert_eq!(asked(&[0x03, 0, 0x6B, 0, 3]), Ok(RegisterAccess::Read { address: 0x6B, count: 3 }));
    }

    #[test]
    fn quantities_and_lengths_that_no_request_has_are_illegal_values() {
        for count in [0, 126, u16::MAX] {
            let [high, low] = count.to_be_bytes();
            assert_eq!(asked(&[3, 0, 0, high, low]), Err(ModbusException::IllegalDataValue), "{count}");
            assert_eq!(asked(&[4, 0, 0, high, low]), Err(ModbusException::IllegalDataValue), "{count}");
        }
        let write = |count: u16, byte_count: u8, bytes: usize| {
            let head = [&[0x10, 0, 0][..], &count.to_be_bytes(), &[byte_count]].concat();
            asked(&[head, vec![0; bytes]].concat())
        };
        assert!(write(123, 246, 246).is_ok());
        // A count of 8000h doubles to 0 in 16 bits, one of 8001h to 2.
        for (count, byte_count, bytes) in
            [(0, 0, 0), (124, 248, 248), (2, 2, 2), (1, 2, 1), (1, 2, 3), (1, 3, 3), (0x8000, 0, 0), (0x8001, 2, 2)]
        {
            assert_eq!(write(count, byte_count, bytes), Err(ModbusException::IllegalDataValue), "{count} {byte_count}");
        }
        for pdu in [&[3][..], &[3, 0, 0, 0], &[4, 0, 0, 0, 1, 0], &[6, 0, 0], &[6, 0, 0, 0, 0, 0], &[0x10, 0, 0, 0, 1]]
        {
            assert_eq!(asked(pdu), Err(ModbusException::IllegalDataValue), "{pdu:02X?}");
        }
    }

    #[test]
    fn what_no_register_is_for_is_an_illegal_function_however_it_goes_on() {
        for pdu in [
            &[0][..],
            &[0x01, 0, 0, 0, 1],
            // More coils than bytes for them.
            &[0x0F, 0, 0, 0xFF, 0xFF, 1, 0],
            &[0x17, 0, 0, 0, 1, 0, 0, 0x80, 0, 0],
            &[0x2B, 0x0E],
            &[0x7F],
        ] {
            assert_eq!(asked(pdu), Err(ModbusException::IllegalFunction), "{pdu:02X?}");
        }
        assert!(parse(&[]).is_none() && parse(&[0x83, 2]).is_none() && parse(&[0xFF]).is_none());
    }
}

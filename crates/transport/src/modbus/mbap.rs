//! The header of Modbus TCP ("MODBUS Messaging on TCP/IP Implementation Guide V1.0b", 3.1.3): transaction, protocol,
//! length of what follows, unit.

use super::adu::Adu;
use super::pdu::MAX_LENGTH;

/// Transaction, protocol and length.
const HEAD: usize = 6;

/// Bytes that are not Modbus: there is no telling where the next request would begin.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct NoModbus;

/// Takes the first whole request out of `input`; `None` while it is not there.
///
/// # Errors
/// [`NoModbus`] for another protocol, or a length that no request has.
pub(super) fn take(input: &mut Vec<u8>) -> Result<Option<Adu>, NoModbus> {
    let Some((&[t0, t1, p0, p1, l0, l1], rest)) = input.split_first_chunk::<HEAD>() else { return Ok(None) };
    let length = usize::from(u16::from_be_bytes([l0, l1]));
    // The length counts the unit and at least a function code.
    if [p0, p1] != [0, 0] || !(2..=1 + MAX_LENGTH).contains(&length) {
        return Err(NoModbus);
    }
    let Some((&unit, pdu)) = rest.get(..length).and_then(<[u8]>::split_first) else { return Ok(None) };
    let adu = Adu { transaction: u16::from_be_bytes([t0, t1]), unit, pdu: pdu.to_vec() };
    input.drain(..HEAD + length);
    Ok(Some(adu))
}

/// Appends a response, which `emit` writes.
pub(super) fn wrap(transaction: u16, unit: u8, out: &mut Vec<u8>, emit: impl FnOnce(&mut Vec<u8>)) {
    out.extend(transaction.to_be_bytes());
    let length_at = out.len() + 2;
    out.extend([0, 0, 0, 0, unit]);
    emit(out);
    let length = (out.len() - length_at - 2) as u16;
    out[length_at..length_at + 2].copy_from_slice(&length.to_be_bytes());
}

/// What a byte changes: the remainders of their polynomials. By half bytes it would be 32 bytes of flash in place of 512, and twice the
/// work for each byte of a transfer.
static REMAINDERS: [u16; 256] = {
    let mut remainders = [0; 256];
    let mut number = 0;
    while number < remainders.len() {
        let (mut remainder, mut bit) = ((number as u16) << 8, 0);
        while bit < 8 {
            remainder = if remainder & 0x8000 != 0 { remainder << 1 ^ POLYNOMIAL } else { remainder << 1 };
            bit += 1;
        }
        remainders[number] = remainder;
        number += 1;
    }
    remainders
};

/// x^16 + x^12 + x^5 + 1. Source: CiA 301, 7.2.4.3.16.
const POLYNOMIAL: u16 = 0x1021;

/// The CRC of a block transfer, of which `sum` is what came before; it begins with 0. Source: CiA 301, 7.2.4.3.16.
pub fn checksum(sum: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(sum, |sum, byte| sum << 8 ^ REMAINDERS[usize::from((sum >> 8) as u8 ^ byte)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CiA 301, 7.2.4.3.16 gives this example.
    #[test]
    fn the_checksum_of_123456789_is_that_of_the_standard_in_one_piece_and_in_two() {
        assert_eq!(checksum(0, b"123456789"), 0x31C3);
        for (first, second) in (0..=9).map(|at| b"123456789".split_at(at)) {
            assert_eq!(checksum(checksum(0, first), second), 0x31C3);
        }
    }

    #[test]
    fn the_checksum_is_the_remainder_of_the_polynomial_bit_by_bit() {
        let by_bits = |bytes: &[u8]| {
            bytes.iter().fold(0_u16, |sum, byte| {
                (0..8).fold(sum ^ u16::from(*byte) << 8, |sum, _| {
                    if sum & 0x8000 != 0 { sum << 1 ^ POLYNOMIAL } else { sum << 1 }
                })
            })
        };
        for first in 0..=u8::MAX {
            let bytes = [first, first.wrapping_mul(31), 0xFF, 0];
            assert_eq!(checksum(0, &bytes), by_bits(&bytes));
        }
    }
}

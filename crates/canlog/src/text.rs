//! Numbers as text, both ways, for logs and line protocols of CAN: no allocation on the way of a frame.

use can::{CanId, Instant};

/// Longest piece of foreign text that an error repeats.
const SHOWN_LENGTH: usize = 60;

/// The value of a hexadecimal digit in ASCII, of either case.
pub fn hex_digit(byte: u8) -> Option<u8> {
    (byte as char).to_digit(16).map(|digit| digit as u8)
}

/// 1 to `max_digits` (at most 8) hexadecimal digits and nothing else.
pub fn parse_hex(word: &str, max_digits: usize) -> Option<u32> {
    if word.is_empty() || word.len() > max_digits {
        return None;
    }
    word.bytes().try_fold(0, |value, byte| Some(value << 4 | u32::from(hex_digit(byte)?)))
}

/// `23.424242`: whole seconds and up to nine decimals.
pub fn parse_seconds(word: &str) -> Option<Instant> {
    let (whole, decimals) = word.split_once('.').unwrap_or((word, ""));
    let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || decimals.len() > 9 || !all_digits(whole) || !all_digits(decimals) {
        return None;
    }
    let nanos = decimals.bytes().chain(std::iter::repeat(b'0')).take(9);
    let nanos = nanos.fold(0, |value, digit| value * 10 + u64::from(digit - b'0'));
    whole.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(nanos).map(Instant::from_nanos)
}

/// The lowest `digits` (at most 8) hexadecimal digits of `value`, in capitals.
pub fn push_hex(out: &mut Vec<u8>, value: u32, digits: u32) {
    for place in (0..digits).rev() {
        out.push(b"0123456789ABCDEF"[(value >> (4 * place)) as usize & 0xF]);
    }
}

/// 3 digits, or 8 for an extended identifier.
pub fn push_hex_id(out: &mut Vec<u8>, id: CanId) {
    push_hex(out, id.raw(), if id.is_extended() { 8 } else { 3 });
}

/// Decimal, as many digits as it takes.
pub fn push_decimal(out: &mut Vec<u8>, value: u64) {
    push_padded(out, value, 1);
}

/// `23.424242`: microseconds, what is below them cut off.
pub fn push_seconds(out: &mut Vec<u8>, at: Instant) {
    push_decimal(out, at.as_nanos() / 1_000_000_000);
    out.push(b'.');
    push_padded(out, at.as_nanos() % 1_000_000_000 / 1_000, 6);
}

/// Decimal with at least `width` (at most 20) digits.
pub fn push_padded(out: &mut Vec<u8>, mut value: u64, width: usize) {
    let mut digits = [b'0'; 20];
    let mut used = 0;
    while value > 0 {
        digits[used] = b'0' + (value % 10) as u8;
        value /= 10;
        used += 1;
    }
    out.extend(digits[..used.max(width)].iter().rev());
}

/// Foreign text as an error may repeat it: short and without control characters.
pub fn shown(text: &str) -> String {
    let mut shown: String = text.trim().chars().take(SHOWN_LENGTH).flat_map(char::escape_debug).collect();
    if text.trim().chars().nth(SHOWN_LENGTH).is_some() {
        shown.push_str("..");
    }
    shown
}

/// [`shown`] for bytes that may be no text at all.
pub fn shown_bytes(bytes: &[u8]) -> String {
    shown(&String::from_utf8_lossy(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_read_what_they_write() {
        for (text, nanos) in [
            ("0.000000", 0),
            ("23.424242", 23_424_242_000),
            ("1700000000.123456", 1_700_000_000_123_456_000),
            ("18446744073.709551", 18_446_744_073_709_551_000),
        ] {
            let at = parse_seconds(text).unwrap();
            assert_eq!(at, Instant::from_nanos(nanos));
            let mut out = Vec::new();
            push_seconds(&mut out, at);
            assert_eq!(out, text.as_bytes());
        }
        assert_eq!(parse_seconds("1"), Some(Instant::from_secs(1)));
        assert_eq!(parse_seconds("1.5"), Some(Instant::from_millis(1500)));
        for text in ["", ".", ".5", "-1.0", "1.0000000001", "1.x", "99999999999999999999.0", "18446744074.0", "+1"] {
            assert_eq!(parse_seconds(text), None, "{text:?}");
        }
    }

    #[test]
    fn hex_takes_digits_only() {
        assert_eq!(parse_hex("7fF", 8), Some(0x7FF));
        assert_eq!(parse_hex("FFFFFFFF", 8), Some(u32::MAX));
        for text in ["", "+1", "0x1", "123456789", "g"] {
            assert_eq!(parse_hex(text, 8), None, "{text:?}");
        }
    }

    #[test]
    fn foreign_text_is_shortened_and_escaped() {
        assert_eq!(shown(" a\u{7}b "), "a\\u{7}b");
        assert_eq!(shown(&"x".repeat(100)).len(), SHOWN_LENGTH + 2);
        assert_eq!(shown_bytes(&[0xFF, b'a']), "\u{FFFD}a");
    }
}

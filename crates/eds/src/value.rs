//! Values as an EDS writes them: numbers in three bases, numbers that depend on the node-ID, others.

use std::fmt;
use std::hash::{Hash, Hasher};
use std::mem::discriminant;

/// A whole number, as it stands or with the node-ID added to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Number {
    /// The number without the node-ID.
    pub base: i128,
    /// `$NODEID` is added.
    pub plus_node_id: bool,
}

impl Number {
    /// A plain number.
    pub const fn plain(base: i128) -> Self {
        Self { base, plus_node_id: false }
    }

    /// The number on the node of this ID.
    pub const fn at_node(self, node_id: u8) -> i128 {
        if self.plus_node_id { self.base + node_id as i128 } else { self.base }
    }
}

/// `300`, or `$NODEID+0x180`.
impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.plus_node_id { write!(f, "$NODEID+{:#X}", self.base) } else { write!(f, "{}", self.base) }
    }
}

/// A value of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A whole number.
    Number(Number),
    /// A number with a decimal point.
    Real(f64),
    /// Text; also the bytes of an OCTET_STRING or DOMAIN and the days and milliseconds of a time, as the file writes them.
    Text(String),
}

impl Hash for Value {
    fn hash<H: Hasher>(&self, state: &mut H) {
        discriminant(self).hash(state);
        match self {
            Self::Number(number) => number.hash(state),
            // Zero and minus zero are equal, and have to have one hash.
            Self::Real(real) => (real + 0.0).to_bits().hash(state),
            Self::Text(text) => text.hash(state),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            // A float's own text reads back as the same float; the standard wants a decimal point.
            Self::Real(real) => write!(f, "{real:?}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// How a number is spelled where CiA 306 knows another spelling; each a trap for some tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Oddity {
    /// A remark behind the number.
    Remark,
    /// Letters behind it that C has: `1LL`.
    Suffix,
    /// `1000h`.
    TrailingH,
    /// Digits 8 or 9 behind a leading zero, which makes octal numbers.
    NoOctal,
    /// A leading zero: octal.
    Octal,
    /// Quotes around it.
    Quoted,
}

impl Oddity {
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Self::Remark => "a remark behind the number: comments have lines of their own (CiA 306)",
            Self::Suffix => "letters behind the number",
            Self::TrailingH => "a hexadecimal number is written 0x..",
            Self::NoOctal => "a leading zero makes a number octal, which has no digits 8 and 9",
            Self::Octal => "a leading zero makes the number octal",
            Self::Quoted => "quotes around the number",
        }
    }

    /// The spelling leaves no doubt about the number.
    pub(crate) const fn is_clear(self) -> bool {
        !matches!(self, Self::NoOctal)
    }
}

/// A number as CiA 306 writes it: decimal, hexadecimal (`0x`), octal (leading zero), with `$NODEID+` or `+$NODEID` in any
/// case of letters and with blanks; and spellings that other tools take. `None` for what is not a number.
pub(crate) fn number(text: &str) -> Option<(Number, Option<Oddity>)> {
    let text = text.trim();
    if let Some(plain) = plain_decimal(text) {
        return Some((Number::plain(plain.into()), None));
    }
    if let Some((before, _)) = text.split_once(';') {
        return number(before).map(|(number, _)| (number, Some(Oddity::Remark)));
    }
    if let Some(inside) = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) {
        return number(inside).map(|(number, _)| (number, Some(Oddity::Quoted)));
    }
    let Some((before, after)) = split_node_id(text) else {
        return integer(text).map(|(base, oddity)| (Number::plain(base), oddity));
    };
    let other = match (before.trim(), after.trim()) {
        ("", "") => return Some((Number { base: 0, plus_node_id: true }, None)),
        ("", after) => after.strip_prefix('+')?.trim(),
        (before, "") => before.strip_suffix('+')?.trim(),
        _ => return None,
    };
    let (base, oddity) = integer(other).filter(|(base, _)| *base >= 0)?;
    Some((Number { base, plus_node_id: true }, oddity))
}

/// What most numbers of a file are: up to nine digits without a leading zero.
fn plain_decimal(text: &str) -> Option<u32> {
    let digits = text.as_bytes();
    let plain = matches!(digits, [b'0'] | [b'1'..=b'9', ..]) && digits.len() <= 9;
    if !plain || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    Some(digits.iter().fold(0, |sum, digit| sum * 10 + u32::from(digit - b'0')))
}

/// What stands before and behind `$NODEID`.
fn split_node_id(text: &str) -> Option<(&str, &str)> {
    const NAME: &str = "$NODEID";
    let at = text.find('$')?;
    let end = at + NAME.len();
    let name = text.get(at..end)?;
    name.eq_ignore_ascii_case(NAME).then(|| (&text[..at], &text[end..]))
}

fn integer(text: &str) -> Option<(i128, Option<Oddity>)> {
    let (sign, digits) = match text.as_bytes().first()? {
        b'-' => (-1, &text[1..]),
        b'+' => (1, &text[1..]),
        _ => (1, text),
    };
    if let Some(hex) = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        if let Some(value) = in_base(hex, 16) {
            return Some((sign * value, None));
        }
        return in_base(without_suffix(hex), 16).map(|value| (sign * value, Some(Oddity::Suffix)));
    }
    if let Some(hex) = digits.strip_suffix(['h', 'H'])
        && digits.starts_with(|first: char| first.is_ascii_digit())
    {
        return in_base(hex, 16).map(|value| (sign * value, Some(Oddity::TrailingH)));
    }
    if digits.len() > 1 && digits.starts_with('0') {
        return match in_base(digits, 8) {
            // Zeros are the same in each base.
            Some(value) if value < 8 => Some((sign * value, None)),
            Some(value) => Some((sign * value, Some(Oddity::Octal))),
            None => in_base(digits, 10).map(|value| (sign * value, Some(Oddity::NoOctal))),
        };
    }
    match in_base(digits, 10) {
        Some(value) => Some((sign * value, None)),
        None => in_base(without_suffix(digits), 10).map(|value| (sign * value, Some(Oddity::Suffix))),
    }
}

fn without_suffix(digits: &str) -> &str {
    digits.trim_end_matches(['l', 'L', 'u', 'U'])
}

/// Digits without a sign; at most 24 of them, so that nothing overflows.
fn in_base(digits: &str, base: u32) -> Option<i128> {
    if digits.is_empty() || digits.len() > 24 {
        return None;
    }
    digits.chars().try_fold(0_i128, |sum, digit| Some(sum * i128::from(base) + i128::from(digit.to_digit(base)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<(i128, bool)> {
        number(text).map(|(number, _)| (number.base, number.plus_node_id))
    }

    #[test]
    fn the_three_bases_of_the_standard_are_read() {
        for (text, value) in [
            ("0", 0),
            ("8", 8),
            ("0x08", 8),
            ("0X1f", 31),
            ("010", 8),
            ("-5", -5),
            ("-0x80", -128),
            ("+7", 7),
            ("00", 0),
            ("999999999", 999_999_999),
            ("4294967296", 1 << 32),
            ("9999999999", 9_999_999_999),
        ] {
            assert_eq!(read(text), Some((value, false)), "{text}");
        }
        assert_eq!(read("0xFFFFFFFFFFFFFFFF"), Some((u64::MAX.into(), false)));
        assert_eq!(read("18446744073709551615"), Some((u64::MAX.into(), false)));
    }

    #[test]
    fn the_node_id_is_read_in_every_spelling() {
        for text in ["$NODEID+0x180", "$NodeId + 0x180", "0x180+$NODEID", "384 + $nodeid", " $NODEID +384 "] {
            assert_eq!(read(text), Some((0x180, true)), "{text}");
        }
        assert_eq!(read("$NODEID"), Some((0, true)));
        for text in ["$NODEID-1", "$NODEID 1", "$NODEID+-1", "1+$NODEID+1", "$NODE", "$NODEID+", "$", "$NODEI\u{e4}"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn other_spellings_are_read_and_named() {
        let oddity = |text| number(text).and_then(|(number, oddity)| Some((number.base, oddity?)));
        assert_eq!(oddity("0x1234LL"), Some((0x1234, Oddity::Suffix)));
        assert_eq!(oddity("17U"), Some((17, Oddity::Suffix)));
        assert_eq!(oddity("1000h"), Some((0x1000, Oddity::TrailingH)));
        assert_eq!(oddity("3 ; three"), Some((3, Oddity::Remark)));
        assert_eq!(oddity("0089"), Some((89, Oddity::NoOctal)));
        assert_eq!(oddity("017"), Some((15, Oddity::Octal)));
        assert_eq!(oddity("\"5\""), Some((5, Oddity::Quoted)));
    }

    #[test]
    fn what_is_no_number_is_none() {
        for text in ["", "-", "+", "0x", "x", "1.5", "12 34", "0xG", "--1", "h", "1e5", "9999999999999999999999999"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn a_number_reads_back_as_it_is_printed() {
        for number in [Number::plain(-5), Number::plain(1 << 63), Number { base: 0x4000_0180, plus_node_id: true }] {
            assert_eq!(super::number(&number.to_string()), Some((number, None)));
        }
    }
}

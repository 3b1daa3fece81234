//! Values of objects: decimal, 0x.., with a unit, or one of the object's words.

use canopen::od::{DataType, Entry, Kind};

use super::suggest::{did_you_mean, near};
use super::unit::{Unit, split_number};

/// Reads the new value of `row`, where `resolution` counts make one of its unit. Its data type bounds the value; its
/// limits are for the drive to check.
pub fn value(row: &Entry, text: &str, resolution: i64) -> Result<i64, String> {
    let (low, high) = row.data_type.range();
    let beyond = |value: &str| {
        format!("{value} does not fit {} ({}): expected {low} to {high}", row.mux(), row.data_type.name())
    };
    let value = match integer(text) {
        Some(value) => value,
        None if is_decimal(text) => return Err(beyond(text.trim())),
        None => match split_number(text).filter(|_| !is_hexadecimal(text)) {
            Some((number, unit)) => with_unit(row, text, number * resolution as f64, unit)?,
            None => word(row, text)?,
        },
    };
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(beyond(&value.to_string()))
}

/// A whole number, of however many digits.
fn is_decimal(text: &str) -> bool {
    let digits = text.trim().trim_start_matches(['-', '+']);
    !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())
}

/// Meant as a hexadecimal number, whatever stands behind `0x`: `0xZZ` has digits that are wrong, not a unit.
fn is_hexadecimal(text: &str) -> bool {
    let digits = text.trim().trim_start_matches(['-', '+']);
    digits.get(..2).is_some_and(|begin| begin.eq_ignore_ascii_case("0x"))
}

/// A value as it was typed.
#[derive(Clone, Debug, PartialEq)]
pub enum Typed {
    /// A whole number of a type.
    Number(DataType, i64),
    /// A real number, of 32 bits or of 64.
    Real(DataType, f64),
    /// Bytes as they go onto the wire.
    Bytes(Vec<u8>),
}

impl Typed {
    /// The whole number.
    pub const fn number(&self) -> Option<i64> {
        match self {
            Self::Number(_, number) => Some(*number),
            _ => None,
        }
    }

    /// The bytes on the wire, little endian.
    pub fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Number(data_type, number) => number.to_le_bytes()[..data_type.size()].to_vec(),
            Self::Real(DataType::Real32, real) => (*real as f32).to_le_bytes().to_vec(),
            Self::Real(_, real) => real.to_le_bytes().to_vec(),
            Self::Bytes(bytes) => bytes.clone(),
        }
    }
}

/// Reads the new value of `row`, of any type: a number as [`value`] has it, a real, a text, or `hex:..` for bytes.
pub fn typed_for(row: &Entry, text: &str, resolution: i64) -> Result<Typed, String> {
    let data_type = row.data_type;
    match data_type.kind() {
        Kind::Signed | Kind::Unsigned => value(row, text, resolution).map(|number| Typed::Number(data_type, number)),
        Kind::Real => {
            let real = text.trim().parse::<f64>().ok().filter(|real| real.is_finite());
            let fits = |real: &f64| data_type != DataType::Real32 || real.abs() <= f64::from(f32::MAX);
            real.filter(fits).map(|real| Typed::Real(data_type, real)).ok_or_else(|| {
                format!("'{text}' is not a value of {} ({}); expected a number, e.g. 1.5", row.mux(), data_type.name())
            })
        }
        Kind::Bytes | Kind::Time => match text.strip_prefix("hex:") {
            Some(digits) => bytes_in_hexadecimal(digits).map(Typed::Bytes),
            None if data_type == DataType::VisibleString => visible(text),
            None => Err(format!(
                "{} is of type {}; give its bytes as hex:01AAFF, or --from FILE",
                row.mux(),
                data_type.name()
            )),
        },
    }
}

/// A VISIBLE_STRING. Source: CiA 301, 7.1.6.2.
fn visible(text: &str) -> Result<Typed, String> {
    match text.chars().find(|character| !matches!(character, ' '..='~')) {
        Some(character) => Err(format!(
            "'{}' cannot be in a VISIBLE_STRING; expected characters from 20h to 7Eh",
            character.escape_default()
        )),
        None if text.is_empty() => Err("expected a text of one character or more".into()),
        None => Ok(Typed::Bytes(text.as_bytes().to_vec())),
    }
}

/// Bytes as pairs of hexadecimal digits, with blanks, dots or underscores between them or not.
pub fn bytes_in_hexadecimal(digits: &str) -> Result<Vec<u8>, String> {
    let digits: Vec<u8> = digits.bytes().filter(|byte| !matches!(byte, b' ' | b'.' | b'_')).collect();
    let byte = |pair: &[u8]| u8::from_str_radix(core::str::from_utf8(pair).ok()?, 16).ok();
    let even = !digits.is_empty() && digits.len().is_multiple_of(2) && digits.iter().all(u8::is_ascii_hexdigit);
    let bytes = if even { digits.chunks(2).map(byte).collect() } else { None };
    bytes.ok_or_else(|| "bytes are pairs of hexadecimal digits, e.g. hex:01AAFF".into())
}

/// Types by the word that stands before a value.
const TYPES: [(&str, DataType); 8] = [
    ("i8", DataType::Integer8),
    ("i16", DataType::Integer16),
    ("i32", DataType::Integer32),
    ("i64", DataType::Integer64),
    ("u8", DataType::Unsigned8),
    ("u16", DataType::Unsigned16),
    ("u32", DataType::Unsigned32),
    ("text", DataType::VisibleString),
];

/// The word before a value of this type, e.g. `u16`, where it has one ([`typed_alone`]).
pub fn type_word(data_type: DataType) -> Option<&'static str> {
    TYPES.iter().find(|(_, its)| *its == data_type).map(|(word, _)| *word)
}

/// The type that this word stands for, in any case of letters.
pub fn type_of_word(word: &str) -> Option<DataType> {
    TYPES.iter().find(|(its, _)| its.eq_ignore_ascii_case(word)).map(|(_, data_type)| *data_type)
}

/// Reads a value of an object that no table describes: `type:value`, e.g. `u16:15`, `text:left wheel`, `hex:01AA`.
pub fn typed_alone(text: &str) -> Result<Typed, String> {
    match text.split_once(':') {
        Some(("hex", digits)) => bytes_in_hexadecimal(digits).map(Typed::Bytes),
        Some(("text", text)) => visible(text),
        Some(("i64", number)) => {
            let value = integer(number).ok_or_else(|| format!("'{number}' is not a whole number of 64 bits"))?;
            Ok(Typed::Number(DataType::Integer64, value))
        }
        _ => typed_value(text).map(|(data_type, number)| Typed::Number(data_type, number)),
    }
}

/// Reads a number of an object that no table describes: `type:number`, e.g. `u16:15`.
pub fn typed_value(text: &str) -> Result<(DataType, i64), String> {
    const EXPECTED: &str = "an object that is in no known table needs its type with the value, e.g. u16:15, i32:-100, u8:0x3, text:left, hex:01AA";
    let (name, number) = text.split_once(':').ok_or(EXPECTED)?;
    let of_numbers = |data_type: &DataType| !matches!(data_type, DataType::Integer64 | DataType::VisibleString);
    let data_type =
        type_of_word(name).filter(of_numbers).ok_or_else(|| format!("'{name}' is not a type; {EXPECTED}"))?;
    let value = integer(number).ok_or_else(|| format!("'{number}' is not a whole number; {EXPECTED}"))?;
    let (low, high) = data_type.range();
    if (low..=high).contains(&value) {
        return Ok((data_type, value));
    }
    Err(format!("{value} does not fit {}: expected {low} to {high}", data_type.name()))
}

/// `-5`, `0x1F`, `-0x10`.
fn integer(text: &str) -> Option<i64> {
    let text = text.trim();
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let (digits, radix) = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(hex) => (hex, 16),
        None => (digits, 10),
    };
    if !digits.starts_with(|first: char| first.is_digit(radix)) {
        return None;
    }
    let magnitude = i64::from_str_radix(digits, radix).ok()?;
    Some(if negative { -magnitude } else { magnitude })
}

fn with_unit(row: &Entry, text: &str, number: f64, unit: &str) -> Result<i64, String> {
    if TYPES.iter().any(|(word, _)| *word == unit) {
        return Err(format!("a type stands before the value: {unit}:{number}"));
    }
    let Some(own) = Unit::of_object(row.unit) else {
        return Err(format!("{} has no unit; expected a whole number, e.g. {}", row.mux(), example(row)));
    };
    let expected = || {
        let own = row.unit;
        format!("expected a whole number in units of {own}, or a number with a unit that converts to {own}")
    };
    let given = Unit::named(unit).ok_or_else(|| format!("'{text}' is not a value; {}", expected()))?;
    if given.dimension != own.dimension {
        return Err(format!("'{unit}' is not a unit of {}; {}", row.mux(), expected()));
    }
    let counts = number * given.factor / own.factor;
    let whole = counts.round();
    let said = || format!("'{text}' is {} counts of {}", master::units::Shown(counts), row.mux());
    if whole.abs() > u32::MAX.into() {
        let (low, high) = row.data_type.range();
        return Err(format!("{}; expected {low} to {high}", said()));
    }
    if (counts - whole).abs() > 1e-6 * counts.abs().max(1.0) {
        return Err(format!("{}; expected a whole number of counts", said()));
    }
    Ok(whole as i64)
}

fn word(row: &Entry, text: &str) -> Result<i64, String> {
    let typed = plain(text);
    let meanings = || row.values.iter().map(|(value, meaning)| (*value, plain(meaning)));
    if let Some((value, _)) = meanings().find(|(_, meaning)| *meaning == typed) {
        return Ok(value);
    }
    if row.values.is_empty() {
        return Err(format!("'{text}' is not a value; expected a number, e.g. {}", example(row)));
    }
    let words: Vec<String> = meanings().map(|(_, meaning)| meaning).collect();
    let listed: Vec<String> = row.values.iter().map(|(value, meaning)| format!("{value} ({meaning})")).collect();
    let near = near(&typed, words.iter().map(String::as_str));
    Err(format!("'{text}' is not a value of {}{}; expected {}", row.mux(), did_you_mean(&near), listed.join(", ")))
}

/// Lower case, with blanks for the marks between words.
fn plain(text: &str) -> String {
    let spaced: String =
        text.chars().map(|c| if c == '_' || c == '-' { ' ' } else { c.to_ascii_lowercase() }).collect();
    spaced.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn example(row: &Entry) -> String {
    match row.integer_limits() {
        Some((_, high)) => format!("{high} or 0x{high:X}"),
        None => "100 or 0x64".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::od::Access;

    const SPEED: Entry =
        Entry::new(0x60FF, 0, DataType::Integer32, Access::ReadWrite, "target_velocity", "").unit("r/min");
    const ACTUAL: Entry =
        Entry::new(0x606C, 0, DataType::Integer32, Access::ReadWrite, "velocity_actual_value", "").unit("0.1 r/min");
    const MODE: Entry = Entry::new(0x6060, 0, DataType::Integer8, Access::ReadWrite, "modes_of_operation", "")
        .values(&[(1, "profile position"), (3, "profile velocity"), (4, "profile torque")]);
    const WORD: Entry = Entry::new(0x6040, 0, DataType::Unsigned16, Access::ReadWrite, "controlword", "");

    #[test]
    fn whole_numbers_are_decimal_or_hexadecimal() {
        for (text, number) in [("15", 15), ("0xF", 15), ("+15", 15), (" 0x0F ", 15)] {
            assert_eq!(value(&WORD, text), Ok(number), "{text}");
        }
        assert_eq!(value(&SPEED, "-0x10"), Ok(-16));
    }

    fn value(row: &Entry, text: &str) -> Result<i64, String> {
        super::value(row, text, 1)
    }

    #[test]
    fn a_finer_resolution_makes_more_counts_of_a_unit_and_the_same_of_a_bare_number() {
        assert_eq!(super::value(&SPEED, "2.7rpm", 10), Ok(27));
        assert_eq!(super::value(&SPEED, "27", 10), Ok(27));
        let error = value(&SPEED, "2.7rpm").unwrap_err();
        assert!(error.starts_with("'2.7rpm' is 2.7 counts of 60FFh:00"), "{error}");
    }

    #[test]
    fn units_are_converted_to_the_objects_own() {
        assert_eq!(value(&SPEED, "60rpm"), Ok(60));
        assert_eq!(value(&ACTUAL, "60 rpm"), Ok(600));
        assert_eq!(value(&ACTUAL, "360deg/s"), Ok(600));
        assert!(value(&ACTUAL, "0.05rpm").unwrap_err().contains("0.5 counts of 606Ch:00"));
        assert!(value(&SPEED, "5A").unwrap_err().contains("r/min"));
        assert!(value(&WORD, "5rpm").unwrap_err().contains("no unit"));
    }

    #[test]
    fn words_of_the_object_are_accepted_and_suggested() {
        assert_eq!(value(&MODE, "profile_velocity"), Ok(3));
        assert_eq!(value(&MODE, "Profile Torque"), Ok(4));
        let error = value(&MODE, "profile_velocty").unwrap_err();
        assert!(error.contains("did you mean profile velocity") && error.contains("4 (profile torque)"), "{error}");
        assert!(value(&WORD, "on").unwrap_err().contains("a number"));
    }

    #[test]
    fn values_that_do_not_fit_the_type_are_refused() {
        assert!(value(&WORD, "65536").unwrap_err().contains("0 to 65535"));
        assert!(value(&WORD, "-1").is_err());
        let beyond = "expected -2147483648 to 2147483647";
        let error = value(&SPEED, "99999999999999999999").unwrap_err();
        assert_eq!(error, format!("99999999999999999999 does not fit 60FFh:00 (INTEGER32): {beyond}"));
        assert!(value(&SPEED, "1e12rpm").unwrap_err().ends_with(&format!("counts of 60FFh:00; {beyond}")));
        assert!(value(&WORD, "").is_err());
        assert_eq!(value(&SPEED, "100u32").unwrap_err(), "a type stands before the value: u32:100");
    }

    #[test]
    fn texts_reals_and_bytes_are_read_by_the_objects_type() {
        let row = |data_type| Entry::new(0x2000, 0, data_type, Access::ReadWrite, "thing", "");
        let bytes = |data_type, text| typed_for(&row(data_type), text, 1).map(|typed| typed.bytes());
        assert_eq!(bytes(DataType::VisibleString, "left"), Ok(b"left".to_vec()));
        assert_eq!(bytes(DataType::Real32, "1.5"), Ok(vec![0, 0, 0xC0, 0x3F]));
        assert_eq!(bytes(DataType::Domain, "hex:01 aa.FF"), Ok(vec![1, 0xAA, 0xFF]));
        assert_eq!(bytes(DataType::Integer64, "-2"), Ok(vec![0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]));
        for (data_type, wrong) in [
            (DataType::VisibleString, "l\u{e4}ngs"),
            (DataType::VisibleString, ""),
            (DataType::Real32, "1e39"),
            (DataType::Real64, "nan"),
            (DataType::Domain, "01AA"),
            (DataType::Domain, "hex:1"),
            (DataType::OctetString, "hex:+1"),
        ] {
            assert!(bytes(data_type, wrong).is_err(), "{wrong:?}");
        }
        assert_eq!(typed_alone("text:a:b"), Ok(Typed::Bytes(b"a:b".to_vec())));
        assert_eq!(typed_alone("hex:01"), Ok(Typed::Bytes(vec![1])));
    }

    #[test]
    fn unknown_objects_take_a_typed_value() {
        assert_eq!(typed_value("u16:15"), Ok((DataType::Unsigned16, 15)));
        assert_eq!(typed_value("i32:-100"), Ok((DataType::Integer32, -100)));
        for wrong in ["15", "u9:1", "u8:256", "u8:x"] {
            assert!(typed_value(wrong).is_err(), "{wrong}");
        }
    }
}

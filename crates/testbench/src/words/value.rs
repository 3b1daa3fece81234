//! Values of objects: decimal, 0x.., with a unit, or one of the object's words.

use canopen::od::{DataType, Entry};

use super::suggest::{did_you_mean, near};
use super::unit::{Unit, split_number};

/// Reads what `row` is to be set to, where `resolution` counts make one of its unit. Its data type bounds the value; its
/// limits are for the drive to check.
pub fn value(row: &Entry, text: &str, resolution: i64) -> Result<i64, String> {
    let (low, high) = row.data_type.range();
    let value = match integer(text) {
        Some(value) => value,
        None => match split_number(text) {
            Some((number, unit)) => with_unit(row, text, number * resolution as f64, unit)?,
            None => word(row, text)?,
        },
    };
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(format!("{value} does not fit {} ({}): expected {low} to {high}", row.mux(), row.data_type.name()))
}

/// Reads a value of an object that no table describes: `type:number`, e.g. `u16:15`.
pub fn typed_value(text: &str) -> Result<(DataType, i64), String> {
    const EXPECTED: &str =
        "an object that is in no known table needs its type with the value, e.g. u16:15, i32:-100, u8:0x3";
    let (name, number) = text.split_once(':').ok_or(EXPECTED)?;
    let data_type = match name.to_ascii_lowercase().as_str() {
        "i8" => DataType::Integer8,
        "i16" => DataType::Integer16,
        "i32" => DataType::Integer32,
        "u8" => DataType::Unsigned8,
        "u16" => DataType::Unsigned16,
        "u32" => DataType::Unsigned32,
        _ => return Err(format!("'{name}' is no type; {EXPECTED}")),
    };
    let value = integer(number).ok_or_else(|| format!("'{number}' is no whole number; {EXPECTED}"))?;
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
    let Some(own) = Unit::of_object(row.unit) else {
        return Err(format!("{} has no unit; expected a whole number, e.g. {}", row.mux(), example(row)));
    };
    let expected = || format!("expected {} in a unit of {}, or a whole number of them", row.mux(), row.unit);
    let given = Unit::named(unit).ok_or_else(|| format!("'{text}' is no value; {}", expected()))?;
    if given.dimension != own.dimension {
        return Err(format!("'{unit}' does not measure what {} holds; {}", row.mux(), expected()));
    }
    let counts = number * given.factor / own.factor;
    let whole = counts.round();
    if (counts - whole).abs() > 1e-6 * counts.abs().max(1.0) || whole.abs() > u32::MAX.into() {
        let counts = master::units::Shown(counts);
        return Err(format!("'{text}' is {counts} counts of {}; a whole number of them in range is needed", row.mux()));
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
        return Err(format!("'{text}' is no value; expected a number, e.g. {}", example(row)));
    }
    let words: Vec<String> = meanings().map(|(_, meaning)| meaning).collect();
    let listed: Vec<String> = row.values.iter().map(|(value, meaning)| format!("{value} ({meaning})")).collect();
    let near = near(&typed, words.iter().map(String::as_str));
    Err(format!("'{text}' is no value of {}{}; expected {}", row.mux(), did_you_mean(&near), listed.join(", ")))
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
        assert!(value(&SPEED, "99999999999999999999").is_err());
        assert!(value(&WORD, "").is_err());
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

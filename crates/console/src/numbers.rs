//! Whole numbers on the command line, refused with what was expected and what was typed.

use std::ops::RangeInclusive;

/// A whole number within bounds, both included. An upper bound that is all the type holds is not named.
///
/// # Errors
/// `expected 2 to 240, got 0`.
pub fn whole<T: Copy + Into<i128> + TryFrom<i128>>(text: &str, within: RangeInclusive<T>) -> Result<T, String> {
    let (low, high): (i128, i128) = ((*within.start()).into(), (*within.end()).into());
    // Of more digits than any bound has, the value does not matter.
    let number = text.parse::<i128>().ok().filter(|number| (low..=high).contains(number));
    number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| {
        let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let of = if is_number { "" } else { "a whole number, " };
        let is_below = text.parse::<i128>().is_ok_and(|number| number < low);
        let bounds = if high == i128::from(u64::MAX) && is_below {
            format!("{low} or more")
        } else {
            format!("{low} to {high}")
        };
        format!("expected {of}{bounds}, got {}", if of.is_empty() { text.to_owned() } else { format!("'{text}'") })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beyond_their_bounds_are_refused_as_they_were_typed() {
        assert_eq!(whole("2", 2..=240_u8), Ok(2));
        assert_eq!(whole("-128", i8::MIN..=i8::MAX), Ok(-128));
        assert_eq!(whole("18446744073709551615", 1..=u64::MAX), Ok(u64::MAX));
        for (text, said) in [
            ("0", "expected 2 to 240, got 0"),
            ("-2", "expected 2 to 240, got -2"),
            (
                "99999999999999999999999999999999999999999999",
                "expected 2 to 240, got 99999999999999999999999999999999999999999999",
            ),
            ("two", "expected a whole number, 2 to 240, got 'two'"),
            ("2.5", "expected a whole number, 2 to 240, got '2.5'"),
            ("", "expected a whole number, 2 to 240, got ''"),
            ("-", "expected a whole number, 2 to 240, got '-'"),
        ] {
            assert_eq!(whole(text, 2..=240_u8), Err(said.to_owned()));
        }
        assert_eq!(whole("0", 1..=u64::MAX), Err("expected 1 or more, got 0".into()));
        let beyond = "expected 1 to 18446744073709551615, got 18446744073709551616";
        assert_eq!(whole("18446744073709551616", 1..=u64::MAX), Err(beyond.into()));
    }
}

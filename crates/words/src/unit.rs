//! Numbers with units, as objects have them: `60rpm`, `0.1 r/min`, `1.5 A`.
//!
//! The quantities of the moving commands are `master::units`; this is for any object of a table.

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// In turns.
    Angle,
    /// In r/min.
    AngularVelocity,
    /// In A.
    Current,
    /// In A/s.
    CurrentRate,
    /// In V.
    Voltage,
    /// In s.
    Time,
    /// In °C.
    Temperature,
    /// In W.
    Power,
    /// In ohm.
    Resistance,
    /// In 1.
    Ratio,
    /// In counts.
    Counts,
}

/// A unit: `factor` of the dimension's base unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub dimension: Dimension,
    /// Base units: turn, r/min, A, A/s, V, s, degree Celsius, W, ohm, 1, count.
    pub factor: f64,
}

use Dimension::*;

#[rustfmt::skip]
const UNITS: &[(Dimension, f64, &[&str])] = &[
    (Angle, 1.0, &["turn", "turns", "rev", "revs", "r"]),
    (Angle, 1.0 / 360.0, &["deg", "°", "degree", "degrees"]),
    (Angle, 1.0 / std::f64::consts::TAU, &["rad"]),
    (AngularVelocity, 1.0, &["rpm", "r/min", "rev/min"]),
    (AngularVelocity, 60.0, &["rps", "r/s", "rev/s", "turn/s"]),
    (AngularVelocity, 1.0 / 6.0, &["deg/s", "°/s"]),
    (AngularVelocity, cia402::RPM_PER_RAD_S, &["rad/s"]),
    (Current, 1.0, &["A", "amp", "amps"]),
    (Current, 1e-3, &["mA"]),
    (CurrentRate, 1.0, &["A/s"]),
    (CurrentRate, 1e-3, &["mA/s"]),
    (Voltage, 1.0, &["V"]),
    (Voltage, 1e-3, &["mV"]),
    // Beside those of `can::DURATION_UNITS`.
    (Time, 1.0, &["sec"]),
    (Temperature, 1.0, &["°C", "degC", "C"]),
    (Power, 1.0, &["W"]),
    (Resistance, 1.0, &["ohm", "Ω", "Ohm"]),
    (Ratio, 0.01, &["%", "percent"]),
    (Counts, 1.0, &["counts", "count", "cnt", "inc", "pulses"]),
];

impl Unit {
    /// The unit spelt `text`; exact spelling first (`mA` is not `MA`), then without regard to case.
    pub fn named(text: &str) -> Option<Self> {
        let find = |same: &dyn Fn(&str) -> bool| {
            if let Some((_, ns)) = can::DURATION_UNITS.iter().find(|(name, _)| same(name)) {
                return Some(Self { dimension: Time, factor: *ns as f64 / 1e9 });
            }
            let row = UNITS.iter().find(|(_, _, names)| names.iter().any(|name| same(name)))?;
            Some(Self { dimension: row.0, factor: row.1 })
        };
        find(&|name| name == text).or_else(|| find(&|name| name.eq_ignore_ascii_case(text)))
    }

    /// The unit of an object row, e.g. `0.1 r/min` or `*10counts`: how many of which unit one count stands for.
    pub fn of_object(text: &str) -> Option<Self> {
        let text = text.trim().trim_start_matches(['*', '×']);
        let (number, name) = split_factor(text);
        let unit = Self::named(name)?;
        Some(Self { factor: unit.factor * number, ..unit })
    }
}

/// How much of which unit one count is: `0.1 r/min`, `1/2000 A`, `100/32768 %`.
pub fn split_factor(text: &str) -> (f64, &str) {
    let (number, rest) = split_number(text).unwrap_or((1.0, text));
    match rest.strip_prefix('/').and_then(split_number) {
        Some((divisor, name)) if divisor > 0.0 => (number / divisor, name),
        _ => (number, rest.trim()),
    }
}

/// A number and what follows it without surrounding blanks; `None` if `text` begins with no number.
pub fn split_number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let begin = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits(begin);
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if let Some(b'e' | b'E') = bytes.get(end) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent_end = digits(end + 1 + sign);
        if exponent_end > end + 1 + sign {
            end = exponent_end;
        }
    }
    let number: f64 = text[..end].parse().ok()?;
    number.is_finite().then(|| (number, text[end..].trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_units_are_distinguished() {
        assert_eq!(split_number("60rpm"), Some((60.0, "rpm")));
        assert_eq!(split_number(" -1.5 A "), Some((-1.5, "A")));
        assert_eq!(split_number("1e3"), Some((1000.0, "")));
        assert_eq!(split_number("2e"), Some((2.0, "e")));
        assert_eq!(split_number(".5s"), Some((0.5, "s")));
        for nothing in ["", "-", "rpm", "+.", "é"] {
            assert_eq!(split_number(nothing), None, "{nothing:?}");
        }
    }

    #[test]
    fn one_turn_a_second_is_sixty_rpm_in_every_spelling() {
        for (text, per_turn_per_second) in
            [("r/s", 1.0), ("deg/s", 360.0), ("rad/s", std::f64::consts::TAU), ("rpm", 60.0)]
        {
            let unit = Unit::named(text).unwrap();
            assert!((unit.factor * per_turn_per_second - 60.0).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn object_units_carry_their_factor() {
        let unit = Unit::of_object("0.1 r/min").unwrap();
        assert_eq!((unit.dimension, unit.factor), (AngularVelocity, 0.1));
        assert_eq!(Unit::of_object("mA").unwrap().factor, 1e-3);
        let unit = Unit::of_object("1/2000 A").unwrap();
        assert_eq!((unit.dimension, unit.factor), (Current, 1.0 / 2000.0));
        assert_eq!(split_factor("1/327 V/(1000 r/min)"), (1.0 / 327.0, "V/(1000 r/min)"));
        assert_eq!(split_factor("r/min"), (1.0, "r/min"));
        assert_eq!(Unit::of_object(""), None);
    }

    #[test]
    fn case_is_forgiven_only_where_it_is_not_ambiguous() {
        assert_eq!(Unit::named("RPM"), Unit::named("rpm"));
        assert_eq!(Unit::named("ma"), Unit::named("mA"));
        assert_eq!(Unit::named("furlong"), None);
    }
}

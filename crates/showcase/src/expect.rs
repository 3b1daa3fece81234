//! What should be seen, from the manual or a closed form, and whether it was.

/// An expectation of a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Expect {
    /// Within a tolerance.
    Near(f64, f64),
    /// Not more than this.
    AtMost(f64),
    /// Not less than this.
    AtLeast(f64),
    /// Exactly this, shown in hexadecimal.
    Bits(u32),
}

impl Expect {
    /// Whether `seen` is as expected.
    pub(super) fn is_met(self, seen: f64) -> bool {
        match self {
            Self::Near(value, tolerance) => (seen - value).abs() <= tolerance,
            Self::AtMost(most) => seen <= most,
            Self::AtLeast(least) => seen >= least,
            Self::Bits(bits) => seen == f64::from(bits),
        }
    }

    /// In words, with the unit.
    pub(super) fn text(self, unit: &str) -> String {
        let text = match self {
            Self::Near(value, 0.0) => number(value),
            Self::Near(value, tolerance) => format!("{} ±{}", number(value), number(tolerance)),
            Self::AtMost(most) => format!("≤ {}", number(most)),
            Self::AtLeast(least) => format!("≥ {}", number(least)),
            Self::Bits(bits) => format!("{bits:04X}h"),
        };
        join(&text, unit)
    }

    /// What was seen, in the same words.
    pub(super) fn seen(self, seen: f64, unit: &str) -> String {
        match self {
            Self::Bits(_) => join(&format!("{:04X}h", seen as u32), unit),
            _ => join(&number(seen), unit),
        }
    }
}

/// With as many decimals as its size deserves.
fn number(value: f64) -> String {
    match value.abs() {
        _ if value.fract() == 0.0 => format!("{value:.0}"),
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

fn join(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.into() } else { format!("{text} {unit}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expectations_are_met_at_their_bounds_and_not_beyond() {
        assert!(Expect::Near(100.0, 1.0).is_met(101.0) && !Expect::Near(100.0, 1.0).is_met(101.1));
        assert!(Expect::AtMost(3.0).is_met(3.0) && !Expect::AtMost(3.0).is_met(3.1));
        assert!(Expect::AtLeast(3.0).is_met(3.0) && !Expect::AtLeast(3.0).is_met(2.9));
        assert!(!Expect::Near(1.0, 1.0).is_met(f64::NAN));
    }

    #[test]
    fn expectations_read_like_a_sentence() {
        assert_eq!(Expect::Near(100.0, 1.0).text("r/min"), "100 ±1 r/min");
        assert_eq!(Expect::Bits(0x237).text(""), "0237h");
        assert_eq!(Expect::AtMost(3.0).seen(2.96, "A"), "2.960 A");
    }
}

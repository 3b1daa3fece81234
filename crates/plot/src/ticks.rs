//! Round tick values: steps of 1, 2 or 5 times a power of ten.

/// Ticks of an axis and how many decimals they need.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ticks {
    /// Ascending.
    pub(crate) values: Vec<f64>,
    /// Distance of neighbours.
    pub(crate) step: f64,
}

impl Ticks {
    /// Ticks inside `low..=high`, at most `most` of them.
    pub(crate) fn within(low: f64, high: f64, most: usize) -> Self {
        let step = round_step((high - low) / most.max(1) as f64);
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        Self { values: (first..=last).map(|n| n as f64 * step).collect(), step }
    }

    /// Each of them with its text.
    pub(crate) fn labelled(&self) -> Vec<(f64, String)> {
        self.values.iter().map(|value| (*value, self.text(*value))).collect()
    }

    /// A tick as text, with as many decimals as the step needs and thousands set apart by a thin space.
    pub(crate) fn text(&self, value: f64) -> String {
        let decimals = (-self.step.log10()).ceil().clamp(0.0, 9.0) as usize;
        let plain = format!("{:.decimals$}", value.abs());
        let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
        let mut text = String::new();
        if value < 0.0 && plain.bytes().any(|digit| (b'1'..=b'9').contains(&digit)) {
            text.push('\u{2212}');
        }
        for (i, digit) in whole.chars().enumerate() {
            if i > 0 && (whole.len() - i) % 3 == 0 && whole.len() > 4 {
                text.push('\u{2009}');
            }
            text.push(digit);
        }
        if !fraction.is_empty() {
            text.push('.');
            text.push_str(fraction);
        }
        text
    }
}

/// Where 1, 2 and 5 times powers of ten stand on an axis of their common logarithms, with their texts.
pub(crate) fn logarithmic(low: f64, high: f64) -> Vec<(f64, String)> {
    let decades = (low.floor() as i32)..=(high.ceil() as i32);
    let values = decades.flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(decade)));
    let inside = values.filter(|value| (low - 1e-9..=high + 1e-9).contains(&value.log10()));
    inside.map(|value| (value.log10(), Ticks { values: Vec::new(), step: value.min(1.0) }.text(value))).collect()
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    if !(least.is_finite() && least > 0.0) {
        return 1.0;
    }
    let magnitude = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * magnitude >= least * (1.0 - 1e-9));
    step.unwrap_or(10.0) * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_one_two_or_five() {
        for (least, step) in
            [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (3.0, 5.0), (7.0, 10.0), (0.013, 0.02), (4100.0, 5000.0)]
        {
            assert!((round_step(least) / step - 1.0).abs() < 1e-9, "{least} gives {}", round_step(least));
        }
    }

    #[test]
    fn inner_ticks_stay_inside() {
        assert_eq!(Ticks::within(0.0, 61.0, 7).values, [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
    }

    #[test]
    fn a_logarithmic_axis_has_one_two_and_five_of_each_decade() {
        let texts = logarithmic(0.5_f64.log10(), 30_f64.log10()).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
        assert_eq!(texts, ["0.5", "1", "2", "5", "10", "20"]);
    }

    #[test]
    fn tick_texts_are_short_and_exact() {
        let step = |step| Ticks { values: Vec::new(), step };
        assert_eq!(step(20000.0).text(-40000.0), "\u{2212}40\u{2009}000");
        assert_eq!(step(500.0).text(1500.0), "1500");
        assert_eq!(step(0.5).text(-0.5), "\u{2212}0.5");
        assert_eq!(step(0.5).text(-0.0), "0.0");
    }
}

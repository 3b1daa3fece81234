//! Angles of the control loops: turns in `[0, 1)`, and a fast sine.

const TAU: f32 = core::f32::consts::TAU;

/// The rest of `turns` after whole turns, in `[0, 1)`; `|turns|` below 2^31.
#[inline]
pub fn wrap_turns(turns: f32) -> f32 {
    let whole = turns as i32 as f32;
    let rest = turns - whole;
    let rest = if rest < 0.0 { rest + 1.0 } else { rest };
    // A tiny negative rest rounds up to one.
    if rest < 1.0 { rest } else { 0.0 }
}

/// The whole number nearest to `x` (`|x|` below 2^22), as a float and as the low bits of an integer. Of two equally near
/// it is the upper one.
///
/// The sum with a number so large that its last bit is worth 1 is rounded to a whole number by the addition itself. That is
/// quicker than a conversion to an integer and back.
#[inline]
fn nearest(x: f32) -> (f32, u32) {
    const NO_FRACTION: f32 = 1.5 * 8_388_608.0;
    /// Decides a tie upwards: more than the last bit of a few quarters, far less than any angle that matters.
    const UP: f32 = 1.0 / 1_048_576.0;
    let sum = x + UP + NO_FRACTION;
    (sum - NO_FRACTION, sum.to_bits())
}

/// Sine and cosine of an angle in turns (`|turns|` below 2^20).
///
/// Reduced to within an eighth of a turn of the nearest quarter, then Taylor series up to `r^7` and `r^8`. The first
/// terms left out bound the error: `(pi/4)^9 / 9! = 3.2e-7` and `(pi/4)^10 / 10! = 2.5e-8`, the order of an `f32`'s
/// own rounding.
#[inline]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let (quarters, number) = nearest(turns * 4.0);
    let r = (turns - quarters * 0.25) * TAU;
    let x = r * r;
    // Summed in pairs: shorter to wait for than term by term.
    let y = x * x;
    let sin = r * ((1.0 - x * (1.0 / 6.0)) + y * (1.0 / 120.0 - x * (1.0 / 5_040.0)));
    let cos = (1.0 - x * 0.5) + y * ((1.0 / 24.0 - x * (1.0 / 720.0)) + y * (1.0 / 40_320.0));
    match number & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_stay_within_the_stated_error() {
        for step in -20_000..20_000 {
            let turns = step as f32 / 4096.0;
            let (sin, cos) = sin_cos_turns(turns);
            let rad = f64::from(turns) * core::f64::consts::TAU;
            assert!((f64::from(sin) - libm::sin(rad)).abs() < 6e-7, "sin of {turns} turns");
            assert!((f64::from(cos) - libm::cos(rad)).abs() < 6e-7, "cos of {turns} turns");
        }
    }

    #[test]
    fn wrapped_turns_stay_in_their_range() {
        for turns in [0.0, -0.0, 0.25, 1.0, -1.0, -1e-12, 7.75, -7.75, 0.999_999_97] {
            assert!((0.0..1.0).contains(&wrap_turns(turns)), "{turns}");
        }
        assert_eq!(wrap_turns(-0.25), 0.75);
    }
}

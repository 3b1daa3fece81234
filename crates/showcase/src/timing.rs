//! Times between frames that were heard.

use can::{Frame, Instant};

/// The longest time between neighbours, ms; not a number with fewer than two frames.
pub(super) fn largest_gap_ms(frames: &[(Instant, Frame)]) -> f64 {
    gaps_ms(frames).fold(f64::NAN, f64::max)
}

/// The shortest time between neighbours, ms; not a number with fewer than two frames.
pub(super) fn smallest_gap_ms(frames: &[(Instant, Frame)]) -> f64 {
    gaps_ms(frames).fold(f64::NAN, f64::min)
}

fn gaps_ms(frames: &[(Instant, Frame)]) -> impl Iterator<Item = f64> + '_ {
    frames.windows(2).map(|pair| (pair[1].0 - pair[0].0).as_secs_f64() * 1e3)
}

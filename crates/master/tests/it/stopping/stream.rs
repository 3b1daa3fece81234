//! A group that follows a stream of points, as of a recorded path.

use std::f64::consts::PI;

use master::group::{Group, StreamOptions};
use master::units::Turns;

use super::PERIOD;

/// Gives the points of 15 s at once: from rest to 0.9 turns/s within a second, and on.
pub(super) fn start(group: &mut Group) {
    const POINTS: u32 = 1500;
    const TURNS_S: f64 = 0.9;
    group.start_stream(StreamOptions { capacity: POINTS as usize, ..StreamOptions::default() }).unwrap();
    let from: Vec<_> = group.points().iter().map(|point| point.position_turns).collect();
    for point in 1..=POINTS {
        let time_s = PERIOD.as_secs_f64() * f64::from(point);
        let begun_s = time_s.min(1.0);
        let begun = 0.5 * TURNS_S * (begun_s - (PI * begun_s).sin() / PI);
        let gone = begun + TURNS_S * (time_s - begun_s);
        group.push(&from.iter().map(|from| Turns(from + gone)).collect::<Vec<_>>()).unwrap();
    }
}

//! The tables that objects point into: currents (2005h), microsteps (2006h) and bit rates (2009h) ("ZLIM42-C user manual
//! V1.03", 5.4).

use can::Bitrate;

/// 2005h: amplitude of the phase current, A. The manual prints rms and peak; the peak is what the bridges regulate to.
pub const PEAK_CURRENTS_A: [f32; 8] = [0.3, 0.5, 0.8, 1.2, 1.5, 1.7, 1.9, 2.2];

/// 2006h: pulses in one turn. First the halvings of a step, then the round numbers.
pub const PULSES_PER_TURN: [u16; 16] =
    [200, 400, 800, 1600, 3200, 6400, 12800, 25600, 1000, 2000, 4000, 5000, 8000, 10000, 20000, 25000];

/// Highest step frequency (2.1), pulses/s: it bounds every speed.
pub const STEP_FREQUENCY_HZ: f64 = 200e3;

/// 2009h.
pub const BIT_RATES: [Bitrate; 7] =
    [Bitrate::M1, Bitrate::K500, Bitrate::K250, Bitrate::K125, Bitrate::K100, Bitrate::K50, K25];

const K25: Bitrate = match Bitrate::new(25_000) {
    Some(rate) => rate,
    None => panic!("25 kbit/s divides a second into whole nanoseconds per bit"),
};

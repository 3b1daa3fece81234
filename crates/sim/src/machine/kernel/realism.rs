//! What real machines have and a calculation has not: readings that flicker, edges off their place, transistors
//! that switch with a pause, magnets that pull at teeth. Seeded, and off unless it is asked for.

use plant::Angle;
use plant::cogging::Cogging;

use crate::Prng;

/// Whether a machine is as it is calculated or as one stands on a bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Realism {
    /// Exact readings, ideal switches, no cogging.
    #[default]
    Ideal,
    /// Noise of encoder, currents, voltage and temperatures; dead time of the switches; cogging.
    Full,
}

impl std::str::FromStr for Realism {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "ideal" => Ok(Self::Ideal),
            "full" => Ok(Self::Full),
            _ => Err(format!("expected ideal or full, not {text:?}")),
        }
    }
}

/// Converter of 12 bits over 100 V, what such drives have: 24 mV a step.
pub(crate) const VOLTAGE_STEP_V: f32 = 100.0 / 4096.0;
/// The same over -60 to 60 A and over -10 to 10 A.
pub(crate) const LARGE_CURRENT_STEP_A: f32 = 120.0 / 4096.0;
pub(crate) const SMALL_CURRENT_STEP_A: f32 = 20.0 / 4096.0;
/// Assumed: a thermistor behind the same converter.
pub(crate) const TEMPERATURE_STEP_C: f32 = 0.1;

/// Guess: an edge of an encoder's disc is up to this share of a count off its place. Its electronics have hysteresis: an
/// edge does not chatter.
const MISPLACED_COUNTS: f64 = 0.2;

/// Assumed: 1 µs in which neither transistor of a bridge conducts, at 16 kHz: share of the bus voltage that is lost.
const DEAD_TIME_SHARE: f64 = 1e-6 * 16e3;
/// Current from which the pause works fully against it; near zero the voltage swings over by itself. Guess.
const DEAD_TIME_FULL_FROM_A: f64 = 0.5;

/// Guess: 30 magnets over 27 teeth, a combination that cogs little: a third of a hundredth of the wheel motor's 6 N·m.
pub(crate) const HUB_COGGING: Cogging = Cogging { amplitude_nm: 0.02, per_turn: 270 };
/// Guess: the same share of the joint motors' 1 N·m; 20 magnets over 24 teeth.
pub(crate) const JOINT_COGGING: Cogging = Cogging { amplitude_nm: 0.003, per_turn: 120 };

/// The noise of one machine.
#[derive(Clone, Debug)]
pub struct Noise {
    prng: Prng,
    /// Which encoder's disc it is.
    disc: u64,
}

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        let mut prng = Prng::new(seed);
        Self { disc: prng.next_u64(), prng }
    }

    /// What a converter with steps of `step` makes of `value`, off by up to one step more.
    pub(crate) fn flicker(&mut self, value: f32, step: f32) -> f32 {
        nearest(value / step + self.share()) * step
    }

    /// A count too many or too few, where an edge of `counts_per_turn` is near that stands off its place.
    pub(crate) fn misplaced_edge(&self, angle: Angle, counts_per_turn: u32) -> i16 {
        let counts = angle.fraction() * f64::from(counts_per_turn);
        let nearest = (counts + 0.5) as u32;
        let past = counts - f64::from(nearest);
        if past.abs() > MISPLACED_COUNTS {
            return 0; // Between two edges, where most periods find it.
        }
        let edge = u64::from(if nearest == counts_per_turn { 0 } else { nearest });
        let share = Prng::new(self.disc ^ edge).next_u64() as f64 / 2_f64.powi(63) - 1.0;
        i16::from(past >= MISPLACED_COUNTS * share) - i16::from(past >= 0.0)
    }

    /// -1 to 1, each as likely as another.
    fn share(&mut self) -> f32 {
        // 24 bits, which any float holds: a signed number of 32 bits is turned into one by one instruction.
        (self.prng.next_u64() >> 40) as i32 as f32 / (1_u32 << 23) as f32 - 1.0
    }
}

/// `round` without a call, for what a converter reads: halves away from zero, exact below 2^23.
fn nearest(value: f32) -> f32 {
    // The largest number below a half: a half itself would lift what is just below it.
    const ALMOST_HALF: f32 = 0.499_999_97;
    (value + ALMOST_HALF.copysign(value)) as i32 as f32
}

/// Duty cycles as they arrive at the motor: the pause takes voltage from where current flows out of the bridge.
pub(crate) fn with_dead_time<const N: usize>(duty: [f64; N], current_a: [f64; N]) -> [f64; N] {
    std::array::from_fn(|n| duty[n] - DEAD_TIME_SHARE * (current_a[n] / DEAD_TIME_FULL_FROM_A).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flickering_reading_is_a_step_of_the_converter_within_a_step_and_a_half_and_right_in_the_mean() {
        let mut noise = Noise::new(1);
        let readings: Vec<f32> = (0..20_000).map(|_| noise.flicker(48.01, VOLTAGE_STEP_V)).collect();
        for reading in &readings {
            assert!((reading - 48.01).abs() <= 1.5 * VOLTAGE_STEP_V, "{reading}");
            assert!((reading / VOLTAGE_STEP_V - (reading / VOLTAGE_STEP_V).round()).abs() < 1e-3, "{reading}");
        }
        let mean = readings.iter().map(|reading| f64::from(*reading)).sum::<f64>() / 20_000.0;
        assert!((mean - 48.01).abs() < 2e-3, "{mean}");
    }

    #[test]
    fn the_nearest_whole_number_is_what_round_gives() {
        let mut prng = Prng::new(4);
        let random = (0..100_000).map(|_| (prng.below(1 << 34) as f32 / 2048.0) - 4_194_304.0);
        let halves = (-4000..4000).flat_map(|half: i16| {
            let half = f32::from(half) * 0.5;
            [half, half.next_up(), half.next_down()]
        });
        for value in random.chain(halves) {
            assert_eq!(nearest(value), value.round(), "{value}");
        }
    }

    #[test]
    fn each_edge_of_a_disc_stands_off_its_place_by_its_own_fifth_of_a_count_at_most() {
        let noise = Noise::new(2);
        let seen = |counts: f64| noise.misplaced_edge(Angle::default().advanced_by(counts / 4096.0), 4096);
        let edges = || (1..2000).map(f64::from);
        assert!(edges().all(|edge| seen(edge + 0.21) == 0 && seen(edge + 0.5) == 0 && seen(edge - 0.21) == 0));
        // A quarter of -0.2 to 0.2 lies above 0.1, where an edge comes late, and a quarter below -0.1: 500, with a
        // standard deviation of 19.
        let (late, early) =
            (edges().filter(|edge| seen(edge + 0.1) == -1), edges().filter(|edge| seen(edge - 0.1) == 1));
        assert!((420..580).contains(&late.count()) && (420..580).contains(&early.count()));
        assert!(edges().all(|edge| seen(edge + 0.1) == seen(edge + 0.1)), "an edge stays where it is");
    }

    #[test]
    fn the_pause_works_against_the_current_and_not_without() {
        let [u, v, w] = with_dead_time([0.6, 0.4, 0.5], [10.0, -10.0, 0.0]);
        assert!((u - (0.6 - 0.016)).abs() < 1e-12 && (v - (0.4 + 0.016)).abs() < 1e-12 && w == 0.5);
    }
}

//! One lumped body that warms and cools against the ambient: a winding, a heat sink, a resistor.
//!
//! ```text
//! C dT/dt = P - (T - T_ambient) / R_th          time constant R_th C
//! ```
//!
//! Explicit steps: sound because bodies are thousands of steps slow.

/// Temperature at which a winding's resistance is stated.
const RESISTANCE_STATED_AT_C: f64 = 20.0;

/// Change of copper's resistance per kelvin, relative to that at 20 °C.
pub(crate) const COPPER_PER_K: f64 = 0.003_93;

/// Resistance at a temperature of a winding that has `stated_ohm` at 20 °C and changes by `per_k` of it per kelvin.
pub fn resistance_at_ohm(stated_ohm: f64, per_k: f64, temperature_c: f64) -> f64 {
    stated_ohm * (1.0 + per_k * (temperature_c - RESISTANCE_STATED_AT_C))
}

/// What a converter's steps make of the range of a thermistor: 13 bits over 256 K. Assumed for every drive.
const READINGS_PER_K: f64 = 32.0;

/// What a thermometer reads of a temperature.
#[inline]
pub fn reading_c(temperature_c: f64) -> f64 {
    // Numbers of this size have no fractions: what is added and taken away again rounds to whole ones.
    const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
    (temperature_c * READINGS_PER_K + WHOLE - WHOLE) * (1.0 / READINGS_PER_K)
}

/// What never changes about a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyModel {
    /// Thermal resistance to the ambient.
    pub resistance_k_w: f64,
    /// Heat capacity.
    pub capacity_j_k: f64,
}

/// State of a body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BodyData {
    /// Its temperature.
    pub temperature_c: f64,
    /// A temperature that the body is held at, whatever the heat: lets a test bring about an over-temperature.
    pub hold_c: Option<f64>,
}

impl BodyModel {
    /// A body in balance with its surroundings.
    pub fn at_ambient(&self, ambient_c: f64) -> BodyData {
        BodyData { temperature_c: ambient_c, hold_c: None }
    }

    /// Time constant of warming and cooling.
    pub fn time_constant_s(&self) -> f64 {
        self.resistance_k_w * self.capacity_j_k
    }

    /// Warms the body by `heat_w` for one step.
    #[inline]
    pub fn step(&self, data: &mut BodyData, dt_s: f64, heat_w: f64, ambient_c: f64) {
        if let Some(temperature_c) = data.hold_c {
            data.temperature_c = temperature_c;
            return;
        }
        let flow_w_by_resistance = heat_w * self.resistance_k_w - (data.temperature_c - ambient_c);
        data.temperature_c += dt_s * flow_w_by_resistance / (self.resistance_k_w * self.capacity_j_k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: BodyModel = BodyModel { resistance_k_w: 2.0, capacity_j_k: 50.0 };

    #[test]
    fn a_heated_body_follows_its_time_constant_to_its_steady_state() {
        let mut body = BODY.at_ambient(25.0);
        for _ in 0..100_000 {
            BODY.step(&mut body, 1e-3, 10.0, 25.0);
        }
        // One time constant: 1 - 1/e of 20 K.
        let expected = 25.0 + 20.0 * (1.0 - libm::exp(-1.0));
        assert!((body.temperature_c - expected).abs() < 1e-3);
        for _ in 0..2_000_000 {
            BODY.step(&mut body, 1e-3, 10.0, 25.0);
        }
        assert!((body.temperature_c - 45.0).abs() < 1e-6);
    }

    #[test]
    fn a_thermometer_reads_the_nearest_32nd_of_a_kelvin() {
        for n in -20_000..20_000_i32 {
            let temperature_c = f64::from(n) * 0.009_77;
            let reading = reading_c(temperature_c);
            assert!((reading - temperature_c).abs() <= 1.0 / 64.0, "{temperature_c}: {reading}");
            assert_eq!((reading * 32.0) % 1.0, 0.0, "{temperature_c}: {reading}");
        }
        assert_eq!(reading_c(25.0), 25.0);
    }

    #[test]
    fn a_held_temperature_stays_until_it_is_let_go() {
        let mut body = BODY.at_ambient(25.0);
        body.hold_c = Some(95.0);
        BODY.step(&mut body, 1e-3, 0.0, 25.0);
        assert_eq!(body.temperature_c, 95.0);
        body.hold_c = None;
        BODY.step(&mut body, 1e-3, 0.0, 25.0);
        assert!(body.temperature_c < 95.0 && body.temperature_c > 94.9);
    }
}

//! The direct-voltage side: a source that gives but cannot take, the bus capacitor, the drive's own consumption and
//! a bleeder (brake chopper) resistor.
//!
//! ```text
//! C dV/dt = I_source - P_load / V - V / R_bleeder [while switched on]
//! I_source = (V_source - V) / R_source, from 0 (it cannot take) to the limit of the source
//! ```
//!
//! Asked for more than its limit the source gives the limit, and the bus sags to where the load takes no more. A source
//! that is disconnected takes the capacitor at its output with it: what is left drains through what draws from it, at
//! constant power while the drive's converter runs and as through a resistor below that.
//!
//! Regeneration is a negative load; with no way back into the source it raises the capacitor's voltage. The implicit
//! midpoint rule makes this one quadratic equation per step, and the energies close to the last bits.

use crate::thermal::{BodyData, BodyModel};

/// What never changes about a supply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyModel {
    /// Resistance of source and wires.
    pub source_resistance_ohm: f64,
    /// The most that the source gives.
    pub source_limit_a: f64,
    /// Capacitor at the output of the source: on the bus while it is connected.
    pub source_capacitance_f: f64,
    /// Bus capacitor in the drive.
    pub capacitance_f: f64,
    /// What the drive's own electronics take while the bus holds at least `consumption_from_v`.
    pub consumption_w: f64,
    /// Bus voltage under which the drive's converter is off; what it takes then falls with the square of the voltage.
    pub consumption_from_v: f64,
    /// The bleeder.
    pub bleeder: BleederModel,
}

/// What never changes about a bleeder resistor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BleederModel {
    /// Resistance.
    pub resistance_ohm: f64,
    /// Power that it stands for ever.
    pub rated_power_w: f64,
    /// Time constant of its warming.
    pub time_constant_s: f64,
    /// Warming, relative to that at rated power, at which it burns out (stays open).
    pub burn_out_load: f64,
}

impl BleederModel {
    /// The resistor as a body whose temperature is its load relative to the rating: 1 in the end at rated power.
    fn body(&self) -> BodyModel {
        let resistance_k_w = 1.0 / self.rated_power_w;
        BodyModel { resistance_k_w, capacity_j_k: self.time_constant_s / resistance_k_w }
    }
}

/// State of a supply. `source_v` and `connected` may be changed while running.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyData {
    /// Open-circuit voltage of the source.
    pub source_v: f64,
    /// The source is switched on and wired.
    pub connected: bool,
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Warming of the bleeder relative to that at rated power for ever.
    pub bleeder_load: f64,
    /// The bleeder has burnt out and does not conduct any more.
    pub bleeder_burnt: bool,
}

impl SupplyData {
    /// A supply that is switched off, its capacitor empty. Setting `connected` switches it on.
    pub fn switched_off(source_v: f64) -> Self {
        SupplyData { connected: false, bus_v: 0.0, ..SupplyData::charged(source_v) }
    }

    /// The bleeder's resistor burns out, or a new, cold one is put in.
    pub fn set_bleeder_burnt(&mut self, burnt: bool) {
        self.bleeder_burnt = burnt;
        self.bleeder_load = 0.0;
    }

    /// A supply whose capacitor has been charged.
    pub fn charged(source_v: f64) -> Self {
        SupplyData { source_v, connected: true, bus_v: source_v, bleeder_load: 0.0, bleeder_burnt: false }
    }
}

/// Energies of one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SupplyOutput {
    /// What the source gave behind its inner resistance: into the capacitor.
    pub source_j: f64,
    /// What the drive's electronics took.
    pub consumption_j: f64,
    /// Heat of the bleeder.
    pub bleeder_j: f64,
}

impl SupplyModel {
    /// Energy in the capacitors of the bus.
    pub fn stored_energy_j(&self, data: &SupplyData) -> f64 {
        0.5 * self.bus_capacitance_f(data) * data.bus_v * data.bus_v
    }

    /// The source charges the bus faster than a step of this length can show: by the midpoint rule what is off of the bus's voltage comes back
    /// with the other sign, and more than a third of it.
    #[inline]
    pub(crate) fn is_stiff(&self, data: &SupplyData, dt_s: f64) -> bool {
        data.connected && self.source_resistance_ohm * self.bus_capacitance_f(data) < 0.25 * dt_s
    }

    #[inline]
    fn bus_capacitance_f(&self, data: &SupplyData) -> f64 {
        if data.connected { self.capacitance_f + self.source_capacitance_f } else { self.capacitance_f }
    }

    /// Moves the bus by one step while the inverter takes `load_w` (negative: gives back).
    ///
    /// A load that the source cannot carry pulls the bus to zero.
    // Inlined by force: with every kind of motor in one program it has several callers, and none would get it.
    #[inline(always)]
    pub fn step(&self, data: &mut SupplyData, dt_s: f64, load_w: f64, bleeder_on: bool) -> SupplyOutput {
        let before = data.bus_v;
        let consumption_j =
            if before > self.consumption_from_v { self.consumption_w * dt_s } else { self.residual_w(before) * dt_s };
        let bleeder_on = bleeder_on && !data.bleeder_burnt;
        let step = BusStep {
            store: 2.0 * self.bus_capacitance_f(data),
            source: dt_s / self.source_resistance_ohm,
            source_v: if data.connected { data.source_v } else { 0.0 },
            bleeder: if bleeder_on { dt_s / self.bleeder.resistance_ohm } else { 0.0 },
            load_j: load_w * dt_s + consumption_j,
        };
        // The diode conducts when that leads to a bus below the source.
        let guess = before < step.source_v;
        let mean = step.mean_voltage(before, guess);
        let conducts = mean < step.source_v;
        let mean = if conducts == guess { mean } else { step.mean_voltage(before, conducts) };
        let limit_c = self.source_limit_a * dt_s;
        let limited = conducts && (step.source_v - mean) * step.source > limit_c;
        let mean = if limited { step.limited_mean_voltage(before, limit_c) } else { mean };
        // A source charges no bus beyond its own voltage, in however short a time.
        let full = conducts && step.load_j >= 0.0 && 2.0 * mean - before > step.source_v;
        let mean = if full { 0.5 * (before + step.source_v) } else { mean };
        data.bus_v = (2.0 * mean - before).max(0.0);

        let bleeder_j = step.bleeder * mean * mean;
        if bleeder_j != 0.0 || data.bleeder_load != 0.0 {
            self.warm_bleeder(data, dt_s, bleeder_j / dt_s);
        }
        let source_j = match conducts {
            true if full => step.store * (step.source_v - before) * mean * 0.5 + step.load_j + bleeder_j,
            true if limited => limit_c * mean,
            true => (step.source_v - mean) * step.source * mean,
            false => 0.0,
        };
        SupplyOutput { source_j, consumption_j, bleeder_j }
    }

    /// One step, of any length, of a bus that is where its source holds it or on the way there: the capacitor by the closed form,
    /// about the voltage at which the source gives what is taken. `None`, and nothing has changed, where the source does not
    /// conduct, or cannot give as much.
    #[inline]
    pub(crate) fn follow(&self, data: &mut SupplyData, dt_s: f64, load_w: f64) -> Option<SupplyOutput> {
        let before = data.bus_v;
        let taken_w = load_w + self.consumption_w;
        let drop_v2 = 4.0 * self.source_resistance_ohm * taken_w;
        let free_v2 = data.source_v * data.source_v - drop_v2;
        // At half of its voltage a source gives the most that it can.
        let gives = data.connected && taken_w >= 0.0 && free_v2 > 0.0 && before <= data.source_v;
        if !gives || before <= self.consumption_from_v {
            return None;
        }
        let held_v = 0.5 * (data.source_v + libm::sqrt(free_v2));
        let least_v = data.source_v - self.source_limit_a * self.source_resistance_ohm;
        if held_v < least_v || before < least_v || held_v <= self.consumption_from_v {
            return None;
        }
        let lag_s = self.source_resistance_ohm * self.bus_capacitance_f(data);
        let left = if dt_s > 20.0 * lag_s { 0.0 } else { libm::exp(-dt_s / lag_s) };
        data.bus_v = held_v + (before - held_v) * left;
        let stored_j = 0.5 * self.bus_capacitance_f(data) * (data.bus_v - before) * (data.bus_v + before);
        if data.bleeder_load != 0.0 {
            self.warm_bleeder(data, dt_s, 0.0);
        }
        let consumption_j = self.consumption_w * dt_s;
        Some(SupplyOutput { source_j: load_w * dt_s + consumption_j + stored_j, consumption_j, bleeder_j: 0.0 })
    }

    /// What draws from a bus on which the drive's converter is off.
    #[cold]
    fn residual_w(&self, bus_v: f64) -> f64 {
        let share = if self.consumption_from_v > 0.0 { bus_v / self.consumption_from_v } else { 0.0 };
        self.consumption_w * share * share
    }

    fn warm_bleeder(&self, data: &mut SupplyData, dt_s: f64, bleeder_w: f64) {
        let mut body = BodyData { temperature_c: data.bleeder_load, hold_c: None };
        self.bleeder.body().step(&mut body, dt_s, bleeder_w, 0.0);
        data.bleeder_load = body.temperature_c;
        data.bleeder_burnt |= data.bleeder_load > self.bleeder.burn_out_load;
    }
}

/// One step of the bus, all conductances times its length.
struct BusStep {
    store: f64,
    source: f64,
    source_v: f64,
    bleeder: f64,
    load_j: f64,
}

impl BusStep {
    /// `a V^2 - b V + E = 0` for the mean voltage, with `a` the sum of the conductances and `b` their currents.
    #[inline]
    fn mean_voltage(&self, before: f64, source_conducts: bool) -> f64 {
        let source = if source_conducts { self.source } else { 0.0 };
        let a = self.store + source + self.bleeder;
        let b = self.store * before + source * self.source_v;
        let discriminant = (b * b - 4.0 * a * self.load_j).max(0.0);
        (b + libm::sqrt(discriminant)) * (0.5 / a)
    }

    /// The same while the source gives the charge `limit_c` in the step.
    #[cold]
    fn limited_mean_voltage(&self, before: f64, limit_c: f64) -> f64 {
        let a = self.store + self.bleeder;
        let b = self.store * before + limit_c;
        let discriminant = (b * b - 4.0 * a * self.load_j).max(0.0);
        (b + libm::sqrt(discriminant)) * (0.5 / a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SUPPLY: SupplyModel = SupplyModel {
        source_resistance_ohm: 0.1,
        source_limit_a: f64::INFINITY,
        source_capacitance_f: 0.0,
        capacitance_f: 2e-3,
        consumption_w: 0.0,
        consumption_from_v: 10.0,
        bleeder: BleederModel { resistance_ohm: 5.0, rated_power_w: 100.0, time_constant_s: 30.0, burn_out_load: 2.0 },
    };

    #[test]
    fn the_bus_sags_by_the_inner_resistance() {
        let mut data = SupplyData::charged(48.0);
        for _ in 0..20_000 {
            SUPPLY.step(&mut data, 50e-6, 470.0, false);
        }
        // V (48 - V) / 0.1 = 470 has the root V = 47.
        assert!((data.bus_v - 47.0).abs() < 1e-9, "{}", data.bus_v);
    }

    #[test]
    fn switching_on_charges_the_capacitor_through_the_inner_resistance() {
        let mut data = SupplyData::switched_off(48.0);
        data.connected = true;
        for _ in 0..40 {
            SUPPLY.step(&mut data, 5e-6, 0.0, false);
        }
        // R C = 200 us, after 200 us.
        assert!((data.bus_v - 48.0 * (1.0 - libm::exp(-1.0))).abs() < 1e-2);
    }

    #[test]
    fn a_source_charges_no_bus_beyond_itself_however_small_the_capacitor_and_the_energies_close() {
        // R C = 22 us, less than half a step.
        let small = SupplyModel { capacitance_f: 220e-6, ..SUPPLY };
        let mut data = SupplyData::charged(24.0);
        data.source_v = 39.5;
        let (mut before, mut source_j) = (small.stored_energy_j(&data), 0.0);
        for step in 0..100 {
            let load_w = if step < 50 { 0.0 } else { 40.0 };
            source_j += small.step(&mut data, 50e-6, load_w, false).source_j;
            before -= load_w * 50e-6;
            assert!(data.bus_v <= 39.5 && data.bus_v > 39.0 - 24.0 / f64::from(step + 1), "{}", data.bus_v);
        }
        assert!((small.stored_energy_j(&data) - before - source_j).abs() < 1e-12);
    }

    #[test]
    fn regeneration_raises_the_bus_by_its_energy_and_nothing_flows_back() {
        let mut data = SupplyData::charged(48.0);
        let before = SUPPLY.stored_energy_j(&data);
        for _ in 0..1000 {
            let out = SUPPLY.step(&mut data, 50e-6, -100.0, false);
            assert_eq!(out.source_j, 0.0);
        }
        // 100 W for 50 ms into the capacitor.
        assert!((SUPPLY.stored_energy_j(&data) - before - 5.0).abs() < 1e-9);
    }

    #[test]
    fn the_bleeder_discharges_the_bus_with_its_time_constant() {
        let mut data = SupplyData { connected: false, ..SupplyData::charged(70.0) };
        for _ in 0..200 {
            SUPPLY.step(&mut data, 50e-6, 0.0, true);
        }
        // R C = 10 ms, after 10 ms.
        assert!((data.bus_v - 70.0 * libm::exp(-1.0)).abs() < 1e-3);
    }

    #[test]
    fn the_bleeder_stands_its_rated_power_and_burns_out_far_above() {
        let mut rated = SupplyData::charged(libm::sqrt(100.0 * 5.0));
        let stiff = SupplyModel { source_resistance_ohm: 1e-3, ..SUPPLY };
        for _ in 0..300_000 {
            stiff.step(&mut rated, 1e-3, 0.0, true);
        }
        assert!((rated.bleeder_load - 1.0).abs() < 2e-3 && !rated.bleeder_burnt);
        let mut over = SupplyData::charged(70.0);
        for _ in 0..30_000 {
            stiff.step(&mut over, 1e-3, 0.0, true);
        }
        assert!(over.bleeder_burnt);
    }

    #[test]
    fn beyond_its_limit_the_source_gives_the_limit_and_the_bus_sags_to_what_a_resistor_takes() {
        let limited = SupplyModel { source_limit_a: 5.0, ..SUPPLY };
        for (load_ohm, expected_v) in [
            // 48 V over 0.1 + 10 ohm is 4.75 A: a divider. Over 4 ohm it would be 11.7 A: 5 A through 4 ohm.
            (10.0, 48.0 * 10.0 / 10.1),
            (4.0, 20.0),
            (0.5, 2.5),
        ] {
            let mut data = SupplyData::charged(48.0);
            let (mut energy_j, stored_j) = (0.0, limited.stored_energy_j(&data));
            for _ in 0..20_000 {
                let load_w = data.bus_v * data.bus_v / load_ohm;
                energy_j += limited.step(&mut data, 50e-6, load_w, false).source_j - load_w * 50e-6;
            }
            assert!((data.bus_v - expected_v).abs() < 2e-2 * expected_v, "{load_ohm} ohm: {} V", data.bus_v);
            let stored = limited.stored_energy_j(&data) - stored_j;
            assert!((energy_j - stored).abs() < 1e-9, "{load_ohm} ohm: {energy_j} J came, {stored} J are there");
        }
    }

    #[test]
    fn one_long_step_of_a_stiff_bus_is_what_many_short_ones_are_and_what_is_too_much_for_it_is_refused() {
        let stiff = SupplyModel { capacitance_f: 220e-6, consumption_w: 1.0, source_limit_a: 7.8, ..SUPPLY };
        for (from_v, load_w) in [(24.0, 40.0), (23.3, 5.0), (23.5, 0.0)] {
            let begun = SupplyData { bus_v: from_v, ..SupplyData::charged(24.0) };
            let (mut long, mut short, mut source_j) = (begun, begun, 0.0);
            let out = stiff.follow(&mut long, 0.5e-3, load_w).expect("the source holds it");
            for _ in 0..5000 {
                source_j += stiff.step(&mut short, 0.1e-6, load_w, false).source_j;
            }
            assert!((long.bus_v - short.bus_v).abs() < 1e-6, "{load_w} W: {} and {} V", long.bus_v, short.bus_v);
            assert!((out.source_j - source_j).abs() < 1e-6, "{load_w} W: {} and {source_j} J", out.source_j);
        }
        // Beyond the limit of the source, fed back, above its voltage, and without it.
        let charged = SupplyData::charged(24.0);
        let refused = [
            (charged, 300.0),
            (charged, -10.0),
            (SupplyData { bus_v: 30.0, ..charged }, 10.0),
            (SupplyData { connected: false, ..charged }, 10.0),
        ];
        for (mut data, load_w) in refused {
            let before = data;
            assert_eq!((stiff.follow(&mut data, 0.5e-3, load_w), data), (None, before));
        }
    }

    #[test]
    fn charging_at_the_limit_is_a_straight_line() {
        // 5 A for 10 ms into 2 mF, and with the capacitor of the source into 10 mF.
        for (source_capacitance_f, expected_v) in [(0.0, 25.0), (8e-3, 5.0)] {
            let limited = SupplyModel { source_limit_a: 5.0, source_capacitance_f, ..SUPPLY };
            let mut data = SupplyData { connected: true, ..SupplyData::switched_off(48.0) };
            for _ in 0..200 {
                limited.step(&mut data, 50e-6, 0.0, false);
            }
            assert!((data.bus_v - expected_v).abs() < 1e-9, "{} V", data.bus_v);
        }
    }

    #[test]
    fn what_is_switched_off_drains_at_constant_power_and_then_as_through_a_resistor() {
        let model = SupplyModel { consumption_w: 4.0, source_capacitance_f: 8e-3, ..SUPPLY };
        let mut data = SupplyData { connected: false, ..SupplyData::charged(48.0) };
        let mut steps = 0;
        while data.bus_v > 10.0 {
            model.step(&mut data, 50e-6, 0.0, false);
            steps += 1;
        }
        // C (48^2 - 10^2) / 2 P, the capacitor of the source not among it.
        let expected_s = 2e-3 * (48.0 * 48.0 - 10.0 * 10.0) / (2.0 * 4.0);
        assert!((f64::from(steps) * 50e-6 - expected_s).abs() < 1e-4, "{steps} steps, expected {expected_s} s");
        // From there (10 V)^2 / 4 W = 25 ohm, R C = 50 ms, after 50 ms.
        for _ in 0..1000 {
            model.step(&mut data, 50e-6, 0.0, false);
        }
        assert!((data.bus_v - 10.0 * libm::exp(-1.0)).abs() < 2e-2, "{} V", data.bus_v);
    }

    #[test]
    fn an_impossible_load_pulls_the_bus_down_without_harm() {
        let mut data = SupplyData::charged(48.0);
        for _ in 0..10_000 {
            SUPPLY.step(&mut data, 50e-6, 50_000.0, false);
            assert!(data.bus_v >= 0.0 && data.bus_v.is_finite());
        }
    }
}

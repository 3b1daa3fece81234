//! What a motor of any kind is rigged up with: load, supply and power stage, warm bodies, and the book of energies.
//!
//! A composition ([`hub_motor`](crate::hub_motor), [`joint_motor`](crate::joint_motor),
//! [`stepper_motor`](crate::stepper_motor)) says what its windings and its shaft did during a step; out come the bus,
//! the temperatures, the winding's resistance and the energies. The load, the source and the surroundings are plain
//! fields that a test or a person at a bench changes at any time. What the load does to the shaft is the composition's.

use crate::current_loop::short_steps;
use crate::flows::Flows;
use crate::mechanics::Load;
use crate::shaft::{Attached, Coupled};
use crate::supply::{SupplyData, SupplyModel, SupplyOutput};
use crate::thermal::{BodyData, BodyModel, resistance_at_ohm};

/// Steps between two looks at the slow things: heat, resistance, and the exact direction of the magnets. Bodies are
/// a million steps slow, and turning the direction on by its series is off by 1e-11 in so many steps.
pub(crate) const SLOW_EVERY: u32 = 16;

/// A bus under this counts as empty, so that its voltage does not fall towards zero for ever.
const EMPTY_V: f64 = 1e-3;

/// The voltage in V against which the diodes of an open power stage conduct. What they give a bus is a power, and at no voltage none: an
/// empty one would be a short for ever, where their current charges it.
#[inline]
pub(crate) fn diode_v(bus_v: f64) -> f64 {
    bus_v.max(EMPTY_V)
}

/// What never changes about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigModel {
    /// The winding as a warm body.
    pub winding: BodyModel,
    /// Change of the winding's resistance per kelvin, relative to that at 20 °C; 0 for none.
    pub resistance_per_k: f64,
    /// The power stage's heat sink as a warm body.
    pub heat_sink: BodyModel,
    /// Resistance of the power stage's switches and wires in each phase.
    pub switch_resistance_ohm: f64,
    /// The direct-voltage side.
    pub supply: SupplyModel,
}

/// Energies since power-on. The sum of what came in equals the sum of where it went, but for what is stored.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energy {
    /// In: from the source.
    pub source_j: f64,
    /// Out: heat of the winding.
    pub winding_j: f64,
    /// Out: heat of the switches, of the arc of a wire that comes off under current, and of short circuits.
    pub switches_j: f64,
    /// Out: heat of all friction, brake and gear included.
    pub friction_j: f64,
    /// Out: work done on the active load torque; negative while the load drove.
    pub load_j: f64,
    /// Out: heat of the bleeder.
    pub bleeder_j: f64,
    /// Out: the drive's own electronics.
    pub consumption_j: f64,
}

impl Energy {
    /// All that came in less all that went out: equals the change of the stored energy.
    pub fn balance_j(&self) -> f64 {
        self.source_j
            - (self.winding_j + self.switches_j + self.friction_j + self.load_j + self.bleeder_j + self.consumption_j)
    }
}

/// Its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// What the shaft, or the gear's output, is joined to.
    pub load: Load,
    /// Source and bus.
    pub supply: SupplyData,
    /// Winding temperature.
    pub winding: BodyData,
    /// Heat-sink temperature.
    pub heat_sink: BodyData,
    /// Temperature of the surroundings.
    pub ambient_c: f64,
    /// Energy book.
    pub energy: Energy,
    pub(crate) attached: Option<Attached>,
    pub(crate) coupled: Option<Coupled>,
    winding_ohm: f64,
    slow_every: u32,
    slow: Slow,
}

/// When the slow things were last looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Slow {
    steps: u32,
    time_s: f64,
    winding_j: f64,
    heat_sink_j: f64,
}

/// The same of steps that are ten times as long: heat shows within a millisecond or two.
const SLOW_EVERY_LONG: u32 = 2;

impl Rig {
    /// No load, the bus charged from a source of `source_v`, all at `ambient_c`. A phase of the winding has `cold_ohm`
    /// at 20 °C.
    pub(crate) fn new(model: &RigModel, cold_ohm: f64, source_v: f64, ambient_c: f64) -> Self {
        Rig {
            load: Load::default(),
            supply: SupplyData::charged(source_v),
            winding: model.winding.at_ambient(ambient_c),
            heat_sink: model.heat_sink.at_ambient(ambient_c),
            ambient_c,
            energy: Energy::default(),
            attached: None,
            coupled: None,
            winding_ohm: resistance_at_ohm(cold_ohm, model.resistance_per_k, ambient_c),
            slow_every: SLOW_EVERY,
            slow: Slow::default(),
        }
    }

    /// Its steps are supervision periods from now on, or control periods. Before the first one.
    pub fn set_long_steps(&mut self, long: bool) {
        self.slow_every = if long { SLOW_EVERY_LONG } else { SLOW_EVERY };
    }

    /// Connects the source or disconnects it, its capacitor with it. The inrush limiter has charged the bus by the time
    /// the drive's converter starts.
    pub fn switch_source(&mut self, model: &RigModel, on: bool) {
        let before_j = model.supply.stored_energy_j(&self.supply);
        if on && !self.supply.connected {
            self.supply.bus_v = self.supply.bus_v.max(self.supply.source_v);
        }
        self.supply.connected = on;
        self.energy.source_j += model.supply.stored_energy_j(&self.supply) - before_j;
    }

    /// Sets the source's voltage. A source that is turned down discharges the capacitor at its own output, and the bus
    /// with it; only the motor's energy it cannot take.
    pub fn set_source_v(&mut self, model: &RigModel, source_v: f64) {
        let before_j = model.supply.stored_energy_j(&self.supply);
        self.supply.source_v = source_v;
        if self.supply.connected && model.supply.source_capacitance_f > 0.0 {
            self.supply.bus_v = self.supply.bus_v.min(source_v);
        }
        self.energy.source_j += model.supply.stored_energy_j(&self.supply) - before_j;
    }

    /// Disconnects the source and empties the bus: no voltage from one step to the next. A motor that turns charges it again, through the
    /// diodes of its power stage, up to its own voltage.
    pub fn cut_source(&mut self, model: &RigModel) {
        self.switch_source(model, false);
        self.energy.switches_j += model.supply.stored_energy_j(&self.supply);
        self.supply.bus_v = 0.0;
    }

    /// Resistance of one phase's path: winding, switches and wires.
    #[inline]
    pub(crate) fn path_ohm(&self, model: &RigModel) -> f64 {
        self.winding_ohm + model.switch_resistance_ohm
    }

    /// One step of bus and energies. True when [`step_slow`](Self::step_slow) is due.
    // Inlined by force: with every kind of motor in one program it has several callers, and none would get it.
    #[inline(always)]
    pub(crate) fn step(&mut self, model: &RigModel, dt_s: f64, flows: &Flows, bleeder_on: bool) -> bool {
        let bus = model.supply.step(&mut self.supply, dt_s, flows.bus_w, bleeder_on);

        self.energy.source_j += bus.source_j;
        self.energy.winding_j += flows.heat_w_per_ohm * self.winding_ohm * dt_s;
        self.energy.switches_j += flows.heat_w_per_ohm * model.switch_resistance_ohm * dt_s + flows.arc_j;
        self.energy.friction_j += flows.friction_j;
        self.energy.load_j += flows.load_j;
        self.energy.bleeder_j += bus.bleeder_j;
        self.energy.consumption_j += bus.consumption_j;

        self.slow.steps += 1;
        self.slow.time_s += dt_s;
        self.slow.steps >= self.slow_every
    }

    /// The same of a step of a supervision period, whose flows are means of it; `beside_w` is what else draws from the bus, by its
    /// voltage, and becomes heat of the switches. The bus goes in control periods, unless its source has it where it stays.
    pub(crate) fn step_long(
        &mut self,
        model: &RigModel,
        dt_s: f64,
        flows: &Flows,
        beside_w: impl Fn(f64) -> f64,
    ) -> bool {
        let nothing_beside = beside_w(self.supply.bus_v) == 0.0;
        let quiet = if nothing_beside { model.supply.follow(&mut self.supply, dt_s, flows.bus_w) } else { None };
        let mut arc_j = flows.arc_j;
        let bus = quiet.unwrap_or_else(|| {
            let mut sum = SupplyOutput::default();
            let steps = short_steps(dt_s);
            let short_s = dt_s / f64::from(steps);
            for _ in 0..steps {
                let beside_w = beside_w(self.supply.bus_v);
                arc_j += beside_w * short_s;
                let bus = model.supply.step(&mut self.supply, short_s, flows.bus_w + beside_w, false);
                sum.source_j += bus.source_j;
                sum.consumption_j += bus.consumption_j;
            }
            sum
        });
        self.energy.source_j += bus.source_j;
        self.energy.winding_j += flows.heat_w_per_ohm * self.winding_ohm * dt_s;
        self.energy.switches_j += flows.heat_w_per_ohm * model.switch_resistance_ohm * dt_s + arc_j;
        self.energy.friction_j += flows.friction_j;
        self.energy.load_j += flows.load_j;
        self.energy.consumption_j += bus.consumption_j;

        // Heat shows within a millisecond or two.
        self.slow.steps += self.slow_every / SLOW_EVERY_LONG;
        self.slow.time_s += dt_s;
        self.slow.steps >= self.slow_every
    }

    /// Steps up to and with the next one after which [`step_slow`](Self::step_slow) is due.
    pub(crate) fn steps_to_slow(&self) -> u32 {
        self.slow_every - self.slow.steps
    }

    /// So many steps in which no power flows but what the drive itself takes, on a bus that such a step leaves as it is: what
    /// [`step`](Self::step) does then, without computing it again for each. True when [`step_slow`](Self::step_slow) is due.
    pub(crate) fn book_rest(&mut self, model: &RigModel, dt_s: f64, bleeder_on: bool, steps: u32) -> bool {
        let mut supply = self.supply;
        let bus = model.supply.step(&mut supply, dt_s, 0.0, bleeder_on);
        for _ in 0..steps {
            self.energy.source_j += bus.source_j;
            self.energy.bleeder_j += bus.bleeder_j;
            self.energy.consumption_j += bus.consumption_j;
            self.slow.time_s += dt_s;
        }
        self.slow.steps += steps;
        self.slow.steps >= self.slow_every
    }

    /// Heat of the steps since the last call into the bodies, and the winding's resistance. The time of those steps, s.
    pub(crate) fn step_slow(&mut self, model: &RigModel, cold_ohm: f64) -> f64 {
        if self.supply.bus_v < EMPTY_V && self.supply.bus_v > 0.0 {
            self.energy.consumption_j += model.supply.stored_energy_j(&self.supply);
            self.supply.bus_v = 0.0;
        }
        let Slow { time_s, winding_j, heat_sink_j, .. } = self.slow;
        let into_winding_j = self.energy.winding_j;
        let into_heat_sink_j = self.energy.switches_j + self.energy.consumption_j;
        if time_s > 0.0 {
            let winding_w = (into_winding_j - winding_j) / time_s;
            let heat_sink_w = (into_heat_sink_j - heat_sink_j) / time_s;
            model.winding.step(&mut self.winding, time_s, winding_w, self.ambient_c);
            model.heat_sink.step(&mut self.heat_sink, time_s, heat_sink_w, self.ambient_c);
        }
        self.winding_ohm = resistance_at_ohm(cold_ohm, model.resistance_per_k, self.winding.temperature_c);
        self.slow = Slow { steps: 0, time_s: 0.0, winding_j: into_winding_j, heat_sink_j: into_heat_sink_j };
        time_s
    }
}

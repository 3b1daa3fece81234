//! A hub motor with its sensors on the power stage of a drive: the whole plant of a single-axis drive.
//!
//! In goes what the drive's pins do ([`Actuation`]), out comes what its sensors read ([`Sensors`]). The load, the
//! supply, the faults and the surroundings are plain fields that a test or a person at a bench changes at any time.
//! Deliberately absent: switching ripple (a step sees the mean voltage), measurement noise, the drive's firmware.

use crate::angle::{Angle, Axis};
use crate::brake::BrakeModel;
use crate::clamp::ClampModel;
use crate::cogging::Cogging;
use crate::current_loop::short_steps;
use crate::encoder::{EncoderData, EncoderModel};
use crate::flows::Flows;
use crate::hall::{HallFault, HallModel};
use crate::mechanics::{RotorData, RotorModel};
use crate::motor::{self, Motor};
use crate::physics::{Physics, load_velocity_rad_s};
use crate::pmsm::{Dq, Phase, PmsmData, PmsmInput, PmsmModel, Terminals};
use crate::rig::{Rig, RigModel, diode_v};
use crate::shaft::{Motion, PendingStep, Turned};
use crate::thermal::reading_c;

/// Assumed: two motor wires that touch have 0.05 ohm with their contact and the cable up to it.
const SHORT_OHM: f64 = 0.05;

/// What never changes about a hub motor and the power stage it is wired to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HubMotorModel {
    /// The name it is published under.
    pub name: &'static str,
    /// Winding and magnets.
    pub pmsm: PmsmModel,
    /// Inertia and friction of the motor alone.
    pub rotor: RotorModel,
    /// Incremental encoder.
    pub encoder: EncoderModel,
    /// Hall sensors.
    pub hall: HallModel,
    /// Holding brake.
    pub brake: BrakeModel,
    /// Warm bodies, power stage and supply.
    pub rig: RigModel,
    /// What limits the voltage of the bus.
    pub clamp: ClampModel,
    /// Temperature of the heat sink at which the power stage melts through.
    pub power_stage_limit_c: f64,
    /// Speed at which the bearings seize.
    pub bearing_limit_rad_s: f64,
}

/// What the drive's power stage does during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Actuation {
    /// The three half bridges.
    pub inverter: Inverter,
    /// The bleeder's switch is closed.
    pub bleeder_on: bool,
    /// The holding brake has current and lets go.
    pub brake_released: bool,
}

/// What the three half bridges do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Inverter {
    /// All switches off.
    #[default]
    Open,
    /// All wires joined to one rail.
    Shorted,
    /// Switching with these duty cycles of U, V, W, each 0 to 1.
    Driven([f64; 3]),
    /// Whatever gives the currents that the motor's current loop is asked for
    /// ([`LoopData::settings`](crate::current_loop::LoopData)).
    Regulated,
}

/// What the drive's sensors read at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// Hardware counter of the encoder's quadrature; wraps.
    pub encoder_count: u16,
    /// Hall state, 1 to 6; 0 or 7 with a fault.
    pub hall: u8,
    /// Currents of U, V, W, positive into the motor.
    pub phase_current_a: [f64; 3],
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Temperature of the winding, in the steps of [`reading_c`].
    pub winding_c: f64,
    /// Temperature of the power stage's heat sink, likewise.
    pub heat_sink_c: f64,
}

/// A hub motor that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct HubMotor {
    /// Its constants.
    pub model: HubMotorModel,
    /// Winding current.
    pub pmsm: PmsmData,
    /// Angle and velocity.
    pub rotor: RotorData,
    /// Encoder counter and its fault.
    pub encoder: EncoderData,
    /// Fault of the Hall sensors.
    pub hall_fault: HallFault,
    /// A motor wire that has come off.
    pub lost_phase: Option<Phase>,
    /// The pull of the magnets at the teeth; none unless it is asked for.
    pub cogging: Option<Cogging>,
    /// Load, supply, temperatures and energies.
    pub rig: Rig,
    /// Torque of the motor on its rotor, mean over the last step, cogging included.
    pub torque_nm: f64,
    /// The wires of U and V touch: the bridge feeds the contact, and no voltage stands between the two in the winding.
    pub wires_touch: bool,
    power_stage_burnt: bool,
    seized: bool,
    axis: Axis,
    /// Current from U to V through the contact of two wires, A.
    short_a: f64,
}

impl HubMotor {
    /// A motor at rest at an angle, its bus charged from a source of `source_v`, all at `ambient_c`.
    pub fn new(model: HubMotorModel, angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        HubMotor {
            model,
            pmsm: PmsmData::default(),
            rotor: RotorData { angle, ..RotorData::default() },
            encoder: model.encoder.power_on(angle),
            hall_fault: HallFault::None,
            lost_phase: None,
            cogging: None,
            rig: Rig::new(&model.rig, model.pmsm.resistance_ohm, source_v, ambient_c),
            torque_nm: 0.0,
            wires_touch: false,
            power_stage_burnt: false,
            seized: false,
            axis: Axis::at_turns(model.pmsm.electrical_turns(angle)),
            short_a: 0.0,
        }
    }

    /// One step: winding, rotor, bus, encoder, energies, and now and then heat. Meant for 50 µs and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, actuation: &Actuation) {
        if self.power_stage_burnt | self.wires_touch | self.rig.is_joined()
            || self.rig.supply.bus_v > self.model.clamp.from_v
        {
            self.step_in_trouble(dt_s, actuation);
        } else if self.rests(actuation) {
            self.torque_nm = 0.0;
            self.book(dt_s, &Flows::default(), actuation);
        } else {
            let terminals = actuation.inverter.terminals(self.rig.supply.bus_v);
            let flows = self.turn(dt_s, actuation, terminals, self.lost_phase);
            self.book(dt_s, &flows, actuation);
        }
    }

    /// A step of a supervision period, with the current loop's closed form ([`Inverter::Regulated`]) or an idle bridge. It is done
    /// in control periods where something goes on that so long a step does not show: suppressors that conduct, molten switches, a bus
    /// that its source charges in no time.
    #[inline(never)]
    pub fn step_long(&mut self, dt_s: f64, actuation: &Actuation) {
        if actuation.inverter != Inverter::Regulated {
            self.pmsm.current_loop.release();
        }
        if self.needs_short_steps(dt_s) {
            let steps = short_steps(dt_s);
            (0..steps).for_each(|_| self.step(dt_s / f64::from(steps), actuation));
        } else {
            self.step(dt_s, actuation);
        }
    }

    #[inline]
    fn needs_short_steps(&self, dt_s: f64) -> bool {
        let supply = &self.rig.supply;
        self.power_stage_burnt || supply.bus_v > self.model.clamp.from_v || self.model.rig.supply.is_stiff(supply, dt_s)
    }

    /// The same while the bus is so high that its suppressors conduct, with two wires that touch, or with molten switches, which
    /// join the wires whatever the drive wants. Apart, so that other steps pay for no more than the question.
    #[cold]
    #[inline(never)]
    fn step_in_trouble(&mut self, dt_s: f64, actuation: &Actuation) {
        if self.rig.is_joined() {
            return self.step_joined(dt_s, actuation);
        }
        let bus_v = self.rig.supply.bus_v;
        let (inverter, lost_phase, short_w) = self.in_trouble(actuation.inverter);
        let mut flows = self.turn(dt_s, actuation, inverter.terminals(bus_v), lost_phase);
        let beside_w = self.model.clamp.power_w(bus_v) + short_w;
        flows.bus_w += beside_w;
        flows.arc_j += beside_w * dt_s;
        self.book(dt_s, &flows, actuation);
    }

    /// What the winding sees of the power stage when that has melted, or when two wires touch; and the power that their contact
    /// takes from the bus.
    ///
    /// A bridge that drives two wires that touch gives the winding the mean of both; with its switches off the two are joined and
    /// the third is open, as if it had come off.
    #[inline]
    fn in_trouble(&mut self, inverter: Inverter) -> (Inverter, Option<Phase>, f64) {
        self.short_a = 0.0;
        match inverter {
            _ if self.power_stage_burnt => (Inverter::Shorted, self.lost_phase, 0.0),
            Inverter::Driven([u, v, w]) if self.wires_touch => {
                let [u, v] = [u, v].map(|duty| if duty > 0.0 { duty.min(1.0) } else { 0.0 });
                let short_v = (u - v) * self.rig.supply.bus_v;
                self.short_a = short_v / (SHORT_OHM + 2.0 * self.model.rig.switch_resistance_ohm);
                let mean = 0.5 * (u + v);
                (Inverter::Driven([mean, mean, w]), self.lost_phase, short_v * self.short_a)
            }
            Inverter::Open if self.wires_touch => (Inverter::Shorted, self.lost_phase.or(Some(Phase::W)), 0.0),
            inverter => (inverter, self.lost_phase, 0.0),
        }
    }

    /// The same for a shaft that is not a plain one. The winding goes by the velocity that is expected in the middle of the step, the
    /// angle by the real one.
    fn step_joined(&mut self, dt_s: f64, actuation: &Actuation) {
        let bus_v = self.rig.supply.bus_v;
        let (inverter, lost_phase, short_w) = self.in_trouble(actuation.inverter);
        let model = &self.model;
        let velocity_rad_s = self.rotor.velocity_rad_s + 0.5 * self.rotor.velocity_change_rad_s;
        let half_turn_rad = 0.5 * dt_s * f64::from(model.pmsm.pole_pairs) * velocity_rad_s;
        let input = PmsmInput {
            terminals: inverter.terminals(bus_v),
            lost_phase,
            resistance_ohm: self.rig.path_ohm(&model.rig),
            axis: self.axis.turned_by(Axis::at_small_rad(half_turn_rad)),
            velocity_rad_s,
        };
        let motor = model.pmsm.step(&mut self.pmsm, dt_s, &input);
        let motor_nm = motor.torque_nm + self.cogging.map_or(0.0, |cogging| cogging.torque_nm(self.rotor.angle));
        let brake_nm = model.brake.torque_nm(actuation.brake_released);
        let beside_w = model.clamp.power_w(bus_v) + short_w;
        let mut flows = motor.flows(0.0, 0.0);
        flows.bus_w += beside_w;
        flows.arc_j += beside_w * dt_s;
        let pending = PendingStep { flows, motor_nm, dt_s, bleeder_on: actuation.bleeder_on };
        if self.rig.is_coupled() {
            self.rig.push_directly((&model.rotor, &self.rotor), pending, brake_nm);
        } else {
            let turned = self.rig.turn_attached((&model.rotor, &mut self.rotor), dt_s, motor_nm, brake_nm);
            self.finish_joined(pending, &turned);
        }
    }

    fn finish_joined(&mut self, pending: PendingStep, turned: &Turned) {
        let PendingStep { mut flows, motor_nm, dt_s, bleeder_on } = pending;
        let turn_rad = dt_s * f64::from(self.model.pmsm.pole_pairs) * turned.mean_rad_s;
        self.axis = self.axis.turned_by(Axis::at_small_rad(turn_rad));
        self.model.encoder.step(&mut self.encoder, self.rotor.angle);
        self.torque_nm = motor_nm;
        (flows.friction_j, flows.load_j) = (turned.friction_j, turned.load_j);
        if self.rig.step(&self.model.rig, dt_s, &flows, bleeder_on) {
            self.step_slow();
        }
    }

    /// Winding, rotor and encoder.
    // Inlined by force: it has two callers, and the frequent one would not get it.
    #[inline(always)]
    fn turn(&mut self, dt_s: f64, actuation: &Actuation, terminals: Terminals, lost_phase: Option<Phase>) -> Flows {
        let model = &self.model;
        let velocity_rad_s = self.rotor.turn(dt_s, &self.rig.load);
        let half_turn = Axis::at_small_rad(0.5 * dt_s * f64::from(model.pmsm.pole_pairs) * velocity_rad_s);
        let input = PmsmInput {
            terminals,
            lost_phase,
            resistance_ohm: self.rig.path_ohm(&model.rig),
            axis: self.axis.turned_by(half_turn),
            velocity_rad_s,
        };
        self.axis = input.axis.turned_by(half_turn);
        let motor = model.pmsm.step(&mut self.pmsm, dt_s, &input);
        let brake_nm = model.brake.torque_nm(actuation.brake_released);
        let torque_nm = motor.torque_nm + self.cogging.map_or(0.0, |cogging| cogging.torque_nm(self.rotor.angle));
        let moved = model.rotor.step(&mut self.rotor, dt_s, torque_nm, &self.rig.load, brake_nm);
        model.encoder.step(&mut self.encoder, self.rotor.angle);
        self.torque_nm = torque_nm;
        motor.flows(moved.friction_j, moved.load_j)
    }

    /// Bus and energies, and now and then the slow things.
    #[inline(always)]
    fn book(&mut self, dt_s: f64, flows: &Flows, actuation: &Actuation) {
        if self.rig.step(&self.model.rig, dt_s, flows, actuation.bleeder_on) {
            self.step_slow();
        }
    }

    /// Blocks the rotor, or frees it; seized bearings are new ones then.
    pub fn lock_rotor(&mut self, locked: bool) {
        self.rig.load.locked = locked;
        self.seized = false;
    }

    /// The bearings have seized.
    pub fn is_seized(&self) -> bool {
        self.seized
    }

    /// Molten switches join the motor's wires and short the bus, so that the source's fuse blows.
    #[cold]
    pub fn burn_power_stage(&mut self) {
        self.power_stage_burnt = true;
        self.rig.cut_source(&self.model.rig);
    }

    /// A new power stage. The caller connects the source again.
    pub fn mend_power_stage(&mut self) {
        self.power_stage_burnt = false;
    }

    /// The power stage has melted through.
    pub fn is_power_stage_burnt(&self) -> bool {
        self.power_stage_burnt
    }

    /// True if nothing will move or flow in this step: friction holds the shaft, and the idle bridge carries no current
    /// (without motion there is no voltage that its diodes could rectify).
    #[inline]
    fn rests(&self, actuation: &Actuation) -> bool {
        actuation.inverter == Inverter::Open
            && self.cogging.is_none()
            && self.pmsm.current_a == Dq::default()
            && self.rotor.stands()
            && self.model.rotor.holds(&self.rig.load, self.model.brake.torque_nm(actuation.brake_released))
    }

    /// Heat of the last steps into the bodies, the winding's resistance, and the magnets' direction afresh.
    fn step_slow(&mut self) {
        self.rig.step_slow(&self.model.rig, self.model.pmsm.resistance_ohm);
        let heat_sink = &self.rig.heat_sink;
        let melts = heat_sink.hold_c.is_none() && heat_sink.temperature_c > self.model.power_stage_limit_c;
        if melts || (self.power_stage_burnt && self.rig.supply.connected) {
            self.burn_power_stage();
        }
        if self.rotor.velocity_rad_s.abs() > self.model.bearing_limit_rad_s {
            self.seized = true;
            self.rig.energy.friction_j += self.rig.seize(&self.model.rotor, &mut self.rotor);
        }
        self.axis = Axis::at_turns(self.model.pmsm.electrical_turns(self.rotor.angle));
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        let electrical = self.model.pmsm.electrical_turns(self.rotor.angle);
        Sensors {
            encoder_count: self.encoder.count,
            hall: self.model.hall.state(electrical, self.hall_fault),
            phase_current_a: self.phase_current_a(),
            bus_v: self.rig.supply.bus_v,
            winding_c: reading_c(self.rig.winding.temperature_c),
            heat_sink_c: reading_c(self.rig.heat_sink.temperature_c),
        }
    }

    /// Currents out of the bridges into the wires, with that of wires that touch.
    #[inline]
    pub fn phase_current_a(&self) -> [f64; 3] {
        let mut phase_current_a = self.model.pmsm.phase_current_a(&self.pmsm, self.axis);
        if self.wires_touch {
            phase_current_a[0] += self.short_a;
            phase_current_a[1] -= self.short_a;
        }
        phase_current_a
    }

    /// Energy stored now: in motion, in the winding's field and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        self.rig.mechanical_j(&self.model.rotor, &self.rotor)
            + self.model.pmsm.magnetic_energy_j(&self.pmsm)
            + self.model.rig.supply.stored_energy_j(&self.rig.supply)
            + self.cogging.map_or(0.0, |cogging| cogging.energy_j(self.rotor.angle))
    }
}

impl Motor for HubMotor {
    type Pins = Actuation;
    /// The power stage has melted.
    type Wear = bool;

    motor::parts!(HubMotor);

    fn pmsm_model(&self) -> Option<&PmsmModel> {
        Some(&self.model.pmsm)
    }

    fn physics(&self) -> Physics {
        let velocity_rad_s = load_velocity_rad_s(&self.rig, self.rotor.velocity_rad_s);
        Physics {
            motor_torque_nm: self.torque_nm,
            phase_current_a: self.sense().phase_current_a.map(Some),
            stored_j: self.stored_j(),
            ..Physics::of_rig(&self.rig, (self.load_angle(), velocity_rad_s))
        }
    }

    fn bleeds(&self, pins: &Actuation) -> bool {
        pins.bleeder_on
    }

    fn wear(&self) -> bool {
        self.power_stage_burnt
    }

    fn follow(&mut self, motion: &Motion) {
        if let Some((pending, turned)) = self.rig.follow(&mut self.rotor, motion) {
            self.finish_joined(pending, &turned);
        }
    }
}

impl Inverter {
    #[inline]
    pub(crate) fn terminals(&self, bus_v: f64) -> Terminals {
        match *self {
            Inverter::Open => Terminals::Open { bus_v: diode_v(bus_v) },
            Inverter::Shorted => Terminals::Shorted,
            Inverter::Driven(duty) => Terminals::from_duties(duty, bus_v),
            Inverter::Regulated => Terminals::Regulated { bus_v },
        }
    }
}

//! A robot joint on the power stage of its drive: motor, harmonic gear, absolute encoder with battery, brake.
//!
//! In goes what the drive's pins do ([`Actuation`]), out comes what its sensors read ([`Sensors`]). The encoder sits
//! on the motor's shaft; the output's own angle ([`JointMotor::output_angle`]) differs from it by the gear's twist and
//! backlash, and no sensor shows that. The load is joined to the output. The load, the supply, the battery, the
//! faults and the surroundings are plain fields that a test or a person at a bench changes at any time.

use crate::absolute_encoder::{AbsoluteEncoderData, AbsoluteEncoderModel, BatteryState};
use crate::angle::{Angle, Axis};
use crate::attachment::Attachment;
use crate::brake::BrakeModel;
use crate::clamp::ClampModel;
use crate::cogging::Cogging;
use crate::current_loop::short_steps;
use crate::gear::{GearData, GearInput, GearModel};
use crate::hub_motor::Inverter;
use crate::mechanics::{Load, RotorData, RotorModel};
use crate::motor::{self, Motor};
use crate::physics::Physics;
use crate::pmsm::{Phase, PmsmData, PmsmInput, PmsmModel};
use crate::rig::{Rig, RigModel};
use crate::shaft::{Coupled, HELD_NM, Motion, PendingStep, Push, Turned};
use crate::thermal::reading_c;

/// Assumed: what a seized bearing holds against, far more than the motor or the load through the gear gives.
const SEIZED_NM: f64 = 100.0;

/// What never changes about a joint and the power stage it is built with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMotorModel {
    /// The name it is published under.
    pub name: &'static str,
    /// Rated torque of the motor alone.
    pub rated_torque_nm: f64,
    /// Winding and magnets.
    pub pmsm: PmsmModel,
    /// Inertia and friction of the motor, wave generator included.
    pub rotor: RotorModel,
    /// Harmonic gear.
    pub gear: GearModel,
    /// Encoder on the motor's shaft.
    pub encoder: AbsoluteEncoderModel,
    /// Holding brake on the motor's shaft.
    pub brake: BrakeModel,
    /// Warm bodies, power stage and supply; the supply's bleeder is the external discharge module.
    pub rig: RigModel,
    /// What limits the voltage of the bus.
    pub clamp: ClampModel,
    /// Temperature of the heat sink at which the power stage melts through.
    pub power_stage_limit_c: f64,
    /// Speed at which the wave generator's bearing seizes.
    pub bearing_limit_rad_s: f64,
}

/// What the drive does during one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Actuation {
    /// The three half bridges.
    pub inverter: Inverter,
    /// The holding brake has current and lets go.
    pub brake_released: bool,
    /// Command to the encoder: the present position is the origin.
    pub set_origin: bool,
}

/// What the drive's sensors read at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sensors {
    /// Counts of the motor's shaft from the origin, turns included.
    pub position_counts: i32,
    /// The encoder has lost its turns: the position is within one turn.
    pub turns_lost: bool,
    /// The encoder's battery.
    pub battery: BatteryState,
    /// Currents of U, V, W, positive into the motor.
    pub phase_current_a: [f64; 3],
    /// Voltage of the bus capacitor.
    pub bus_v: f64,
    /// Temperature of the winding, in the steps of [`reading_c`].
    pub winding_c: f64,
    /// Temperature of the power stage's heat sink, likewise.
    pub heat_sink_c: f64,
}

/// A joint that runs.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMotor {
    /// Its constants.
    pub model: JointMotorModel,
    /// Winding current.
    pub pmsm: PmsmData,
    /// Angle and velocity of the motor's shaft.
    pub rotor: RotorData,
    /// Twist of the gear and velocity of the output.
    pub gear: GearData,
    /// Counter of turns and its battery.
    pub encoder: AbsoluteEncoderData,
    /// A motor wire that has come off.
    pub lost_phase: Option<Phase>,
    /// An external discharge module is wired to the bus, and conducts above this voltage.
    pub discharge_from_v: Option<f64>,
    /// The pull of the magnets at the teeth; none unless it is asked for.
    pub cogging: Option<Cogging>,
    /// Load, supply, temperatures and energies. A locked load holds the output. Friction includes all of the gear's; the
    /// encoder's battery is not in the book.
    pub rig: Rig,
    /// Torque of the motor on its rotor, mean over the last step, cogging included.
    pub torque_nm: f64,
    axis: Axis,
    power_stage_burnt: bool,
    seized: bool,
}

impl JointMotor {
    /// A joint at rest with its motor's shaft at an angle, its battery full, its bus charged from a source of
    /// `source_v`, all at `ambient_c`.
    pub fn new(model: JointMotorModel, motor_angle: Angle, source_v: f64, ambient_c: f64) -> Self {
        JointMotor {
            model,
            pmsm: PmsmData::default(),
            rotor: RotorData { angle: motor_angle, ..RotorData::default() },
            gear: model.gear.at_rest(motor_angle),
            encoder: model.encoder.with_full_battery(),
            lost_phase: None,
            discharge_from_v: None,
            cogging: None,
            rig: Rig::new(&model.rig, model.pmsm.resistance_ohm, source_v, ambient_c),
            torque_nm: 0.0,
            axis: Axis::at_turns(model.pmsm.electrical_turns(motor_angle)),
            power_stage_burnt: false,
            seized: false,
        }
    }

    /// One step: winding, both sides of the gear, bus, energies, and now and then heat and battery. Meant for 50 µs
    /// and less.
    #[inline]
    pub fn step(&mut self, dt_s: f64, actuation: &Actuation) {
        let model = &self.model;
        let electrical_s = dt_s * f64::from(model.pmsm.pole_pairs);
        // The winding goes by the velocity that is expected in the middle of the step, the angle by the real one.
        let velocity_rad_s = self.rotor.velocity_rad_s + 0.5 * self.rotor.velocity_change_rad_s;
        let input = PmsmInput {
            terminals: self.inverter(actuation).terminals(self.rig.supply.bus_v),
            lost_phase: self.lost_phase,
            resistance_ohm: self.rig.path_ohm(&model.rig),
            axis: self.axis.turned_by(Axis::at_small_rad(0.5 * electrical_s * velocity_rad_s)),
            velocity_rad_s,
        };
        let motor = model.pmsm.step(&mut self.pmsm, dt_s, &input);
        // A seized bearing is a brake that nothing lets go of.
        let seized_nm = if self.seized { SEIZED_NM } else { 0.0 };
        let brake_nm = model.brake.torque_nm(actuation.brake_released) + seized_nm;
        let motor_nm = motor.torque_nm + self.cogging.map_or(0.0, |cogging| cogging.torque_nm(self.rotor.angle));
        let clamp_w = model.clamp.power_w(self.rig.supply.bus_v);
        let mut flows = motor.flows(0.0, 0.0);
        flows.bus_w += clamp_w;
        flows.arc_j += clamp_w * dt_s;
        self.torque_nm = motor_nm;
        let pending = PendingStep { flows, motor_nm, dt_s, bleeder_on: self.is_discharging() };
        if self.rig.is_joined() {
            self.step_joined(pending, brake_nm);
        } else {
            let shafts = GearInput { motor_nm, brake_nm, load: &self.rig.load };
            let moved = model.gear.step(&mut self.gear, &model.rotor, &mut self.rotor, dt_s, &shafts);
            let (mean_rad_s, friction_j) = (moved.motor_velocity_rad_s, moved.friction_j);
            self.finish(pending, &Turned { mean_rad_s, friction_j, load_j: moved.load_j });
        }
        if actuation.set_origin {
            self.model.encoder.set_origin(&mut self.encoder, self.rotor.angle);
        }
    }

    /// A step of a supervision period: see [`HubMotor::step_long`](crate::HubMotor::step_long).
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
        self.power_stage_burnt
            || supply.bus_v > self.model.clamp.from_v
            || self.discharge_from_v.is_some()
            || self.model.rig.supply.is_stiff(supply, dt_s)
    }

    /// Bus, energies and the magnets' direction, and now and then the slow things.
    #[inline(always)]
    fn finish(&mut self, pending: PendingStep, turned: &Turned) {
        let PendingStep { mut flows, dt_s, bleeder_on, .. } = pending;
        let turn_rad = dt_s * f64::from(self.model.pmsm.pole_pairs) * turned.mean_rad_s;
        self.axis = self.axis.turned_by(Axis::at_small_rad(turn_rad));
        (flows.friction_j, flows.load_j) = (turned.friction_j, turned.load_j);
        if self.rig.step(&self.model.rig, dt_s, &flows, bleeder_on) {
            self.step_slow();
        }
    }

    /// The mechanical half of a step of an output that is not a plain one.
    #[cold]
    #[inline(never)]
    fn step_joined(&mut self, pending: PendingStep, brake_nm: f64) {
        let JointMotorModel { gear: gear_model, rotor: rotor_model, .. } = &self.model;
        let angle = gear_model.output_angle(&self.gear, self.rotor.angle);
        if self.rig.is_coupled() {
            let push = self.push(&pending, angle, brake_nm);
            self.rig.coupled = Some(Coupled { push, pending });
            return;
        }
        let what = self.rig.attachment();
        let before = (self.rotor, self.gear);
        let at = (angle, self.gear.output_velocity_rad_s);
        let ((moved, out), work) = what.step(&self.rig.load, at, pending.dt_s, |load| {
            let (mut rotor, mut gear) = before;
            let input = GearInput { motor_nm: pending.motor_nm, brake_nm, load };
            let out = gear_model.step(&mut gear, rotor_model, &mut rotor, pending.dt_s, &input);
            (out.output_velocity_rad_s, ((rotor, gear), out))
        });
        (self.rotor, self.gear) = moved;
        let friction_j = out.friction_j + out.load_j - work.stored_j - work.load_j;
        self.finish(pending, &Turned { mean_rad_s: out.motor_velocity_rad_s, friction_j, load_j: work.load_j });
    }

    /// What a coupled joint does to its machine. Its gear is taken as stiff there: what is wound up in it stays.
    fn push(&self, pending: &PendingStep, angle: Angle, brake_nm: f64) -> Push {
        let JointMotorModel { gear, rotor, .. } = &self.model;
        let ratio = gear.ratio;
        let load = self.rig.expected_load(angle, self.rotor.velocity_rad_s / ratio, pending.dt_s);
        let held_nm = if load.locked { HELD_NM } else { 0.0 };
        let output_dry_nm = load.coulomb_nm + gear.output_coulomb_nm + gear.mesh_loss * self.gear.torque_nm.abs();
        Push {
            velocity_rad_s: self.rotor.velocity_rad_s,
            torque_nm: pending.motor_nm - load.torque_nm / ratio,
            inertia_kg_m2: rotor.inertia_kg_m2 + (gear.output_inertia_kg_m2 + load.inertia_kg_m2) / (ratio * ratio),
            dry_nm: rotor.coulomb_nm + gear.coulomb_nm + brake_nm + held_nm + output_dry_nm / ratio,
            viscous_nm_s: rotor.viscous_nm_s + gear.viscous_nm_s + load.viscous_nm_s / (ratio * ratio),
        }
    }

    /// The discharge module conducts.
    #[inline]
    fn is_discharging(&self) -> bool {
        self.discharge_from_v.is_some_and(|from_v| self.rig.supply.bus_v > from_v)
    }

    /// What the bridge does: molten switches join the wires, whatever the drive wants.
    #[inline]
    fn inverter(&self, actuation: &Actuation) -> Inverter {
        if self.power_stage_burnt { Inverter::Shorted } else { actuation.inverter }
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

    /// The wave generator's bearing has seized: the motor's shaft stands.
    pub fn is_seized(&self) -> bool {
        self.seized
    }

    /// A new reducer, wave generator and all: nothing is seized, nothing has slipped.
    pub fn replace_reducer(&mut self) {
        self.seized = false;
        self.gear.forget_damage();
    }

    /// Heat of the last steps into the bodies, the winding's resistance, the encoder's battery, and the magnets'
    /// direction afresh.
    fn step_slow(&mut self) {
        let model = &self.model;
        let time_s = self.rig.step_slow(&model.rig, model.pmsm.resistance_ohm);
        let heat_sink = &self.rig.heat_sink;
        let melts = heat_sink.hold_c.is_none() && heat_sink.temperature_c > model.power_stage_limit_c;
        if melts || (self.power_stage_burnt && self.rig.supply.connected) {
            self.burn_power_stage();
        }
        let model = &self.model;
        self.seized |= self.rotor.velocity_rad_s.abs() > model.bearing_limit_rad_s;
        let powered = self.rig.supply.bus_v > model.rig.supply.consumption_from_v;
        model.encoder.step(&mut self.encoder, time_s, self.rotor.angle, powered);
        self.axis = Axis::at_turns(model.pmsm.electrical_turns(self.rotor.angle));
        model.gear.align(&mut self.gear, self.rotor.angle);
    }

    /// What the sensors read now.
    #[inline]
    pub fn sense(&self) -> Sensors {
        Sensors {
            position_counts: self.model.encoder.position_counts(&self.encoder, self.rotor.angle),
            turns_lost: self.encoder.turns_lost,
            battery: self.model.encoder.battery_state(&self.encoder),
            phase_current_a: self.phase_current_a(),
            bus_v: self.rig.supply.bus_v,
            winding_c: reading_c(self.rig.winding.temperature_c),
            heat_sink_c: reading_c(self.rig.heat_sink.temperature_c),
        }
    }

    /// Currents out of the bridges into the wires.
    #[inline]
    pub fn phase_current_a(&self) -> [f64; 3] {
        self.model.pmsm.phase_current_a(&self.pmsm, self.axis)
    }

    /// The output's angle: the truth behind the gear.
    pub fn output_angle(&self) -> Angle {
        self.model.gear.output_angle(&self.gear, self.rotor.angle)
    }

    /// Energy stored now: in motion, in the gear's spring, in the winding's field and in the bus capacitor.
    pub fn stored_j(&self) -> f64 {
        let JointMotorModel { gear, rotor, pmsm, rig, .. } = &self.model;
        let what = self.rig.attachment();
        let load = Load { inertia_kg_m2: what.inertia_kg_m2(&self.rig.load), ..self.rig.load };
        gear.kinetic_energy_j(&self.gear, rotor, &self.rotor, &load)
            + what.energy_j(self.output_angle())
            + gear.spring_energy_j(&self.gear)
            + pmsm.magnetic_energy_j(&self.pmsm)
            + rig.supply.stored_energy_j(&self.rig.supply)
            + self.cogging.map_or(0.0, |cogging| cogging.energy_j(self.rotor.angle))
    }
}

impl Motor for JointMotor {
    type Pins = Actuation;
    /// Power stage, turns of the encoder, its battery.
    type Wear = (bool, bool, BatteryState);

    motor::parts!(JointMotor);

    fn pmsm_model(&self) -> Option<&PmsmModel> {
        Some(&self.model.pmsm)
    }

    /// The load is behind the reducer.
    fn physics(&self) -> Physics {
        Physics {
            motor_torque_nm: self.torque_nm,
            phase_current_a: self.sense().phase_current_a.map(Some),
            stored_j: self.stored_j(),
            ..Physics::of_rig(&self.rig, (self.output_angle(), self.gear.output_velocity_rad_s))
        }
    }

    fn bleeds(&self, _pins: &Actuation) -> bool {
        self.is_discharging()
    }

    fn wear(&self) -> Self::Wear {
        (self.power_stage_burnt, self.encoder.turns_lost, self.model.encoder.battery_state(&self.encoder))
    }

    fn follow(&mut self, motion: &Motion) {
        let dry_nm = self.rig.push().map_or(0.0, |push| push.dry_nm);
        let output_dry_nm = self.rig.load.coulomb_nm + self.model.gear.output_coulomb_nm;
        let Some((pending, turned)) = self.rig.follow(&mut self.rotor, motion) else { return };
        let JointMotorModel { rotor, gear, .. } = &self.model;
        let ratio = gear.ratio;
        // What the motor's side does not take goes through the gear. Of the friction it takes its share: motor, brake and teeth.
        let gained_nm = rotor.inertia_kg_m2 * self.rotor.velocity_change_rad_s / pending.dt_s;
        let viscous_nm = (rotor.viscous_nm_s + gear.viscous_nm_s) * motion.mean_rad_s;
        let share = if dry_nm > 0.0 { 1.0 - output_dry_nm / ratio / dry_nm } else { 0.0 };
        let dry_nm = motion.dry_nm * share;
        self.gear.output_velocity_rad_s = motion.velocity_rad_s / ratio;
        let torque_nm = ratio * (pending.motor_nm - gained_nm - viscous_nm - dry_nm);
        self.gear.torque_nm = torque_nm;
        self.model.gear.watch_strength(&mut self.gear, torque_nm);
        self.finish(pending, &turned);
    }

    /// To the output. It has a gear already: none is taken from `what`.
    fn attach(&mut self, what: Attachment) {
        let angle = self.output_angle();
        self.rig.attach(Attachment { gear: None, ..what }, &self.model.rotor, angle);
    }

    fn load_angle(&self) -> Angle {
        self.output_angle()
    }
}

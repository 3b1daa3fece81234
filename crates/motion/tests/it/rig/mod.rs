//! A motor of crate `plant` under the loops of crate `motion`, with gains for it.

use motion::Point;
use motion::cascade::{Cascade, CascadeGains, PositionDemand, VelocityDemand};
use motion::commutation::{Commutation, CommutationModel};
use motion::filter::{LowPass, LowPassGains};
use motion::foc::{FeedForward, Foc, FocGains, FocInput};
use motion::frames::Dq;
use motion::observer::{Observer, ObserverGains};
use motion::pid::PiGains;
use plant::angle::Angle;
use plant::{Actuation, HubMotor, HubMotorModel, Inverter, Sensors};

/// Period of the current loop.
pub(crate) const DT_S: f32 = 50e-6;
/// Current periods to one of the velocity and position loops.
pub(crate) const AT_4_KHZ: u32 = 5;
pub(crate) const AT_1_KHZ: u32 = 20;
pub(crate) const COUNTS_PER_TURN: f64 = 4096.0;
const COUNT_RAD: f32 = core::f32::consts::TAU / 4096.0;
const CURRENT_LIMIT_A: f32 = 15.0;

pub(crate) fn rad_s(r_min: f32) -> f32 {
    r_min * core::f32::consts::TAU / 60.0
}

pub(crate) struct Rig {
    pub(crate) motor: HubMotor,
    pub(crate) velocity_rad_s: f32,
    foc_gains: FocGains,
    cascade_gains: CascadeGains,
    observer_gains: ObserverGains,
    smooth: LowPassGains,
    commutation_model: CommutationModel,
    foc: Foc,
    cascade: Cascade,
    observer: Observer,
    filter: LowPass,
    commutation: Commutation,
    setpoint_a: f32,
    outer_every: u32,
    ticks: u32,
}

impl Rig {
    /// A ZLLG65ASM250-L on 48 V, somewhere within a turn; outer loops once in so many periods.
    pub(crate) fn new(outer_every: u32) -> Self {
        Rig::with_motor(HubMotorModel::ZLLG65ASM250_L, outer_every)
    }

    /// Any motor on 48 V, its gains derived from its own constants.
    pub(crate) fn with_motor(model: HubMotorModel, outer_every: u32) -> Self {
        let motor = HubMotor::new(model, Angle::new(0, 0.123), 48.0, 25.0);
        let resistance_ohm = (model.pmsm.resistance_ohm + model.rig.switch_resistance_ohm) as f32;
        let inductance_h = model.pmsm.inductance_q_h as f32;
        let torque_constant = model.pmsm.torque_constant_nm_a() as f32;
        let current = PiGains::for_winding(3000.0, resistance_ohm, inductance_h);
        let inertia = model.rotor.inertia_kg_m2 as f32;
        let commutation_model = CommutationModel {
            counts_per_turn: model.encoder.counts_per_turn(),
            pole_pairs: model.pmsm.pole_pairs,
            offset_turns: 0.0,
            sequence: plant::hall::FORWARD_SEQUENCE,
        };
        let sensors = motor.sense();
        Rig {
            foc_gains: FocGains {
                d: current,
                q: current,
                feed_forward: Some(FeedForward {
                    inductance_d_h: inductance_h,
                    inductance_q_h: inductance_h,
                    flux_linkage_wb: model.pmsm.flux_linkage_wb as f32,
                }),
                modulation_limit: 0.95,
                voltage_delay_s: 0.5 * DT_S,
            },
            cascade_gains: CascadeGains {
                position_per_s: 20.0,
                velocity_feed_forward: 1.0,
                velocity: PiGains::for_inertia(70.0, inertia, torque_constant, 8.0),
                acceleration_feed_forward: inertia / torque_constant,
                friction_feed_forward: 0.0,
                velocity_limit_rad_s: rad_s(1100.0),
            },
            observer_gains: ObserverGains::new(2e-3, 0.2, DT_S),
            smooth: LowPassGains::from_time_constant(0.5e-3, DT_S),
            foc: Foc::default(),
            cascade: Cascade::default(),
            observer: Observer::new(sensors.encoder_count),
            filter: LowPass::default(),
            commutation: Commutation::new(&commutation_model, sensors.hall, sensors.encoder_count),
            commutation_model,
            motor,
            velocity_rad_s: 0.0,
            setpoint_a: 0.0,
            outer_every,
            ticks: 0,
        }
    }

    /// Turns the shaft by hand over a Hall border, so that the commutation angle is exact.
    pub(crate) fn align(&mut self) {
        let locked = core::mem::take(&mut self.motor.rig.load.locked);
        self.motor.rotor.velocity_rad_s = 4.0;
        for _ in 0..2000 {
            self.motor.step(f64::from(DT_S), &Actuation { brake_released: true, ..Actuation::default() });
            let Sensors { hall, encoder_count, .. } = self.motor.sense();
            self.commutation.update(&self.commutation_model, hall, encoder_count);
            self.observer.update(&self.observer_gains, encoder_count);
        }
        assert!(self.commutation.is_aligned());
        self.motor.rig.load.locked = locked;
    }

    /// Counts since power-on.
    pub(crate) fn position(&self) -> i32 {
        self.observer.position()
    }

    /// A planner's point in counts as a demand, after so many counts.
    pub(crate) fn demand(&self, point: Point, travelled: f64) -> PositionDemand {
        PositionDemand {
            error_rad: (point.position - travelled) as f32 * COUNT_RAD,
            velocity_rad_s: point.velocity as f32 * COUNT_RAD,
            acceleration_rad_s2: point.acceleration as f32 * COUNT_RAD,
        }
    }

    pub(crate) fn tick_position(&mut self, demand: &PositionDemand) {
        if self.ticks.is_multiple_of(self.outer_every) {
            let dt_s = self.outer_every as f32 * DT_S;
            let (gains, velocity) = (&self.cascade_gains, self.velocity_rad_s);
            self.setpoint_a = self.cascade.position(gains, demand, velocity, CURRENT_LIMIT_A, dt_s);
        }
        self.tick_current(self.setpoint_a);
    }

    pub(crate) fn tick_velocity(&mut self, demand: &VelocityDemand) {
        if self.ticks.is_multiple_of(self.outer_every) {
            let dt_s = self.outer_every as f32 * DT_S;
            let (gains, velocity) = (&self.cascade_gains, self.velocity_rad_s);
            self.setpoint_a = self.cascade.velocity(gains, demand, velocity, CURRENT_LIMIT_A, dt_s);
        }
        self.tick_current(self.setpoint_a);
    }

    pub(crate) fn tick_current(&mut self, q_a: f32) {
        let sensors = self.motor.sense();
        let turns = self.commutation.update(&self.commutation_model, sensors.hall, sensors.encoder_count);
        let counts = self.observer.update(&self.observer_gains, sensors.encoder_count);
        self.velocity_rad_s = self.filter.update(&self.smooth, counts * COUNT_RAD / DT_S);
        let input = FocInput {
            phase_current_a: sensors.phase_current_a.map(|a| a as f32),
            electrical_turns: turns,
            electrical_rad_s: self.velocity_rad_s * self.commutation_model.pole_pairs as f32,
            bus_v: sensors.bus_v as f32,
        };
        let out = self.foc.tick(&self.foc_gains, Dq { d: 0.0, q: q_a }, &input, DT_S);
        let actuation =
            Actuation { inverter: Inverter::Driven(out.duty.map(f64::from)), bleeder_on: false, brake_released: true };
        self.motor.step(f64::from(DT_S), &actuation);
        self.ticks += 1;
    }
}

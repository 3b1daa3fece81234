//! Constants of the four M-series joints: M4230E17B50, M4230E17B80, M8025E25B50, M8025E25B80.
//!
//! Figures are those of the M robot joint motor CANopen manual, "Parameters", unless named otherwise. How its table
//! is read, since it does not say:
//!
//! **Rated current** (3.5 A, 7 A) is the r.m.s. current of a phase at the motor's torque (1 N m, 2 N m), as is usual in
//! tables of servo motors: `Kt = torque / (sqrt(2) * current)` is 0.202 N m for each ampere of q current in both. The
//! copper loss at it is 16 and 39 W.
//!
//! **Resistance and inductance** are between two wires; a phase has half.
//!
//! **Maximum speed** (2000, 1500 r/min). The amplitude of the line-to-line back-emf equals 36 V at 1474 r/min in both
//! motors; beyond, the drive weakens the field, which 2604h names. The M8025's 1000 r/min at rated torque need none.
//!
//! **Losses.** 34 of 50 N m, 51 of 80, 51 of 100 and 85 of 160 N m come out; what the unloaded friction does not explain
//! is the loss in the teeth.
//!
//! **Gear.** "E17" and "E25" are sizes of harmonic gears: the M8025E25B50's 51 and 127 N m are the rated and repeated
//! peak torque of a Harmonic Drive CSG-25-50. The stiffness is that of robot joints with such gears.
//!
//! What is assumed is a named constant with its reason.

use crate::absolute_encoder::AbsoluteEncoderModel;
use crate::brake::BrakeModel;
use crate::clamp::ClampModel;
use crate::gear::GearModel;
use crate::joint_motor::JointMotorModel;
use crate::mechanics::{RAD_S_PER_RPM, RotorModel};
use crate::pmsm::PmsmModel;
use crate::rig::RigModel;
use crate::supply::{BleederModel, SupplyModel};
use crate::thermal::{BodyModel, COPPER_PER_K};

/// Assumed: "multistage DD motor structure" is a multi-pole direct-drive motor, and 36 slots with 42 poles are its usual
/// winding. With the printed inductance, a d current of 5 A then takes the unloaded M4230 to its 2000 r/min; fewer
/// poles would need more than the drive's 10 A (r.m.s.) allow at an advance of 20 degrees, the end of 2604h.
const POLE_PAIRS: u32 = 21;

/// Assumed: motor and unloaded gear take 8 % of the motor's rated torque at rated speed, which leaves most of the loss to
/// the teeth, as in harmonic gears.
const NO_LOAD_SHARE: f64 = 0.08;
/// Assumed: half of it is dry, as for the hub motors.
const DRY_SHARE: f64 = 0.5;
/// Assumed: half of it is the motor's bearings, seals and iron, half the gear's.
const MOTOR_SHARE: f64 = 0.5;

/// "Backspace: less than 20 arc seconds"; the bound is taken. At the output.
const BACKLASH_RAD: f64 = 20.0 / 3600.0 * core::f64::consts::PI / 180.0;
/// Assumed: damping over stiffness of the torsion. The flexspline is steel and rings: with a load of 0.1 kg m² the two
/// masses of a size-17 joint swing at 66 Hz, and this damps them by 1 % of critical.
const TORSION_DAMPING_S: f64 = 50e-6;

/// Stiffness of joints with a size-17 gear: 14000 N m/rad (Rainbow Robotics RB-Y1 joint specification, type 17). That
/// is for a ratio of 101, taken for 80 too. Assumed: at 50, whose teeth carry less, a fifth less.
const SIZE_17_STIFFNESS_NM_RAD: [f64; 2] = [1.1e4, 1.4e4];
/// Positioning accuracy of size 17 from a ratio of 50 on, 1.5 arc minutes from end to end; the amplitude is half of it.
/// Catalogue of Harmonic Drive's CSF and CSG gears, table 40.
const SIZE_17_ERROR_RAD: f64 = 0.5 * 4.4e-4;
/// The same of size 25: 1 arc minute.
const SIZE_25_ERROR_RAD: f64 = 0.5 * 2.9e-4;
/// Ratcheting torque of the CSG series, size 17 at ratios of 50 and 80: the same catalogue, table 6.
const SIZE_17_RATCHET_NM: [f64; 2] = [190.0, 260.0];
/// The same of size 25.
const SIZE_25_RATCHET_NM: [f64; 2] = [580.0, 880.0];
/// The same for size 25: 50000 N m/rad (type 25). Assumed: at 50 a third less.
const SIZE_25_STIFFNESS_NM_RAD: [f64; 2] = [3.4e4, 5.0e4];
/// Assumed: the flange and cross-roller ring as a steel disc of 0.15 kg and 30 mm radius: `m r^2 / 2`.
const SIZE_17_FLANGE_KG_M2: f64 = 7e-5;
/// Assumed: 0.4 kg and 43 mm.
const SIZE_25_FLANGE_KG_M2: f64 = 3.7e-4;

/// "Maximum permissible temperature of motor 85°" at the highest ambient of 40 °C, at rated torque.
const TEMPERATURE_RISE_K: f64 = 45.0;
/// Assumed: half of the weight is copper and iron, at about 420 J/(kg K).
const WINDING_HEAT_J_KG_K: f64 = 210.0;

/// Assumed: one switch of 5 mohm in each phase's path, 5 mohm of board.
const SWITCH_RESISTANCE_OHM: f64 = 0.01;
/// Assumed: the board on the aluminium back cover; 5 W warm it by 20 K.
const HEAT_SINK: BodyModel = BodyModel { resistance_k_w: 4.0, capacity_j_k: 100.0 };

const ENCODER: AbsoluteEncoderModel = AbsoluteEncoderModel {
    // "Single-loop 15 bit".
    counts_per_turn: 32_768,
    // "Multi-turn memory range -60000 ~ 60000 laps" (the table's 9 bits would be 512 turns).
    turn_limit: 60_000,
    // Assumed: a small rechargeable cell; full, it lasts 24 days.
    battery_capacity_mah: 40.0,
    // Assumed: a tenth of the capacity an hour, what such cells stand for ever.
    charge_current_ma: 4.0,
    // "The battery current consumption is only 0.07 mA".
    standby_current_ma: 0.07,
};

const SUPPLY: SupplyModel = SupplyModel {
    // Assumed: power supply with cable.
    source_resistance_ohm: 0.1,
    // Assumed: a 36 V supply of 600 W, which is rated 16.6 A and limits at 120 % of it.
    source_limit_a: 20.0,
    // What is at the supply's output is of the machine that the joint is in.
    source_capacitance_f: 0.0,
    // Assumed: what fits into the joint.
    capacitance_f: 470e-6,
    // Assumed: controller, drivers, encoder; as much as the drive of a wheel motor takes.
    consumption_w: 3.0,
    // Assumed: where the drive's own converter stops.
    consumption_from_v: 9.0,
    // The "discharge module" that the manual asks for when generation raises the voltage. Assumed: 10 ohm, 50 W.
    bleeder: BleederModel { resistance_ohm: 10.0, rated_power_w: 50.0, time_constant_s: 30.0, burn_out_load: 2.0 },
};

/// Assumed: the highest input speeds with grease that makers of harmonic gears print for sizes 17 and 25.
const SIZE_17_INPUT_R_MIN: f64 = 7300.0;
const SIZE_25_INPUT_R_MIN: f64 = 5600.0;

/// Assumed: a transient suppressor of 58 V stand-off, the first of the usual row above the 52 V of the alarm. The data
/// sheets of 1.5 kW types have 64.4 to 71.2 V at 1 mA, and 93.6 V at 16.1 A.
const CLAMP: ClampModel = ClampModel { from_v: 67.8, resistance_ohm: (93.6 - 67.8) / 16.1 };

/// Assumed: the absolute maximum of the junctions of power MOSFETs, by their data sheets.
const POWER_STAGE_LIMIT_C: f64 = 175.0;

impl JointMotorModel {
    /// 34 N m, 0 to 30 r/min.
    pub const M4230E17B50: JointMotorModel = joint("M4230E17B50", M4230, E17B50);
    /// 51 N m, 0 to 15 r/min.
    pub const M4230E17B80: JointMotorModel = joint("M4230E17B80", M4230, E17B80);
    /// 51 N m, 0 to 30 r/min.
    pub const M8025E25B50: JointMotorModel = joint("M8025E25B50", M8025, E25B50);
    /// 85 N m, 0 to 18 r/min.
    pub const M8025E25B80: JointMotorModel = joint("M8025E25B80", M8025, E25B80);

    /// The variant with a holding brake (the manual's special functions 7 and 8 are for it). Assumed: it holds the
    /// motor's rated torque, as power-off brakes are chosen.
    pub const fn with_brake(self) -> JointMotorModel {
        JointMotorModel { brake: BrakeModel { holding_nm: self.rated_torque_nm }, ..self }
    }
}

/// A row of the table: the motor.
#[derive(Clone, Copy)]
struct Motor {
    torque_nm: f64,
    /// Of a phase, r.m.s., at this torque.
    current_a: f64,
    rated_r_min: f64,
    /// Of one phase: half of what is printed.
    resistance_ohm: f64,
    inductance_h: f64,
    inertia_kg_m2: f64,
    weight_kg: f64,
    flange_kg_m2: f64,
}

const M4230: Motor = Motor {
    torque_nm: 1.0,
    current_a: 3.5,
    rated_r_min: 1500.0,
    resistance_ohm: 0.5 * 0.86,
    inductance_h: 0.5 * 0.8e-3,
    inertia_kg_m2: 0.69e-4,
    weight_kg: 1.0,
    flange_kg_m2: SIZE_17_FLANGE_KG_M2,
};

const M8025: Motor = Motor {
    torque_nm: 2.0,
    current_a: 7.0,
    rated_r_min: 1000.0,
    resistance_ohm: 0.5 * 0.53,
    inductance_h: 0.5 * 0.5e-3,
    inertia_kg_m2: 1.74e-4,
    weight_kg: 2.5,
    flange_kg_m2: SIZE_25_FLANGE_KG_M2,
};

/// A row of the table: the reducer.
#[derive(Clone, Copy)]
struct Reducer {
    ratio: f64,
    /// "Output rated torque", which the motor's torque gives at its rated speed: that gives the loss in the teeth.
    output_nm: f64,
    /// "Peak start-stop torque".
    peak_nm: f64,
    stiffness_nm_rad: f64,
    error_rad: f64,
    ratchet_nm: f64,
    input_limit_r_min: f64,
}

const E17B50: Reducer = Reducer {
    ratio: 50.0,
    output_nm: 34.0,
    peak_nm: 44.0,
    stiffness_nm_rad: SIZE_17_STIFFNESS_NM_RAD[0],
    error_rad: SIZE_17_ERROR_RAD,
    ratchet_nm: SIZE_17_RATCHET_NM[0],
    input_limit_r_min: SIZE_17_INPUT_R_MIN,
};

const E17B80: Reducer = Reducer {
    ratio: 80.0,
    output_nm: 51.0,
    peak_nm: 70.0,
    stiffness_nm_rad: SIZE_17_STIFFNESS_NM_RAD[1],
    error_rad: SIZE_17_ERROR_RAD,
    ratchet_nm: SIZE_17_RATCHET_NM[1],
    input_limit_r_min: SIZE_17_INPUT_R_MIN,
};

const E25B50: Reducer = Reducer {
    ratio: 50.0,
    output_nm: 51.0,
    peak_nm: 127.0,
    stiffness_nm_rad: SIZE_25_STIFFNESS_NM_RAD[0],
    error_rad: SIZE_25_ERROR_RAD,
    ratchet_nm: SIZE_25_RATCHET_NM[0],
    input_limit_r_min: SIZE_25_INPUT_R_MIN,
};

const E25B80: Reducer = Reducer {
    ratio: 80.0,
    output_nm: 85.0,
    peak_nm: 178.0,
    stiffness_nm_rad: SIZE_25_STIFFNESS_NM_RAD[1],
    error_rad: SIZE_25_ERROR_RAD,
    ratchet_nm: SIZE_25_RATCHET_NM[1],
    input_limit_r_min: SIZE_25_INPUT_R_MIN,
};

/// A motor with a gear.
const fn joint(name: &'static str, motor: Motor, reducer: Reducer) -> JointMotorModel {
    let Reducer { ratio, output_nm, stiffness_nm_rad, .. } = reducer;
    let torque_constant_nm_a = motor.torque_nm / (core::f64::consts::SQRT_2 * motor.current_a);
    let flux_linkage_wb = torque_constant_nm_a / (1.5 * POLE_PAIRS as f64);
    let copper_w = 3.0 * motor.current_a * motor.current_a * motor.resistance_ohm;
    let no_load_nm = NO_LOAD_SHARE * motor.torque_nm;
    let dry_nm = DRY_SHARE * no_load_nm;
    let viscous_nm_s = (1.0 - DRY_SHARE) * no_load_nm / (motor.rated_r_min * RAD_S_PER_RPM);
    // The gear's dry share is at its output, behind the spring: the output's hysteresis is twice that over the stiffness,
    // 0.6 and 0.4 arc minutes at a ratio of 50. Catalogues of such gears have one to two.
    let output_dry_nm = (1.0 - MOTOR_SHARE) * dry_nm * ratio;
    let lost_before_teeth_nm = no_load_nm - (1.0 - MOTOR_SHARE) * dry_nm;
    JointMotorModel {
        name,
        rated_torque_nm: motor.torque_nm,
        pmsm: PmsmModel {
            pole_pairs: POLE_PAIRS,
            resistance_ohm: motor.resistance_ohm,
            // One figure is printed for both axes: surface magnets.
            inductance_d_h: motor.inductance_h,
            inductance_q_h: motor.inductance_h,
            flux_linkage_wb,
        },
        rotor: RotorModel {
            inertia_kg_m2: motor.inertia_kg_m2,
            viscous_nm_s: MOTOR_SHARE * viscous_nm_s,
            coulomb_nm: MOTOR_SHARE * dry_nm,
        },
        gear: GearModel {
            ratio,
            stiffness_nm_rad,
            damping_nm_s_rad: TORSION_DAMPING_S * stiffness_nm_rad,
            backlash_rad: BACKLASH_RAD,
            output_inertia_kg_m2: motor.flange_kg_m2,
            coulomb_nm: 0.0,
            viscous_nm_s: (1.0 - MOTOR_SHARE) * viscous_nm_s,
            mesh_loss: ratio * (motor.torque_nm - lost_before_teeth_nm) / (output_nm + output_dry_nm) - 1.0,
            output_coulomb_nm: output_dry_nm,
            kinematic_error_rad: reducer.error_rad,
            rated_nm: output_nm,
            peak_nm: reducer.peak_nm,
            ratchet_nm: reducer.ratchet_nm,
        },
        encoder: ENCODER,
        brake: BrakeModel { holding_nm: 0.0 },
        rig: RigModel {
            winding: BodyModel {
                resistance_k_w: TEMPERATURE_RISE_K / copper_w,
                capacity_j_k: WINDING_HEAT_J_KG_K * motor.weight_kg,
            },
            resistance_per_k: COPPER_PER_K,
            heat_sink: HEAT_SINK,
            switch_resistance_ohm: SWITCH_RESISTANCE_OHM,
            supply: SUPPLY,
        },
        clamp: CLAMP,
        power_stage_limit_c: POWER_STAGE_LIMIT_C,
        bearing_limit_rad_s: reducer.input_limit_r_min * RAD_S_PER_RPM,
    }
}

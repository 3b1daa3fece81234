//! Constants of published hub motors that fit the ZLAC8030L.
//!
//! Published figures and where they stand:
//!
//! | figure | value | source |
//! |---|---|---|
//! | pole pairs | 15 | ZLAC8030L quick start guide V1.00, object 200Ch; motor data header (below) |
//! | encoder lines | 1024 | same guide, object 200Bh; motor data header |
//! | phase resistance, inductance, torque constant | see the constants | `user_motor_database.h` of a Bear Robotics motor controller ("motor electrical parameter definitions") for ZLLG65ASM250-L and ZLLG65ASM250 |
//! | no-load speed 262 r/min at 24 V, efficiency 80.7 % at 1.77 N m, 19.15 N m at 23.08 A | | test sheet of the sister ZLLG80ASM250-L-24V, as quoted in ROS 2 monitor nodes for it |
//! | mass 3.75 kg, wheel diameter 173 mm | | ZLLG65ASM250 data sheet, as quoted in a simulator for it |
//! | rated 6 N m at 6 A, peak 18 A | | same |
//!
//! **Torque constant to flux linkage.** 24 V over 262 r/min (27.4 rad/s) is 0.875 V s/rad: the header's "torque
//! constant" 0.8791 is the constant of the equivalent direct-current motor, the amplitude of the line-to-line
//! back-emf per velocity. One phase has `1/sqrt(3)` of it, and `psi = K / (sqrt(3) * pole pairs)`. The torque per
//! ampere of q current follows: `3/2 * 15 * psi = 0.866 K`.
//!
//! What is assumed is a named constant with its reason.

use crate::brake::BrakeModel;
use crate::clamp::ClampModel;
use crate::encoder::EncoderModel;
use crate::hall::HallModel;
use crate::hub_motor::HubMotorModel;
use crate::mechanics::{RAD_S_PER_RPM, RotorModel};
use crate::pmsm::{PmsmModel, SQRT_3};
use crate::rig::RigModel;
use crate::supply::{BleederModel, SupplyModel};
use crate::thermal::{BodyModel, COPPER_PER_K};

const POLE_PAIRS: u32 = 15;

/// Disc of the published mass and wheel diameter: `m r^2 / 2 = 3.75 * 0.0865^2 / 2`.
const ROTOR_INERTIA_KG_M2: f64 = 0.014;

/// Friction and iron loss without load. Best efficiency is `(1 - sqrt(I0/Is))^2 = 0.807`, so `I0 = 0.0103 Is` with
/// the published `Is` = 23.08 A, times the published 19.15 N m / 23.08 A.
const NO_LOAD_TORQUE_NM: f64 = 0.198;
/// Speed that belongs to it: 262 r/min.
const NO_LOAD_VELOCITY_RAD_S: f64 = 27.4;
/// Assumed: dry friction's share of it. The test sheet gives only the sum; bearings and cogging do not grow with
/// speed, iron loss does.
const DRY_SHARE: f64 = 0.5;

/// Assumed: the rated current (6 A r.m.s., 27.5 W in 3 x 0.255 ohm) warms the winding to the drive's default limit
/// of 80 °C (object 2013h:01) from 25 °C, so 55 K / 27.5 W.
const WINDING_RESISTANCE_K_W: f64 = 2.0;
/// Assumed: 1.5 kg of the published 3.75 kg are stator, copper and iron, at about 420 J/(kg K).
const WINDING_CAPACITY_J_K: f64 = 630.0;

/// Assumed: one switch of 4 mohm in each phase's path, 4 mohm of board and cable.
const SWITCH_RESISTANCE_OHM: f64 = 0.008;
/// Assumed: aluminium housing of a palm's size; 10 W of switches and electronics warm it by 20 K.
const HEAT_SINK_RESISTANCE_K_W: f64 = 2.0;
/// Assumed: 0.3 kg of aluminium at 900 J/(kg K).
const HEAT_SINK_CAPACITY_J_K: f64 = 270.0;

/// Assumed: battery or power supply with cable.
const SOURCE_RESISTANCE_OHM: f64 = 0.05;
/// Assumed: what the protection circuit of a 48 V battery of some 20 Ah lets through, as a wheeled robot has one.
const SOURCE_LIMIT_A: f64 = 60.0;
/// Assumed: at the output of a 48 V supply of some 500 W. A bare wheel that brakes from its full speed at 48 V stays
/// under 76 V with it; a loaded one does not.
const SOURCE_CAPACITANCE_F: f64 = 8_000e-6;
/// Assumed: four electrolytics of 470 uF in the drive.
const BUS_CAPACITANCE_F: f64 = 1_880e-6;
/// Assumed: controller, gate drivers and encoder supply.
const CONSUMPTION_W: f64 = 3.0;
/// Assumed: where the drive's own converter stops.
const CONSUMPTION_FROM_V: f64 = 9.0;

/// Resistance and power: defaults of objects 202Eh:01 (5.0 ohm) and 202Eh:02 (100 W).
const BLEEDER: BleederModel = BleederModel {
    resistance_ohm: 5.0,
    rated_power_w: 100.0,
    // Assumed: wire-wound resistor in an aluminium housing.
    time_constant_s: 30.0,
    // Assumed: makers allow short overloads to some way above the rated warming.
    burn_out_load: 2.0,
};

const SUPPLY: SupplyModel = SupplyModel {
    source_resistance_ohm: SOURCE_RESISTANCE_OHM,
    source_limit_a: SOURCE_LIMIT_A,
    source_capacitance_f: SOURCE_CAPACITANCE_F,
    capacitance_f: BUS_CAPACITANCE_F,
    consumption_w: CONSUMPTION_W,
    consumption_from_v: CONSUMPTION_FROM_V,
    bleeder: BLEEDER,
};

/// Assumed: a transient suppressor of 78 V stand-off, the first of the usual row above the 75 V at which the drive reports
/// over-voltage. The data sheets of 1.5 kW types have 86.7 to 95.8 V at 1 mA, and 126 V at 11.9 A.
const CLAMP: ClampModel = ClampModel { from_v: 91.25, resistance_ohm: (126.0 - 91.25) / 11.9 };

/// Assumed: the absolute maximum of the junctions of power MOSFETs, by their data sheets. A heat sink that is as hot leaves
/// nothing to the junction.
const POWER_STAGE_LIMIT_C: f64 = 175.0;

/// Assumed: sealed ball bearings for a shaft of 20 mm (6204-2RS), whose makers limit them to 10,000 r/min.
const BEARING_LIMIT_RAD_S: f64 = 10_000.0 * RAD_S_PER_RPM;

impl HubMotorModel {
    /// ZLTECH ZLLG65ASM250-L, the 24 V to 48 V wheel motor: 0.761 N m/A, 261 r/min at 24 V, 521 r/min at 48 V.
    pub const ZLLG65ASM250_L: HubMotorModel = wheel_motor("ZLLG65ASM250-L", 0.255, 0.697e-3, 0.8791);

    /// ZLTECH ZLLG65ASM250, the fast winding of the same wheel motor: 0.297 N m/A, 669 r/min at 24 V, 1338 r/min at
    /// 48 V, so that it reaches the drive's 1000 r/min.
    pub const ZLLG65ASM250: HubMotorModel = wheel_motor("ZLLG65ASM250", 0.069_16, 0.145_3e-3, 0.342_4);
}

/// The wheel motor with one of its windings: phase resistance, inductance and line-to-line back-emf constant.
const fn wheel_motor(name: &'static str, resistance_ohm: f64, inductance_h: f64, line_emf_v_s: f64) -> HubMotorModel {
    HubMotorModel {
        name,
        pmsm: PmsmModel {
            pole_pairs: POLE_PAIRS,
            resistance_ohm,
            // The header gives one figure for both axes: surface magnets.
            inductance_d_h: inductance_h,
            inductance_q_h: inductance_h,
            flux_linkage_wb: line_emf_v_s / (SQRT_3 * POLE_PAIRS as f64),
        },
        rotor: RotorModel {
            inertia_kg_m2: ROTOR_INERTIA_KG_M2,
            viscous_nm_s: (1.0 - DRY_SHARE) * NO_LOAD_TORQUE_NM / NO_LOAD_VELOCITY_RAD_S,
            coulomb_nm: DRY_SHARE * NO_LOAD_TORQUE_NM,
        },
        encoder: EncoderModel { lines: 1024 },
        hall: HallModel { offset_turns: 0.0 },
        brake: BrakeModel { holding_nm: 0.0 },
        rig: RigModel {
            winding: BodyModel { resistance_k_w: WINDING_RESISTANCE_K_W, capacity_j_k: WINDING_CAPACITY_J_K },
            resistance_per_k: COPPER_PER_K,
            heat_sink: BodyModel { resistance_k_w: HEAT_SINK_RESISTANCE_K_W, capacity_j_k: HEAT_SINK_CAPACITY_J_K },
            switch_resistance_ohm: SWITCH_RESISTANCE_OHM,
            supply: SUPPLY,
        },
        clamp: CLAMP,
        power_stage_limit_c: POWER_STAGE_LIMIT_C,
        bearing_limit_rad_s: BEARING_LIMIT_RAD_S,
    }
}

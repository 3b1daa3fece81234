//! Constants of an industrial servo motor: Yaskawa SGMAH-04A, 400 W, 60 mm flange, for 200 V mains.
//!
//! A servo motor with incremental encoder and commutation tracks is the composition of [`hub_motor`](crate::hub_motor) with
//! other figures. Those of the maker are in "AC Servo Drives, Sigma-II Series, SGMxH/SGDM User's Manual" (SIEP S800000 15),
//! 3.1.1, typical values:
//!
//! | figure | value |
//! |---|---|
//! | rated output, torque, speed | 400 W, 1.27 N m, 3000 r/min |
//! | peak torque, highest speed | 3.82 N m, 5000 r/min |
//! | rated and peak current | 2.8 A, 8.5 A (r.m.s.) |
//! | torque constant | 0.498 N m/A (r.m.s.) |
//! | rotor inertia; more with a holding brake | 0.173e-4 kg m², 0.058e-4 kg m² |
//! | inertia time constant, inductive time constant | 0.25 ms, 5.4 ms |
//!
//! **Torque constant to flux linkage.** `Kt = 3/2 p psi sqrt(2)` per ampere r.m.s.
//!
//! **Resistance and inductance.** The inertia time constant is `3 R J / Kt^2` with the resistance of a phase (the same for
//! the maker's other motors: SGMSH-10A, 0.87 ms), the inductive one is `L / R`.
//!
//! What is assumed is a named constant with its reason.

use crate::brake::BrakeModel;
use crate::clamp::ClampModel;
use crate::encoder::EncoderModel;
use crate::hall::HallModel;
use crate::hub_motor::HubMotorModel;
use crate::mechanics::{RAD_S_PER_RPM, RotorModel};
use crate::pmsm::PmsmModel;
use crate::rig::RigModel;
use crate::supply::{BleederModel, SupplyModel};
use crate::thermal::{BodyModel, COPPER_PER_K};

const TORQUE_CONSTANT_NM_A_RMS: f64 = 0.498;
const RATED_TORQUE_NM: f64 = 1.27;
const RATED_CURRENT_A_RMS: f64 = 2.8;
const RATED_VELOCITY_RAD_S: f64 = 3000.0 * RAD_S_PER_RPM;
const INERTIA_KG_M2: f64 = 0.173e-4;
const BRAKE_INERTIA_KG_M2: f64 = 0.058e-4;
const INERTIA_TIME_CONSTANT_S: f64 = 0.25e-3;
const INDUCTIVE_TIME_CONSTANT_S: f64 = 5.4e-3;

const SQRT_2: f64 = core::f64::consts::SQRT_2;

/// Assumed: eight poles, as servo motors of this size have.
const POLE_PAIRS: u32 = 4;
/// The 17-bit encoder that the motor is sold with: 131072 counts a turn, four a line.
const ENCODER_LINES: u32 = 32_768;

/// Of one phase at 20 °C: 1.19 ohm.
const RESISTANCE_OHM: f64 =
    INERTIA_TIME_CONSTANT_S * TORQUE_CONSTANT_NM_A_RMS * TORQUE_CONSTANT_NM_A_RMS / (3.0 * INERTIA_KG_M2);

/// Assumed: bearings and seal take 2 % of the rated torque at any speed,
const DRY_SHARE: f64 = 0.02;
/// and iron and grease 2 % more at rated speed.
const VISCOUS_SHARE: f64 = 0.02;

/// "Armature winding temperature of 100 °C" at rated torque and 40 °C around.
const TEMPERATURE_RISE_K: f64 = 60.0;
/// Assumed: 0.6 kg of the motor's 1.1 kg are copper and iron, at about 420 J/(kg K).
const WINDING_CAPACITY_J_K: f64 = 250.0;
const HOT_LOSS_W: f64 = 3.0 * RATED_CURRENT_A_RMS * RATED_CURRENT_A_RMS * RESISTANCE_OHM * (1.0 + COPPER_PER_K * 80.0);

/// The torque that a motor's holding brake holds. Assumed: its rated torque, the usual rule.
const BRAKE_NM: f64 = RATED_TORQUE_NM;

/// Assumed: the drive's IGBTs of some 0.1 ohm around their working point, and cable.
const SWITCH_RESISTANCE_OHM: f64 = 0.1;
/// Assumed: a heat sink of a hand's size; 20 W of the power stage warm it by 20 K.
const HEAT_SINK: BodyModel = BodyModel { resistance_k_w: 1.0, capacity_j_k: 450.0 };

/// Rectified mains: 200 V r.m.s. has a peak of 283 V.
const SUPPLY: SupplyModel = SupplyModel {
    // Assumed: rectifier, inrush resistor's switch and mains.
    source_resistance_ohm: 0.5,
    // Assumed: the fuse of the mains.
    source_limit_a: 16.0,
    source_capacitance_f: 0.0,
    // Assumed: the electrolytics of a 400 W drive.
    capacitance_f: 660e-6,
    // Assumed: controller, gate drivers, encoder, fan.
    consumption_w: 10.0,
    // Assumed: where the drive's own converter stops.
    consumption_from_v: 60.0,
    // Assumed: the built-in regenerative resistor of drives of this class.
    bleeder: BleederModel { resistance_ohm: 50.0, rated_power_w: 60.0, time_constant_s: 30.0, burn_out_load: 2.0 },
};

/// Assumed: varistors across the bus, which conduct well above the 400 V at which drives of this class stop.
const CLAMP: ClampModel = ClampModel { from_v: 470.0, resistance_ohm: 5.0 };

/// Assumed: the absolute maximum of an IGBT module's junctions.
const POWER_STAGE_LIMIT_C: f64 = 150.0;

/// Assumed: small sealed ball bearings stand three times the motor's highest speed.
const BEARING_LIMIT_RAD_S: f64 = 15_000.0 * RAD_S_PER_RPM;

impl HubMotorModel {
    /// Yaskawa SGMAH-04A: 400 W, 1.27 N m, 3000 r/min, 17-bit encoder, on rectified 200 V mains. No brake.
    pub const SGMAH_04A: HubMotorModel = servo_motor("SGMAH-04A", INERTIA_KG_M2, 0.0);

    /// The same with its holding brake.
    pub const SGMAH_04A_BRAKE: HubMotorModel =
        servo_motor("SGMAH-04A with brake", INERTIA_KG_M2 + BRAKE_INERTIA_KG_M2, BRAKE_NM);
}

const fn servo_motor(name: &'static str, inertia_kg_m2: f64, holding_nm: f64) -> HubMotorModel {
    HubMotorModel {
        name,
        pmsm: PmsmModel {
            pole_pairs: POLE_PAIRS,
            resistance_ohm: RESISTANCE_OHM,
            // Surface magnets: one figure for both axes.
            inductance_d_h: INDUCTIVE_TIME_CONSTANT_S * RESISTANCE_OHM,
            inductance_q_h: INDUCTIVE_TIME_CONSTANT_S * RESISTANCE_OHM,
            flux_linkage_wb: TORQUE_CONSTANT_NM_A_RMS / (1.5 * SQRT_2 * POLE_PAIRS as f64),
        },
        rotor: RotorModel {
            inertia_kg_m2,
            viscous_nm_s: VISCOUS_SHARE * RATED_TORQUE_NM / RATED_VELOCITY_RAD_S,
            coulomb_nm: DRY_SHARE * RATED_TORQUE_NM,
        },
        encoder: EncoderModel { lines: ENCODER_LINES },
        hall: HallModel { offset_turns: 0.0 },
        brake: BrakeModel { holding_nm },
        rig: RigModel {
            winding: BodyModel { resistance_k_w: TEMPERATURE_RISE_K / HOT_LOSS_W, capacity_j_k: WINDING_CAPACITY_J_K },
            resistance_per_k: COPPER_PER_K,
            heat_sink: HEAT_SINK,
            switch_resistance_ohm: SWITCH_RESISTANCE_OHM,
            supply: SUPPLY,
        },
        clamp: CLAMP,
        power_stage_limit_c: POWER_STAGE_LIMIT_C,
        bearing_limit_rad_s: BEARING_LIMIT_RAD_S,
    }
}

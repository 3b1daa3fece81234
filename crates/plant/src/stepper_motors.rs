//! Constants of the ZLIM42-C's two motors.
//!
//! The manual (ZLIM42-C user manual V1.03, 2.1) gives 24 V, at most 2.2 A peak, and the holding torques of the two
//! bodies; the windings are those of published motors of the same frame, step angle, torque and current:
//!
//! | body | holding torque | published motor | R | L | rotor |
//! |---|---|---|---|---|---|
//! | L = 70 mm (48 mm motor) | 0.48 N m | LDO 42STH47-1684AC, 0.49 N m at 1.68 A | 1.65 ohm | 2.8 mH | 68 g cm² |
//! | L = 82 mm (60 mm motor) | 0.72 N m | Hanpose 17HS6401S, 0.73 N m at 1.8 A | 2.3 ohm | 5.4 mH | 72 g cm² |
//!
//! (makers' data as collected in a public database of stepper motors).
//!
//! **Holding torque to flux linkage.** A sinusoidal drive's two currents make a vector as long as their peak, and
//! 2.2 A peak is the manual's highest setting (object 2005h = 7), so `K = 0.48 N m / 2.2 A = 0.218 N m/A` and
//! `psi = K / 50`. Makers state the holding torque with both phases at the rated current, a vector `sqrt(2)` as
//! long: 0.49 / (1.68 sqrt 2) = 0.206 N m/A and 0.73 / (1.8 sqrt 2) = 0.287 N m/A, 5 % and 12 % less.
//!
//! What is assumed is a named constant with its reason.

use crate::clamp::ClampModel;
use crate::mechanics::{RAD_S_PER_RPM, RotorModel};
use crate::rig::RigModel;
use crate::stepper::StepperModel;
use crate::stepper_motor::StepperMotorModel;
use crate::supply::{BleederModel, SupplyModel};
use crate::thermal::{BodyModel, COPPER_PER_K};

/// 200 full steps a turn, four to a tooth.
const TEETH: u32 = 50;
/// Highest peak current: ZLIM42-C user manual V1.03, 2.1 and object 2005h.
const HOLDING_CURRENT_A: f64 = 2.2;
/// Detent torque over holding torque. A guess: motors of this frame that are sold for low vibration have 2 to 3 %, and the
/// manual calls this one's ultra-low (1.2). A plain one has more: the published MotionKing 17HS4401 2.2 N cm of 40 N cm.
const DETENT_SHARE: f64 = 0.025;

/// Assumed: two small ball bearings, 1 % of the smaller holding torque.
const COULOMB_NM: f64 = 0.005;
/// Assumed: iron loss and windage as 0.03 N m at 3000 r/min, some 10 W. It leaves the resonance a damping of half a
/// per cent of critical, which is why the drive should not dwell there.
const VISCOUS_NM_S: f64 = 1e-4;

/// Makers' general specification of such motors: temperature rise of at most 80 K, both phases at the rated current.
const TEMPERATURE_RISE_K: f64 = 80.0;
/// Assumed: copper, iron and magnets at about 450 J/(kg K).
const HEAT_J_KG_K: f64 = 450.0;

/// Assumed: two switches in each phase's path, 0.1 ohm each, as in integrated dual bridges of this size.
const SWITCH_RESISTANCE_OHM: f64 = 0.2;
/// Assumed: the board on the motor's back cover; 3 W warm it by 30 K.
const HEAT_SINK: BodyModel = BodyModel { resistance_k_w: 10.0, capacity_j_k: 30.0 };

/// Assumed: a suppressor of 40 V stand-off, as the manual's over-voltage (2.1) asks for. The data sheets of the 600 W types have
/// 44.4 to 49.1 V at 1 mA, and 64.5 V at 9.3 A.
const CLAMP: ClampModel = ClampModel { from_v: 46.75, resistance_ohm: (64.5 - 46.75) / 9.3 };
/// Assumed: the absolute maximum of the junctions of integrated bridges, by their data sheets. A board that is as hot leaves
/// nothing to the junction.
const POWER_STAGE_LIMIT_C: f64 = 150.0;
/// Assumed: shielded ball bearings for a shaft of 5 mm (625ZZ), whose makers limit them to 36,000 r/min with grease.
const BEARING_LIMIT_RAD_S: f64 = 36_000.0 * RAD_S_PER_RPM;

/// Bus voltage below which the drive's own converter stops. A guess: its manual (2.1) wants 20 V of the supply, and cable and
/// bus take some tenths when the motor draws its most.
const CONVERTER_STOPS_V: f64 = 19.3;

const SUPPLY: SupplyModel = SupplyModel {
    // Assumed: power supply with cable.
    source_resistance_ohm: 0.1,
    // Assumed: a 24 V supply of 150 W, which is rated 6.5 A and limits at 120 % of it.
    source_limit_a: 7.8,
    // Assumed: cable long enough that the supply's own capacitor hardly helps.
    source_capacitance_f: 0.0,
    // Assumed: two electrolytics of 100 uF and ceramics; an integrated drive has no room for more.
    capacitance_f: 220e-6,
    // Assumed: controller, bridges' drivers and optocouplers.
    consumption_w: 1.0,
    consumption_from_v: CONVERTER_STOPS_V,
    // The drive has none; these values never matter.
    bleeder: BleederModel { resistance_ohm: 1e6, rated_power_w: 1.0, time_constant_s: 1.0, burn_out_load: 1e9 },
};

impl StepperMotorModel {
    /// The ZLIM42-C of 70 mm: 0.48 N m.
    pub const ZLIM42_C_70: StepperMotorModel = Published {
        name: "ZLIM42-C L=70",
        holding_nm: 0.48,
        rated_current_a: 1.68,
        resistance_ohm: 1.65,
        inductance_h: 2.8e-3,
        inertia_kg_m2: 68e-7,
        mass_kg: 0.36,
    }
    .model();

    /// The ZLIM42-C of 82 mm: 0.72 N m.
    pub const ZLIM42_C_82: StepperMotorModel = Published {
        name: "ZLIM42-C L=82",
        holding_nm: 0.72,
        rated_current_a: 1.8,
        resistance_ohm: 2.3,
        inductance_h: 5.4e-3,
        inertia_kg_m2: 72e-7,
        mass_kg: 0.5,
    }
    .model();
}

/// What differs between the two.
struct Published {
    name: &'static str,
    holding_nm: f64,
    rated_current_a: f64,
    resistance_ohm: f64,
    inductance_h: f64,
    inertia_kg_m2: f64,
    mass_kg: f64,
}

impl Published {
    const fn model(self) -> StepperMotorModel {
        let rated_w = 2.0 * self.rated_current_a * self.rated_current_a * self.resistance_ohm;
        StepperMotorModel {
            name: self.name,
            stepper: StepperModel {
                teeth: TEETH,
                resistance_ohm: self.resistance_ohm,
                inductance_h: self.inductance_h,
                flux_linkage_wb: self.holding_nm / HOLDING_CURRENT_A / TEETH as f64,
                detent_nm: DETENT_SHARE * self.holding_nm,
            },
            rotor: RotorModel { inertia_kg_m2: self.inertia_kg_m2, viscous_nm_s: VISCOUS_NM_S, coulomb_nm: COULOMB_NM },
            clamp: CLAMP,
            power_stage_limit_c: POWER_STAGE_LIMIT_C,
            bearing_limit_rad_s: BEARING_LIMIT_RAD_S,
            rig: RigModel {
                winding: BodyModel {
                    resistance_k_w: TEMPERATURE_RISE_K / rated_w,
                    capacity_j_k: self.mass_kg * HEAT_J_KG_K,
                },
                resistance_per_k: COPPER_PER_K,
                heat_sink: HEAT_SINK,
                switch_resistance_ohm: SWITCH_RESISTANCE_OHM,
                supply: SUPPLY,
            },
        }
    }
}

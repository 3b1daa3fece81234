//! What differs between the four models, as const data ("M Robot Joint Motor CanOpen Manual", "Parameters").

use devices::mjoint::{M4230_MAX_RPM, M8025_MAX_RPM};

/// One model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// Name to type: `m4230e17b50`.
    pub name: &'static str,
    /// Reduction ratio: motor turns in one turn of the output.
    pub ratio: f64,
    /// Highest speed of the motor, r/min: no set-point is faster.
    pub max_rpm: f64,
    /// Electrical turns in one turn of the motor. Not printed: assumed, as for the motors of crate `plant`.
    pub pole_pairs: u16,
    /// Resistance of one phase, ohm: half of what is printed, which is between two wires.
    pub resistance_ohm: f32,
    /// Inductance of one phase, H: half of what is printed.
    pub inductance_h: f32,
    /// Amplitude of the q current for each rad/s² of the bare motor: its inertia over its torque constant, A/(rad/s²).
    pub acceleration_a_s2: f32,
}

impl Model {
    /// 34 N·m, 0 to 30 r/min.
    pub const M4230E17B50: Self = Self { name: "m4230e17b50", ratio: 50.0, ..M4230 };
    /// 51 N·m, 0 to 15 r/min.
    pub const M4230E17B80: Self = Self { name: "m4230e17b80", ratio: 80.0, ..M4230 };
    /// 51 N·m, 0 to 30 r/min.
    pub const M8025E25B50: Self = Self { name: "m8025e25b50", ratio: 50.0, ..M8025 };
    /// 85 N·m, 0 to 18 r/min.
    pub const M8025E25B80: Self = Self { name: "m8025e25b80", ratio: 80.0, ..M8025 };

    /// The model of this name, in any case of letters.
    pub fn named(name: &str) -> Option<&'static Self> {
        static ALL: [Model; 4] = [Model::M4230E17B50, Model::M4230E17B80, Model::M8025E25B50, Model::M8025E25B80];
        ALL.iter().find(|model| model.name.eq_ignore_ascii_case(name))
    }
}

/// Of both motors: 1 N·m at 3.5 A and 2 N·m at 7 A, r.m.s.; for each ampere of amplitude.
const TORQUE_CONSTANT_NM_A: f32 = 1.0 / (core::f32::consts::SQRT_2 * 3.5);

const M4230: Model = Model {
    name: "m4230",
    ratio: 1.0,
    max_rpm: M4230_MAX_RPM,
    pole_pairs: 21,
    resistance_ohm: 0.5 * 0.86,
    inductance_h: 0.5 * 0.8e-3,
    acceleration_a_s2: 0.69e-4 / TORQUE_CONSTANT_NM_A,
};

const M8025: Model = Model {
    name: "m8025",
    ratio: 1.0,
    max_rpm: M8025_MAX_RPM,
    pole_pairs: 21,
    resistance_ohm: 0.5 * 0.53,
    inductance_h: 0.5 * 0.5e-3,
    acceleration_a_s2: 1.74e-4 / TORQUE_CONSTANT_NM_A,
};

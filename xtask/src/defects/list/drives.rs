//! Motion, physics, firmware and the world around them.

use crate::defects::defect::Defect;
use crate::defects::defect::programs::{DRIVES, DRIVES_IT, MOTION_IT, PLANT, PLANT_IT, SIM, WHEEL};

pub(super) const DEFECTS: &[Defect] = &[
    Defect {
        file: "crates/motion/src/pid.rs",
        text: "share * (gains.proportional * error + rest);",
        instead: "share * (gains.proportional * error);",
        noticed_by: MOTION_IT,
    },
    Defect {
        file: "crates/motion/src/profile.rs",
        text: "0.5 - y + 2.0 / 3.0 * y * y * y",
        instead: "0.5 - y + 1.0 / 3.0 * y * y * y",
        noticed_by: MOTION_IT,
    },
    Defect {
        file: "crates/motion/src/foc.rs",
        text: "let centre = 0.5 - (highest(phases)",
        instead: "let centre = 0.5 + (highest(phases)",
        noticed_by: MOTION_IT,
    },
    Defect {
        file: "crates/plant/src/thermal.rs",
        text: "let flow_w_by_resistance = heat_w * self.resistance_k_w -",
        instead: "let flow_w_by_resistance = heat_w -",
        noticed_by: PLANT,
    },
    Defect {
        file: "crates/plant/src/hall.rs",
        text: "[u8; 6] = [5, 1, 3, 2, 6, 4];",
        instead: "[u8; 6] = [5, 4, 6, 2, 3, 1];",
        noticed_by: PLANT,
    },
    Defect {
        file: "crates/plant/src/encoder.rs",
        text: "        4 * self.lines",
        instead: "        2 * self.lines",
        noticed_by: PLANT,
    },
    Defect {
        file: "crates/plant/src/supply.rs",
        text: "if data.connected { self.capacitance_f + self.source_capacitance_f }",
        instead: "if data.connected { self.capacitance_f }",
        noticed_by: PLANT,
    },
    Defect {
        file: "crates/plant/src/pmsm.rs",
        text: "alpha_v: u * (2.0 * third_v) -",
        instead: "alpha_v: u * third_v -",
        noticed_by: PLANT_IT,
    },
    Defect {
        file: "crates/drives/src/engine/host_watchdog.rs",
        text: "now.nanos_since(last) >= timeout_ns",
        instead: "now.nanos_since(last) > timeout_ns",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/engine/inputs.rs",
        text: "if *differs_for >= periods {",
        instead: "if *differs_for > periods {",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/engine/actuator/overload.rs",
        text: "(high_y - low_y) * (x - low)",
        instead: "(high_y - low_y) * (high - x)",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/engine/storage.rs",
        text: "(b.sequence.wrapping_sub(a.sequence) as i32) > 0",
        instead: "(b.sequence.wrapping_sub(a.sequence) as i32) < 0",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/engine/axis/trajectory.rs",
        text: "f64::from(target.wrapping_sub(from.position)) - from.fraction;",
        instead: "f64::from(target.wrapping_sub(from.position)) + from.fraction;",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/zlim42c/protection.rs",
        text: "lost |= *empty_for >= PHASE_LOSS_DEBOUNCE_PERIODS;",
        instead: "lost |= *empty_for > PHASE_LOSS_DEBOUNCE_PERIODS;",
        noticed_by: DRIVES,
    },
    Defect {
        file: "crates/drives/src/zlac8030l/protection.rs",
        text: "[u, v, u + v].iter()",
        instead: "[u, v, u - v].iter()",
        noticed_by: DRIVES_IT,
    },
    Defect {
        file: "crates/drives/src/zlac8030l/protection.rs",
        text: "matches!(sensors.hall & 7, 0 | 7)",
        instead: "matches!(sensors.hall & 7, 7)",
        noticed_by: DRIVES_IT,
    },
    Defect {
        file: "crates/sim/src/wire/confinement.rs",
        text: "const BUS_OFF_ABOVE: u16 = 255;",
        instead: "const BUS_OFF_ABOVE: u16 = 247;",
        noticed_by: SIM,
    },
    Defect {
        file: "crates/sim/src/wire/confinement.rs",
        text: "self.rec = (self.rec + 9)",
        instead: "self.rec = (self.rec + 8)",
        noticed_by: SIM,
    },
    Defect {
        file: "crates/sim/src/wire/collision.rs",
        text: "Some(stuffing.count + 1)",
        instead: "Some(stuffing.count)",
        noticed_by: SIM,
    },
    Defect {
        file: "crates/sim/src/pace.rs",
        text: "(nanos as f64 / self.speed).ceil()",
        instead: "(nanos as f64 * self.speed).ceil()",
        noticed_by: SIM,
    },
    Defect {
        file: "crates/drives/src/engine/cia402/stopping.rs",
        text: "StopRamp::QuickStop => Braking::Ramp(parameters.quick_stop_ramp),",
        instead: "StopRamp::QuickStop => Braking::Ramp(parameters.moves.deceleration),",
        noticed_by: WHEEL,
    },
];

//! Defects put in on purpose: a place each, what is there, what is written instead, and the tests that have to notice.
//!
//! A line each, of the kind that a person writes by mistake: a limit by one, a sign, a word for its neighbour. Where a defect was not
//! noticed a test was missing, and has been written.

/// One line that is written wrongly.
pub(super) struct Defect {
    /// The file, from the root of the workspace.
    pub(super) file: &'static str,
    /// What is there, once.
    pub(super) text: &'static str,
    /// What is written instead.
    pub(super) instead: &'static str,
    pub(super) noticed_by: Tests,
}

/// A program with tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tests {
    pub(super) package: &'static str,
    /// `--lib`, or the name of an integration test.
    pub(super) target: &'static str,
    /// A part of the names of the tests that run; empty for all.
    pub(super) filter: &'static str,
}

impl Tests {
    pub(super) const fn of(package: &'static str, target: &'static str) -> Self {
        Self { package, target, filter: "" }
    }
}

const CAN: Tests = Tests::of("ferrodrive-can", "--lib");
const CANOPEN: Tests = Tests::of("ferrodrive-canopen", "--lib");
const CANOPEN_IT: Tests = Tests::of("ferrodrive-canopen", "it");
const CIA402: Tests = Tests::of("ferrodrive-cia402", "--lib");
const MOTION_IT: Tests = Tests::of("ferrodrive-motion", "it");
const PLANT: Tests = Tests::of("ferrodrive-plant", "--lib");
const PLANT_IT: Tests = Tests::of("ferrodrive-plant", "it");
const DRIVES: Tests = Tests::of("ferrodrive-drives", "--lib");
const DRIVES_IT: Tests = Tests::of("ferrodrive-drives", "it");
const SIM: Tests = Tests::of("ferrodrive-sim", "--lib");
const MASTER: Tests = Tests::of("ferrodrive-master", "--lib");
const MASTER_IT: Tests = Tests::of("ferrodrive-master", "it");
const EDS: Tests = Tests::of("ferrodrive-eds", "--lib");
const WORDS: Tests = Tests::of("ferrodrive-words", "--lib");
const TABLES: Tests = Tests { filter: "tables_of_", ..Tests::of("ferrodrive-tests", "it") };
const WHEEL: Tests = Tests { filter: "zlac8030l", ..Tests::of("ferrodrive-tests", "it") };

pub(super) const DEFECTS: &[Defect] = &[
    Defect {
        file: "crates/can/src/length.rs",
        text: "const STUFF_RUN: u8 = 5;",
        instead: "const STUFF_RUN: u8 = 6;",
        noticed_by: CAN,
    },
    Defect {
        file: "crates/can/src/length.rs",
        text: "const CRC_POLYNOMIAL: u16 = 0x4599;",
        instead: "const CRC_POLYNOMIAL: u16 = 0x4589;",
        noticed_by: CAN,
    },
    Defect {
        file: "crates/can/src/bitrate.rs",
        text: "bits_per_second >= 10_000 &&",
        instead: "bits_per_second > 10_000 &&",
        noticed_by: CAN,
    },
    Defect {
        file: "crates/canopen/src/period.rs",
        text: "self.next = self.next.plus_nanos((missed + 1).saturating_mul(self.period_ns));",
        instead: "self.next = now.plus_nanos(self.period_ns + 0 * missed);",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/nmt.rs",
        text: "matches!(self, Self::PreOperational | Self::Operational)",
        instead: "matches!(self, Self::Operational)",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/emcy.rs",
        text: "[low, high, self.error_register, a, b, c, d, e]",
        instead: "[high, low, self.error_register, a, b, c, d, e]",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/sdo/wire.rs",
        text: "EXPEDITED | SIZE_INDICATED | unused << 2",
        instead: "EXPEDITED | SIZE_INDICATED | unused << 1",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/pdo/tpdo.rs",
        text: "inhibit_ns: if is_event_driven {",
        instead: "inhibit_ns: if !is_event_driven {",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/pdo/tpdo.rs",
        text: "let reached = *left == 0;",
        instead: "let reached = *left <= 1;",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/sdo/server.rs",
        text: "self.refuse(mux, AbortCode::TIMED_OUT);",
        instead: "self.refuse(mux, AbortCode::UNKNOWN_COMMAND);",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/cia402/src/power.rs",
        text: "matches!(state, PowerState::FaultReactionActive | PowerState::Fault);",
        instead: "matches!(state, PowerState::Fault);",
        noticed_by: CIA402,
    },
    Defect {
        file: "crates/cia402/src/window.rs",
        text: "self.held && self.held_ms + ROUNDING_MS >=",
        instead: "self.held && self.held_ms >=",
        noticed_by: CIA402,
    },
    Defect {
        file: "crates/cia402/src/touch_probe.rs",
        text: "pub const POSITIVE_STORED: u8 = 1 << 1;",
        instead: "pub const POSITIVE_STORED: u8 = 1 << 3;",
        noticed_by: CIA402,
    },
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
        file: "crates/master/src/core/cycle.rs",
        text: "{ 0 } else { missed };",
        instead: "{ missed } else { missed };",
        noticed_by: MASTER,
    },
    Defect {
        file: "crates/master/src/core/field.rs",
        text: "(-(i128::from(mask >> 1) + 1),",
        instead: "(-(i128::from(mask >> 1)),",
        noticed_by: MASTER,
    },
    Defect {
        file: "crates/master/src/core/facts.rs",
        text: "watch.deadline = (!booted || watch.asked).then(|| now + watch.time);",
        instead: "watch.deadline = Some(now + watch.time);",
        noticed_by: MASTER,
    },
    Defect {
        file: "crates/master/src/gear.rs",
        text: "        of_shaft / self.ratio",
        instead: "        of_shaft * self.ratio",
        noticed_by: MASTER_IT,
    },
    Defect {
        file: "crates/eds/src/value.rs",
        text: "&& digits.len() <= 9;",
        instead: "&& digits.len() <= 10;",
        noticed_by: EDS,
    },
    Defect { file: "crates/eds/src/check/pdo.rs", text: "if bits > 64 {", instead: "if bits > 72 {", noticed_by: EDS },
    Defect {
        file: "crates/eds/src/diff.rs",
        text: "(Some(a), Some(b)) => a.min(b),",
        instead: "(Some(a), Some(b)) => a.max(b),",
        noticed_by: EDS,
    },
    Defect {
        file: "crates/words/src/suggest.rs",
        text: "row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);",
        instead: "row[j + 1] = replaced.min(row[j] + 1);",
        noticed_by: WORDS,
    },
    Defect {
        file: "crates/cia402/src/power.rs",
        text: "row(8, S::OperationEnabled, Command(C::Shutdown), S::ReadyToSwitchOn)",
        instead: "row(8, S::OperationEnabled, Command(C::Shutdown), S::SwitchedOn)",
        noticed_by: TABLES,
    },
    Defect {
        file: "crates/devices/src/zltech/zlac8030l/objects/profile.rs",
        text: ".range(1, 1000).default(120)",
        instead: ".range(1, 1000).default(60)",
        noticed_by: TABLES,
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
        file: "crates/drives/src/engine/cia402/stopping.rs",
        text: "StopRamp::QuickStop => Braking::Ramp(parameters.quick_stop_ramp),",
        instead: "StopRamp::QuickStop => Braking::Ramp(parameters.moves.deceleration),",
        noticed_by: WHEEL,
    },
];

//! CAN, CANopen, CiA 402, tables and EDS.

use crate::defects::defect::Defect;
use crate::defects::defect::programs::{CAN, CANOPEN, CANOPEN_IT, CIA402, EDS, TABLES};

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
        file: "crates/canopen/src/sync.rs",
        text: "if counter >= self.overflow { 1 }",
        instead: "if counter > self.overflow { 1 }",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/sdo/block/checksum.rs",
        text: "const POLYNOMIAL: u16 = 0x1021;",
        instead: "const POLYNOMIAL: u16 = 0x8005;",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/heartbeat.rs",
        text: "Watch::Alive { until } if now >= until",
        instead: "Watch::Alive { until } if now > until",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/time_stamp.rs",
        text: "if month <= 2 { 1 }",
        instead: "if month < 2 { 1 }",
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
        file: "crates/canopen/src/guarding.rs",
        text: "let lost = now >= self.until;",
        instead: "let lost = now > self.until;",
        noticed_by: CANOPEN,
    },
    Defect {
        file: "crates/canopen/src/sdo/block/receiver.rs",
        text: "segment.sequence == self.received + 1",
        instead: "segment.sequence > self.received",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/sdo/server/block.rs",
        text: "values.view().length(slot) <= usize::from(switch_threshold)",
        instead: "values.view().length(slot) < usize::from(switch_threshold)",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/pdo/mapping.rs",
        text: "u32::from(used) + u32::from(record.bits) > MAX_BITS",
        instead: "u32::from(used) + u32::from(record.bits) >= MAX_BITS",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/pdo/rpdo.rs",
        text: "if frame.dlc() < mapping.length()",
        instead: "if frame.dlc() != mapping.length()",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/node/cycle.rs",
        text: "if self.now < self.sync.window_end",
        instead: "if self.now <= self.sync.window_end",
        noticed_by: CANOPEN_IT,
    },
    Defect {
        file: "crates/canopen/src/sdo/client.rs",
        text: "Segment::new(toggle, rest.len() <= MAX_SEGMENT, rest)",
        instead: "Segment::new(toggle, rest.len() < MAX_SEGMENT, rest)",
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
        file: "crates/cia402/src/units.rs",
        text: "if rest >= denominator - rest",
        instead: "if rest > denominator - rest",
        noticed_by: CIA402,
    },
    Defect {
        file: "crates/cia402/src/window.rs",
        text: "deviation.unsigned_abs() <= self.half_width as u64",
        instead: "deviation.unsigned_abs() < self.half_width as u64",
        noticed_by: CIA402,
    },
    Defect {
        file: "crates/cia402/src/terminals.rs",
        text: "HOME_SWITCH: u32 = 1 << 2",
        instead: "HOME_SWITCH: u32 = 1 << 3",
        noticed_by: CIA402,
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
];

//! The master, its host, and what people use all day.

use crate::defects::defect::Defect;
use crate::defects::defect::programs::{
    CANLOG, CONFORM_IT, FMU, FOXGLOVE, MACHINE, MACHINE_IT, MASTER, MASTER_IT, RECORDING, SCENARIO, SCENARIO_IT, SERVE,
    SLCAN, WORDS,
};

pub(super) const DEFECTS: &[Defect] = &[
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
        file: "crates/words/src/suggest.rs",
        text: "row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);",
        instead: "row[j + 1] = replaced.min(row[j] + 1);",
        noticed_by: WORDS,
    },
    Defect {
        file: "crates/words/src/value.rs",
        text: "(counts - whole).abs() > 1e-6 *",
        instead: "(counts - whole).abs() > 1.0 *",
        noticed_by: WORDS,
    },
    Defect {
        file: "crates/words/src/decode.rs",
        text: "fold(0u32, |raw, byte| raw << 8 | u32::from(*byte));",
        instead: "fold(0u32, |raw, byte| raw << 7 | u32::from(*byte));",
        noticed_by: WORDS,
    },
    Defect {
        file: "crates/slcan/src/codec.rs",
        text: "(raw <= CanId::MAX_EXTENDED)",
        instead: "(raw < CanId::MAX_EXTENDED)",
        noticed_by: SLCAN,
    },
    Defect {
        file: "crates/slcan/src/client.rs",
        text: "Polling::Asked(question, tries)) if tries < TRIES",
        instead: "Polling::Asked(question, tries)) if tries <= TRIES",
        noticed_by: SLCAN,
    },
    Defect {
        file: "crates/canlog/src/pcap.rs",
        text: "1_000_000_000 + u64::from(number(4)) * unit;",
        instead: "1_000_000_000 + u64::from(number(4));",
        noticed_by: CANLOG,
    },
    Defect {
        file: "crates/canlog/src/trc.rs",
        text: "if decimals.len() > 6 ||",
        instead: "if decimals.len() > 5 ||",
        noticed_by: CANLOG,
    },
    Defect {
        file: "crates/scenario/src/condition.rs",
        text: "Order::AtMost => value <= self.value,",
        instead: "Order::AtMost => value < self.value,",
        noticed_by: SCENARIO,
    },
    Defect {
        file: "crates/scenario/src/sweep/summary.rs",
        text: "value == self.min.0 && number < self.min.1",
        instead: "value == self.min.0 && number > self.min.1",
        noticed_by: SCENARIO,
    },
    Defect {
        file: "crates/scenario/src/script.rs",
        text: "(Law::Once, ..) if over && occurrence.is_none() => Some(Verdict::Failed),",
        instead: "(Law::Once, ..) if over && occurrence.is_none() => Some(Verdict::Passed),",
        noticed_by: SCENARIO_IT,
    },
    Defect {
        file: "crates/machine/src/file/configuration.rs",
        text: "&& low >= high",
        instead: "&& low > high",
        noticed_by: MACHINE,
    },
    Defect {
        file: "crates/machine/src/check/traps.rs",
        text: "&& slave.node() != Some(delivered)",
        instead: "&& slave.node() == Some(delivered)",
        noticed_by: MACHINE_IT,
    },
    Defect {
        file: "crates/recording/src/cdr.rs",
        text: "self.u32(text.len() as u32 + 1);",
        instead: "self.u32(text.len() as u32);",
        noticed_by: RECORDING,
    },
    Defect {
        file: "crates/fmu/src/operation.rs",
        text: "const ARBITRATION_LOST: u32 = 0x30;",
        instead: "const ARBITRATION_LOST: u32 = 0x31;",
        noticed_by: FMU,
    },
    Defect {
        file: "crates/foxglove/src/client.rs",
        text: "state.time.is_none_or(|known| known < nanos)",
        instead: "state.time.is_none_or(|known| known > nanos)",
        noticed_by: FOXGLOVE,
    },
    Defect {
        file: "crates/serve/src/lag.rs",
        text: "None if lag >= BEHIND => {",
        instead: "None if lag > BEHIND => {",
        noticed_by: SERVE,
    },
    Defect {
        file: "crates/master/src/core/frame_log.rs",
        text: "if log.frames.len() >= log.capacity",
        instead: "if log.frames.len() > log.capacity",
        noticed_by: MASTER,
    },
    Defect {
        file: "crates/conform/src/cases/pdo.rs",
        text: "gap.abs_diff(TIMER_MS.into()) > slack",
        instead: "gap.abs_diff(TIMER_MS.into()) < slack",
        noticed_by: CONFORM_IT,
    },
    Defect {
        file: "crates/master/src/drive/power.rs",
        text: "speed.abs() < self.gear.at_output(STANDSTILL_RPM)",
        instead: "speed.abs() < STANDSTILL_RPM",
        noticed_by: MASTER_IT,
    },
    Defect {
        file: "crates/fmu/src/operation.rs",
        text: "const WAKEUP: u32 = 0x42;",
        instead: "const WAKEUP: u32 = 0x43;",
        noticed_by: FMU,
    },
    Defect {
        file: "crates/scenario/src/condition.rs",
        text: "Order::Above => value > self.value,",
        instead: "Order::Above => value >= self.value,",
        noticed_by: SCENARIO,
    },
];

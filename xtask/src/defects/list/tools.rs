//! The master, its host, and what people use all day.

use crate::defects::defect::Defect;
use crate::defects::defect::programs::{MASTER, MASTER_IT, WORDS};

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
];

//! What is found of a drive that does not move, as rows.

use master::explain::{Explained, Finding, PdoSeen, Weight};
use serde::Serialize;

/// What a drive shows, and why it does not move as commanded.
#[derive(Debug, Serialize)]
pub struct ExplainReport {
    /// Its node-ID.
    pub node: u8,
    /// Its model, if it is known.
    pub model: Option<&'static str>,
    /// Its NMT state, as heard.
    pub nmt: Option<String>,
    /// Its state by CiA 402-2.
    pub state: Option<&'static str>,
    /// The mode of operation that is active (6061h).
    pub mode: Option<i8>,
    /// Speed of the shaft in r/min.
    pub velocity_rpm: Option<f64>,
    /// Supply in V.
    pub supply_v: Option<f64>,
    /// How long the bus was listened to before, in s.
    pub listened_s: f64,
    /// How many findings keep it from moving.
    pub causes: usize,
    /// The findings, the gravest first.
    pub findings: Vec<ExplainRow>,
    /// Its PDOs.
    pub pdos: Vec<PdoRow>,
}

/// One reason why a drive does not move, or may not: what is expected, what was found, what to do.
#[derive(Debug, Serialize)]
pub struct ExplainRow {
    /// The name of the rule.
    pub rule: &'static str,
    /// What it is about.
    pub topic: &'static str,
    /// `cause` or `warning`.
    pub weight: &'static str,
    /// What a drive that moves has.
    pub expected: String,
    /// What this one has.
    pub found: String,
    /// What follows from it.
    pub follows: String,
    /// What to do.
    pub remedy: String,
}

/// A PDO of the drive as it is set up there: identifier, mapping, and why it is silent if it is.
#[derive(Debug, Serialize)]
pub struct PdoRow {
    /// Which one.
    pub pdo: String,
    /// Its identifier.
    pub id: u32,
    /// It is switched on.
    pub valid: bool,
    /// How often it was heard.
    pub heard: u64,
    /// Why it was not heard; `None` if it was, or is off.
    pub silent: Option<String>,
}

impl From<Explained> for ExplainReport {
    fn from(explained: Explained) -> Self {
        let causes = explained.findings.iter().filter(|finding| finding.weight == Weight::Cause).count();
        Self {
            node: explained.node.raw(),
            model: explained.model,
            nmt: explained.nmt.map(|state| state.to_string()),
            state: explained.power.map(cia402::PowerState::name),
            mode: explained.mode.map(|mode| mode.0),
            velocity_rpm: explained.speed_rpm,
            supply_v: explained.supply_v,
            listened_s: explained.listened.as_secs_f64(),
            causes,
            findings: explained.findings.into_iter().map(ExplainRow::from).collect(),
            pdos: explained.pdos.into_iter().map(PdoRow::from).collect(),
        }
    }
}

impl From<Finding> for ExplainRow {
    fn from(finding: Finding) -> Self {
        let Finding { rule, topic, weight, expected, found, follows, remedy } = finding;
        Self { rule, topic: topic.name(), weight: weight.name(), expected, found, follows, remedy }
    }
}

impl From<PdoSeen> for PdoRow {
    fn from(seen: PdoSeen) -> Self {
        Self { pdo: seen.pdo.to_string(), id: seen.id, valid: seen.valid, heard: seen.heard, silent: seen.silent }
    }
}

impl ExplainReport {
    /// `node 4 (zlac8030l): Operation enabled, mode 3, operational, 0.0 r/min, 48.0 V; listened 1.5 s`.
    pub fn headline(&self) -> String {
        let model = self.model.map_or_else(String::new, |model| format!(" ({model})"));
        let parts = [
            self.state.map(str::to_owned),
            self.mode.map(|mode| format!("mode {mode}")),
            self.nmt.clone(),
            self.velocity_rpm.map(|speed| format!("{speed:.1} r/min")),
            self.supply_v.map(|volts| format!("{volts:.1} V")),
        ];
        let parts: Vec<_> = parts.into_iter().flatten().collect();
        let said = if parts.is_empty() { "no answer".to_owned() } else { parts.join(", ") };
        format!("node {}{model}: {said}; listened {:.1} s", self.node, self.listened_s)
    }
}

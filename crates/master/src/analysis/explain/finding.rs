//! What is found, and how a rule says it.

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Whether it answers, its NMT state, heartbeats, other masters, its watch over a host.
    Communication,
    /// Digital inputs that stop a motor, and the brake.
    Terminals,
    /// The power state machine: the way to Operation enabled, and faults.
    Power,
    /// 6060h and 6061h.
    Mode,
    /// Targets, ramps, limits, start bits.
    SetPoint,
    /// What the shaft does with all that.
    Load,
    /// A PDO.
    Pdo,
}

impl Topic {
    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Communication => "communication",
            Self::Terminals => "terminals",
            Self::Power => "power",
            Self::Mode => "mode",
            Self::SetPoint => "set-point",
            Self::Load => "load",
            Self::Pdo => "pdo",
        }
    }
}

/// What a finding weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// With this the drive does not move.
    Cause,
    /// It may move with this, but not always as expected.
    Warning,
}

impl Weight {
    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cause => "cause",
            Self::Warning => "warning",
        }
    }
}

/// Something that is not as a moving drive has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its rule, for programs: `target_zero`.
    pub rule: &'static str,
    /// What it is about.
    pub topic: Topic,
    /// What it weighs.
    pub weight: Weight,
    /// What a moving drive has.
    pub expected: String,
    /// What this one has.
    pub found: String,
    /// The consequence.
    pub follows: String,
    /// What to do.
    pub remedy: String,
}

/// A finding that keeps the drive from moving.
pub(super) fn cause(topic: Topic, rule: &'static str, [expected, found, follows, remedy]: [String; 4]) -> Finding {
    Finding { rule, topic, weight: Weight::Cause, expected, found, follows, remedy }
}

/// A finding that does not.
pub(super) fn warning(topic: Topic, rule: &'static str, texts: [String; 4]) -> Finding {
    Finding { weight: Weight::Warning, ..cause(topic, rule, texts) }
}

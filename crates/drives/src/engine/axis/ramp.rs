use motion::jerk::JerkRamp;

/// How a velocity changes. All kinds take one path through the planner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ramp {
    /// An S of two parabolas that takes this long, s, whatever the change is; of a move, from the start to the plateau and
    /// from the plateau to the end. 0 is a step.
    Time(f64),
    /// Straight, counts/s². 0 is a step.
    Rate(f64),
    /// As straight as its jerk allows, counts/s² and counts/s³; without a jerk it is straight.
    Jerk(JerkRamp),
}

impl Ramp {
    /// A step.
    pub const NONE: Self = Self::Time(0.0);

    /// True for a step.
    pub fn is_none(self) -> bool {
        matches!(self, Self::Time(amount) | Self::Rate(amount) | Self::Jerk(JerkRamp { rate: amount, .. }) if amount == 0.0)
    }

    /// The straight ramp that takes the time of this one between rest and `speed`.
    pub fn rate(self, speed: f64) -> f64 {
        match self {
            Self::Rate(rate) | Self::Jerk(JerkRamp { rate, .. }) => rate,
            Self::Time(time_s) if time_s > 0.0 => speed / time_s,
            Self::Time(_) => 0.0,
        }
    }

    /// The ramp itself, without any limit of its jerk.
    #[must_use]
    pub const fn without_jerk(self) -> Self {
        match self {
            Self::Jerk(JerkRamp { rate, .. }) => Self::Rate(rate),
            Self::Time(_) | Self::Rate(_) => self,
        }
    }
}

impl Default for Ramp {
    fn default() -> Self {
        Self::NONE
    }
}

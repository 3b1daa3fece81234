//! What a base may do, and what is wrong with what it was asked.

use core::time::Duration;

use canopen::{Mux, NodeId};

use super::state::StopCause;
use crate::cyclic::{Bound, CyclicError, NotAtRest};
use crate::error::Error;
use crate::network::NoCycle;
use crate::units::Shown;

/// What a base may do. All of it has to be stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseLimits {
    /// Highest speed along the heading, m/s.
    pub linear_m_s: f64,
    /// Highest rate of the heading, rad/s.
    pub angular_rad_s: f64,
    /// Highest speed of a wheel over the ground, m/s.
    pub wheel_m_s: f64,
    /// How fast the speed of a wheel over the ground may change, m/s^2: also when the base is stopped.
    pub wheel_m_s2: f64,
    /// How long a twist counts. Without a new one the base stops.
    pub watchdog: Duration,
    /// How far a wheel may lag behind its commanded way, over the ground, before both are stopped, m: it is blocked, or
    /// its load is too heavy. See [`lag_for`](Self::lag_for).
    pub lag_m: f64,
}

/// Default lag: what a wheel at its highest speed covers in this time, s.
const LAG_S: f64 = 0.25;

/// The least of such lags, m: at low speeds a wheel may stick before it begins to roll.
const LEAST_LAG_M: f64 = 0.1;

impl BaseLimits {
    /// That each value is one that a base can have.
    ///
    /// # Errors
    /// [`BaseError::BadLimit`].
    pub fn check(&self) -> Result<(), BaseError> {
        let values = [
            ("linear_m_s", self.linear_m_s),
            ("angular_rad_s", self.angular_rad_s),
            ("wheel_m_s", self.wheel_m_s),
            ("wheel_m_s2", self.wheel_m_s2),
            ("lag_m", self.lag_m),
            ("watchdog in seconds", self.watchdog.as_secs_f64()),
        ];
        match values.into_iter().find(|(_, value)| !value.is_finite() || *value <= 0.0) {
            Some((what, value)) => Err(BaseError::BadLimit { what, value }),
            None => Ok(()),
        }
    }

    /// The default lag for wheels of this highest speed: several times what velocity loops and a bus take.
    pub fn lag_for(wheel_m_s: f64) -> f64 {
        (LAG_S * wheel_m_s).max(LEAST_LAG_M)
    }

    #[cfg(test)]
    pub(super) fn of_test() -> Self {
        let watchdog = Duration::from_millis(500);
        Self { linear_m_s: 1.0, angular_rad_s: 1.0, wheel_m_s: 1.0, wheel_m_s2: 1.0, watchdog, lag_m: 0.25 }
    }
}

/// Why a base cannot be made, or did not do what it should.
#[derive(Clone, Debug, thiserror::Error)]
pub enum BaseError {
    /// Not a length.
    #[error("{what} is {value}: state a finite length above 0, in metres")]
    BadLength {
        /// The name of the length.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A limit that allows nothing or that bounds nothing.
    #[error("the limit {what} is {value}: state a finite number above 0")]
    BadLimit {
        /// The name of the limit.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A twist that is infinite or not a number.
    #[error(
        "a twist of {linear_m_s} m/s and {angular_rad_s} rad/s: both have to be finite numbers. The last one stays in force"
    )]
    BadTwist {
        /// What was given.
        linear_m_s: f64,
        /// What was given.
        angular_rad_s: f64,
    },
    /// A wheel was not seen to come to rest.
    #[error(transparent)]
    NotAtRest(#[from] NotAtRest),
    /// Two networks.
    #[error("both wheels have to be on one network, with one SYNC")]
    OtherNetwork,
    /// Another base or group has the wheel.
    #[error("node {node} ({controlword}) already belongs to a group or a base: close that first")]
    Taken {
        /// The node.
        node: NodeId,
        /// Its controlword: which axis it is.
        controlword: Mux,
    },
    /// The limit is more than the drive does.
    #[error(
        "node {node}: wheel_m_s needs {} r/min, and the drive does {} r/min at most, by {bound}. Lower wheel_m_s",
        Shown(*needed_rpm), Shown(*most_rpm)
    )]
    BeyondDrive {
        /// The node.
        node: NodeId,
        /// What the limit needs.
        needed_rpm: f64,
        /// What the drive does.
        most_rpm: f64,
        /// Where that stands.
        bound: Bound,
    },
    /// The drive takes no speeds in its mode, or does not show where it is.
    #[error(
        "node {node} cannot be a wheel: its mode takes no speeds, or its position is in no TPDO that comes each cycle"
    )]
    NoWheel {
        /// The node.
        node: NodeId,
    },
    /// The base was stopped.
    #[error("{0}")]
    Stopped(StopCause),
    /// The base was stopped, and a wheel was not seen to come to rest behind that.
    #[error("{cause}. After that {why}")]
    NotStopped {
        /// Why it was stopped.
        cause: Box<StopCause>,
        /// What became of it.
        why: NotAtRest,
    },
    /// The wheels were not enabled in time.
    #[error(
        "the wheels were not enabled within {} s: {left}; {right}. Look at the faults, the supply and the enable input of the wheel that \
         is not enabled, and whether the bus carries the cycle",
        limit.as_secs()
    )]
    NotEnabled {
        /// How long it was waited for.
        limit: Duration,
        /// What the left drive shows.
        left: String,
        /// What the right drive shows.
        right: String,
    },
    /// A drive cannot be moved cycle by cycle.
    #[error(transparent)]
    Cyclic(#[from] CyclicError),
    /// A request failed.
    #[error(transparent)]
    Drive(#[from] Error),
    /// There is no next cycle.
    #[error(transparent)]
    NoCycle(#[from] NoCycle),
}

impl BaseError {
    /// What a drive said, where that is why.
    pub const fn of_drive(&self) -> Option<&Error> {
        match self {
            Self::Drive(error) => Some(error),
            Self::Cyclic(error) => error.of_drive(),
            _ => None,
        }
    }
}

//! Whether the world keeps up with the clock, and when that is worth a word.

use std::fmt;
use std::time::Duration;

/// From here on the bus is reported to be behind: clients wait that long for an answer, and some time out soon after.
const BEHIND: Duration = Duration::from_millis(100);

/// Below this it has caught up: one step of the loop.
const CAUGHT_UP: Duration = Duration::from_millis(20);

/// See the [module](self).
#[derive(Debug, Default)]
pub(crate) struct Lag {
    now: Duration,
    /// The most since it fell behind, if it is behind.
    worst: Option<Duration>,
}

/// What is worth a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LagNews {
    /// It has fallen behind.
    Behind(Duration),
    /// It has caught up; `worst` is the most that it was behind.
    CaughtUp { worst: Duration },
}

impl fmt::Display for LagNews {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Behind(lag) => write!(
                f,
                "warning: the bus is {} ms behind the clock: the drives and clients are more than this machine can do at \
                 once, or the simulator was stopped",
                lag.as_millis()
            ),
            Self::CaughtUp { worst } => {
                write!(f, "the bus has caught up with the clock; it was up to {} ms behind", worst.as_millis())
            }
        }
    }
}

impl Lag {
    /// How far the world is behind.
    pub(crate) fn now(&self) -> Duration {
        self.now
    }

    /// Takes a new value; what is to be said about it.
    pub(crate) fn update(&mut self, lag: Duration) -> Option<LagNews> {
        self.now = lag;
        match &mut self.worst {
            None if lag >= BEHIND => {
                self.worst = Some(lag);
                Some(LagNews::Behind(lag))
            }
            None => None,
            Some(worst) => {
                *worst = lag.max(*worst);
                let worst = *worst;
                (lag <= CAUGHT_UP).then(|| {
                    self.worst = None;
                    LagNews::CaughtUp { worst }
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn falling_behind_and_catching_up_are_said_once_each() {
        let mut lag = Lag::default();
        let said: Vec<String> = [0, 99, 100, 250, 40, 99, 20, 50, 0]
            .into_iter()
            .filter_map(|millis| lag.update(Duration::from_millis(millis)))
            .map(|news| news.to_string())
            .collect();
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("100 ms behind") && said[1].contains("up to 250 ms"), "{said:?}");
        assert_eq!(lag.now(), Duration::ZERO);
    }
}

//! What can be wrong with a node's access to the bus, and with the wire, in words: `4 bus late 5 20`, `bus corrupt 0.01`.

use std::fmt;
use std::time::Duration;

use can::Frame;

use super::error::StimulusError;
use crate::fault::{Babble, Delay, NodeFaults, Overrun};

/// One thing that is wrong with a node's access to the bus, or is mended; the others stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BusFault {
    /// `bus silent on`: it listens only.
    Silent(bool),
    /// `bus late 5 20`: its frames reach the bus 5 to 20 ms late.
    Late(Option<Delay>),
    /// `bus babble 080# 1`: it sends this frame again 1 ms after it went out, for ever.
    Babble(Option<Babble>),
    /// `bus overrun 2 0.5`: it holds two frames, and takes 0.5 ms for each; what comes faster is lost.
    Overrun(Option<Overrun>),
    /// `bus corrupt 0.3`: each attempt to send a frame fails with this probability, as with a bad plug at this node.
    Corrupt(f64),
}

/// What disturbs the wire itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WireFault {
    /// `bus corrupt 0.01`: each frame is destroyed with this probability.
    Corrupt(f64),
    /// `bus destroy 3 20`: the third frame from here on is destroyed at its 20th bit.
    Destroy {
        /// Which attempt; the next is 1.
        nth: u64,
        /// Which bit of it; start of frame is 1, stuff bits count.
        bit: u32,
    },
}

pub(super) const SILENT: &str = "NODE bus silent on|off";
pub(super) const LATE: &str = "NODE bus late MIN_MS MAX_MS, or NODE bus late off";
pub(super) const BABBLE: &str = "NODE bus babble FRAME GAP_MS (as in 080# 1), or NODE bus babble off";
pub(super) const OVERRUN: &str = "NODE bus overrun FRAMES SERVICE_MS, or NODE bus overrun off";
pub(super) const CORRUPT: &str = "NODE bus corrupt PROBABILITY (0 to 1), or NODE bus corrupt off";
pub(super) const WIRE: &str = "bus corrupt PROBABILITY (0 to 1), bus corrupt off, or bus destroy NTH_FRAME BIT";
const ANY: &str = "NODE bus silent|late|babble|overrun|corrupt ..";

/// Longest delay that is taken: a day.
const LONGEST: Duration = Duration::from_secs(86_400);

impl BusFault {
    /// From the words after `bus`.
    pub(super) fn parse(words: &[&str]) -> Result<Self, StimulusError> {
        Ok(match words {
            ["silent", "on"] => Self::Silent(true),
            ["silent", "off"] => Self::Silent(false),
            ["silent", ..] => return Err(StimulusError::Usage(SILENT)),
            ["late", "off"] => Self::Late(None),
            ["late", min, max] => {
                let bad = |_| StimulusError::BadValue { text: (*max).into(), what: "longest delay", usage: LATE };
                Self::late(delay(min, LATE)?, delay(max, LATE)?).map_err(bad)?
            }
            ["late", ..] => return Err(StimulusError::Usage(LATE)),
            ["babble", "off"] => Self::Babble(None),
            ["babble", frame, gap] => {
                let bad = |_| StimulusError::BadValue { text: (*frame).into(), what: "frame", usage: BABBLE };
                let frame: Frame = frame.parse().map_err(bad)?;
                Self::babble(frame, delay(gap, BABBLE)?)?
            }
            ["babble", ..] => return Err(StimulusError::Usage(BABBLE)),
            ["overrun", "off"] => Self::Overrun(None),
            ["overrun", depth, service] => {
                let bad =
                    |_| StimulusError::BadValue { text: (*depth).into(), what: "number of frames", usage: OVERRUN };
                let depth = depth.parse().map_err(bad)?;
                Self::overrun(depth, delay(service, OVERRUN)?)?
            }
            ["overrun", ..] => return Err(StimulusError::Usage(OVERRUN)),
            ["corrupt", "off"] => Self::Corrupt(0.0),
            ["corrupt", text] => Self::Corrupt(probability(number(text), text, CORRUPT)?),
            ["corrupt", ..] => return Err(StimulusError::Usage(CORRUPT)),
            _ => return Err(StimulusError::Usage(ANY)),
        })
    }

    /// Its frames reach the bus between `min` and `max` late.
    ///
    /// # Errors
    /// It is more than a day, or `max` is less than `min`.
    pub fn late(min: Duration, max: Duration) -> Result<Self, StimulusError> {
        let (min_ns, max_ns) = (nanos(min, LATE)?, nanos(max, LATE)?);
        if max_ns < min_ns {
            let text = format!("{max:?}");
            return Err(StimulusError::BadValue { text, what: "longest delay", usage: LATE });
        }
        Ok(Self::Late(Some(Delay { min_ns, max_ns })))
    }

    /// It sends `frame` again and again, each `gap` after the one before went out.
    ///
    /// # Errors
    /// The gap is more than a day.
    pub fn babble(frame: Frame, gap: Duration) -> Result<Self, StimulusError> {
        Ok(Self::Babble(Some(Babble { frame, gap_ns: nanos(gap, BABBLE)? })))
    }

    /// It holds `depth` frames, and takes `service` for each.
    ///
    /// # Errors
    /// That is more than a day.
    pub fn overrun(depth: u32, service: Duration) -> Result<Self, StimulusError> {
        Ok(Self::Overrun(Some(Overrun { depth, service_ns: nanos(service, OVERRUN)? })))
    }

    /// Each attempt to send a frame fails with this probability.
    ///
    /// # Errors
    /// It is not from 0 to 1.
    pub fn corrupt(share: f64) -> Result<Self, StimulusError> {
        probability(share, share, CORRUPT).map(Self::Corrupt)
    }

    /// Puts it among what is wrong with a node already.
    pub(crate) fn put_into(self, faults: &mut NodeFaults) {
        match self {
            Self::Silent(silent) => faults.silent = silent,
            Self::Late(late) => faults.late = late,
            Self::Babble(babble) => faults.babble = babble,
            Self::Overrun(overrun) => faults.overrun = overrun,
            Self::Corrupt(corrupt) => faults.corrupt = corrupt,
        }
    }
}

impl WireFault {
    /// Each frame is destroyed with this probability.
    ///
    /// # Errors
    /// It is not from 0 to 1.
    pub fn corrupt(share: f64) -> Result<Self, StimulusError> {
        probability(share, share, WIRE).map(Self::Corrupt)
    }

    /// The `nth` frame from here on is destroyed at its `bit`-th bit.
    ///
    /// # Errors
    /// One of them is less than 1.
    pub fn destroy(nth: u32, bit: u32) -> Result<Self, StimulusError> {
        let bad = |text: u32, what| StimulusError::BadValue { text: text.to_string(), what, usage: WIRE };
        match (nth, bit) {
            (0, _) => Err(bad(nth, "number of a frame from 1 on")),
            (_, 0) => Err(bad(bit, "bit from 1 on")),
            _ => Ok(Self::Destroy { nth: nth.into(), bit }),
        }
    }

    /// From the words after `bus`.
    pub(crate) fn parse(words: &[&str]) -> Result<Self, StimulusError> {
        let whole = |text: &str, what| -> Result<u32, StimulusError> {
            let number = text.parse().ok().filter(|number| *number > 0);
            number.ok_or_else(|| StimulusError::BadValue { text: text.into(), what, usage: WIRE })
        };
        match words {
            ["corrupt", "off"] => Ok(Self::Corrupt(0.0)),
            ["corrupt", text] => Ok(Self::Corrupt(probability(number(text), text, WIRE)?)),
            ["destroy", nth, bit] => Ok(Self::Destroy {
                nth: whole(nth, "number of a frame from 1 on")?.into(),
                bit: whole(bit, "bit from 1 on")?,
            }),
            _ => Err(StimulusError::Usage(WIRE)),
        }
    }
}

/// What a word says; not a number where it says none.
fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::NAN)
}

fn probability(value: f64, text: impl ToString, usage: &'static str) -> Result<f64, StimulusError> {
    let bad = || StimulusError::BadValue { text: text.to_string(), what: "probability", usage };
    (0.0..=1.0).contains(&value).then_some(value).ok_or_else(bad)
}

fn delay(text: &str, usage: &'static str) -> Result<Duration, StimulusError> {
    can::parse_duration_in("ms", text).map_err(|_| StimulusError::BadValue {
        text: text.into(),
        what: "time in ms",
        usage,
    })
}

fn nanos(time: Duration, usage: &'static str) -> Result<u64, StimulusError> {
    let bad = || StimulusError::BadValue { text: format!("{time:?}"), what: "time in ms", usage };
    if time <= LONGEST { Ok(time.as_nanos() as u64) } else { Err(bad()) }
}

/// Milliseconds as they are read back: nanoseconds of a day fit a double.
fn millis(nanos: u64) -> f64 {
    nanos as f64 / 1e6
}

impl fmt::Display for BusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Silent(silent) => write!(f, "bus silent {}", if silent { "on" } else { "off" }),
            Self::Late(None) => f.write_str("bus late off"),
            Self::Late(Some(Delay { min_ns, max_ns })) => write!(f, "bus late {} {}", millis(min_ns), millis(max_ns)),
            Self::Babble(None) => f.write_str("bus babble off"),
            Self::Babble(Some(Babble { frame, gap_ns })) => write!(f, "bus babble {frame} {}", millis(gap_ns)),
            Self::Overrun(None) => f.write_str("bus overrun off"),
            Self::Overrun(Some(Overrun { depth, service_ns })) => {
                write!(f, "bus overrun {depth} {}", millis(service_ns))
            }
            Self::Corrupt(0.0) => f.write_str("bus corrupt off"),
            Self::Corrupt(share) => write!(f, "bus corrupt {share}"),
        }
    }
}

impl fmt::Display for WireFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Corrupt(0.0) => f.write_str("bus corrupt off"),
            Self::Corrupt(share) => write!(f, "bus corrupt {share}"),
            Self::Destroy { nth, bit } => write!(f, "bus destroy {nth} {bit}"),
        }
    }
}

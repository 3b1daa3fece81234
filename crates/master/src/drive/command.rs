//! A command to one drive as one value: a line of a scenario, a message to a host, the arguments of a command line and a call from
//! another language all become this, and are carried out by [`Drive::perform`].
//!
//! As text it is what people type: `enable`, `velocity 60rpm acceleration 500ms`, `move by 90deg at 30rpm no-wait`, `home 17`.

use core::fmt;
use core::str::FromStr;
use std::time::Duration;

use cia402::ModeOfOperation;

use super::guard::SwitchedOff;
use super::handle::Drive;
use super::homing::HomingOptions;
use super::motion::{MotionOptions, MotionReport};
use crate::error::Error;
use crate::host_loss::HostLoss;
use crate::units::{Along, Amperes, Angle, ParseUnitError, Ramp, Rpm, Turning, parse_duration};

/// What a drive is commanded to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// To operation enabled.
    Enable,
    /// To switched on or below.
    Disable,
    /// Stops by the ramp of the mode; the drive stays enabled.
    Stop,
    /// Quick stop.
    QuickStop,
    /// Resets a fault.
    ResetFault,
    /// Stores the parameters.
    Save,
    /// Restores the parameters as delivered.
    Restore,
    /// Has the drive stop when this host falls silent.
    Guard(SwitchedOff),
    /// Takes that back.
    ReleaseGuard,
    /// Sets the shaft in motion.
    Motion(Motion),
}

/// How a drive is commanded to move its shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Turns at a speed.
    Velocity(Along<Rpm>, Manner),
    /// Turns to a position, or by an angle from the last target.
    Move {
        /// Where to, or by how much.
        to: Along<Angle>,
        /// By so much from the last target.
        relative: bool,
        /// Largest speed on the way; as the drive has it with `None`.
        speed: Option<Along<Rpm>>,
        /// Its ramps, whether the target is waited for, and for how long.
        manner: Manner,
    },
    /// Applies a motor current.
    Torque(Amperes),
    /// Finds the reference position.
    Home {
        /// The method of CiA 402.
        method: i8,
        /// Speed of the search, of a model that has an object for it; `None` leaves it as the drive has it.
        speed: Option<Along<Rpm>>,
        /// Wait until it is found, and watch the drive meanwhile.
        wait: bool,
        /// Longest time that it may take; [the default](HomingOptions) with `None`.
        within: Option<Duration>,
    },
}

impl From<Motion> for Command {
    fn from(motion: Motion) -> Self {
        Self::Motion(motion)
    }
}

/// How a motion is to be made. `None` leaves a setting as the drive has it. Ramps may be along the way of what is moved:
/// the [gear](Drive::gear) of a drive makes a rotation of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manner {
    /// How fast the speed may rise.
    pub acceleration: Option<Along<Ramp>>,
    /// How fast the speed may fall.
    pub deceleration: Option<Along<Ramp>>,
    /// Wait until the target is reached, and watch the drive meanwhile.
    pub wait: bool,
    /// Longest time that it may take; the [computed](MotionOptions::within) one with `None`.
    pub within: Option<Duration>,
}

impl Default for Manner {
    fn default() -> Self {
        Self { acceleration: None, deceleration: None, wait: true, within: None }
    }
}

/// What came of a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// It is done.
    Done,
    /// What the drive does now when this host falls silent.
    Guarded(HostLoss),
    /// How the motion went.
    Moved(MotionReport),
}

impl Drive {
    /// Carries a command out.
    ///
    /// # Errors
    /// Those of the method of the same name; of a motion those of [`make`](Self::make).
    pub async fn perform(&self, command: &Command) -> Result<Report, Error> {
        match command {
            Command::Enable => self.enable().await,
            Command::Disable => self.disable().await,
            Command::Stop => self.stop().await,
            Command::QuickStop => self.quick_stop().await,
            Command::ResetFault => self.reset_fault().await,
            Command::Save => self.save().await,
            Command::Restore => self.restore().await,
            Command::ReleaseGuard => self.release_guard().await,
            Command::Guard(switched_off) => return self.guard(*switched_off).await.map(Report::Guarded),
            Command::Motion(motion) => return self.make(motion).await.map(Report::Moved),
        }
        .map(|()| Report::Done)
    }

    /// Makes a motion.
    ///
    /// # Errors
    /// Those of [`check_motion`](Self::check_motion) and of the method of the same name.
    pub async fn make(&self, motion: &Motion) -> Result<MotionReport, Error> {
        match motion {
            Motion::Velocity(speed, manner) => self.velocity(self.turning(*speed)?, manner.options(self, None)?).await,
            Motion::Move { to, relative, speed, manner } => {
                let (to, options) = (self.turning(*to)?, manner.options(self, *speed)?);
                match relative {
                    true => self.move_relative(to, options).await,
                    false => self.move_absolute(to, options).await,
                }
            }
            Motion::Torque(current) => self.torque(*current).await,
            Motion::Home { method, speed, wait, within } => {
                let speed = speed.map(|speed| self.turning(speed)).transpose()?;
                let limit = within.unwrap_or(HomingOptions::default().limit);
                self.home(*method, HomingOptions { speed, limit, wait: *wait }).await
            }
        }
    }

    /// Checks what can be known of a motion without asking the drive.
    ///
    /// # Errors
    /// [`Error::NoFeed`] for a way, where the [gear](Self::gear) has no feed; [`Error::NoSuchMode`] where the model has no mode for it.
    pub fn check_motion(&self, motion: &Motion) -> Result<(), Error> {
        if let Some(axis) = self.axis_description() {
            let (mode, is_there) = match motion {
                Motion::Velocity(..) => (axis.velocity_mode(), true),
                Motion::Move { .. } => (ModeOfOperation::PROFILE_POSITION, true),
                Motion::Torque(_) => (ModeOfOperation::PROFILE_TORQUE, axis.units.target_current.is_some()),
                Motion::Home { .. } => (ModeOfOperation::HOMING, axis.homing.is_some()),
            };
            if !(is_there && axis.modes.contains(&mode)) {
                return Err(self.no_such_mode(axis, mode));
            }
        }
        match motion {
            Motion::Velocity(speed, manner) => self.turning(*speed).and_then(|_| manner.options(self, None)).map(drop),
            Motion::Move { to, speed, manner, .. } => {
                self.turning(*to).and_then(|_| manner.options(self, *speed)).map(drop)
            }
            Motion::Torque(_) => Ok(()),
            Motion::Home { speed, .. } => speed.map_or(Ok(()), |speed| self.turning(speed).map(drop)),
        }
    }
}

impl Manner {
    /// The same for this drive, with this largest speed.
    fn options(&self, drive: &Drive, speed: Option<Along<Rpm>>) -> Result<MotionOptions, Error> {
        let ramp = |ramp: Option<Along<Ramp>>| ramp.map(|ramp| drive.turning(ramp)).transpose();
        Ok(MotionOptions {
            speed: speed.map(|speed| drive.turning(speed)).transpose()?,
            acceleration: ramp(self.acceleration)?,
            deceleration: ramp(self.deceleration)?,
            wait: self.wait,
            within: self.within,
        })
    }
}

impl Command {
    /// Every form of it as text.
    pub const FORMS: &[&str] = &[
        "enable|disable|stop|quick-stop|reset|save|restore|guard [leave]|release",
        "velocity SPEED [acceleration RAMP] [deceleration RAMP] [within TIME] [no-wait]",
        "move [by] POSITION [at SPEED] [acceleration RAMP] [deceleration RAMP] [within TIME] [no-wait]",
        "torque CURRENT",
        "home METHOD [at SPEED] [within TIME] [no-wait]",
    ];

    /// The words of the commands that have no value.
    const PLAIN: [(&str, Self); 10] = [
        ("enable", Self::Enable),
        ("disable", Self::Disable),
        ("stop", Self::Stop),
        ("quick-stop", Self::QuickStop),
        ("reset", Self::ResetFault),
        ("save", Self::Save),
        ("restore", Self::Restore),
        ("guard", Self::Guard(SwitchedOff::SwitchOn)),
        ("guard leave", Self::Guard(SwitchedOff::Leave)),
        ("release", Self::ReleaseGuard),
    ];
}

/// Why a text is not a command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParseCommandError {
    /// Not one of the [forms](Command::FORMS).
    #[error("'{0}' is not a command to a drive; expected one of: {forms}", forms = Command::FORMS.join("; "))]
    Form(String),
    /// An option without its value.
    #[error("'{0}' has no value; expected one as in: {0} {example}", example = example(.0))]
    NoValue(String),
    /// Not an option of this motion.
    #[error("'{word}' is not an option of {motion}; expected {options}")]
    Option {
        /// What was typed.
        word: String,
        /// The motion.
        motion: &'static str,
        /// The options that it has.
        options: String,
    },
    /// Not a homing method.
    #[error("'{0}' is not a homing method; expected a number from -128 to 127, as in: home 17")]
    Method(String),
    /// Not a quantity.
    #[error(transparent)]
    Quantity(#[from] ParseUnitError),
}

fn example(option: &str) -> &'static str {
    match option {
        "at" => "60rpm",
        "within" => "5s",
        _ => "500ms",
    }
}

impl FromStr for Command {
    type Err = ParseCommandError;

    fn from_str(text: &str) -> Result<Self, ParseCommandError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        if let Some((_, command)) = Self::PLAIN.iter().find(|(plain, _)| plain.split(' ').eq(words.iter().copied())) {
            return Ok(*command);
        }
        match *words {
            ["velocity", speed, ref rest @ ..] => Ok(Motion::Velocity(speed.parse()?, manner("velocity", rest)?.1)),
            ["move", "by", to, ref rest @ ..] => movement(to, true, rest),
            ["move", to, ref rest @ ..] if to != "by" => movement(to, false, rest),
            ["torque", current] => Ok(Motion::Torque(current.parse()?)),
            ["home", method, ref rest @ ..] => {
                let number = method.parse().map_err(|_| ParseCommandError::Method(method.to_owned()))?;
                let (speed, Manner { wait, within, .. }) = manner("home", rest)?;
                Ok(Motion::Home { method: number, speed, wait, within })
            }
            _ => Err(ParseCommandError::Form(words.join(" "))),
        }
        .map(Self::Motion)
    }
}

/// The options of a motion with their values, as its form has them behind its target: `at SPEED`, `no-wait`.
fn options_of(motion: &str) -> impl Iterator<Item = &'static str> {
    let form = Command::FORMS.iter().find(|form| form.split(' ').next() == Some(motion));
    form.into_iter().flat_map(|form| form.split('[')).filter_map(|part| part.trim_end().strip_suffix(']'))
}

fn movement(to: &str, relative: bool, rest: &[&str]) -> Result<Motion, ParseCommandError> {
    let (speed, manner) = manner("move", rest)?;
    Ok(Motion::Move { to: to.parse()?, relative, speed, manner })
}

/// What stands behind the target of a motion: its speed and how it is made.
fn manner(motion: &'static str, mut words: &[&str]) -> Result<(Option<Along<Rpm>>, Manner), ParseCommandError> {
    let (mut speed, mut manner) = (None, Manner::default());
    while let Some((&word, rest)) = words.split_first() {
        if !options_of(motion).any(|option| option.split(' ').next() == Some(word)) {
            let options: Vec<_> = options_of(motion).collect();
            let options = options.join(", ").replace(", no-wait", " or no-wait");
            return Err(ParseCommandError::Option { word: word.to_owned(), motion, options });
        }
        words = rest;
        if word == "no-wait" {
            manner.wait = false;
            continue;
        }
        let Some((&value, rest)) = rest.split_first() else {
            return Err(ParseCommandError::NoValue(word.to_owned()));
        };
        words = rest;
        match word {
            "at" => speed = Some(value.parse()?),
            "acceleration" => manner.acceleration = Some(value.parse()?),
            "deceleration" => manner.deceleration = Some(value.parse()?),
            _ => manner.within = Some(parse_duration(value)?),
        }
    }
    Ok((speed, manner))
}

impl fmt::Display for Command {
    /// As it is typed: it is parsed again as the same value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Motion(motion) => motion.fmt(f),
            plain => {
                let word = Self::PLAIN.iter().find(|(_, command)| command == plain);
                f.write_str(word.map_or("", |(word, _)| word))
            }
        }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Velocity(speed, manner) => write!(f, "velocity {}{manner}", typed(speed, rotation_speed)),
            Self::Move { to, relative, speed, manner } => {
                let by = if *relative { "by " } else { "" };
                write!(f, "move {by}{}{}{manner}", typed(to, rotation), at(speed))
            }
            Self::Torque(Amperes(current)) => write!(f, "torque {current}A"),
            Self::Home { method, speed, wait, within } => {
                let manner = Manner { wait: *wait, within: *within, ..Manner::default() };
                write!(f, "home {method}{}{manner}", at(speed))
            }
        }
    }
}

impl fmt::Display for Manner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (option, ramp) in [("acceleration", &self.acceleration), ("deceleration", &self.deceleration)] {
            if let Some(ramp) = ramp {
                write!(f, " {option} {}", typed(ramp, rotation_ramp))?;
            }
        }
        if let Some(within) = self.within {
            write!(f, " within {}s", within.as_secs_f64())?;
        }
        f.write_str(if self.wait { "" } else { " no-wait" })
    }
}

fn at(speed: &Option<Along<Rpm>>) -> String {
    speed.as_ref().map_or_else(String::new, |speed| format!(" at {}", typed(speed, rotation_speed)))
}

/// A quantity with all of its digits, unlike its [`Display`](fmt::Display) for people.
fn typed<T: Turning>(quantity: &Along<T>, rotation: impl Fn(&T) -> String) -> String {
    match quantity {
        Along::Turning(turning) => rotation(turning),
        Along::Metres(metres) => format!("{metres}m{}", T::PER[0]),
    }
}

fn rotation_speed(Rpm(speed): &Rpm) -> String {
    format!("{speed}rpm")
}

fn rotation(angle: &Angle) -> String {
    match angle {
        Angle::Counts(counts) => counts.to_string(),
        Angle::Turns(turns) => format!("{turns}turn"),
    }
}

fn rotation_ramp(ramp: &Ramp) -> String {
    match ramp {
        Ramp::RpmPerSecond(rate) => format!("{rate}rpm/s"),
        Ramp::Time(time) => format!("{}s", time.as_secs_f64()),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn speed() -> impl Strategy<Value = Along<Rpm>> {
        let value = -1e6..1e6f64;
        prop_oneof![value.clone().prop_map(|rpm| Along::Turning(Rpm(rpm))), value.prop_map(Along::Metres)]
    }

    fn ramp() -> impl Strategy<Value = Along<Ramp>> {
        prop_oneof![
            (1e-3..1e6f64).prop_map(|rate| Along::Turning(Ramp::RpmPerSecond(rate))),
            (1u64..100_000).prop_map(|ms| Along::Turning(Ramp::Time(Duration::from_millis(ms)))),
            (1e-3..1e6f64).prop_map(Along::Metres),
        ]
    }

    fn angle() -> impl Strategy<Value = Along<Angle>> {
        prop_oneof![
            any::<i32>().prop_map(|counts| Along::Turning(Angle::Counts(counts.into()))),
            (-1e6..1e6f64).prop_map(|turns| Along::Turning(Angle::Turns(turns))),
            (-1e3..1e3f64).prop_map(Along::Metres),
        ]
    }

    fn within() -> impl Strategy<Value = Option<Duration>> {
        prop::option::of((0u64..1_000_000).prop_map(Duration::from_millis))
    }

    fn any_manner() -> impl Strategy<Value = Manner> {
        (prop::option::of(ramp()), prop::option::of(ramp()), any::<bool>(), within())
            .prop_map(|(acceleration, deceleration, wait, within)| Manner { acceleration, deceleration, wait, within })
    }

    fn command() -> impl Strategy<Value = Command> {
        let plain = prop::sample::select(Command::PLAIN.map(|(_, command)| command).to_vec());
        let motion = prop_oneof![
            (speed(), any_manner()).prop_map(|(speed, manner)| Motion::Velocity(speed, manner)),
            (angle(), any::<bool>(), prop::option::of(speed()), any_manner())
                .prop_map(|(to, relative, speed, manner)| Motion::Move { to, relative, speed, manner }),
            (-1e3..1e3f64).prop_map(|amperes| Motion::Torque(Amperes(amperes))),
            (any::<i8>(), prop::option::of(speed()), any::<bool>(), within())
                .prop_map(|(method, speed, wait, within)| Motion::Home { method, speed, wait, within }),
        ];
        prop_oneof![plain, motion.prop_map(Command::Motion)]
    }

    proptest! {
        #[test]
        fn what_is_printed_is_parsed_as_the_same(command in command()) {
            prop_assert_eq!(command.to_string().parse(), Ok(command));
        }

        #[test]
        fn any_text_is_a_command_or_refused(text in "([a-z0-9.-]{0,8} ){0,6}") {
            let _ = text.parse::<Command>();
        }
    }

    #[test]
    fn what_is_wrong_is_refused_with_what_was_expected() {
        for (text, said) in [
            ("", "expected one of"),
            ("dance", "expected one of: enable|disable"),
            ("enable now", "expected one of"),
            ("velocity", "expected one of"),
            ("velocity fast", "does not begin with a number"),
            ("velocity 60rpm at 5rpm", "'at' is not an option of velocity; expected acceleration"),
            ("move by", "expected one of"),
            ("move 90deg at", "'at' has no value; expected one as in: at 60rpm"),
            ("move 90deg quickly", "expected at SPEED"),
            ("home up", "expected a number from -128 to 127"),
            ("home 200", "expected a number from -128 to 127"),
            ("home 17 acceleration 1s", "is not an option of home; expected at SPEED, within TIME or no-wait"),
            (
                "move by 1deg by",
                "'by' is not an option of move; expected at SPEED, acceleration RAMP, deceleration RAMP,",
            ),
            ("torque 2", "has no unit"),
        ] {
            let refused = text.parse::<Command>().err().map(|error| error.to_string()).unwrap_or_default();
            assert!(refused.contains(said), "{text}: {refused}");
        }
    }
}

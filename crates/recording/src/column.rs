//! What a record has of what.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use sim::Place;
use sim::coupling::BodyState;
use sim::recorder::{Channel, Signal};

use words::suggest::{did_you_mean, near};

/// What a column is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Subject {
    /// An axis of a node.
    Axis(Place),
    /// A body that drives move, by its name.
    Body(String),
}

/// One signal over time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Of what.
    pub subject: Subject,
    /// Its name with the unit in it: `velocity_rpm`.
    pub signal: Cow<'static, str>,
    /// Its unit as people write it; empty for what has none.
    pub unit: Cow<'static, str>,
}

impl Column {
    /// A signal of an axis.
    pub fn of_axis(Channel { place, signal }: Channel) -> Self {
        Self { subject: Subject::Axis(place), signal: signal.name().into(), unit: signal.unit().into() }
    }

    /// The signals of a machine that drives move.
    pub fn of_body(body: &BodyState) -> Vec<Self> {
        let subject = Subject::Body(body.name.clone());
        let column = |(signal, _): (String, f64)| Self {
            subject: subject.clone(),
            unit: unit_of(&signal).into(),
            signal: signal.into(),
        };
        body.kind.signals().into_iter().map(column).collect()
    }

    /// How many binary digits after the point an MCAP file and those who watch get of it; `None`: all of them. Of a simulated
    /// value, the last of 53 digits say nothing of a drive.
    pub(super) fn kept_bits(&self) -> Option<u8> {
        let is_simulated =
            matches!(self.subject, Subject::Body(_)) || Signal::ALL.iter().any(|it| it.name() == self.signal);
        KEPT_BITS.iter().find(|(unit, _)| is_simulated && *unit == self.unit).map(|(_, bits)| *bits)
    }

    /// Its name in a file, `4.velocity_rpm`, and back: see [`FromStr`].
    pub fn name(&self) -> String {
        format!("{}.{}", self.subject, self.signal)
    }
}

impl fmt::Display for Subject {
    /// `4`, `5.2`, `base`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axis(place) => place.fmt(f),
            Self::Body(name) => f.write_str(name),
        }
    }
}

impl Subject {
    /// Its topic in an MCAP file: `/node/4`, `/node/5/2`, `/body/base`.
    pub(super) fn topic(&self) -> String {
        match self {
            Self::Axis(place) => format!("/node/{}", place.to_string().replace('.', "/")),
            Self::Body(name) => format!("/body/{name}"),
        }
    }

    /// The subject of a topic; `None` for a topic of another kind.
    pub(super) fn of_topic(topic: &str) -> Option<Self> {
        if let Some(name) = topic.strip_prefix("/body/") {
            return Some(Self::Body(name.to_owned()));
        }
        topic.strip_prefix("/node/")?.replace('/', ".").parse().ok()
    }

    /// In words: `node 4`, `node 5, axis 2`, `base`.
    pub fn title(&self) -> String {
        match self {
            Self::Axis(place) => match place.to_string().split_once('.') {
                Some((node, axis)) => format!("node {node}, axis {axis}"),
                None => format!("node {place}"),
            },
            Self::Body(name) => name.clone(),
        }
    }
}

impl FromStr for Subject {
    type Err = std::convert::Infallible;

    /// A place is an axis, anything else the name of a body.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(text.parse().map_or_else(|_| Self::Body(text.to_owned()), Self::Axis))
    }
}

impl FromStr for Column {
    type Err = String;

    /// `4.velocity_rpm`, `5.2.velocity_rpm`, `base.x_m`.
    fn from_str(name: &str) -> Result<Self, String> {
        let (subject, signal) =
            name.rsplit_once('.').ok_or_else(|| format!("'{name}' is not of the form NODE.SIGNAL"))?;
        let Ok(subject) = subject.parse();
        let known = Signal::ALL.into_iter().find(|known| known.name() == signal);
        let unit = known.map_or_else(|| unit_of(signal).into(), |known| Cow::from(known.unit()));
        Ok(Self { subject, signal: Cow::from(signal.to_owned()), unit })
    }
}

/// How the name of a signal ends, and the unit that it says.
const ENDINGS: [(&str, &str); 13] = [
    ("_counts", "counts"),
    ("_rpm", "r/min"),
    ("_rad_s", "rad/s"),
    ("_deg_s", "°/s"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_deg", "°"),
    ("_nm", "N·m"),
    ("_a", "A"),
    ("_v", "V"),
    ("_c", "°C"),
    ("_j", "J"),
    ("_m", "m"),
];

/// The unit that a name ends with.
pub(super) fn unit_of(signal: &str) -> &'static str {
    ENDINGS.iter().find(|(ending, _)| signal.ends_with(ending)).map_or("", |(_, unit)| unit)
}

/// What the name of a signal ends with for its unit: `_rpm` for `r/min`; empty for a unit that names do not have.
pub fn ending_of(unit: &str) -> &'static str {
    ENDINGS.iter().find(|(_, known)| *known == unit).map_or("", |(ending, _)| ending)
}

/// Whether a signal has this name, with its unit or without: `velocity_rpm` is called `velocity`, `velocity_demand_rpm` is not.
pub fn is_called(signal: &str, name: &str) -> bool {
    let unit = signal.strip_prefix(name);
    unit.is_some_and(|unit| unit.is_empty() || ENDINGS.iter().any(|(ending, _)| *ending == unit))
}

/// What is kept of a simulated value, by its unit: steps of 2 thousandths of 1 r/min, 1 mA, 8 mV, 16 mK, 8 urad, 0.5 mN·m, 8 mJ, 1 um.
const KEPT_BITS: [(&str, u8); 12] = [
    ("r/min", 9),
    ("A", 10),
    ("V", 7),
    ("°C", 6),
    ("rad", 17),
    ("rad/s", 10),
    ("°", 12),
    ("°/s", 6),
    ("N·m", 11),
    ("J", 7),
    ("m", 20),
    ("m/s", 14),
];

/// Every signal of these axes.
pub fn columns_of_drives(places: impl IntoIterator<Item = Place>) -> Vec<Column> {
    let all = |place| Signal::ALL.map(|signal| Column::of_axis(Channel { place, signal }));
    places.into_iter().flat_map(all).collect()
}

/// Which of `names` the patterns ask for, in the order of the names: a pattern is a name (`4.velocity_rpm`), the beginning of
/// a signal (`velocity`, of everything), or has `*` for anything (`4.*`, `*.current_a`).
///
/// # Errors
/// A sentence about a pattern that asks for nothing, with the nearest name.
pub fn select(names: &[String], patterns: &[String]) -> Result<Vec<usize>, String> {
    let mut wanted = vec![false; names.len()];
    for pattern in patterns {
        let mut found = false;
        for (name, wanted) in names.iter().zip(&mut wanted) {
            let signal = name.rsplit_once('.').map_or(name.as_str(), |(_, signal)| signal);
            let asked = if pattern.contains('*') {
                fits(pattern, name)
            } else {
                name == pattern || signal.starts_with(pattern.as_str())
            };
            *wanted |= asked;
            found |= asked;
        }
        if !found {
            return Err(nothing_like(pattern, names));
        }
    }
    Ok((0..names.len()).filter(|i| wanted[*i]).collect())
}

/// Whether `name` is the pattern with something for each `*`.
fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, rest)) => name.strip_prefix(head).is_some_and(|name| {
            // The shortest first: names are short.
            name.char_indices().map(|(at, _)| at).chain([name.len()]).any(|at| fits(rest, &name[at..]))
        }),
    }
}

fn nothing_like(pattern: &str, names: &[String]) -> String {
    let signal_of = |name: &'_ String| name.rsplit_once('.').map_or(name.clone(), |(_, signal)| signal.to_owned());
    let mut signals: Vec<String> = names.iter().map(signal_of).collect();
    signals.sort_unstable();
    signals.dedup();
    // Who names a node means one signal of it; who does not, means a kind.
    let candidates = if pattern.contains('.') { names } else { &signals };
    let hint = did_you_mean(&near(pattern, candidates.iter().map(String::as_str)));
    format!("unknown signal '{pattern}'{hint}\nsignals: {}", signals.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Vec<String> {
        columns_of_drives([Place::node(4), Place::node(5)]).iter().map(Column::name).collect()
    }

    fn selected(patterns: &[&str]) -> Result<Vec<String>, String> {
        let patterns: Vec<String> = patterns.iter().map(|pattern| (*pattern).to_owned()).collect();
        select(&names(), &patterns).map(|chosen| chosen.into_iter().map(|i| names()[i].clone()).collect())
    }

    #[test]
    fn a_name_gives_the_kind_of_its_column() {
        for column in columns_of_drives([Place::node(4), "5.2".parse().unwrap()]) {
            assert_eq!(column.name().parse(), Ok(column.clone()));
            assert_eq!(Subject::of_topic(&column.subject.topic()), Some(column.subject));
        }
        let pose: Column = "base.x_m".parse().unwrap();
        assert_eq!((&*pose.unit, pose.subject.topic()), ("m", "/body/base".to_owned()));
        assert_eq!("base.speed_m_s".parse::<Column>().unwrap().unit, "m/s");
        assert!("velocity".parse::<Column>().is_err());
    }

    #[test]
    fn patterns_select_by_name_by_beginning_and_by_star() {
        assert_eq!(selected(&["4.velocity_rpm"]).unwrap(), ["4.velocity_rpm"]);
        assert_eq!(selected(&["supply"]).unwrap(), ["4.supply_v", "5.supply_v"]);
        assert_eq!(selected(&["5.current*"]).unwrap(), ["5.current_a", "5.current_demand_a"]);
        assert_eq!(selected(&["*"]).unwrap().len(), names().len());
        let error = selected(&["velocty_rpm"]).unwrap_err();
        assert!(error.contains("did you mean velocity_rpm?") && error.contains("supply_v"), "{error}");
        assert!(selected(&["6.*"]).is_err());
    }
}

//! What a scenario waits for and expects, in words: `4 velocity > 50`, `4 statusword bit 10`, `frame 084#1032`.
//!
//! A condition about values holds for some time; one about what happens ([`Condition::is_event`]: frames, events of the world) holds
//! at that instant only. Words that are not a condition are refused with the possible forms.

use std::fmt;

use can::Frame;
use cia402::{PowerState, Statusword};
use sim::recorder::Signal;
use sim::wire::{ErrorState, WireEvent};
use sim::{Brake, Place, Report, World};

use super::occurrence::{EventPattern, Occurrence, code, spelled};
use words::suggest::{did_you_mean, near};

/// Every form of a condition, for messages and the manual.
pub const FORMS: &[&str] = &[
    "NODE SIGNAL =|!=|<|<=|>|>= NUMBER [+- TOLERANCE]",
    "NODE statusword bit N",
    "NODE state STATE (as in operation-enabled)",
    "NODE powered",
    "NODE fault [CODE]",
    "NODE damaged",
    "NODE brake engaged|released",
    "NODE output NAME",
    "NODE bus error-active|error-passive|bus-off|cut",
    "NODE boots",
    "NODE emcy [CODE]",
    "NODE event KIND [WHAT]",
    "body NAME SIGNAL =|!=|<|<=|>|>= NUMBER [+- TOLERANCE]",
    "frame ID#[DATA] (.. for any byte)",
    "error frame",
    "event KIND [WHAT]",
    "done NAME",
    "not CONDITION",
    "CONDITION and CONDITION",
];

/// So many of them, the first, are about a node.
const NODE_FORMS: usize = 12;

/// Something that is so or is not.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// A signal of an axis compared with a number.
    Signal(Place, Signal, Comparison),
    /// A bit of the statusword is set.
    Bit(Place, u8),
    /// The power state by the statusword.
    Power(Place, PowerState),
    /// The supply is switched on.
    Powered(Place),
    /// A fault is present: any, or the one with this code in the drive's own numbering.
    Fault(Place, Option<u32>),
    /// Something has been destroyed.
    Damaged(Place),
    /// The brake is engaged, or released.
    Brake(Place, bool),
    /// A digital output is on.
    Output(Place, String),
    /// The state of the node's CAN controller; `None`: its cable is cut.
    Bus(u8, Option<ErrorState>),
    /// A signal of a body that drives move, by the names of both, compared with a number.
    Body(String, String, Comparison),
    /// Now a frame like this has passed.
    Frame(Pattern),
    /// Now an attempt to send a frame has failed.
    ErrorFrame,
    /// The world has just reported such an event.
    Event(EventPattern),
    /// The step or the host of this name is done.
    Done(String),
    /// The other is not so.
    Not(Box<Self>),
    /// All are so at once.
    All(Vec<Self>),
}

/// How a number is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    order: Order,
    value: f64,
    tolerance: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Equal,
    Unequal,
    Below,
    AtMost,
    Above,
    AtLeast,
}

const ORDERS: [(&str, Order); 7] = [
    ("=", Order::Equal),
    ("==", Order::Equal),
    ("!=", Order::Unequal),
    ("<", Order::Below),
    ("<=", Order::AtMost),
    (">", Order::Above),
    (">=", Order::AtLeast),
];

impl Comparison {
    fn holds(&self, value: f64) -> bool {
        match self.order {
            Order::Equal => (value - self.value).abs() <= self.tolerance,
            // A value that is not there is not unequal: it is not there.
            Order::Unequal => (value - self.value).abs() > self.tolerance,
            Order::Below => value < self.value,
            Order::AtMost => value <= self.value,
            Order::Above => value > self.value,
            Order::AtLeast => value >= self.value,
        }
    }
}

/// An identifier and bytes, some of which may be any.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    id: u32,
    extended: bool,
    bytes: Vec<Option<u8>>,
    /// Nothing may follow the bytes.
    whole: bool,
}

impl Pattern {
    fn matches(&self, frame: &Frame) -> bool {
        let data = frame.data();
        let alike = self.bytes.iter().zip(data).all(|(wanted, byte)| wanted.is_none_or(|wanted| wanted == *byte));
        let long = data.len() == self.bytes.len() || !self.whole && data.len() > self.bytes.len();
        frame.id().raw() == self.id && frame.id().is_extended() == self.extended && alike && long
    }

    /// `084#1032`, `184#3706..`, `704#`: what follows the bytes may be anything.
    fn parse(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("'{text}' is not a frame; expected ID#DATA in hexadecimal, as in 084#1032 or 184#37..00");
        let (id, data) = text.split_once('#').ok_or_else(wrong)?;
        let number = u32::from_str_radix(id, 16).ok().filter(|_| !id.starts_with('+')).ok_or_else(wrong)?;
        let extended = id.len() > 3;
        if number > if extended { 0x1FFF_FFFF } else { 0x7FF } || !data.is_ascii() || data.len() > 16 {
            return Err(wrong());
        }
        let byte = |pair: &[u8]| match pair {
            b".." => Some(None),
            _ => u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok().filter(|_| pair.len() == 2).map(Some),
        };
        let bytes = data.as_bytes().chunks(2).map(byte).collect::<Option<Vec<_>>>().ok_or_else(wrong)?;
        Ok(Self { id: number, extended, bytes, whole: false })
    }
}

/// What there is to look at when a condition is asked.
pub struct View<'a> {
    /// The world as it is now.
    pub world: &'a mut World,
    /// What has just happened, if this is asked because of it.
    pub occurrence: Option<Occurrence<'a>>,
    /// Whether the step or host of a name is done.
    pub done: &'a dyn Fn(&str) -> bool,
}

impl View<'_> {
    fn report(&mut self, place: Place) -> Option<Report> {
        let report = self.world.with_drive(place.node, |drive, now| {
            drive.advance(now);
            drive.check_axis(place.axis).ok().map(|()| drive.report_of(place.axis))
        });
        report.ok().flatten()
    }
}

impl Condition {
    /// True if it is about what happens, and so holds at instants only.
    pub fn is_event(&self) -> bool {
        match self {
            Self::Frame(_) | Self::ErrorFrame | Self::Event(_) => true,
            Self::All(parts) => parts.iter().any(Self::is_event),
            _ => false,
        }
    }

    /// True if it is about events that only a watched world reports.
    pub fn needs_events(&self) -> bool {
        match self {
            Self::Event(_) => true,
            Self::All(parts) => parts.iter().any(Self::needs_events),
            _ => false,
        }
    }

    /// The nodes and the names of steps that it speaks of.
    pub fn names<'a>(&'a self, node: &mut dyn FnMut(Place), name: &mut dyn FnMut(&'a str)) {
        match self {
            Self::Signal(place, ..)
            | Self::Bit(place, _)
            | Self::Power(place, _)
            | Self::Powered(place)
            | Self::Fault(place, _)
            | Self::Damaged(place)
            | Self::Brake(place, _)
            | Self::Output(place, _) => node(*place),
            Self::Bus(number, _) => node(Place::node(*number)),
            Self::Frame(_) | Self::ErrorFrame | Self::Body(..) => {}
            Self::Event(pattern) => pattern.place().into_iter().for_each(node),
            Self::Done(it) => name(it),
            Self::Not(part) => part.names(node, name),
            Self::All(parts) => parts.iter().for_each(|part| part.names(node, name)),
        }
    }

    /// The bodies and their signals that it speaks of.
    pub fn bodies<'a>(&'a self, body: &mut dyn FnMut(&'a str, &'a str)) {
        match self {
            Self::Body(name, signal, _) => body(name, signal),
            Self::Not(part) => part.bodies(body),
            Self::All(parts) => parts.iter().for_each(|part| part.bodies(body)),
            _ => {}
        }
    }

    /// Whether it is so now.
    pub fn holds(&self, view: &mut View<'_>) -> bool {
        match self {
            Self::Frame(pattern) => {
                matches!(view.occurrence, Some(Occurrence::Wire(WireEvent::Frame { frame, .. })) if pattern.matches(frame))
            }
            Self::ErrorFrame => matches!(view.occurrence, Some(Occurrence::Wire(WireEvent::Error { .. }))),
            Self::Event(pattern) => matches!(view.occurrence, Some(Occurrence::Event(event)) if pattern.matches(event)),
            Self::Body(name, signal, comparison) => {
                of_body(view.world, name, signal).is_some_and(|value| comparison.holds(value))
            }
            Self::Bus(node, state) => view.world.drive_id(*node).is_some_and(|id| match state {
                None => view.world.is_cut(id),
                Some(state) => !view.world.is_cut(id) && view.world.counters(id).state() == *state,
            }),
            Self::Done(name) => (view.done)(name),
            Self::Not(part) => !part.holds(view),
            Self::All(parts) => parts.iter().all(|part| part.holds(view)),
            Self::Signal(place, signal, comparison) => {
                view.report(*place).is_some_and(|report| comparison.holds(signal.of(&report)))
            }
            Self::Bit(place, _)
            | Self::Power(place, _)
            | Self::Powered(place)
            | Self::Fault(place, _)
            | Self::Damaged(place)
            | Self::Brake(place, _)
            | Self::Output(place, _) => view.report(*place).is_some_and(|report| self.holds_in(&report)),
        }
    }

    fn holds_in(&self, report: &Report) -> bool {
        match self {
            Self::Bit(_, bit) => report.statusword.is_some_and(|word| word >> bit & 1 == 1),
            Self::Power(_, state) => report.statusword.and_then(|word| Statusword(word).state()) == Some(*state),
            Self::Powered(_) => report.powered,
            Self::Fault(_, None) => report.error_code != 0,
            Self::Fault(_, Some(code)) => report.error_code == *code,
            Self::Damaged(_) => report.damage.is_some(),
            Self::Brake(_, engaged) => report.brake.is_some_and(|brake| (brake == Brake::Engaged) == *engaged),
            Self::Output(_, name) => {
                report.outputs.iter().any(|(output, level)| level && output.eq_ignore_ascii_case(name))
            }
            _ => false,
        }
    }

    /// Its present state, for people.
    pub fn seen(&self, view: &mut View<'_>) -> String {
        match self {
            Self::Frame(_) | Self::ErrorFrame | Self::Event(_) => match (view.occurrence, self) {
                (Some(occurrence), _) => occurrence.to_string(),
                (None, Self::Event(_)) => "no such event".into(),
                (None, _) => "no such frame".into(),
            },
            Self::Body(name, signal, _) => match of_body(view.world, name, signal) {
                Some(value) => format!("{signal} {}", master::units::Shown(value)),
                None => format!("there is no {signal} of a body {name}"),
            },
            Self::Bus(node, _) => match view.world.drive_id(*node) {
                Some(id) if view.world.is_cut(id) => format!("node {node}: cable cut"),
                Some(id) => {
                    let counters = view.world.counters(id);
                    format!("node {node}: {:?}, TEC {}, REC {}", counters.state(), counters.tec(), counters.rec())
                }
                None => format!("there is no node {node}"),
            },
            Self::Done(name) => format!("'{name}' is {}done", if (view.done)(name) { "" } else { "not " }),
            Self::Not(part) => part.seen(view),
            Self::All(parts) => parts.iter().map(|part| part.seen(view)).collect::<Vec<_>>().join("; "),
            Self::Signal(place, signal, _) => match view.report(*place) {
                Some(report) => {
                    let value = signal.of(&report);
                    let unit = signal.unit();
                    let gap = if unit.is_empty() { "" } else { " " };
                    if value.is_nan() {
                        "no value".into()
                    } else {
                        format!("{}{gap}{unit}", master::units::Shown(value))
                    }
                }
                None => format!("there is no {place}"),
            },
            Self::Bit(place, _)
            | Self::Power(place, _)
            | Self::Powered(place)
            | Self::Fault(place, _)
            | Self::Damaged(place)
            | Self::Brake(place, _)
            | Self::Output(place, _) => match view.report(*place) {
                Some(report) => self.seen_in(&report),
                None => format!("there is no {place}"),
            },
        }
    }

    fn seen_in(&self, report: &Report) -> String {
        match self {
            Self::Bit(..) | Self::Power(..) => match report.statusword {
                Some(word) => {
                    let state = Statusword(word).state().map_or("no state of CiA 402", PowerState::name);
                    format!("statusword {word:04X}h ({state})")
                }
                None => "no statusword: no power".into(),
            },
            Self::Powered(_) => format!("powered {}", report.powered),
            Self::Fault(..) if report.error_code == 0 => "no fault".into(),
            Self::Fault(..) => format!("fault {:04X}h", report.error_code),
            Self::Damaged(_) => report.damage.unwrap_or("no damage").into(),
            Self::Brake(..) => {
                report.brake.map_or("no brake".into(), |brake| format!("brake {brake:?}").to_lowercase())
            }
            _ => {
                let levels: Vec<_> =
                    report.outputs.iter().map(|(name, on)| format!("{name} {}", u8::from(on))).collect();
                levels.join(", ")
            }
        }
    }
}

/// A number of a body that drives move, by its name with the unit: `x_m`.
pub(super) fn of_body(world: &mut World, name: &str, signal: &str) -> Option<f64> {
    let signals = world.body(name)?.kind.signals();
    signals.into_iter().find(|(known, _)| known == signal).map(|(_, value)| value)
}

/// The name of a signal without its unit: `velocity` of `velocity_rpm`.
fn short_name(signal: Signal) -> &'static str {
    let name = signal.name();
    if signal.unit().is_empty() { name } else { name.rsplit_once('_').map_or(name, |(name, _)| name) }
}

/// The signal that is meant: `velocity`, `velocity_rpm`.
///
/// # Errors
/// It is unknown, with the known ones.
pub fn signal(word: &str) -> Result<Signal, String> {
    let found = Signal::ALL.into_iter().find(|signal| signal.name() == word || short_name(*signal) == word);
    found.ok_or_else(|| {
        let near = did_you_mean(&near(word, Signal::ALL.into_iter().map(short_name)));
        let known: Vec<_> = Signal::ALL.into_iter().map(short_name).collect();
        format!("'{word}' is not a signal of a node{near}; a node has: {}, and: state, fault, powered, damaged, brake, output, bus, boots, emcy, event", known.join(", "))
    })
}

impl std::str::FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let parts: Vec<_> = words.split(|word| *word == "and").map(one).collect::<Result<_, _>>()?;
        match <[Self; 1]>::try_from(parts) {
            Ok([one]) => Ok(one),
            Err(parts) => Ok(Self::All(parts)),
        }
    }
}

/// One condition, without `and`.
fn one(words: &[&str]) -> Result<Condition, String> {
    let wrong = |form: &str| format!("'{}' is not a condition; expected: {form}", words.join(" "));
    match words {
        [] => Err(format!("a condition is missing; one of: {}", FORMS.join("; "))),
        ["not", rest @ ..] => match one(rest)? {
            part if part.is_event() => {
                Err("an event holds at an instant only; to expect its absence use never = \"..\"".into())
            }
            part => Ok(Condition::Not(Box::new(part))),
        },
        ["frame", frame] => Ok(Condition::Frame(Pattern::parse(frame)?)),
        ["error", "frame"] => Ok(Condition::ErrorFrame),
        ["event", rest @ ..] => EventPattern::parse(None, rest).map(Condition::Event),
        ["body", name, signal, order, rest @ ..] if ORDERS.iter().any(|(word, _)| word == order) => {
            let comparison = comparison("", order, rest)?;
            Ok(Condition::Body((*name).to_owned(), (*signal).to_owned(), comparison))
        }
        ["body", ..] => Err(wrong("body NAME SIGNAL =|!=|<|<=|>|>= NUMBER [+- TOLERANCE], as in: body base x_m > 1.5")),
        ["done", name @ ..] if !name.is_empty() => Ok(Condition::Done(name.join(" "))),
        [place, rest @ ..] => match place.parse() {
            Ok(place) => of_node(place, rest),
            Err(()) => Err(wrong(&FORMS.join("; "))),
        },
    }
}

fn of_node(place: Place, words: &[&str]) -> Result<Condition, String> {
    let wrong = |form: &str| format!("'{}' is not a condition of a node; expected: {form}", words.join(" "));
    Ok(match words {
        ["event", rest @ ..] => Condition::Event(EventPattern::parse(Some(place), rest)?),
        ["powered"] => Condition::Powered(place),
        ["damaged"] => Condition::Damaged(place),
        ["fault"] => Condition::Fault(place, None),
        ["fault", text] => Condition::Fault(place, Some(code(text)?)),
        ["brake", "engaged"] => Condition::Brake(place, true),
        ["brake", "released"] => Condition::Brake(place, false),
        ["brake", ..] => return Err(wrong("NODE brake engaged|released")),
        ["output", name] => Condition::Output(place, (*name).into()),
        ["statusword", "bit", bit] => {
            let bit = bit.parse().ok().filter(|bit| *bit < 16).ok_or_else(|| wrong("NODE statusword bit 0 to 15"))?;
            Condition::Bit(place, bit)
        }
        ["state", state] => {
            let known = PowerState::ALL.into_iter().find(|known| spelled(known.name()) == spelled(state));
            let names = || PowerState::ALL.map(|known| spelled(known.name())).join(", ");
            Condition::Power(
                place,
                known.ok_or_else(|| format!("'{state}' is not a state; expected one of: {}", names()))?,
            )
        }
        ["bus", state] => Condition::Bus(
            place.node,
            match *state {
                "error-active" => Some(ErrorState::ErrorActive),
                "error-passive" => Some(ErrorState::ErrorPassive),
                "bus-off" => Some(ErrorState::BusOff),
                "cut" => None,
                _ => return Err(wrong("NODE bus error-active|error-passive|bus-off|cut")),
            },
        ),
        // CiA 301, 7.2.8.3.3: one byte of 0 under 700h plus the node-ID.
        ["boots"] => Condition::Frame(Pattern {
            id: 0x700 + u32::from(place.node),
            extended: false,
            bytes: vec![Some(0)],
            whole: true,
        }),
        // CiA 301, 7.2.7: eight bytes under 80h plus the node-ID, the error code first, low byte first.
        ["emcy", rest @ ..] if rest.len() <= 1 => {
            let bytes = rest
                .first()
                .map(|text| code(text))
                .transpose()?
                .map_or(Vec::new(), |code| (code as u16).to_le_bytes().into_iter().map(Some).collect());
            Condition::Frame(Pattern { id: 0x80 + u32::from(place.node), extended: false, bytes, whole: false })
        }
        [name, order, rest @ ..] if ORDERS.iter().any(|(word, _)| word == order) => {
            let signal = signal(name)?;
            Condition::Signal(place, signal, comparison(signal.unit(), order, rest)?)
        }
        [name, ..] => {
            signal(name)?;
            return Err(wrong(FORMS[0]));
        }
        [] => {
            return Err(format!(
                "a condition of node {place} is missing; expected: {}",
                FORMS[..NODE_FORMS].join("; ")
            ));
        }
    })
}

fn comparison(unit: &str, order: &str, words: &[&str]) -> Result<Comparison, String> {
    let order = ORDERS.iter().find(|(word, _)| *word == order).map_or(Order::Equal, |(_, order)| *order);
    let (value, tolerance) = match words {
        [value] => (value, &"0"),
        [value, "+-" | "±", tolerance] if matches!(order, Order::Equal | Order::Unequal) => (value, tolerance),
        _ => return Err(format!("expected: {}", FORMS[0])),
    };
    Ok(Comparison { order, value: number(unit, value)?, tolerance: number(unit, tolerance)? })
}

/// A number in the signal's unit, which may stand behind it; also `0x1F`.
fn number(unit: &str, text: &str) -> Result<f64, String> {
    let wrong =
        || format!("'{text}' is not a number{}", if unit.is_empty() { String::new() } else { format!(" in {unit}") });
    if let Some(digits) = text.strip_prefix("0x") {
        return u32::from_str_radix(digits, 16).map(f64::from).map_err(|_| wrong());
    }
    let spelled = if unit == "r/min" { ["r/min", "rpm"] } else { [unit, unit] };
    let bare = spelled.into_iter().find_map(|unit| text.strip_suffix(unit)).unwrap_or(text);
    bare.trim().parse().ok().filter(|number: &f64| number.is_finite()).ok_or_else(wrong)
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = if self.extended { 8 } else { 3 };
        write!(f, "{:0width$X}#", self.id)?;
        self.bytes.iter().try_for_each(|byte| match byte {
            Some(byte) => write!(f, "{byte:02X}"),
            None => f.write_str(".."),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        text.parse::<Condition>().err().unwrap_or_default()
    }

    #[test]
    fn an_order_holds_on_its_side_of_the_value_and_at_it_where_it_includes_it() {
        for (order, holds) in [
            (Order::Equal, [false, true, false]),
            (Order::Unequal, [true, false, true]),
            (Order::Below, [true, false, false]),
            (Order::AtMost, [true, true, false]),
            (Order::Above, [false, false, true]),
            (Order::AtLeast, [false, true, true]),
        ] {
            let comparison = Comparison { order, value: 2.5, tolerance: 0.0 };
            assert_eq!([2.0, 2.5, 3.0].map(|value| comparison.holds(value)), holds, "{order:?}");
        }
    }

    #[test]
    fn words_become_conditions_and_others_are_refused_with_the_possible_forms() {
        for text in [
            "4 velocity > 50",
            "4 velocity = 60rpm +- 3",
            "5.2 position != 1000",
            "4 statusword bit 10",
            "4 state operation-enabled",
            "4 fault 0x0020 and not 4 powered",
            "done brown-out",
            "frame 084#..32",
            "1 emcy 3220h",
            "4 boots",
            "4 event fault 0x0020",
            "5.2 event target reached",
            "event bus_state bus-off and 4 powered",
            "body base x_m = 1.5 +- 0.01 and not body base speed_m_s > 0.1",
        ] {
            assert!(text.parse::<Condition>().is_ok(), "{text}: {}", refusal(text));
        }
        for (text, said) in [
            ("", "a condition is missing"),
            ("4", "a condition of node 4 is missing"),
            ("four velocity > 5", "NODE SIGNAL"),
            ("4 velocty > 5", "did you mean velocity"),
            ("4 velocity > fast", "'fast' is not a number in r/min"),
            ("4 velocity > nan", "'nan' is not a number"),
            ("4 velocity > 5 +- 1", "expected: NODE SIGNAL"),
            ("4 velocity", "expected: NODE SIGNAL"),
            ("4 statusword bit 16", "bit 0 to 15"),
            ("4 state running", "operation-enabled"),
            ("frame 84", "is not a frame"),
            ("frame 800#", "is not a frame"),
            ("frame 084#1", "is not a frame"),
            ("not frame 084#", "never ="),
            ("not 4 event fault", "never ="),
            ("4 event falt", "did you mean fault"),
            ("body base", "body NAME SIGNAL"),
            ("body base x_m > far", "'far' is not a number"),
            ("4 powered and", "a condition is missing"),
        ] {
            assert!(refusal(text).contains(said), "{text}: {}", refusal(text));
        }
    }

    #[test]
    fn a_pattern_matches_what_begins_like_it_and_a_boot_up_message_is_one_byte() {
        let frame = |text: &str| text.parse::<Frame>().expect("a frame");
        let pattern = Pattern::parse("184#37..05").expect("a pattern");
        assert!(pattern.matches(&frame("184#37FF05")) && pattern.matches(&frame("184#37000599")));
        assert!(!pattern.matches(&frame("184#37FF")) && !pattern.matches(&frame("185#37FF05")));
        let Ok(Condition::Frame(boots)) = "4 boots".parse() else { panic!("it is about a frame") };
        assert!(boots.matches(&frame("704#00")) && !boots.matches(&frame("704#0000")));
        assert_eq!(pattern.to_string(), "184#37..05");
    }

    #[test]
    fn a_number_that_is_not_there_is_neither_equal_nor_unequal() {
        for order in ["=", "!=", "<", ">="] {
            let Ok(Condition::Signal(_, _, it)) = format!("4 motor {order} 20").parse() else { panic!("{order}") };
            assert!(!it.holds(f64::NAN), "{order}");
        }
    }
}

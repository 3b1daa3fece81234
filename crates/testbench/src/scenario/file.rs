//! A scenario as its file has it. Each key is described in `docs/scenarios.md`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use master::units::parse_duration;
use sim::command::Command;
use sim::recorder::Signal;
use sim::stimulus::WireFault;
use sim::{Place, Stimulus};

use super::condition::{Condition, signal};
use super::deed::Deed;
use crate::document::reader::{self, Field, Parameters, Table};
use crate::document::{BadFile, Located, Problem, read_text};
use crate::machine_file::Machine;
use crate::sweep::file::{Axis, axes};
use crate::words::suggest::{did_you_mean, near};

/// What a scenario may say.
pub const KEYS: &[&str] = &[
    "title",
    "about",
    "machine",
    "seed",
    "limit",
    "end",
    "sample",
    "parameters",
    "sweep",
    "figures",
    "step",
    "host",
    "expect",
];
/// What a step may say.
pub const STEP_KEYS: &[&str] = &["name", "at", "after", "when", "within", "delay", "do"];
/// What a host may say.
pub const HOST_KEYS: &[&str] = &["name", "start", "do"];
/// What a line of a host may say that is a table.
pub const LINE_KEYS: &[&str] = &["do", "name", "is", "tolerance", "fails", "within"];
/// What an expectation may say.
pub const EXPECT_KEYS: &[&str] = &["name", "that", "always", "never", "at", "from", "after", "until", "within", "why"];

/// Virtual time after which a run ends in any case, if nothing is said; and the most that may be said.
const LIMIT: Duration = Duration::from_secs(60);
const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// How often values are looked at, if nothing is said; and the least that may be said.
const SAMPLE: Duration = Duration::from_millis(1);
const SHORTEST_SAMPLE: Duration = Duration::from_micros(10);

/// Steps, lines and expectations that a scenario may have: each is looked at in each millisecond.
const MOST: usize = 1000;

/// A machine, what is done to it and by it, and what is expected.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// What it is called.
    pub title: String,
    /// What it shows.
    pub about: String,
    /// The machine.
    pub machine: Machine,
    /// What decides everything random, where it says so.
    pub seed: Option<u64>,
    /// The parameters and their values.
    pub parameters: Parameters,
    /// What a sweep goes through.
    pub sweep: Vec<Axis>,
    pub(super) limit: Duration,
    pub(super) end: Option<Duration>,
    pub(super) sample: Duration,
    pub(super) steps: Vec<Step>,
    pub(super) hosts: Vec<Host>,
    pub(super) expects: Vec<Expect>,
    pub(super) figures: Vec<Figure>,
    text: String,
    folder: PathBuf,
}

/// What the outer world does.
#[derive(Clone, Debug)]
pub(super) struct Step {
    pub(super) name: Option<String>,
    pub(super) base: Base,
    pub(super) when: Option<Condition>,
    pub(super) within: Option<Duration>,
    pub(super) delay: Duration,
    pub(super) acts: Vec<Act>,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// From when on something counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Base {
    /// A time of the run.
    At(Duration),
    /// When the step or host of this name is done.
    After(String),
}

/// One thing that the outer world does.
#[derive(Clone, Debug)]
pub(super) enum Act {
    World(Place, Stimulus),
    Wire(WireFault),
    /// The host's cable: cut is true.
    HostCable(bool),
    /// The host is gone for good, in the middle of what it does.
    HostDies,
}

/// A script of the master.
#[derive(Clone, Debug)]
pub(super) struct Host {
    pub(super) name: String,
    /// `None`: when the drives have booted.
    pub(super) start: Option<Duration>,
    pub(super) lines: Vec<HostLine>,
}

/// One line of it.
#[derive(Clone, Debug)]
pub(super) struct HostLine {
    pub(super) deed: Deed,
    pub(super) name: Option<String>,
    pub(super) wanted: Wanted,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// What is to come of a line.
#[derive(Clone, Debug, Default)]
pub(super) struct Wanted {
    /// It fails, and the reason has this in it.
    pub(super) fails: Option<String>,
    /// A number that is read.
    pub(super) value: Option<f64>,
    pub(super) tolerance: f64,
    pub(super) within: Option<Duration>,
}

/// What is expected.
#[derive(Clone, Debug)]
pub(super) struct Expect {
    pub(super) name: String,
    pub(super) law: Law,
    pub(super) condition: Condition,
    pub(super) from: Base,
    pub(super) until: Until,
    pub(super) asked: String,
    pub(super) place: Located,
}

/// How often it is to be so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Law {
    /// At least once.
    Once,
    /// All the time.
    Always,
    /// At no time.
    Never,
}

/// How long it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Until {
    /// To the end of the run.
    End,
    /// To a time of the run.
    At(Duration),
    /// So long from its beginning.
    Within(Duration),
}

/// A number that a run is told by.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Figure {
    pub(super) name: String,
    pub(super) of: Measure,
}

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Measure {
    Signal(Statistic, Place, Signal),
    /// When the step or host of this name is done, in s.
    Time(String),
}

/// What is made of the values of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Statistic {
    Min,
    Max,
    Mean,
    /// The largest magnitude.
    Peak,
    Last,
}

type Many<T> = Result<T, Vec<Problem>>;

fn single(problem: Problem) -> Vec<Problem> {
    vec![problem]
}

impl Scenario {
    /// The scenario of a file; files that it names are looked for beside it.
    ///
    /// # Errors
    /// That it cannot be read, or everything that is wrong with it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = read_text(path)?;
        let parsed = Self::parse(&text, path.parent().unwrap_or(Path::new("")));
        parsed.map_err(|bad| bad.named(path.display().to_string()).to_string())
    }

    /// Reads the text of a scenario; files that it names are looked for in `folder`.
    ///
    /// # Errors
    /// Everything that is wrong, with its place and what is expected there.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, BadFile> {
        Self::parse_with(text, folder, &Parameters::new())
    }

    /// The same scenario with other values of its parameters.
    ///
    /// # Errors
    /// A name that is no parameter of it, or what becomes wrong with the value.
    pub fn with(&self, values: &Parameters) -> Result<Self, BadFile> {
        Self::parse_with(&self.text, &self.folder, values)
    }

    fn parse_with(text: &str, folder: &Path, values: &Parameters) -> Result<Self, BadFile> {
        let bad = |problems| BadFile::new(text, problems);
        let mut parameters = reader::read(text, &Parameters::new(), "a scenario", parameters).map_err(bad)?;
        for (name, value) in values {
            if parameters.insert(name.clone(), value.clone()).is_none() {
                let near =
                    did_you_mean(&near(name, parameters.keys().map(String::as_str).filter(|known| known != name)));
                let what = format!("there is no parameter '{name}'{near}; [parameters] gives each a value");
                return Err(bad(vec![Problem::new(0..0, what)]));
            }
        }
        let read = |file: &Table<'_>| Self::from_table(file, text, folder, &parameters);
        reader::read(text, &parameters, "a scenario", read).map_err(bad)
    }

    fn from_table(file: &Table<'_>, text: &str, folder: &Path, parameters: &Parameters) -> Many<Self> {
        let mut problems = file.strangers(KEYS);
        let machine = kept(machine(file, folder), &mut problems).unwrap_or_default();
        let title = file.get("title").map(|field| field.words("a title as text")).transpose().map_err(single);
        let about = file.get("about").map(|field| field.words("a text")).transpose().map_err(single);
        let seed = file.get("seed").map(|field| field.whole("a whole number from 0 on")).transpose().map_err(single);
        let end = file.get("end").map(|field| bounded(&field, Duration::ZERO)).transpose().map_err(single);
        let limit = file.get("limit").map(|field| bounded(&field, Duration::ZERO)).transpose().map_err(single);
        let sample = file.get("sample").map(|field| bounded(&field, SHORTEST_SAMPLE)).transpose().map_err(single);
        let mut scenario = Self {
            title: kept(title, &mut problems).flatten().unwrap_or_else(|| "scenario".into()),
            about: kept(about, &mut problems).flatten().unwrap_or_default(),
            machine,
            seed: kept(seed, &mut problems).flatten(),
            parameters: parameters.clone(),
            sweep: kept(axes(file, parameters), &mut problems).unwrap_or_default(),
            limit: kept(limit, &mut problems).flatten().unwrap_or(LIMIT),
            end: kept(end, &mut problems).flatten(),
            sample: kept(sample, &mut problems).flatten().unwrap_or(SAMPLE),
            steps: entries(file, "step", "a step", &mut problems, |table, _| step(table)),
            hosts: entries(file, "host", "a host", &mut problems, host),
            expects: entries(file, "expect", "an expectation", &mut problems, expect),
            figures: kept(figures(file), &mut problems).unwrap_or_default(),
            text: text.to_owned(),
            folder: folder.to_owned(),
        };
        scenario.limit = scenario.limit.max(scenario.end.unwrap_or_default());
        if problems.is_empty() {
            problems = scenario.check(file);
        }
        if problems.is_empty() { Ok(scenario) } else { Err(problems) }
    }

    /// What fits each other badly: nodes and names that are not there, and too much of it.
    fn check(&self, file: &Table<'_>) -> Vec<Problem> {
        let mut problems = Vec::new();
        let lines: usize = self.hosts.iter().map(|host| host.lines.len()).sum();
        if self.steps.len() + lines + self.expects.len() > MOST {
            let what = format!("it has more than {MOST} steps, lines and expectations");
            problems.push(Problem::new(file.place(), what));
        }
        let names: Vec<&str> = self.names().collect();
        let mut named = |name: &str, at: &Located| {
            if !names.contains(&name) {
                let near = did_you_mean(&near(name, names.iter().copied()));
                let known = if names.is_empty() { "none has a name".into() } else { names.join(", ") };
                problems.push(placed(
                    at,
                    file.text(),
                    format!("there is no step or host '{name}'{near}; there is: {known}"),
                ));
            }
        };
        let base = |base: &Base| match base {
            Base::At(_) => None,
            Base::After(name) => Some(name.clone()),
        };
        self.steps.iter().for_each(|step| base(&step.base).iter().for_each(|name| named(name, &step.place)));
        self.expects.iter().for_each(|expect| base(&expect.from).iter().for_each(|name| named(name, &expect.place)));
        for (condition, at) in self.conditions() {
            let mut places = Vec::new();
            condition.names(&mut |place| places.push(place), &mut |name| named(name, at));
            let strange = places.iter().find(|place| !self.has_node(place.node));
            if let Some(place) = strange {
                problems.push(placed(at, file.text(), self.no_such(*place)));
                break;
            }
        }
        for step in &self.steps {
            let strange = step.acts.iter().find_map(|act| match act {
                Act::World(place, _) if !self.has_node(place.node) => Some(*place),
                _ => None,
            });
            problems.extend(strange.map(|place| placed(&step.place, file.text(), self.no_such(place))));
        }
        problems
    }

    fn has_node(&self, node: u8) -> bool {
        self.machine.drives.iter().any(|drive| drive.spec.node.raw() == node)
    }

    fn no_such(&self, place: Place) -> String {
        let known: Vec<_> = self.machine.drives.iter().map(|drive| drive.spec.node.to_string()).collect();
        format!("the machine has no node {}; it has: {}", place.node, known.join(", "))
    }

    /// Every condition of it, and where it stands.
    fn conditions(&self) -> impl Iterator<Item = (&Condition, &Located)> {
        let steps = self.steps.iter().filter_map(|step| Some((step.when.as_ref()?, &step.place)));
        let lines = self.hosts.iter().flat_map(|host| &host.lines).filter_map(|line| match &line.deed {
            Deed::WaitFor(condition, _) => Some((condition, &line.place)),
            _ => None,
        });
        steps.chain(lines).chain(self.expects.iter().map(|expect| (&expect.condition, &expect.place)))
    }

    /// The names of steps and hosts, which `after` and `done` may give.
    fn names(&self) -> impl Iterator<Item = &str> {
        let steps = self.steps.iter().filter_map(|step| step.name.as_deref());
        steps.chain(self.hosts.iter().map(|host| host.name.as_str()))
    }
}

/// A problem at a place that is known by its line already.
fn placed(at: &Located, text: &str, what: String) -> Problem {
    let begin: usize = text.split_inclusive('\n').take(at.line - 1).map(str::len).sum();
    let skipped: usize = text[begin..].chars().take(at.column - 1).map(char::len_utf8).sum();
    let width: usize = text[begin + skipped..].chars().take(at.width).map(char::len_utf8).sum();
    Problem::new(begin + skipped..begin + skipped + width, what)
}

/// The value, or nothing and its problems among the others.
fn kept<T>(value: Many<T>, problems: &mut Vec<Problem>) -> Option<T> {
    value.map_err(|wrong| problems.extend(wrong)).ok()
}

/// The tables of a list, each made into what it describes.
fn entries<T>(
    file: &Table<'_>,
    name: &'static str,
    what: &'static str,
    problems: &mut Vec<Problem>,
    mut make: impl FnMut(&Table<'_>, usize) -> Many<T>,
) -> Vec<T> {
    const EXPECTED: &str = "tables of their own, each begun by its name in double brackets, as in [[step]]";
    let Some(field) = file.get(name) else { return Vec::new() };
    let fields = kept(field.list(EXPECTED).map_err(single), problems).unwrap_or_default();
    let made = fields.iter().enumerate().filter_map(|(n, field)| {
        let table = field.table(what, EXPECTED).map_err(single);
        kept(table.and_then(|table| make(&table, n)), problems)
    });
    made.collect()
}

/// The machine, written here or in a file of its own.
fn machine(file: &Table<'_>, folder: &Path) -> Many<Machine> {
    const EXPECTED: &str = "a machine: [machine] with [[machine.drive]], or the path of a machine file";
    let field = file.need("machine", EXPECTED).map_err(single)?;
    if field.is_table() {
        return Machine::from_table(&field.table("a machine", EXPECTED).map_err(single)?, folder);
    }
    let path = folder.join(field.words(EXPECTED).map_err(single)?);
    crate::machine_file::read(&path)
        .map_err(|reason| vec![field.problem(format!("the machine file {} cannot be used:\n{reason}", path.display()))])
}

/// The parameters and their values, in the words that they are put into texts with.
fn parameters(file: &Table<'_>) -> Many<Parameters> {
    const EXPECTED: &str = "a table of names and values, e.g. [parameters] torque = 0.5";
    let Some(field) = file.get("parameters") else { return Ok(Parameters::new()) };
    let table = field.table("the parameters", EXPECTED).map_err(single)?;
    let values = table.fields().map(|field| {
        let value = crate::sweep::file::value(&field).map_err(single)?;
        Ok((field.name().to_owned(), value))
    });
    values.collect()
}

fn time(field: &Field<'_>) -> Result<Duration, Problem> {
    const EXPECTED: &str = "a time as text with its unit, e.g. \"500ms\" or \"2s\"";
    let text = field.words(EXPECTED)?;
    parse_duration(&text).map_err(|error| field.problem(format!("'{}': {error}", field.name())))
}

/// A time that the run can take.
fn bounded(field: &Field<'_>, least: Duration) -> Result<Duration, Problem> {
    let time = time(field)?;
    if time > LONGEST || time < least {
        let what = format!("'{}' must be between {} s and 24 h", field.name(), least.as_secs_f64());
        return Err(field.problem(what));
    }
    Ok(time)
}

fn optional_time(table: &Table<'_>, name: &str) -> Result<Option<Duration>, Problem> {
    table.get(name).map(|field| bounded(&field, Duration::ZERO)).transpose()
}

fn name_of(table: &Table<'_>) -> Result<Option<String>, Problem> {
    table.get("name").map(|field| field.words("a name as text")).transpose()
}

/// What `at`, `from` and `after` say; the beginning of the run without them.
fn base(table: &Table<'_>, absolute: &str) -> Result<Base, Problem> {
    match (table.get(absolute), table.get("after")) {
        (Some(_), Some(after)) => Err(after.problem(format!("it has '{absolute}' already; give one of them"))),
        (Some(at), None) => Ok(Base::At(bounded(&at, Duration::ZERO)?)),
        (None, Some(after)) => Ok(Base::After(after.words("the name of a step or a host")?)),
        (None, None) => Ok(Base::At(Duration::ZERO)),
    }
}

fn condition(field: &Field<'_>) -> Result<Condition, Problem> {
    let words = field.words("a condition as text, e.g. \"4 velocity > 50\"")?;
    words.parse().map_err(|reason: String| field.problem(reason))
}

/// A text, or each of a list of texts.
fn texts<'a>(table: &Table<'a>, expected: &str) -> Result<Vec<Field<'a>>, Problem> {
    let field = table.need("do", expected)?;
    if field.is_list() { field.list(expected) } else { Ok(vec![field]) }
}

fn step(table: &Table<'_>) -> Many<Step> {
    const EXPECTED: &str = "a world command or a list of them, e.g. \"4 supply 20\"";
    let mut problems = table.strangers(STEP_KEYS);
    let parts = (|| {
        let when = table.get("when").map(|field| condition(&field)).transpose()?;
        if let (None, Some(field)) = (&when, table.get("within")) {
            return Err(field.problem("'within' is about 'when', which is not there"));
        }
        let fields = texts(table, EXPECTED)?;
        Ok((
            name_of(table)?,
            base(table, "at")?,
            when,
            optional_time(table, "within")?,
            optional_time(table, "delay")?,
            fields,
        ))
    })();
    let (name, base, when, within, delay, fields) = match parts {
        Ok(parts) if problems.is_empty() => parts,
        Ok(_) => return Err(problems),
        Err(problem) => {
            problems.push(problem);
            return Err(problems);
        }
    };
    let mut acts = Vec::new();
    let mut asked = Vec::new();
    for field in &fields {
        let read = field.words(EXPECTED).and_then(|words| Ok((act(field, &words)?, words)));
        if let Some((act, words)) = kept(read.map_err(single), &mut problems) {
            acts.push(act);
            asked.push(words);
        }
    }
    let place = fields.first().map_or(Problem::new(table.place(), ""), |field| field.problem("")).locate(table.text());
    let step =
        Step { name, base, when, within, delay: delay.unwrap_or_default(), acts, asked: asked.join("; "), place };
    if problems.is_empty() { Ok(step) } else { Err(problems) }
}

fn act(field: &Field<'_>, words: &str) -> Result<Act, Problem> {
    match words.split_whitespace().collect::<Vec<_>>().as_slice() {
        ["host", "cut"] => return Ok(Act::HostCable(true)),
        ["host", "join"] => return Ok(Act::HostCable(false)),
        ["host", "die"] => return Ok(Act::HostDies),
        ["host", ..] => return Err(field.problem("expected: host cut, host join, or host die")),
        _ => {}
    }
    match words.parse::<Command>() {
        Ok(Command::Apply(place, stimulus)) => Ok(Act::World(place, stimulus)),
        Ok(Command::Disturb(fault)) => Ok(Act::Wire(fault)),
        Ok(_) => Err(field.problem(format!("'{words}' does nothing to the machine; [[expect]] looks at it"))),
        Err(error) => Err(field.problem(error.to_string())),
    }
}

fn host(table: &Table<'_>, n: usize) -> Many<Host> {
    const EXPECTED: &str = "a list of what the host does, e.g. [\"4 enable\", \"4 move 90deg\"]";
    let mut problems = table.strangers(HOST_KEYS);
    let name = kept(name_of(table).map_err(single), &mut problems).flatten();
    let start = kept(optional_time(table, "start").map_err(single), &mut problems).flatten();
    let fields = kept(texts(table, EXPECTED).map_err(single), &mut problems).unwrap_or_default();
    let lines = fields.iter().filter_map(|field| kept(line(field).map_err(single), &mut problems));
    let lines = lines.collect();
    let name = name.unwrap_or_else(|| if n == 0 { "host".into() } else { format!("host {}", n + 1) });
    if problems.is_empty() { Ok(Host { name, start, lines }) } else { Err(problems) }
}

fn line(field: &Field<'_>) -> Result<HostLine, Problem> {
    const EXPECTED: &str = "what the host does as text, or a table, e.g. { do = \"4 read 603F\", is = 0x3220 }";
    let deed = |field: &Field<'_>| {
        let asked = field.words(EXPECTED)?;
        let deed = asked.parse().map_err(|reason: String| field.problem(reason))?;
        Ok((asked, deed))
    };
    if !field.is_table() {
        let (asked, deed) = deed(field)?;
        let place = field.problem("").locate(field.source_text());
        return Ok(HostLine { deed, name: None, wanted: Wanted::default(), asked, place });
    }
    let table = field.table("a line of a host", EXPECTED)?;
    table.takes_only(LINE_KEYS)?;
    let (asked, deed) = deed(&table.need("do", EXPECTED)?)?;
    let value = table.get("is").map(|field| field.number("a number, which is read")).transpose()?;
    let tolerance = table.get("tolerance").map(|field| field.number("a number, e.g. 5")).transpose()?;
    if let (Some(is), false) = (table.get("is"), matches!(deed, Deed::Read(..))) {
        return Err(is.problem("'is' needs something that is read: NODE read OBJECT"));
    }
    let fails = table.get("fails").map(|field| field.words("a part of the reason as text; \"\" for any reason"));
    let wanted = Wanted {
        fails: fails.transpose()?,
        value,
        tolerance: tolerance.unwrap_or_default().abs(),
        within: optional_time(&table, "within")?,
    };
    let shown = value.map(|value| format!("{asked} is {}", master::units::Shown(value))).unwrap_or(asked);
    let asked = if wanted.fails.is_some() { format!("{shown} fails") } else { shown };
    Ok(HostLine { deed, name: name_of(&table)?, wanted, asked, place: field.problem("").locate(field.source_text()) })
}

fn expect(table: &Table<'_>, n: usize) -> Many<Expect> {
    let mut problems = table.strangers(EXPECT_KEYS);
    match expectation(table, n) {
        Ok(expect) if problems.is_empty() => Ok(expect),
        Ok(_) => Err(problems),
        Err(problem) => {
            problems.push(problem);
            Err(problems)
        }
    }
}

fn expectation(table: &Table<'_>, n: usize) -> Result<Expect, Problem> {
    let laws = [("that", Law::Once), ("always", Law::Always), ("never", Law::Never)];
    let mut given = laws.iter().filter_map(|(name, law)| Some((table.get(name)?, *law)));
    let (field, law) =
        given.next().ok_or_else(|| Problem::new(table.place(), "an expectation needs 'that', 'always' or 'never'"))?;
    if let Some((other, _)) = given.next() {
        return Err(other.problem(format!("it has '{}' already; make another expectation of this", field.name())));
    }
    let condition = condition(&field)?;
    let at = optional_time(table, "at")?;
    if condition.is_event() && (at.is_some() || law == Law::Always) {
        return Err(field.problem("a frame passes at an instant: give that or never, and a stretch of time"));
    }
    let (from, until) = match (at, table.get("until"), table.get("within")) {
        (Some(at), None, None) if table.get("from").or(table.get("after")).is_none() => (Base::At(at), Until::At(at)),
        (Some(_), ..) => {
            return Err(field.problem("'at' is an instant: it goes without from, after, until and within"));
        }
        (None, Some(_), Some(within)) => {
            return Err(within.problem("it has 'until' already; give one of them"));
        }
        (None, Some(until), None) => (base(table, "from")?, Until::At(bounded(&until, Duration::ZERO)?)),
        (None, None, Some(within)) => (base(table, "from")?, Until::Within(bounded(&within, Duration::ZERO)?)),
        (None, None, None) => (base(table, "from")?, Until::End),
    };
    if let (Base::At(from), Until::At(until)) = (&from, &until)
        && from > until
    {
        return Err(field.problem("it ends before it begins: 'until' is before 'from'"));
    }
    if let Some(why) = table.get("why") {
        why.text("a reason as text")?;
    }
    let words = field.words("a condition as text")?;
    let asked = if law == Law::Once { words } else { format!("{} {words}", field.name()) };
    let name = name_of(table)?.unwrap_or_else(|| format!("expectation {}", n + 1));
    Ok(Expect { name, law, condition, from, until, asked, place: field.problem("").locate(table.text()) })
}

fn figures(file: &Table<'_>) -> Many<Vec<Figure>> {
    const EXPECTED: &str = "a table of names and figures, e.g. [figures] peak_current = \"peak 4 current\"";
    let Some(field) = file.get("figures") else { return Ok(Vec::new()) };
    let table = field.table("the figures", EXPECTED).map_err(single)?;
    table.fields().map(|field| figure(&field).map_err(single)).collect()
}

fn figure(field: &Field<'_>) -> Result<Figure, Problem> {
    const EXPECTED: &str =
        "min, max, mean, peak or last and a signal, e.g. \"max 4 velocity\"; or \"time NAME\" of a step or host";
    let words = field.words(EXPECTED)?;
    let words: Vec<&str> = words.split_whitespace().collect();
    let name = field.name().to_owned();
    let (statistic, place, what) = match words.as_slice() {
        ["time", rest @ ..] if !rest.is_empty() => return Ok(Figure { name, of: Measure::Time(rest.join(" ")) }),
        [statistic, place, what] => (*statistic, *place, *what),
        _ => return Err(field.wrong(EXPECTED)),
    };
    let statistic = match statistic {
        "min" => Statistic::Min,
        "max" => Statistic::Max,
        "mean" => Statistic::Mean,
        "peak" => Statistic::Peak,
        "last" => Statistic::Last,
        _ => return Err(field.wrong(EXPECTED)),
    };
    let place = place.parse().map_err(|()| field.wrong(EXPECTED))?;
    let signal = signal(what).map_err(|reason| field.problem(reason))?;
    Ok(Figure { name, of: Measure::Signal(statistic, place, signal) })
}

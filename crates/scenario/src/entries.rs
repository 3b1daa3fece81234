//! The entries of a scenario file, each made into a part of its plan: steps, hosts, expectations, figures.

use std::time::Duration;

use master::units::parse_duration;
use sim::command::Command as WorldCommand;

use super::command::{Command, PdoCommand};
use super::condition::{Condition, signal};
use super::plan::{
    Act, Base, Expect, Host, HostLine, Law, Measure, PlannedFigure, ScenarioStep, Statistic, Until, Wait, WantedResult,
};
use words::document::Problem;
use words::document::reader::{Field, Table};

/// What a step may say.
pub const STEP_KEYS: &[&str] = &["name", "at", "after", "when", "within", "delay", "do"];
/// What a host may say.
pub const HOST_KEYS: &[&str] = &["name", "start", "do"];
/// What a line of a host may say that is a table.
pub const LINE_KEYS: &[&str] = &["do", "name", "is", "tolerance", "fails", "within"];
/// What an expectation may say.
pub const EXPECT_KEYS: &[&str] = &["name", "that", "always", "never", "at", "from", "after", "until", "within", "why"];

/// Steps, lines and expectations that a scenario may have: each is looked at in each millisecond.
pub(super) const MOST: usize = 1000;

/// The longest time that anything may take.
pub(super) const LONGEST: Duration = Duration::from_secs(24 * 3600);

/// A value, or everything that is wrong with it.
pub(super) type Many<T> = Result<T, Vec<Problem>>;

/// One thing that is wrong.
pub(super) fn single(problem: Problem) -> Vec<Problem> {
    vec![problem]
}

/// The value, or nothing and its problems among the others.
pub(super) fn kept<T>(value: Many<T>, problems: &mut Vec<Problem>) -> Option<T> {
    value.map_err(|wrong| problems.extend(wrong)).ok()
}

/// A list that is not longer than a scenario may have entries.
fn bounded_list(fields: Vec<Field<'_>>) -> Result<Vec<Field<'_>>, Problem> {
    match fields.get(MOST) {
        None => Ok(fields),
        Some(beyond) => Err(beyond.problem(format!("'{}' has more than {MOST} entries", beyond.name()))),
    }
}

/// The tables of a list, each made into what it describes.
pub(super) fn entries<T>(
    file: &Table<'_>,
    name: &'static str,
    what: &'static str,
    problems: &mut Vec<Problem>,
    mut make: impl FnMut(&Table<'_>, usize) -> Many<T>,
) -> Vec<T> {
    const EXPECTED: &str = "tables of their own, each begun by its name in double brackets, as in [[step]]";
    let Some(field) = file.get(name) else { return Vec::new() };
    let fields = kept(field.list(EXPECTED).and_then(bounded_list).map_err(single), problems).unwrap_or_default();
    let made = fields.iter().enumerate().filter_map(|(n, field)| {
        let table = field.table(what, EXPECTED).map_err(single);
        kept(table.and_then(|table| make(&table, n)), problems)
    });
    made.collect()
}

pub(super) fn time(field: &Field<'_>) -> Result<Duration, Problem> {
    const EXPECTED: &str = "a time as text with its unit, e.g. \"500ms\" or \"2s\"";
    let text = field.words(EXPECTED)?;
    parse_duration(&text).map_err(|error| field.problem(format!("'{}': {error}", field.name())))
}

/// A time that the run can take.
pub(super) fn bounded(field: &Field<'_>, least: Duration) -> Result<Duration, Problem> {
    let time = time(field)?;
    if time > LONGEST || time < least {
        let what = format!("'{}' must be between {} s and 24 h", field.name(), least.as_secs_f64());
        return Err(field.problem(what));
    }
    Ok(time)
}

pub(super) fn optional_time(table: &Table<'_>, name: &str) -> Result<Option<Duration>, Problem> {
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
        (None, Some(after)) => {
            let place = after.problem("").locate(after.source_text());
            Ok(Base::After(after.words("the name of a step or a host")?, place))
        }
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
    if field.is_list() { field.list(expected).and_then(bounded_list) } else { Ok(vec![field]) }
}

pub(super) fn step(table: &Table<'_>) -> Many<ScenarioStep> {
    const EXPECTED: &str = "a world command or a list of them, e.g. \"4 supply 20\"";
    let mut problems = table.strangers(STEP_KEYS);
    let parts = (|| {
        let wait = |field: Field<'_>| {
            let place = field.problem("").locate(field.source_text());
            Ok(Wait { condition: condition(&field)?, asked: field.words("a condition as text")?, place })
        };
        let when = table.get("when").map(wait).transpose()?;
        if let (None, Some(field)) = (&when, table.get("within")) {
            return Err(field.problem("'within' needs 'when'"));
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
    let step = ScenarioStep {
        name,
        base,
        when,
        within,
        delay: delay.unwrap_or_default(),
        acts,
        asked: asked.join("; "),
        place,
    };
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
    match words.parse::<WorldCommand>() {
        Ok(WorldCommand::Apply(place, stimulus)) => Ok(Act::World(place, stimulus)),
        Ok(WorldCommand::Disturb(fault)) => Ok(Act::Wire(fault)),
        Ok(WorldCommand::ApplyToBody(name, stimulus)) => Ok(Act::Body(name, stimulus)),
        Ok(_) => Err(field.problem(format!("'{words}' changes nothing; use [[expect]] to look at the machine"))),
        Err(error) => Err(field.problem(error.to_string())),
    }
}

pub(super) fn host(table: &Table<'_>, n: usize) -> Many<Host> {
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
    let command = |field: &Field<'_>| {
        let asked = field.words(EXPECTED)?;
        let command = asked.parse().map_err(|reason: String| field.problem(reason))?;
        Ok((asked, command))
    };
    if !field.is_table() {
        let (asked, command) = command(field)?;
        let place = field.problem("").locate(field.source_text());
        return Ok(HostLine { command, name: None, wanted: WantedResult::default(), asked, place });
    }
    let table = field.table("a line of a host", EXPECTED)?;
    table.takes_only(LINE_KEYS)?;
    let (asked, command) = command(&table.need("do", EXPECTED)?)?;
    let value = table.get("is").map(|field| field.number("a number, which is read")).transpose()?;
    let tolerance = table.get("tolerance").map(|field| field.number("a number, e.g. 5")).transpose()?;
    let reads = matches!(command, Command::Read(..) | Command::Pdo(_, PdoCommand::Read(_)));
    if let (Some(is), false) = (table.get("is"), reads) {
        return Err(is.problem("'is' needs something that is read: NODE read OBJECT, or NODE pdo read OBJECT"));
    }
    let fails = table.get("fails").map(|field| field.words("a part of the reason as text; \"\" for any reason"));
    let wanted = WantedResult {
        fails: fails.transpose()?,
        value,
        tolerance: tolerance.unwrap_or_default().abs(),
        within: optional_time(&table, "within")?,
    };
    let shown = value.map(|value| format!("{asked} is {}", master::units::Shown(value))).unwrap_or(asked);
    let asked = if wanted.fails.is_some() { format!("{shown} fails") } else { shown };
    Ok(HostLine {
        command,
        name: name_of(&table)?,
        wanted,
        asked,
        place: field.problem("").locate(field.source_text()),
    })
}

pub(super) fn expect(table: &Table<'_>, n: usize) -> Many<Expect> {
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
        return Err(field.problem("an event holds at an instant only: use that or never, and a span of time"));
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

pub(super) fn figures(file: &Table<'_>) -> Many<Vec<PlannedFigure>> {
    const EXPECTED: &str = "a table of names and figures, e.g. [figures] peak_current = \"peak 4 current\"";
    let Some(field) = file.get("figures") else { return Ok(Vec::new()) };
    let table = field.table("the figures", EXPECTED).map_err(single)?;
    table.fields().map(|field| figure(&field).map_err(single)).collect()
}

fn figure(field: &Field<'_>) -> Result<PlannedFigure, Problem> {
    const EXPECTED: &str = "min, max, mean, peak or last and a signal, e.g. \"max 4 velocity\", \"last body base x_m\"; or \"time NAME\" of a step or host";
    let words = field.words(EXPECTED)?;
    let words: Vec<&str> = words.split_whitespace().collect();
    let name = field.name().to_owned();
    let statistic = |word: &str| match word {
        "min" => Ok(Statistic::Min),
        "max" => Ok(Statistic::Max),
        "mean" => Ok(Statistic::Mean),
        "peak" => Ok(Statistic::Peak),
        "last" => Ok(Statistic::Last),
        _ => Err(field.wrong(EXPECTED)),
    };
    let of = match words.as_slice() {
        ["time", rest @ ..] if !rest.is_empty() => Measure::Time(rest.join(" ")),
        [word, "body", body, what] => Measure::Body(statistic(word)?, (*body).to_owned(), (*what).to_owned()),
        [word, place, what] => {
            let statistic = statistic(word)?;
            let place = place.parse().map_err(|()| field.wrong(EXPECTED))?;
            Measure::Signal(statistic, place, signal(what).map_err(|reason| field.problem(reason))?)
        }
        _ => return Err(field.wrong(EXPECTED)),
    };
    Ok(PlannedFigure { name, of, place: field.problem("").locate(field.source_text()) })
}

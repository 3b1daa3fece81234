//! What is around a drive in a machine file: its supply, load, inputs, sensors and what is broken, as stimuli.

use sim::{Source, Stimulus};

use words::document::reader::{Field, Table};
use words::document::{Located, Problem};

const VOLTAGE: &str = "a voltage in V, e.g. 48";

/// The supply: its voltage (also `supply_v`) and what is behind it. What is wrong is added to `problems`.
pub(super) fn source(table: &Table<'_>, problems: &mut Vec<Problem>) -> Source {
    let mut number = |table: &Table<'_>, name: &str, expected: &str| {
        let number = table.get(name).map(|field| field.number(expected)).transpose();
        number.unwrap_or_else(|problem| {
            problems.push(problem);
            None
        })
    };
    let source = Source { voltage_v: number(table, "supply_v", VOLTAGE), limit_a: None, resistance_ohm: None };
    let Some(supply) = table.get("supply") else { return source };
    let supply = match supply.table("a supply", "a table, e.g. { voltage_v = 48, limit_a = 10 }") {
        Ok(supply) => supply,
        Err(problem) => {
            problems.push(problem);
            return source;
        }
    };
    let source = Source {
        voltage_v: number(&supply, "voltage_v", VOLTAGE).or(source.voltage_v),
        limit_a: number(&supply, "limit_a", "a current in A, e.g. 10"),
        resistance_ohm: number(&supply, "resistance_ohm", "a resistance in ohms, e.g. 0.2"),
    };
    problems.extend(supply.strangers(&["voltage_v", "limit_a", "resistance_ohm"]));
    source
}

/// What else is around a drive, with its places. What is wrong is added to `problems`, each thing on its own.
pub(super) fn around(table: &Table<'_>, problems: &mut Vec<Problem>) -> Vec<(Stimulus, Located)> {
    let parts: [TablePart; 7] = [load, inputs, switches, rotor, temperatures, faults, battery];
    let mut stimuli = Vec::new();
    for said in parts.into_iter().flat_map(|part| part(table)) {
        let stimulus = said.and_then(|Words { words, place }| match words.parse() {
            Ok(stimulus) => Ok((stimulus, place.locate(table.text()))),
            Err(error) => Err(Problem { what: format!("'{words}' cannot be done: {error}"), ..place }),
        });
        match stimulus {
            Ok(stimulus) => stimuli.push(stimulus),
            Err(problem) => problems.push(problem),
        }
    }
    stimuli
}

/// What makes world commands of a part of the table.
type TablePart = fn(&Table<'_>) -> Vec<WordsOrProblem>;

/// A world command, or what is wrong where one would come from.
type WordsOrProblem = Result<Words, Problem>;

/// A world command without its node, and where it comes from.
struct Words {
    words: String,
    place: Problem,
}

impl Words {
    fn of(field: &Field<'_>, words: String) -> Self {
        Self { words, place: field.problem("") }
    }
}

/// A world command whose words come from several fields.
struct Sentence {
    words: String,
    problems: Vec<Problem>,
}

impl Sentence {
    /// Begins one that comes from a table with these names.
    fn begin(words: impl Into<String>, table: &Table<'_>, names: &[&str]) -> Self {
        Self { words: words.into(), problems: table.strangers(names) }
    }

    /// The next word.
    fn word(&mut self, word: Result<impl std::fmt::Display, Problem>) {
        match word {
            Ok(word) => self.words += &format!(" {word}"),
            Err(problem) => self.problems.push(problem),
        }
    }

    /// The command, or all that is wrong with it.
    fn end(self, field: &Field<'_>) -> Vec<WordsOrProblem> {
        let Self { words, problems } = self;
        if problems.is_empty() {
            return vec![Ok(Words::of(field, words))];
        }
        problems.into_iter().map(Err).collect()
    }
}

const A_NUMBER: &str = "a number, e.g. 0.5";

/// What a load may have.
const LOAD_KEYS: &[&str] = &["torque_nm", "inertia_kg_m2", "gear", "friction", "pulley", "spring", "stop", "fan"];

/// What hangs on the shaft. A gear comes first: spring and stops stand where the load is behind it.
fn load(table: &Table<'_>) -> Vec<WordsOrProblem> {
    let Some(load) = table.get("load") else { return Vec::new() };
    let load = match load.table("a load", "a table, e.g. { torque_nm = 0.5 }") {
        Ok(load) => load,
        Err(problem) => return vec![Err(problem)],
    };
    let mut said: Vec<WordsOrProblem> = load.strangers(LOAD_KEYS).into_iter().map(Err).collect();
    for (name, word) in [("torque_nm", "torque"), ("inertia_kg_m2", "inertia")] {
        if let Some(field) = load.get(name) {
            said.push(field.number(A_NUMBER).map(|number| Words::of(&field, format!("load {word} {number}"))));
        }
    }
    said.extend(part(&load, "gear", &["ratio", "backlash_deg"], &["stiffness_nm_rad"]));
    said.extend(friction(&load));
    said.extend(part(&load, "pulley", &["mass_kg", "radius_m"], &[]));
    said.extend(part(&load, "spring", &["stiffness_nm_rad"], &["rest_deg"]));
    said.extend(stop(&load));
    said.extend(part(&load, "fan", &["torque_nm", "speed_rpm"], &[]));
    said
}

/// The table of a part of a load, if there is one.
fn part_of<'a>(
    load: &Table<'a>,
    name: &str,
    what: &'static str,
    expected: &str,
) -> Option<(Field<'a>, Result<Table<'a>, Problem>)> {
    let field = load.get(name)?;
    let table = field.table(what, expected);
    Some((field, table))
}

/// A part of a load whose words are its numbers in this order: those that it needs, and those that may follow.
fn part(load: &Table<'_>, name: &'static str, needs: &[&str], may: &[&str]) -> Vec<WordsOrProblem> {
    let names = [needs, may].concat();
    let expected = format!("a table of {}", names.join(", "));
    let Some((field, table)) = part_of(load, name, "a part of a load", &expected) else { return Vec::new() };
    let table = match table {
        Ok(table) => table,
        Err(problem) => return vec![Err(problem)],
    };
    let mut sentence = Sentence::begin(format!("load {name}"), &table, &names);
    for key in needs {
        sentence.word(table.need(key, A_NUMBER).and_then(|number| number.number(A_NUMBER)));
    }
    for number in may.iter().map_while(|key| table.get(key)) {
        sentence.word(number.number(A_NUMBER));
    }
    sentence.end(&field)
}

fn friction(load: &Table<'_>) -> Vec<WordsOrProblem> {
    let expected = "a table, e.g. { coulomb_nm = 0.2, viscous_nm_s = 0.01 }";
    let Some((field, table)) = part_of(load, "friction", "a friction", expected) else { return Vec::new() };
    let table = match table {
        Ok(table) => table,
        Err(problem) => return vec![Err(problem)],
    };
    let names = ["coulomb_nm", "viscous_nm_s", "static_nm", "stribeck_rad_s"];
    let mut sentence = Sentence::begin("load friction", &table, &names);
    sentence.word(table.get("coulomb_nm").map_or(Ok(0.0), |number| number.number(A_NUMBER)));
    for (key, word) in [("viscous_nm_s", "viscous"), ("static_nm", "static"), ("stribeck_rad_s", "stribeck")] {
        if let Some(number) = table.get(key) {
            sentence.word(number.number(A_NUMBER).map(|number| format!("{word} {number}")));
        }
    }
    sentence.end(&field)
}

fn stop(load: &Table<'_>) -> Vec<WordsOrProblem> {
    let expected = "a table, e.g. { range = [-5000, \"max\"], stiffness_nm_rad = 1000 }";
    let Some((field, table)) = part_of(load, "stop", "end stops", expected) else { return Vec::new() };
    let table = match table {
        Ok(table) => table,
        Err(problem) => return vec![Err(problem)],
    };
    let mut sentence = Sentence::begin("load stop", &table, &["range", "stiffness_nm_rad", "damping_nm_s_rad"]);
    let range = table.need("range", "two bounds, [low, high]").and_then(|range| bounds(&range));
    sentence.word(range.map(|[low, high]| format!("{low} {high}")));
    if let Some(stiffness) = table.get("stiffness_nm_rad") {
        sentence.word(stiffness.number(A_NUMBER));
    }
    if let Some(damping) = table.get("damping_nm_s_rad") {
        let stiffness = table.need("stiffness_nm_rad", "the stiffness that goes with the damping");
        sentence.word(stiffness.and_then(|_| damping.number(A_NUMBER)));
    }
    sentence.end(&field)
}

fn inputs(table: &Table<'_>) -> Vec<WordsOrProblem> {
    each(fields(table, "inputs", "a table of levels, e.g. { X0 = true }"), |input| {
        let level = u8::from(input.flag("true or false")?);
        Ok(format!("input {} {level}", word(input)?))
    })
}

fn switches(table: &Table<'_>) -> Vec<WordsOrProblem> {
    each(fields(table, "switches", "a table of ranges, e.g. { X0 = [-5000, \"max\"] }"), |switch| {
        let [low, high] = bounds(switch)?;
        Ok(format!("switch {} {low} {high}", word(switch)?))
    })
}

fn rotor(table: &Table<'_>) -> Vec<WordsOrProblem> {
    let Some(locked) = table.get("rotor_locked") else { return Vec::new() };
    match locked.flag("true or false") {
        Ok(true) => vec![Ok(Words::of(&locked, "rotor lock".into()))],
        Ok(false) => Vec::new(),
        Err(problem) => vec![Err(problem)],
    }
}

fn temperatures(table: &Table<'_>) -> Vec<WordsOrProblem> {
    each(fields(table, "temperatures_c", "a table of sensors, e.g. { motor = 95 }"), |sensor| {
        let celsius = sensor.number("degrees Celsius, e.g. 95")?;
        Ok(format!("temperature {} {celsius}", word(sensor)?))
    })
}

fn faults(table: &Table<'_>) -> Vec<WordsOrProblem> {
    let expected = "a list of components, e.g. [\"hall\"]";
    let components = table.get("faults").map_or(Ok(Vec::new()), |field| field.list(expected).and_then(bounded));
    each(components, |component| {
        let name = component.text(expected)?;
        Ok(format!("fault {} on", one_word(component, name)?))
    })
}

fn battery(table: &Table<'_>) -> Vec<WordsOrProblem> {
    let Some(battery) = table.get("battery") else { return Vec::new() };
    let state = battery.flag("true or false").map(|connected| if connected { "on" } else { "off" });
    vec![state.map(|state| Words::of(&battery, format!("battery {state}")))]
}

/// A world command of each field, or what is wrong with it.
fn each(
    fields: Result<Vec<Field<'_>>, Problem>,
    words: impl Fn(&Field<'_>) -> Result<String, Problem>,
) -> Vec<WordsOrProblem> {
    match fields {
        Ok(fields) => fields.iter().map(|field| Ok(Words::of(field, words(field)?))).collect(),
        Err(problem) => vec![Err(problem)],
    }
}

/// The two ends of a switch's range.
fn bounds(switch: &Field<'_>) -> Result<[String; 2], Problem> {
    const EXPECTED: &str = "two bounds, [low, high], each a whole number of counts, \"min\" or \"max\"";
    let ends = switch.list(EXPECTED)?;
    let words = ends.iter().map(|end| match end.word(EXPECTED) {
        Ok(word) if matches!(word.as_str(), "min" | "max") || word.parse::<i64>().is_ok() => Ok(word),
        _ => Err(end.wrong(EXPECTED)),
    });
    let words = words.collect::<Result<Vec<_>, _>>()?;
    <[String; 2]>::try_from(words).map_err(|_| switch.wrong(EXPECTED))
}

/// The names and values of the table behind `name`; none if it is not there.
pub(super) fn fields<'a>(table: &Table<'a>, name: &'static str, expected: &str) -> Result<Vec<Field<'a>>, Problem> {
    let Some(field) = table.get(name) else { return Ok(Vec::new()) };
    bounded(field.table(name, expected)?.fields().collect())
}

/// No drive has so many of anything.
const MOST: usize = 1024;

fn bounded(fields: Vec<Field<'_>>) -> Result<Vec<Field<'_>>, Problem> {
    match fields.get(MOST) {
        None => Ok(fields),
        Some(beyond) => Err(beyond.problem(format!("more than {MOST} entries: no drive has so many of anything"))),
    }
}

/// The name of a field as a word of a world command.
fn word<'a>(field: &'a Field<'_>) -> Result<&'a str, Problem> {
    one_word(field, field.name())
}

/// A name that is one word: it must not bring words of its own into a world command.
fn one_word<'a>(field: &Field<'_>, name: &'a str) -> Result<&'a str, Problem> {
    let word = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if word {
        Ok(name)
    } else {
        Err(field.problem(format!("'{name}' is not the name of an input or a part of a drive")))
    }
}

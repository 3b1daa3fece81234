//! What is around a drive in a machine file: its supply, load, inputs, sensors and what is broken, as stimuli.

use sim::{Source, Stimulus};

use crate::document::reader::{Field, Table};
use crate::document::{Located, Problem};

const VOLTAGE: &str = "a voltage in V, e.g. 48";

/// The supply: its voltage (also `supply_v`) and what is behind it.
pub(super) fn source(table: &Table<'_>) -> Result<Source, Problem> {
    let number = |table: &Table<'_>, name: &str, expected: &str| -> Result<Option<f64>, Problem> {
        table.get(name).map(|field| field.number(expected)).transpose()
    };
    let source = Source { voltage_v: number(table, "supply_v", VOLTAGE)?, limit_a: None, resistance_ohm: None };
    let Some(supply) = table.get("supply") else { return Ok(source) };
    let supply = supply.table("a supply", "a table, e.g. { voltage_v = 48, limit_a = 10 }")?;
    supply.takes_only(&["voltage_v", "limit_a", "resistance_ohm"])?;
    Ok(Source {
        voltage_v: number(&supply, "voltage_v", VOLTAGE)?.or(source.voltage_v),
        limit_a: number(&supply, "limit_a", "a current in A, e.g. 10")?,
        resistance_ohm: number(&supply, "resistance_ohm", "a resistance in ohms, e.g. 0.2")?,
    })
}

/// What else is around a drive, with its places. What is wrong is added to `problems`.
pub(super) fn around(table: &Table<'_>, problems: &mut Vec<Problem>) -> Vec<(Stimulus, Located)> {
    let parts: [Part; 7] = [load, inputs, switches, rotor, temperatures, faults, battery];
    let mut stimuli = Vec::new();
    for part in parts {
        match part(table) {
            Err(problem) => problems.push(problem),
            Ok(said) => {
                for Words { words, place } in said {
                    match words.parse() {
                        Ok(stimulus) => stimuli.push((stimulus, place.locate(table.text()))),
                        Err(error) => {
                            problems.push(Problem { what: format!("'{words}' cannot be done: {error}"), ..place })
                        }
                    }
                }
            }
        }
    }
    stimuli
}

/// What makes world commands of a part of the table.
type Part = fn(&Table<'_>) -> Result<Vec<Words>, Problem>;

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

const A_NUMBER: &str = "a number, e.g. 0.5";

/// What hangs on the shaft. A gear comes first: spring and stops stand where the load is behind it.
fn load(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let Some(load) = table.get("load") else { return Ok(Vec::new()) };
    let load = load.table("a load", "a table, e.g. { torque_nm = 0.5 }")?;
    load.takes_only(&["torque_nm", "inertia_kg_m2", "gear", "friction", "pulley", "spring", "stop", "fan"])?;
    let mut said = Vec::new();
    for (name, word) in [("torque_nm", "torque"), ("inertia_kg_m2", "inertia")] {
        if let Some(field) = load.get(name) {
            said.push(Words::of(&field, format!("load {word} {}", field.number(A_NUMBER)?)));
        }
    }
    said.extend(part(&load, "gear", &["ratio", "backlash_deg"], &["stiffness_nm_rad"])?);
    said.extend(friction(&load)?);
    said.extend(part(&load, "pulley", &["mass_kg", "radius_m"], &[])?);
    said.extend(part(&load, "spring", &["stiffness_nm_rad"], &["rest_deg"])?);
    said.extend(stop(&load)?);
    said.extend(part(&load, "fan", &["torque_nm", "speed_rpm"], &[])?);
    Ok(said)
}

/// A part of a load whose words are its numbers in this order: those that it needs, and those that may follow.
fn part(load: &Table<'_>, name: &'static str, needs: &[&str], may: &[&str]) -> Result<Option<Words>, Problem> {
    let Some(field) = load.get(name) else { return Ok(None) };
    let table = field.table("a part of a load", &format!("a table of {}", [needs, may].concat().join(", ")))?;
    table.takes_only(&[needs, may].concat())?;
    let mut words = format!("load {name}");
    for key in needs {
        words += &format!(" {}", table.need(key, A_NUMBER)?.number(A_NUMBER)?);
    }
    for key in may {
        match table.get(key) {
            Some(number) => words += &format!(" {}", number.number(A_NUMBER)?),
            None => break,
        }
    }
    Ok(Some(Words::of(&field, words)))
}

fn friction(load: &Table<'_>) -> Result<Option<Words>, Problem> {
    let Some(field) = load.get("friction") else { return Ok(None) };
    let table = field.table("a friction", "a table, e.g. { coulomb_nm = 0.2, viscous_nm_s = 0.01 }")?;
    table.takes_only(&["coulomb_nm", "viscous_nm_s", "static_nm", "stribeck_rad_s"])?;
    let coulomb_nm = table.get("coulomb_nm").map_or(Ok(0.0), |number| number.number(A_NUMBER))?;
    let mut words = format!("load friction {coulomb_nm}");
    for (key, word) in [("viscous_nm_s", "viscous"), ("static_nm", "static"), ("stribeck_rad_s", "stribeck")] {
        if let Some(number) = table.get(key) {
            words += &format!(" {word} {}", number.number(A_NUMBER)?);
        }
    }
    Ok(Some(Words::of(&field, words)))
}

fn stop(load: &Table<'_>) -> Result<Option<Words>, Problem> {
    let Some(field) = load.get("stop") else { return Ok(None) };
    let table = field.table("end stops", "a table, e.g. { range = [-5000, \"max\"], stiffness_nm_rad = 1000 }")?;
    table.takes_only(&["range", "stiffness_nm_rad", "damping_nm_s_rad"])?;
    let [low, high] = bounds(&table.need("range", "two bounds, [low, high]")?)?;
    let mut words = format!("load stop {low} {high}");
    if table.get("damping_nm_s_rad").is_some() {
        table.need("stiffness_nm_rad", "the stiffness that goes with the damping")?;
    }
    for key in ["stiffness_nm_rad", "damping_nm_s_rad"] {
        if let Some(number) = table.get(key) {
            words += &format!(" {}", number.number(A_NUMBER)?);
        }
    }
    Ok(Some(Words::of(&field, words)))
}

fn inputs(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let inputs = fields(table, "inputs", "a table of levels, e.g. { X0 = true }")?;
    let said = inputs.iter().map(|input| {
        let level = u8::from(input.flag("true or false")?);
        Ok(Words::of(input, format!("input {} {level}", word(input)?)))
    });
    said.collect()
}

fn switches(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let switches = fields(table, "switches", "a table of ranges, e.g. { X0 = [-5000, \"max\"] }")?;
    let said = switches.iter().map(|switch| {
        let [low, high] = bounds(switch)?;
        Ok(Words::of(switch, format!("switch {} {low} {high}", word(switch)?)))
    });
    said.collect()
}

fn rotor(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let Some(locked) = table.get("rotor_locked") else { return Ok(Vec::new()) };
    Ok(if locked.flag("true or false")? { vec![Words::of(&locked, "rotor lock".into())] } else { Vec::new() })
}

fn temperatures(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let sensors = fields(table, "temperatures_c", "a table of sensors, e.g. { motor = 95 }")?;
    let said = sensors.iter().map(|sensor| {
        let celsius = sensor.number("degrees Celsius, e.g. 95")?;
        Ok(Words::of(sensor, format!("temperature {} {celsius}", word(sensor)?)))
    });
    said.collect()
}

fn faults(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let expected = "a list of components, e.g. [\"hall\"]";
    let components = table.get("faults").map_or(Ok(Vec::new()), |field| field.list(expected).and_then(bounded))?;
    let said = components.iter().map(|component| {
        let name = component.text(expected)?;
        Ok(Words::of(component, format!("fault {} on", one_word(component, name)?)))
    });
    said.collect()
}

fn battery(table: &Table<'_>) -> Result<Vec<Words>, Problem> {
    let Some(battery) = table.get("battery") else { return Ok(Vec::new()) };
    let state = if battery.flag("true or false")? { "on" } else { "off" };
    Ok(vec![Words::of(&battery, format!("battery {state}"))])
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
    if word { Ok(name) } else { Err(field.problem(format!("'{name}' is no name of anything on a drive"))) }
}

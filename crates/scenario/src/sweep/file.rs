//! What a scenario file says of a sweep: names of parameters, and the values that each goes through.

use words::document::Problem;
use words::document::reader::{Field, Parameters, Table};
use words::suggest::{did_you_mean, near};

/// A parameter and the values that it goes through, in the words that they are put into texts with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SweepAxis {
    /// The parameter.
    pub name: String,
    /// Its values.
    pub values: Vec<String>,
}

impl SweepAxis {
    /// True if all of its values are numbers, written as a number is.
    pub(super) fn is_numeric(&self) -> bool {
        let is_number =
            |value: &String| value.parse().is_ok_and(|number: f64| number.is_finite() && number.to_string() == *value);
        self.values.iter().all(is_number)
    }
}

/// Values that one parameter may go through.
const MOST_VALUES: usize = 100_000;

const EXPECTED: &str = "a list of values, or { from = 0, to = 2, step = 0.5 }";

/// The sweep of a scenario with these parameters.
pub(crate) fn axes(file: &Table<'_>, parameters: &Parameters) -> Result<Vec<SweepAxis>, Vec<Problem>> {
    let single = |problem| vec![problem];
    let Some(field) = file.get("sweep") else { return Ok(Vec::new()) };
    let table = field.table("the sweep", "a table of parameters and their values").map_err(single)?;
    let known: Vec<&str> = parameters.keys().map(String::as_str).collect();
    let problems = table.strangers(&known);
    if let Some(first) = problems.first() {
        let name = table.text().get(first.at.clone()).unwrap_or_default();
        let near = did_you_mean(&near(name, known));
        let what =
            format!("there is no parameter '{name}'{near}; [parameters] gives each its value outside of a sweep");
        return Err(single(Problem::new(first.at.clone(), what)));
    }
    table.fields().map(|field| axis(&field).map_err(single)).collect()
}

fn axis(field: &Field<'_>) -> Result<SweepAxis, Problem> {
    let name = field.name().to_owned();
    if field.is_list() {
        let values = field.list(EXPECTED)?.iter().map(value).collect::<Result<Vec<_>, _>>()?;
        return match values.len() {
            0 => Err(field.wrong(EXPECTED)),
            count if count > MOST_VALUES => Err(field.problem(format!("more than {MOST_VALUES} values"))),
            _ => Ok(SweepAxis { name, values }),
        };
    }
    let range = field.table("a range", EXPECTED)?;
    range.takes_only(&["from", "to", "step"])?;
    let number = |name| range.need(name, EXPECTED)?.number("a number");
    let (from, to, step) = (number("from")?, number("to")?, number("step")?);
    // Half a step of grace, so that 0 to 1 by 0.1 ends at 1.
    let steps = ((to - from) / step + 1e-9).floor();
    if !(0.0..MOST_VALUES as f64).contains(&steps) {
        let what = format!("from {from} to {to} by {step} does not give 1 to {MOST_VALUES} values");
        return Err(field.problem(what));
    }
    let values = (0..=steps as usize).map(|n| shown(from + n as f64 * step)).collect();
    Ok(SweepAxis { name, values })
}

/// A number without the last digits, in which a sum of steps is off.
fn shown(number: f64) -> String {
    let text = format!("{number:.12}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A number or a text, in the words that it is put into texts with.
pub(crate) fn value(field: &Field<'_>) -> Result<String, Problem> {
    let expected = "a number or a text";
    field.word(expected).or_else(|_| field.number(expected).map(|number| number.to_string()))
}

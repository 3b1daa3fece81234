//! Parameters as TOML, for people: objects by number or name, values with their units.
//!
//! ```toml
//! node = 4
//! identity = { vendor_id = 0x100, product_code = 0x1 }
//! [values]
//! "1017" = 200                # producer_heartbeat_time, ms
//! profile_velocity = "60rpm"
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;

use canopen::od::{DataType, DefaultValue, Entry, Kind, Value};
use canopen::{Mux, NodeId};
use devices::Description;
use master::identify::Identity;
use master::parameters::Parameters;

use words::document::reader::{self, Field, Parameters as Placeholders, Table};
use words::document::{BadFile, Problem};
use words::models::resolve as resolve_model;
use words::node::node;
use words::object::object;
use words::unit::split_factor;
use words::value::{Typed, bytes_in_hexadecimal, type_of_word, type_word, typed_alone, typed_for};

const KEYS: &[&str] = &["model", "node", "identity", "values"];
const IDENTITY_KEYS: &[&str] = &["device_type", "vendor_id", "product_code", "revision_number"];
const NODE: &str = "a node-ID from 1 to 127, e.g. 4";
const VALUE: &str = "a whole number, or a text such as \"60rpm\", \"profile velocity\", \"u16:15\" or \"hex:01AA\"";

/// Reads such a file.
///
/// # Errors
/// Everything that is wrong with it, each with its place and what is expected there.
pub fn parse(text: &str, model: Option<&'static Description>) -> Result<Parameters, BadFile> {
    reader::read(text, &Placeholders::new(), "a file of parameters", |file| from_table(file, model))
        .map_err(|problems| BadFile::new(text, problems))
}

fn from_table(file: &Table<'_>, model: Option<&'static Description>) -> Result<Parameters, Vec<Problem>> {
    let mut problems = file.strangers(KEYS);
    let mut parameters = Parameters::default();
    match node_of(file) {
        Ok(node) => parameters.node = node,
        Err(problem) => problems.push(problem),
    }
    match identity_of(file) {
        Ok(identity) => parameters.identity = identity,
        Err(problem) => problems.push(problem),
    }
    let named = file.get("model").map(|field| (field.text("a model as text, e.g. \"zlac8030l\""), field));
    let model = match named {
        Some((Err(problem), _)) => {
            problems.push(problem);
            model
        }
        Some((Ok(name), field)) if model.is_some_and(|model| model.name != name) => {
            let node = model.map_or("", |model| model.name);
            problems.push(field.problem(format!("these are parameters of a {name}, and the node is a {node}")));
            model
        }
        // Of a model of a file, which is not there perhaps, the objects have numbers.
        Some((Ok(name), _)) => model.or_else(|| resolve_model(name).ok()),
        None => model,
    };
    let values = file.need("values", "a table of objects and their values, begun by [values]");
    match values.and_then(|field| field.table("the values", "a table of objects, e.g. { 1017 = 200 }")) {
        Ok(table) => match values_of(&table, model) {
            Ok(values) => parameters.values = values,
            Err(wrong) => problems.extend(wrong),
        },
        Err(problem) => problems.push(problem),
    }
    if problems.is_empty() { Ok(parameters) } else { Err(problems) }
}

fn node_of(file: &Table<'_>) -> Result<Option<NodeId>, Problem> {
    let Some(field) = file.get("node") else { return Ok(None) };
    node(&field.whole::<u8>(NODE)?.to_string()).map(Some).map_err(|reason| field.problem(reason))
}

fn identity_of(file: &Table<'_>) -> Result<Identity, Problem> {
    let Some(field) = file.get("identity") else { return Ok(Identity::default()) };
    let table = field.table("an identity", "a table, e.g. { vendor_id = 0x100, product_code = 1 }")?;
    table.takes_only(IDENTITY_KEYS)?;
    let number = |name: &str| table.get(name).map(|field| field.whole::<u32>("a number of 32 bits")).transpose();
    Ok(Identity {
        device_type: number("device_type")?,
        vendor_id: number("vendor_id")?,
        product_code: number("product_code")?,
        revision_number: number("revision_number")?,
    })
}

/// Objects and values of a table, as [`Parameters`] has them; also what a machine file says of a drive.
///
/// # Errors
/// Everything that is wrong with them.
pub fn values_of(
    table: &Table<'_>,
    model: Option<&'static Description>,
) -> Result<BTreeMap<Mux, Vec<u8>>, Vec<Problem>> {
    let (mut values, mut problems) = (BTreeMap::new(), Vec::new());
    let fields: Vec<Field<'_>> = table.fields().collect();
    let resolved: Vec<_> = fields.iter().map(|field| resolve(field, model)).collect();
    // A number with a unit depends on the object that decides how fine its counts are.
    let count_of = |place: Mux| {
        let of_file = fields.iter().zip(&resolved).find(|(_, found)| matches!(found, Ok((mux, _)) if *mux == place));
        let of_file = of_file.and_then(|(field, _)| field.whole::<i64>(VALUE).ok());
        of_file.or_else(|| match model?.row(place)?.default {
            DefaultValue::Value(value) => Some(value),
            _ => None,
        })
    };
    for (field, found) in fields.iter().zip(&resolved) {
        let value = found.clone().and_then(|(mux, row)| {
            let resolution = row.and_then(|row| row.resolution).and_then(count_of).unwrap_or(1).max(1);
            Ok((mux, bytes_of(field, row, resolution)?))
        });
        match value {
            Ok((mux, _)) if values.contains_key(&mux) => problems.push(field.problem(format!("{mux} is given twice"))),
            Ok((mux, bytes)) => {
                values.insert(mux, bytes);
            }
            Err(problem) => problems.push(problem),
        }
    }
    if problems.is_empty() { Ok(values) } else { Err(problems) }
}

fn resolve(field: &Field<'_>, model: Option<&'static Description>) -> Result<(Mux, Option<&'static Entry>), Problem> {
    let found = object(field.name()).and_then(|object| object.resolve(model.map(|model| model.dictionary)));
    found.map_err(|reason| field.problem(reason))
}

/// The value of a field for an object of a model, as delivered in what decides about its unit.
///
/// # Errors
/// It is not one.
pub fn value_of(field: &Field<'_>, row: &'static Entry, model: &'static Description) -> Result<Vec<u8>, Problem> {
    let resolution = row.resolution.and_then(|place| match model.row(place)?.default {
        DefaultValue::Value(value) => Some(value),
        _ => None,
    });
    bytes_of(field, Some(row), resolution.unwrap_or(1).max(1))
}

fn bytes_of(field: &Field<'_>, row: Option<&'static Entry>, resolution: i64) -> Result<Vec<u8>, Problem> {
    let text = match field.number(VALUE) {
        Ok(number) if number.fract() != 0.0 => number.to_string(),
        _ => field.word(VALUE)?,
    };
    let refused = |reason: String| field.problem(reason);
    if let Some(digits) = text.strip_prefix("hex:") {
        let bytes = bytes_in_hexadecimal(digits).map_err(refused)?;
        let size = row.map_or(0, |row| row.data_type.size());
        return if size == 0 || size == bytes.len() {
            Ok(bytes)
        } else {
            Err(field.problem(format!("{} bytes for '{}', which has {size}", bytes.len(), field.name())))
        };
    }
    let Some(row) = row else {
        return typed_alone(&text).map(|typed| typed.bytes()).map_err(|reason| {
            field.problem(format!("'{}' is not an object of any known model: {reason}", field.name()))
        });
    };
    let typed = typed_for(row, without_type(row, &text).map_err(refused)?, resolution).map_err(refused)?;
    if let Typed::Number(_, number) = typed
        && row.resolution.is_none()
        && row.check_value(number).is_err()
    {
        return Err(field.problem(format!(
            "{} {}: {number} is not taken; it takes {}",
            row.mux(),
            row.name,
            taken(row)
        )));
    }
    Ok(typed.bytes())
}

/// The value behind its type, which a file for a model of a data sheet has, so that it can be read without that.
fn without_type<'a>(row: &Entry, text: &'a str) -> Result<&'a str, String> {
    let typed = text.split_once(':').and_then(|(word, value)| Some((type_of_word(word)?, value)));
    match typed {
        Some((data_type, value)) if data_type == row.data_type => Ok(value),
        // A text may begin with the name of another type.
        Some(_) if row.data_type != DataType::VisibleString => {
            Err(format!("'{text}' for {} {}, which is of type {}", row.mux(), row.name, row.data_type.name()))
        }
        _ => Ok(text),
    }
}

fn taken(row: &Entry) -> String {
    if row.values.is_empty() {
        let (low, high) = row.limits_at(1);
        return format!(
            "{low} to {high}{}",
            if row.unit.is_empty() { String::new() } else { format!(" in {}", row.unit) }
        );
    }
    row.values.iter().map(|(value, meaning)| format!("{value} ({meaning})")).collect::<Vec<_>>().join(", ")
}

/// The file of these parameters, with what each is and its unit as a comment. It reads back as the same.
pub fn print(parameters: &Parameters, model: Option<&'static Description>) -> String {
    let mut text = String::new();
    if let Some(model) = model {
        text += &format!("# Parameters of a {}.\nmodel = {:?}\n", model.title, model.name);
    }
    if let Some(node) = parameters.node {
        text += &format!("node = {node}\n");
    }
    let identity = &parameters.identity;
    let numbers = [identity.device_type, identity.vendor_id, identity.product_code, identity.revision_number];
    let said = IDENTITY_KEYS.iter().zip(numbers).filter_map(|(key, number)| Some(format!("{key} = 0x{:X}", number?)));
    let said: Vec<String> = said.collect();
    if !said.is_empty() {
        text += &format!("identity = {{ {} }}\n", said.join(", "));
    }
    // Who has the file has not always the data sheet.
    let typed = model.is_some_and(|model| resolve_model(model.name).is_err());
    text += "\n[values]\n";
    for (object, bytes) in &parameters.values {
        let row = model.and_then(|model| model.row(*object));
        // Writing into a String cannot fail.
        let _ = writeln!(text, "\"{object:X}\" = {}{}", shown(row, bytes, typed), remark(row, bytes));
    }
    text
}

/// A value in the words of TOML; `typed` with its type.
fn shown(row: Option<&Entry>, bytes: &[u8], typed: bool) -> String {
    let in_hexadecimal = || {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        format!("\"hex:{digits}\"")
    };
    let Some(row) = row else { return in_hexadecimal() };
    match (row.data_type, Value::parse(row.data_type, bytes)) {
        (of, Some(Value::Integer(number))) => {
            let in_hex = row.is_communication() && of == DataType::Unsigned32;
            let number = if in_hex { format!("0x{number:X}") } else { number.to_string() };
            match type_word(of) {
                _ if !typed => number,
                Some(word) => format!("\"{word}:{number}\""),
                None => in_hexadecimal(),
            }
        }
        (DataType::VisibleString, Some(Value::Bytes(bytes)))
            if !bytes.is_empty()
                && !bytes.starts_with(b"hex:")
                && !bytes.starts_with(b"text:")
                && bytes.iter().all(|byte| matches!(byte, b' '..=b'~')) =>
        {
            let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
            toml::Value::String(if typed { format!("text:{text}") } else { text }).to_string()
        }
        _ => in_hexadecimal(),
    }
}

fn remark(row: Option<&Entry>, bytes: &[u8]) -> String {
    let Some(row) = row else { return String::new() };
    let number = match Value::parse(row.data_type, bytes) {
        Some(Value::Integer(number)) if row.data_type.kind() != Kind::Bytes => Some(number),
        _ => None,
    };
    let meaning = number.and_then(|number| row.meaning(number)).map(|meaning| format!(": {meaning}"));
    let quantity = number.filter(|_| !row.unit.is_empty() && row.resolution.is_none()).map(|number| {
        let (factor, name) = split_factor(row.unit);
        format!(", {} {name}", master::units::Shown(number as f64 * factor))
    });
    format!("  # {}{}{}", row.name, meaning.unwrap_or_default(), quantity.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> &'static Description {
        devices::model("zlac8030l").expect("a model")
    }

    fn read(values: &str) -> BTreeMap<Mux, Vec<u8>> {
        parse(&format!("[values]\n{values}"), Some(model())).unwrap_or_else(|bad| panic!("{bad}")).values
    }

    fn refusal(text: &str) -> String {
        parse(text, Some(model())).map_or_else(|bad| bad.to_string(), |_| String::new())
    }

    #[test]
    fn the_defaults_of_every_model_are_printed_and_read_again() {
        let node = NodeId::new(4).expect("a node-ID");
        for model in devices::all().iter() {
            let rows = master::parameters::wanted_of(model);
            let value = |mux: Mux| Some((mux, master::parameters::default_of(model.row(mux)?, node)?));
            let identity = Identity { vendor_id: Some(0x100), ..Identity::default() };
            let values = rows.into_iter().filter_map(value).collect();
            let parameters = Parameters { identity, node: Some(node), values };
            let text = print(&parameters, Some(model));
            let again = parse(&text, Some(model)).unwrap_or_else(|bad| panic!("{}: {bad}", model.name));
            assert_eq!(again, parameters, "{}", model.name);
        }
    }

    #[test]
    fn objects_have_numbers_or_names_and_values_have_units() {
        let values = read("1017 = 200\nprofile_velocity = \"60rpm\"\n\"1A00:01\" = 0x60410010\n");
        assert_eq!(values[&Mux::new(0x1017, 0)], [200, 0]);
        assert_eq!(values[&Mux::new(0x6081, 0)], [60, 0, 0, 0]);
        assert_eq!(values[&Mux::new(0x1A00, 1)], [0x10, 0, 0x41, 0x60]);
    }

    #[test]
    fn what_is_wrong_is_reported_at_its_place() {
        assert!(refusal("node = 4\n").contains("needs 'values'"));
        assert!(refusal("[values]\nprofile_velocty = 1").contains("did you mean profile_velocity?"));
        assert!(refusal("[values]\n1017 = 70000").contains("line 2, column 8"));
        assert!(refusal("[values]\n1017 = [1]").contains("'1017' is a list of 1; expected a whole number"));
        assert!(refusal("[values]\n6081 = -1").contains("6081h:00"));
        assert!(refusal("[values]\n1017 = 1\n\"1017:00\" = 2").contains("is given twice"));
        assert!(refusal("[values]\n5555 = 1").contains("needs its type"));
        assert!(refusal("[values]\n1017 = \"hex:01\"").contains("1 bytes for '1017', which has 2"));
        assert!(refusal("model = 'zlim42c'\n[values]").contains("the node is a zlac8030l"));
        assert!(refusal("identity = { vendor = 1 }\n[values]").contains("has no 'vendor'; did you mean vendor_id?"));
        assert!(refusal("[values]\n1017 = ").starts_with("line 2, column "));
    }
}

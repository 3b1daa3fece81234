//! `ferrodrive objects`: the object dictionary of a model, searchable.

use canopen::od::{DefaultValue, Entry, ValueRange};
use canopen::{Mux, NodeId};
use master::drive::{Limits, Setting};
use serde::Serialize;

use super::departures::DepartureList;
use super::drive::guessed;
use crate::context::Context;
use crate::failure::Failure;
use plot::Paint;
use plot::Table;
use words::models::{Description, is_from_file, known, resolve};
use words::node::node;
use words::object::{ObjectArg, object};
use words::unresolved::Unresolved;

/// List the object dictionary of a model or of a node; without one, the models
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive objects\n  ferrodrive objects zlac8030l\n  ferrodrive objects 4 velocity\n  ferrodrive objects zlim42c homing\n  \
        ferrodrive objects zlac8030l,firmware=2.01 202F\n  ferrodrive objects zlac8030l --departures"
)]
pub struct Objects {
    /// Model (e.g. zlac8030l), data sheet (FILE.eds) or node-ID
    #[arg(value_name = "MODEL|FILE.eds|NODE", value_parser = whose)]
    pub whose: Option<Whose>,
    /// Show only objects with this index, or with this word in name, title or meaning
    search: Vec<String>,
    /// Show where the model departs from CiA 301 and CiA 402, and what a program written for them has to do
    #[arg(long, conflicts_with = "search", requires = "whose")]
    pub departures: bool,
}

/// Whose dictionary.
#[derive(Clone, Copy, Debug)]
pub enum Whose {
    /// A model's.
    Model(&'static Description),
    /// That of a node, whose model is to be found out.
    Node(NodeId),
}

fn whose(text: &str) -> Result<Whose, Unresolved> {
    if text.starts_with(|first: char| first.is_ascii_digit() || first == '-') {
        return Ok(Whose::Node(node(text)?));
    }
    resolve(text).map(Whose::Model)
}

/// The models that are known by name.
#[derive(Debug, Serialize)]
pub struct ModelList {
    models: Vec<ModelRow>,
}

#[derive(Debug, Serialize)]
struct ModelRow {
    name: &'static str,
    title: &'static str,
    /// What it is known from.
    manual: &'static str,
    /// Axes that it moves; 0 for what is not a drive.
    axes: usize,
    /// Node-ID as delivered.
    node_id: Option<u8>,
    /// Bit rate as delivered, in kbit/s.
    bitrate_kbit: Option<u32>,
}

impl ModelList {
    /// All of them.
    pub fn of_all() -> Self {
        let row = |model: &Description| ModelRow {
            name: model.name,
            title: model.title,
            manual: if is_from_file(model) { "an EDS that is built in" } else { model.manual },
            axes: model.axes.len(),
            node_id: model.node_id.map(NodeId::raw),
            bitrate_kbit: model.bitrate.map(|bitrate| bitrate.bits_per_second() / 1000),
        };
        Self { models: known().map(row).collect() }
    }
}

impl ModelList {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["model", "what it is", "node-ID", "kbit/s", "known from"]);
        let delivered = |number: Option<u32>| number.map_or_else(String::new, |number| number.to_string());
        for row in &self.models {
            let (node_id, bitrate) = (delivered(row.node_id.map(u32::from)), delivered(row.bitrate_kbit));
            table.row([row.name.to_owned(), row.title.to_owned(), node_id, bitrate, row.manual.to_owned()]);
        }
        let rest = "Any other device: FILE.eds in place of a model. Objects of a model: ferrodrive objects MODEL";
        format!("{}\n{rest}", table.plain(paint))
    }
}

/// The rows found.
#[derive(Debug, Serialize)]
pub struct ObjectList {
    model: &'static str,
    /// The model, if a node was asked and its model is a guess.
    #[serde(skip_serializing_if = "Option::is_none")]
    guess: Option<&'static str>,
    title: String,
    objects: Vec<TableRow>,
}

#[derive(Debug, Serialize)]
struct TableRow {
    object: String,
    #[serde(skip)]
    mux: Mux,
    name: &'static str,
    title: &'static str,
    /// What the manual calls it or says of it, where that is not the title.
    #[serde(skip_serializing_if = "str::is_empty")]
    description: &'static str,
    data_type: &'static str,
    access: &'static str,
    stored: bool,
    mappable: bool,
    default: Factory,
    /// Smallest and largest value, if narrower than the type.
    limits: Option<NumberBounds>,
    /// The object that multiplies them, and divides the unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    limits_times: Option<String>,
    /// The object beyond whose value a value is taken and has no more effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    acts_up_to: Option<String>,
    /// What is in force on the node that was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    now: Option<Now>,
    unit: &'static str,
    values: Vec<Meaning>,
}

/// A factory value, as programs read it: a number, a text, or what the node-ID is added to.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Factory {
    Number(i64),
    Unsigned(u64),
    Real(f64),
    PlusNodeId { plus_node_id: u32 },
    Text(&'static str),
    Bytes(&'static [u8]),
}

/// Limits as programs read them: two numbers.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum NumberBounds {
    Integer((i64, i64)),
    Unsigned((u64, u64)),
    Real((f64, f64)),
}

/// The limits in force on a node, and the objects that they follow from.
#[derive(Debug, Serialize)]
struct Now {
    limits: (i64, i64),
    #[serde(skip_serializing_if = "Option::is_none")]
    acts_up_to: Option<i64>,
    by: Vec<By>,
    #[serde(skip)]
    text: String,
}

#[derive(Debug, Serialize)]
struct By {
    object: String,
    name: &'static str,
    value: i64,
    /// The drive goes by the value of its last restart.
    since_restart: bool,
}

impl Now {
    fn of(limits: &Limits) -> Self {
        let held = limits.held_to.and_then(|(_, by)| by.setting());
        let settings = [limits.resolution, held, limits.raised_to.map(|(_, setting)| setting)].into_iter().flatten();
        let by = settings.map(|Setting { object, name, value, since_restart }| By {
            object: object.to_string(),
            name,
            value,
            since_restart,
        });
        Self {
            limits: (limits.low, limits.high),
            acts_up_to: limits.held_to.map(|(most, _)| most),
            by: by.collect(),
            text: limits.to_string(),
        }
    }
}

#[derive(Debug, Serialize)]
struct Meaning {
    value: i64,
    meaning: &'static str,
}

impl Objects {
    /// What was asked for, as lines for people.
    ///
    /// # Errors
    /// The model of a node is not known, no object fits; those of SDO.
    pub async fn text(&self, context: &Context, paint: Paint) -> Result<String, Failure> {
        Ok(match self.whose {
            None => ModelList::of_all().text(paint),
            Some(Whose::Model(model)) if self.departures => DepartureList::of(model, None).text(paint),
            Some(Whose::Node(node)) if self.departures => self.departures_of_node(context, node).await?.text(paint),
            Some(Whose::Model(model)) => self.list(model)?.text(paint),
            Some(Whose::Node(node)) => self.of_node(context, node).await?.text(paint),
        })
    }

    /// Where a node's model departs from the standards.
    pub async fn departures_of_node(&self, context: &Context, node: NodeId) -> Result<DepartureList, Failure> {
        let drive = context.known_drive(node).await?;
        let model = drive.description().ok_or_else(|| Failure::unknown_model(node))?;
        Ok(DepartureList::of(model, guessed(&drive)))
    }

    /// Searches the table of a node's model.
    pub async fn of_node(&self, context: &Context, node: NodeId) -> Result<ObjectList, Failure> {
        let drive = context.known_drive(node).await?;
        let model = drive.description().ok_or_else(|| Failure::unknown_model(node))?;
        let mut list = ObjectList { guess: guessed(&drive), ..self.list(model)? };
        for row in &mut list.objects {
            if !model.row(row.mux).is_some_and(|row| drive.is_limited_elsewhere(row)) {
                continue;
            }
            row.now = Some(Now::of(&drive.limits(row.mux).await?));
        }
        Ok(list)
    }

    /// Searches the table of `model`.
    pub fn list(&self, model: &'static Description) -> Result<ObjectList, Failure> {
        let rows = model.dictionary.rows();
        let wanted = |row: &&Entry| self.search.iter().all(|word| matches(row, word));
        let objects: Vec<TableRow> = rows.iter().filter(wanted).map(TableRow::new).collect();
        if objects.is_empty() {
            let words = self.search.join(" ");
            return Err(Failure::new(format!("no object of the {} matches '{words}'", model.name)).next(format!(
                "ferrodrive objects {} lists all {}",
                model.name,
                rows.len()
            )));
        }
        Ok(ObjectList {
            model: model.name,
            guess: None,
            title: format!("{}, object dictionary of \"{}\"", model.title, model.manual),
            objects,
        })
    }
}

fn matches(row: &Entry, word: &str) -> bool {
    if let Ok(ObjectArg::Mux(mux)) = object(word)
        && mux.index == row.index
        && (!word.contains(':') || mux.sub_index == row.sub_index)
    {
        return true;
    }
    let word = word.to_lowercase();
    let texts =
        [row.name, row.title, row.description].into_iter().chain(row.values.iter().map(|(_, meaning)| *meaning));
    texts.into_iter().any(|text| text.to_lowercase().contains(&word))
}

impl TableRow {
    fn new(row: &Entry) -> Self {
        Self {
            object: row.mux().to_string(),
            mux: row.mux(),
            name: row.name,
            title: row.title,
            description: row.description,
            data_type: row.data_type.name(),
            access: row.access.name(),
            stored: row.stored,
            mappable: row.pdo.is_allowed(),
            default: Factory::of(row),
            limits: row.limits.map(NumberBounds::of),
            limits_times: row.resolution.map(|object| object.to_string()),
            acts_up_to: row.held_to.map(|held_to| held_to.object.to_string()),
            now: None,
            unit: row.unit,
            values: row.values.iter().map(|(value, meaning)| Meaning { value: *value, meaning }).collect(),
        }
    }

    fn accepts(&self) -> String {
        if let Some(now) = &self.now {
            return now.text.clone();
        }
        if self.values.is_empty() {
            let limits = self.limits.as_ref().map(NumberBounds::text).unwrap_or_default();
            let times = self.limits_times.as_ref().map(|object| format!(", times {object}")).unwrap_or_default();
            let held = self.acts_up_to.as_ref().map(|object| format!("; acts up to {object}")).unwrap_or_default();
            return limits + &times + &held;
        }
        let listed = self.values.iter().map(|row| format!("{} {}", row.value, row.meaning));
        listed.collect::<Vec<_>>().join("; ")
    }

    fn rights(&self) -> String {
        let stored = if self.stored { "/s" } else { "" };
        let mappable = if self.mappable { " pdo" } else { "" };
        format!("{}{stored}{mappable}", self.access)
    }
}

impl Factory {
    const fn of(row: &Entry) -> Self {
        match row.default {
            DefaultValue::Value(value) => Self::Number(value),
            DefaultValue::Unsigned(value) => Self::Unsigned(value),
            DefaultValue::Real(value) => Self::Real(value),
            DefaultValue::NodeIdPlus(base) => Self::PlusNodeId { plus_node_id: base },
            DefaultValue::Text(text) => Self::Text(text),
            DefaultValue::Bytes(bytes) => Self::Bytes(bytes),
        }
    }

    /// For people. What is in the communication area is mostly identifiers and mappings.
    fn text(&self, in_communication_area: bool) -> String {
        match self {
            Self::Number(value) if in_communication_area && *value > 255 => format!("0x{value:X}"),
            Self::Number(value) => value.to_string(),
            Self::Unsigned(value) => value.to_string(),
            Self::Real(value) => value.to_string(),
            Self::PlusNodeId { plus_node_id } => format!("0x{plus_node_id:X} + node-ID"),
            Self::Text(text) => format!("{text:?}"),
            Self::Bytes(bytes) => bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" "),
        }
    }
}

impl NumberBounds {
    const fn of(limits: ValueRange) -> Self {
        match limits {
            ValueRange::Integer(low, high) => Self::Integer((low, high)),
            ValueRange::Unsigned(low, high) => Self::Unsigned((low, high)),
            ValueRange::Real(low, high) => Self::Real((low, high)),
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Integer((low, high)) => format!("{low} to {high}"),
            Self::Unsigned((low, high)) => format!("{low} to {high}"),
            Self::Real((low, high)) => format!("{low} to {high}"),
        }
    }
}

impl ObjectList {
    /// As lines for people.
    pub fn text(&self, paint: Paint) -> String {
        let mut table = Table::new(&["object", "name", "type", "access", "default", "unit", "accepts"]);
        for row in &self.objects {
            table.row([
                row.object.clone(),
                row.name.into(),
                row.data_type.into(),
                row.rights(),
                row.default.text(matches!(row.mux.index, 0x1000..=0x1FFF)),
                row.unit.into(),
                row.accepts(),
            ]);
        }
        format!("{}\n\n{}", self.title, table.plain(paint))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use words::models::embedded;

    fn found(words: &[&str]) -> Vec<&'static str> {
        let search = words.iter().map(|word| (*word).into()).collect();
        let (_, model) = embedded()[0];
        let list = Objects { whose: Some(Whose::Model(model)), search, departures: false }.list(model);
        list.map(|list| list.objects.iter().map(|row| row.name).collect()).unwrap_or_default()
    }

    #[test]
    fn objects_are_found_by_index_word_and_meaning() {
        assert_eq!(found(&["6064"]), ["position_actual_value"]);
        assert_eq!(found(&["2026:01"]), ["motor_temperature"]);
        assert!(found(&["2026"]).len() == 3);
        assert!(found(&["temperature", "threshold"]).contains(&"motor_temperature_protection_threshold"));
        assert!(found(&["profile torque"]).contains(&"modes_of_operation"));
        assert!(found(&["zebra"]).is_empty());
    }
}

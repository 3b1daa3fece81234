//! The fields of a message that is a JSON object.

use canopen::NodeId;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value, from_value};

/// The fields of a message.
pub(crate) type Fields = Map<String, Value>;

/// All of them as one value, which refuses those that it does not have.
pub(crate) fn whole<T: DeserializeOwned>(fields: Fields) -> Result<T, String> {
    from_value(Value::Object(fields)).map_err(|error| error.to_string())
}

/// A command by its word and its fields, which refuses those that it does not have. Serde reads the word first then: where it has to
/// look for the word among the fields, it keeps all of them in a form of its own, which is much code for each type.
pub(crate) fn command<T: DeserializeOwned>(word: &str, mut fields: Fields) -> Result<T, String> {
    fields.remove("do");
    whole(Fields::from_iter([(word.to_owned(), Value::Object(fields))]))
}

/// A field, taken out; one that is omitted is `null`.
pub(super) fn taken<T: DeserializeOwned>(fields: &mut Fields, name: &str) -> Result<T, String> {
    match fields.remove(name) {
        Some(value) => from_value(value).map_err(|error| format!("field `{name}`: {error}")),
        None => from_value(Value::Null).map_err(|_| format!("missing field `{name}`")),
    }
}

/// A node-ID as a number.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "u8")]
struct Number(NodeId);

impl TryFrom<u8> for Number {
    type Error = String;

    fn try_from(raw: u8) -> Result<Self, String> {
        NodeId::new(raw).map(Self).ok_or_else(|| format!("expected a node-ID from 1 to 127, got {raw}"))
    }
}

/// The field `node`, taken out.
pub(super) fn node_id(fields: &mut Fields) -> Result<NodeId, String> {
    taken(fields, "node").map(|Number(node)| node)
}

/// The node-ID of a field.
pub(super) fn node<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NodeId, D::Error> {
    Number::deserialize(deserializer).map(|Number(node)| node)
}

/// The node-ID of a field that may be `null`.
pub(super) fn node_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<NodeId>, D::Error> {
    Option::deserialize(deserializer).map(|number| number.map(|Number(node)| node))
}

/// The node-IDs of a pair.
pub(super) fn two_nodes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[NodeId; 2], D::Error> {
    <[Number; 2]>::deserialize(deserializer).map(|numbers| numbers.map(|Number(node)| node))
}

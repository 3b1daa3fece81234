//! The fields of a message that is a JSON object.

use canopen::NodeId;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, from_value};

/// The fields of a message.
pub(crate) type Fields = Map<String, Value>;

/// All of them as one value, which refuses those that it does not have.
pub(crate) fn whole<T: DeserializeOwned>(fields: Fields) -> Result<T, String> {
    from_value(Value::Object(fields)).map_err(|error| error.to_string())
}

/// A field, taken out; one that is omitted is `null`.
pub(super) fn taken<T: DeserializeOwned>(fields: &mut Fields, name: &str) -> Result<T, String> {
    match fields.remove(name) {
        Some(value) => from_value(value).map_err(|error| format!("field `{name}`: {error}")),
        None => from_value(Value::Null).map_err(|_| format!("missing field `{name}`")),
    }
}

/// The field `node`, taken out.
pub(super) fn node_id(fields: &mut Fields) -> Result<NodeId, String> {
    let raw: u8 = taken(fields, "node")?;
    NodeId::new(raw).ok_or_else(|| format!("expected a node-ID from 1 to 127, got {raw}"))
}

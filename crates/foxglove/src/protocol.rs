//! Messages of the protocol, version 1: texts are JSON with the name of the operation in `op`, binary ones begin with its number.

use recording::{Channel, MESSAGE_ENCODING, SCHEMA_ENCODING};
use serde_json::{Value, json};

/// Names of the protocol that a client may offer.
pub(crate) const SUBPROTOCOLS: [&str; 2] = ["foxglove.websocket.v1", "foxglove.sdk.v1"];

/// Binary messages of a server.
const MESSAGE_DATA: u8 = 1;
const TIME: u8 = 2;

/// How much a status message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Warning = 1,
    Error = 2,
}

/// What a client asks for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// Its number of a subscription, and the channel.
    Subscribe(Vec<(u32, u64)>),
    Unsubscribe(Vec<u32>),
}

/// What clients ask of servers that can more.
const OF_OTHERS: [&str; 10] = [
    "advertise",
    "unadvertise",
    "getParameters",
    "setParameters",
    "subscribeParameterUpdates",
    "unsubscribeParameterUpdates",
    "subscribeConnectionGraph",
    "unsubscribeConnectionGraph",
    "fetchAsset",
    "playbackControlRequest",
];

/// What a text asks for.
///
/// # Errors
/// A sentence for the client.
pub(crate) fn request(text: &str) -> Result<Request, String> {
    let message: Value = serde_json::from_str(text).map_err(|error| format!("expected an object of JSON: {error}"))?;
    let number = |value: &Value| value.as_u64().and_then(|number| u32::try_from(number).ok());
    match message["op"].as_str() {
        Some("subscribe") => {
            let pair = |it: &Value| Some((number(&it["id"])?, it["channelId"].as_u64()?));
            let pairs = message["subscriptions"].as_array().and_then(|all| all.iter().map(pair).collect());
            let expected = "expected \"subscriptions\":[{\"id\":NUMBER,\"channelId\":NUMBER},..] in a subscribe";
            pairs.map(Request::Subscribe).ok_or_else(|| expected.to_owned())
        }
        Some("unsubscribe") => {
            let numbers = message["subscriptionIds"].as_array().and_then(|all| all.iter().map(number).collect());
            let expected = "expected \"subscriptionIds\":[NUMBER,..] in an unsubscribe";
            numbers.map(Request::Unsubscribe).ok_or_else(|| expected.to_owned())
        }
        Some(op) if OF_OTHERS.contains(&op) => {
            Err(format!("'{op}' is not among the capabilities of this server, which only shows"))
        }
        Some(op) => {
            let op: String = op.chars().take(40).collect();
            Err(format!("unknown operation '{op}': expected subscribe or unsubscribe"))
        }
        None => Err("expected \"op\", the operation, in the object".to_owned()),
    }
}

/// What a client hears first.
pub(crate) fn server_info(session: &str) -> String {
    let name = concat!("ferrodrive ", env!("CARGO_PKG_VERSION"));
    json!({ "op": "serverInfo", "name": name, "capabilities": ["time"], "sessionId": session }).to_string()
}

/// Channels that are new, of which the first has the identifier `first`.
pub(crate) fn advertise(first: usize, channels: &[Channel]) -> String {
    let channel = |(id, Channel { topic, schema_name, schema }): (usize, &Channel)| {
        json!({
            "id": id, "topic": topic, "encoding": MESSAGE_ENCODING, "schemaName": schema_name, "schema": schema,
            "schemaEncoding": SCHEMA_ENCODING
        })
    };
    let channels: Vec<Value> = (first..).zip(channels).map(channel).collect();
    json!({ "op": "advertise", "channels": channels }).to_string()
}

/// Something that a person at the client should know.
pub(crate) fn status(level: Level, text: &str) -> String {
    json!({ "op": "status", "level": level as u8, "message": text }).to_string()
}

/// A message of a channel, for a subscription.
pub(crate) fn message_data(subscription: u32, nanos: u64, data: &[u8]) -> Vec<u8> {
    let mut message = Vec::with_capacity(1 + 4 + 8 + data.len());
    message.push(MESSAGE_DATA);
    message.extend(subscription.to_le_bytes());
    message.extend(nanos.to_le_bytes());
    message.extend_from_slice(data);
    message
}

/// Whether a binary message has data of a channel.
pub(crate) fn is_data(message: &[u8]) -> bool {
    message.first() == Some(&MESSAGE_DATA)
}

/// The time of what follows.
pub(crate) fn time(nanos: u64) -> Vec<u8> {
    [&[TIME][..], &nanos.to_le_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_client_asks_for_is_taken_or_refused_in_words() {
        let subscribe = r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]}"#;
        assert_eq!(request(subscribe), Ok(Request::Subscribe(vec![(0, 3), (1, 5)])));
        assert_eq!(request(r#"{"op":"unsubscribe","subscriptionIds":[7]}"#), Ok(Request::Unsubscribe(vec![7])));
        for (text, part) in [
            ("", "an object of JSON"),
            ("[1]", "expected \"op\""),
            ("{\"op\":3}", "expected \"op\""),
            (r#"{"op":"subscribe"}"#, "subscriptions"),
            (r#"{"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]}"#, "NUMBER"),
            (r#"{"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":3}]}"#, "NUMBER"),
            (r#"{"op":"unsubscribe","subscriptionIds":["a"]}"#, "subscriptionIds"),
            (r#"{"op":"getParameters","parameterNames":[]}"#, "not among the capabilities"),
            (r#"{"op":"move"}"#, "unknown operation 'move'"),
        ] {
            let why = request(text).expect_err(text);
            assert!(why.contains(part), "{text}: {why}");
        }
        let deep = "[".repeat(10_000);
        assert!(request(&deep).is_err());
    }

    /// The layout of the protocol's page: opcode, subscription, time, all little-endian, then the data.
    #[test]
    fn binary_messages_are_laid_out_as_specified() {
        assert_eq!(message_data(0x0102, 3, b"x"), [1, 2, 1, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, b'x']);
        assert_eq!(time(0x0100), [2, 0, 1, 0, 0, 0, 0, 0, 0]);
    }
}

//! The way back: writes that lead to what a node had, and how far they got.

use std::fmt;

use canopen::Mux;

use super::values::{hex, same};
use crate::error::Error;
use crate::network::Node;

/// How the way back went.
#[derive(Clone, Debug, Default)]
pub struct Undone {
    /// Objects that have again what they had.
    pub put_back: usize,
    /// Those that could not be put back.
    pub not_put_back: Vec<NotPutBack>,
}

/// An object that has not what it had.
#[derive(Clone, Debug)]
pub struct NotPutBack {
    /// The object.
    pub object: Mux,
    /// What it had.
    pub had: Vec<u8>,
    /// Why it could not be put back.
    pub why: String,
}

impl fmt::Display for Undone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.not_put_back.is_empty() {
            return match self.put_back {
                0 => f.write_str("Nothing had been written: nothing has changed"),
                1 => f.write_str("What had been written was put back: 1 object reads as before"),
                many => write!(f, "What had been written was put back: {many} objects read as before"),
            };
        }
        f.write_str("Not everything could be put back: ")?;
        for (position, left) in self.not_put_back.iter().enumerate() {
            let comma = if position == 0 { "" } else { "; " };
            write!(f, "{comma}{} had {}, {}", left.object, hex(&left.had), left.why)?;
        }
        Ok(())
    }
}

/// Writes what leads back, in this order, and checks whether every object has again what it had: `had`, or else what
/// its last write here was. Ends at the first silence: what is left then is reported.
pub async fn roll_back(node: &Node, undo: &[(Mux, Vec<u8>)], had: impl Fn(Mux) -> Option<Vec<u8>>) -> Undone {
    let mut silent = None;
    for (object, value) in undo {
        if let Err(error @ (Error::NoAnswer { .. } | Error::QueueFull { .. })) = node.download(*object, value).await {
            silent = Some(error.to_string());
            break;
        }
    }
    // The last write of an object is its oldest value.
    let mut finals: Vec<(Mux, Vec<u8>)> = Vec::new();
    for (object, value) in undo.iter().rev() {
        if finals.iter().all(|(other, _)| other != object) {
            finals.push((*object, had(*object).unwrap_or_else(|| value.clone())));
        }
    }
    let mut undone = Undone::default();
    for (object, had) in finals {
        let why = match (&silent, node_has(node, object, &had, silent.is_some()).await) {
            (Some(silent), _) => silent.clone(),
            (None, None) => {
                undone.put_back += 1;
                continue;
            }
            (None, Some(why)) => why,
        };
        undone.not_put_back.push(NotPutBack { object, had, why });
    }
    undone
}

/// Why an object has not this value; `None` if it has.
async fn node_has(node: &Node, object: Mux, had: &[u8], silent: bool) -> Option<String> {
    if silent {
        return None;
    }
    match node.upload(object).await {
        Ok(payload) if same(object, had, payload.as_bytes()) => None,
        Ok(payload) => Some(format!("and has {}", hex(payload.as_bytes()))),
        Err(error) => Some(error.to_string()),
    }
}

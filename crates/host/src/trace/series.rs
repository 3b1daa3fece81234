//! The values of objects over time, from the frames that carry them: mapped into PDOs, or read or written by
//! SDO, by any client.

use std::collections::BTreeMap;

use can::Instant;
use canopen::{Mux, NodeId};
use master::decode::Number;
use serde::{Deserialize, Serialize};

use super::query::{MOST_SEARCHED, node};
use super::ring::Held;

/// Most objects in one request.
const MOST_OBJECTS: usize = 32;

/// The parameters of a request, unparsed.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AskedSeries {
    after: Option<u64>,
    #[serde(default)]
    objects: String,
}

/// Objects of nodes; none for a list of all objects with numbers.
#[derive(Clone, Debug)]
pub struct SeriesQuery {
    after: Option<u64>,
    objects: Vec<(NodeId, Mux)>,
}

/// Values of the frames from `from` to below `to`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Values {
    from: u64,
    to: u64,
    /// Frames between those of the reader and this part: they were too many, or are no longer kept.
    skipped: u64,
    series: Vec<Series>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Series {
    /// As in the request: `4:606C:00`.
    object: String,
    node: u8,
    name: Option<&'static str>,
    unit: &'static str,
    /// The number of values.
    count: usize,
    /// Bus time in s and value, for a requested object.
    points: Vec<(f64, i64)>,
}

impl AskedSeries {
    /// Parses the parameters.
    ///
    /// # Errors
    /// The parameter that is not valid.
    pub fn understand(self) -> Result<SeriesQuery, String> {
        let parts = self.objects.split(',').map(str::trim).filter(|part| !part.is_empty());
        let objects: Vec<_> = parts.map(object).collect::<Result<_, _>>()?;
        match objects.len() {
            0..=MOST_OBJECTS => Ok(SeriesQuery { after: self.after, objects }),
            more => Err(format!("expected at most {MOST_OBJECTS} objects, got {more}")),
        }
    }
}

/// `4:606C:00`.
fn object(text: &str) -> Result<(NodeId, Mux), String> {
    let wrong = || {
        format!(
            "'{text}' is not an object of a node; expected NODE:INDEX:SUB with index and sub-index in hexadecimal, e.g. 4:606C:00"
        )
    };
    let mut parts = text.split(':');
    let (Some(id), Some(index), Some(sub), None) = (parts.next(), parts.next(), parts.next(), parts.next()) else {
        return Err(wrong());
    };
    let index = u16::from_str_radix(index, 16).map_err(|_| wrong())?;
    let sub_index = u8::from_str_radix(sub, 16).map_err(|_| wrong())?;
    Ok((node(id)?, Mux { index, sub_index }))
}

impl SeriesQuery {
    /// The requested values, or the list of objects that have any.
    pub fn values(&self, held: &Held) -> Values {
        let to = held.next();
        let wanted_from = self.after.unwrap_or_default();
        let from = wanted_from.max(held.oldest()).max(to.saturating_sub(MOST_SEARCHED)).min(to);
        let mut found = BTreeMap::new();
        held.decode(from, to, |_, passed, decoded| {
            let Some(node) = decoded.node() else { return };
            for Number { mux, name, value, unit } in decoded.numbers() {
                if !self.objects.is_empty() && !self.objects.contains(&(node, mux)) {
                    continue;
                }
                let one = found.entry((node, mux.index, mux.sub_index)).or_insert_with(|| Series {
                    object: format!("{node}:{:04X}:{:02X}", mux.index, mux.sub_index),
                    node: node.raw(),
                    name,
                    unit,
                    count: 0,
                    points: Vec::new(),
                });
                one.count += 1;
                if !self.objects.is_empty() {
                    one.points.push(((passed.at - Instant::ZERO).as_secs_f64(), value));
                }
            }
        });
        Values {
            from,
            to,
            skipped: self.after.map_or(0, |after| from.saturating_sub(after)),
            series: found.into_values().collect(),
        }
    }
}

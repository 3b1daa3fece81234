//! The values of objects over time, from the frames that carry them: mapped into PDOs, or read or written by
//! SDO, by any client.

use std::collections::BTreeMap;

use can::{Frame, Instant};
use canopen::{Mux, NodeId};
use master::decode::{Decoded, Number};
use serde::{Deserialize, Serialize};

use super::query::{MOST_SEARCHED, node};
use super::ring::{Held, Trace};

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
        let mut found = Collected::default();
        let is_list = self.objects.is_empty();
        held.decode(from, to, |_, passed, decoded| {
            found.take(passed.at, decoded, !is_list, |object| is_list || self.objects.contains(object));
        });
        Values {
            from,
            to,
            skipped: self.after.map_or(0, |after| from.saturating_sub(after)),
            series: found.0.into_values().collect(),
        }
    }
}

/// The values of each object so far.
#[derive(Debug, Default)]
struct Collected(BTreeMap<(NodeId, u16, u8), Series>);

impl Collected {
    /// Adds the numbers of a frame; `keeps`: their values too, and not only how many there are. Returns how many were added.
    fn take(
        &mut self,
        at: Instant,
        decoded: &Decoded,
        keeps: bool,
        is_wanted: impl Fn(&(NodeId, Mux)) -> bool,
    ) -> usize {
        let node = match decoded {
            Decoded::Pdo(pdo) => pdo.object_node(),
            _ => decoded.node(),
        };
        let Some(node) = node else { return 0 };
        let mut added = 0;
        for Number { mux, name, value, unit } in decoded.numbers() {
            if !is_wanted(&(node, mux)) {
                continue;
            }
            let one = self.0.entry((node, mux.index, mux.sub_index)).or_insert_with(|| Series {
                object: format!("{node}:{mux:X}"),
                node: node.raw(),
                name,
                unit,
                count: 0,
                points: Vec::new(),
            });
            one.count += 1;
            added += 1;
            if keeps {
                one.points.push(((at - Instant::ZERO).as_secs_f64(), value));
            }
        }
        added
    }
}

/// Most values of one log: some 40 MB of text.
const MOST_OF_A_LOG: usize = 2_000_000;

impl Trace {
    /// The values of every object in a log of another time, decoded by the models of this bus's nodes: object, name, unit, and times
    /// in s with values.
    ///
    /// # Errors
    /// More than two million values.
    pub fn values_of_log(&self, frames: impl IntoIterator<Item = (Instant, Frame)>) -> Result<Vec<LogSeries>, String> {
        let mut decoder = self.fresh_decoder();
        let mut found = Collected::default();
        let mut count = 0;
        for (at, frame) in frames {
            count += found.take(at, &decoder.decode(&frame), true, |_| true);
            if count > MOST_OF_A_LOG {
                return Err(format!(
                    "the log has more than {MOST_OF_A_LOG} values: cut it, for instance with ferrodrive convert"
                ));
            }
        }
        let series = found.0.into_values();
        Ok(series.map(|Series { object, name, unit, points, .. }| LogSeries { object, name, unit, points }).collect())
    }
}

/// The values of an object in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogSeries {
    /// `4:606C:00`.
    pub object: String,
    /// Its name, if its node's model is known.
    pub name: Option<&'static str>,
    /// The unit of one count, as text; may be empty.
    pub unit: &'static str,
    /// Time in s and value.
    pub points: Vec<(f64, i64)>,
}

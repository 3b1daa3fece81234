//! A recorded path of several axes: a record (CSV) of which the positions are taken.

use std::f64::consts::TAU;
use std::path::Path;

use canopen::NodeId;
use master::Drive;
use recording::{Column, Kind, Recorded, Series, Subject, is_called, read_csv};
use words::document::read_bytes;
use words::failure::Failure;

/// What a column with positions is called, without its unit; of a node with several the first of these is taken. The last two are where
/// the shaft should have been.
const POSITIONS: [&str; 5] = ["angle", "position", "position_actual_value", "target_position", "position_demand"];

/// The largest file that is read, in bytes: six axes at 1 ms for an hour.
const LARGEST: u64 = 1 << 29;

/// Where several axes were at which times.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedPath {
    /// The name of its file.
    pub(super) name: String,
    /// Times in s, which rise.
    pub(super) time_s: Vec<f64>,
    pub(super) axes: Vec<PathAxis>,
}

/// The positions of one axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PathAxis {
    pub(super) node: NodeId,
    unit: Unit,
    /// One for each time.
    pub(super) positions: Vec<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    Degrees,
    Radians,
    /// Of the drive: 6064h.
    Counts,
}

impl Unit {
    fn of(column: &Column) -> Option<Self> {
        match &*column.unit {
            "°" => Some(Self::Degrees),
            "rad" => Some(Self::Radians),
            "counts" => Some(Self::Counts),
            _ => None,
        }
    }
}

impl PathAxis {
    /// How many turns of its drive's output one of its unit is.
    ///
    /// # Errors
    /// The counts of a turn are not known.
    pub(super) async fn turns_each(&self, drive: &Drive) -> Result<f64, master::Error> {
        Ok(match self.unit {
            Unit::Degrees => 1.0 / 360.0,
            Unit::Radians => 1.0 / TAU,
            Unit::Counts => 1.0 / drive.counts_per_turn().await?,
        })
    }
}

impl RecordedPath {
    /// Reads the file of a path.
    ///
    /// # Errors
    /// `bad_file`, with what is wrong with it and what to do.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        if Kind::of_name(&name) != Some(Kind::Csv) {
            return Err(bad(&name, "expected a path as CSV: NAME.csv").next(FORM));
        }
        let bytes = read_bytes(path, LARGEST).map_err(|why| bad(&name, why).next("name a file that can be read"))?;
        Self::parse(&name, &bytes)
    }

    /// The path in the contents of a file, which messages call by this name.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Failure> {
        let recorded = read_csv(bytes).map_err(|why| bad(name, why).next(FORM))?;
        if recorded.torn {
            return Err(bad(name, "its last line has no end: it may be cut off")
                .next("end it with a line break if it is complete, or take the line out"));
        }
        let chosen = positions_of(name, &recorded)?;
        let mut path = Self { name: name.to_owned(), time_s: Vec::new(), axes: Vec::new() };
        let of = |(node, unit, _): &(NodeId, Unit, usize)| PathAxis { node: *node, unit: *unit, positions: Vec::new() };
        path.axes.extend(chosen.iter().map(of));
        let rows = recorded.series.first().map_or(0, |series| series.points.len());
        for row in 0..rows {
            let at = |place: usize| recorded.series[place].points[row];
            let (time_s, _) = at(0);
            let missing = chosen.iter().find(|(.., place)| !at(*place).1.is_finite());
            if let Some((node, ..)) = missing {
                let is_of_others = chosen.iter().all(|(.., place)| at(*place).1.is_nan())
                    && (0..recorded.series.len()).any(|place| !at(place).1.is_nan());
                // What else was recorded may have been sampled at times of its own.
                if is_of_others {
                    continue;
                }
                return Err(bad(name, format!("at {time_s} s node {node} has no position that is a finite number"))
                    .next("give every axis a position in each line, or take the line out"));
            }
            if let Some(before) = path.time_s.last().filter(|before| **before >= time_s) {
                return Err(bad(name, format!("its times do not rise: {time_s} s follows {before} s"))
                    .next("sort its lines by time, and give each time once"));
            }
            path.time_s.push(time_s);
            for (axis, (.., place)) in path.axes.iter_mut().zip(&chosen) {
                axis.positions.push(at(*place).1);
            }
        }
        match path.time_s.len() {
            0 | 1 => {
                Err(bad(name, format!("a path of {} points leads nowhere: expected 2 or more", path.time_s.len()))
                    .next("give it the points from where the motion begins to where it ends"))
            }
            _ => Ok(path),
        }
    }

    /// The nodes whose positions it has, in the order of its columns.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> {
        self.axes.iter().map(|axis| axis.node)
    }

    /// From its first point to its last, in s.
    pub fn duration_s(&self) -> f64 {
        self.time_s.last().unwrap_or(&0.0) - self.time_s.first().unwrap_or(&0.0)
    }
}

/// What such a file looks like.
const FORM: &str = "its first line names the columns, divided by commas, t_s and a position of each axis by its node: t_s,1.angle_deg,2.angle_deg; a record \
                    or capture of this program with positions is one too";

fn bad(name: &str, why: impl std::fmt::Display) -> Failure {
    Failure::bad_file(format!("{name} cannot be followed")).because(why)
}

/// Of each node the column whose positions are taken.
fn positions_of(name: &str, recorded: &Recorded) -> Result<Vec<(NodeId, Unit, usize)>, Failure> {
    let mut chosen: Vec<(NodeId, Unit, usize, usize)> = Vec::new();
    for (at, series) in recorded.series.iter().enumerate() {
        let column = &series.column;
        let rank = POSITIONS.iter().position(|position| is_called(&column.signal, position));
        let (Some(rank), Some(unit), Subject::Axis(place)) = (rank, Unit::of(column), &column.subject) else {
            continue;
        };
        // A record of a drive that is switched off, or has no such value, has an empty column.
        if series.points.iter().all(|(_, value)| value.is_nan()) {
            continue;
        }
        let node = NodeId::new(place.node).filter(|_| sim::Place::node(place.node) == *place);
        let Some(node) = node else {
            return Err(bad(name, format!("{} is not the first axis of a node from 1 to 127", column.name()))
                .next("a group is made of first axes: take the column out"));
        };
        match chosen.iter_mut().find(|(other, ..)| *other == node) {
            None => chosen.push((node, unit, at, rank)),
            Some(before) if before.3 == rank => {
                return Err(bad(
                    name,
                    format!("node {node} has two columns of positions, one of them {}", column.name()),
                )
                .next("take one of them out"));
            }
            Some(before) if rank < before.3 => *before = (node, unit, at, rank),
            Some(_) => {}
        }
    }
    if chosen.is_empty() {
        return Err(bad(name, "none of its columns has positions").next(FORM));
    }
    // A misspelt name would leave its axis where it is while the others move.
    let is_left = |series: &&Series| {
        let Subject::Axis(place) = &series.column.subject else { return false };
        let has_values = series.points.iter().any(|(_, value)| !value.is_nan());
        has_values && chosen.iter().all(|(node, ..)| node.raw() != place.node)
    };
    if let Some(Column { subject: Subject::Axis(place), .. }) =
        recorded.series.iter().find(is_left).map(|it| &it.column)
    {
        let of_node =
            recorded.series.iter().map(|series| &series.column).filter(|it| it.subject == Subject::Axis(*place));
        let names = of_node.map(Column::name).collect::<Vec<_>>().join(", ");
        let node = place.node;
        return Err(bad(name, format!("it has {names} of node {node}, and no positions of it"))
            .next(format!("call its positions {node}.angle_deg, or take the columns of node {node} out")));
    }
    Ok(chosen.into_iter().map(|(node, unit, at, _)| (node, unit, at)).collect())
}

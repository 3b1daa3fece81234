//! What a picture shows, as plain data.

/// A page of figures, as plain data.
#[derive(Clone, Debug, Default)]
pub struct Poster {
    /// Large line at the top.
    pub(crate) title: String,
    /// Small line under it.
    pub(crate) subtitle: String,
    /// From top to bottom; those of a row stand side by side.
    pub(crate) rows: Vec<Vec<Figure>>,
}

/// A figure: what to draw, not how.
#[derive(Clone, Debug, Default)]
pub(crate) struct Figure {
    /// Line above it.
    pub(crate) title: String,
    /// Small words after the title.
    pub(crate) subtitle: String,
    /// What the time axis shows: "time, s".
    pub(crate) time: &'static str,
    /// From top to bottom.
    pub(crate) panels: Vec<Panel>,
    /// Spans of time with a name, not overlapping.
    pub(crate) sections: Vec<Section>,
    /// Marked moments.
    pub(crate) events: Vec<Event>,
    /// Spans of time that are left out, ascending; a mark on the time axis tells of each.
    pub(crate) cuts: Vec<(f64, f64)>,
}

/// One set of axes.
#[derive(Clone, Debug)]
pub(crate) struct Panel {
    /// The quantity: "velocity".
    pub(crate) title: &'static str,
    /// Its unit: "r/min".
    pub(crate) unit: &'static str,
    /// Of its axes, px.
    pub(crate) height: f64,
    /// Drawn in order, the last one on top.
    pub(crate) traces: Vec<Trace>,
}

/// One line of a panel.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    /// Written at the line's right end.
    pub(crate) label: &'static str,
    /// How it looks.
    pub(crate) style: Style,
    /// Time in the figure's unit and value in the panel's unit, time ascending.
    pub(crate) points: Vec<(f64, f64)>,
}

/// The role of a line decides its look; the same role looks alike in all panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// What was measured: a solid line in the colour of that number.
    Actual(Colour),
    /// What the drive's planner asks of its loops: broad and pale, so that the actual line lies inside it.
    Demand,
    /// What the user asked for: dashed steps.
    SetPoint,
    /// What was measured at one of several machines, the first one the broadest: those that lie under another show.
    OneOf(Colour, u8),
}

/// Colours that stay apart for colour-blind readers on a light ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colour {
    /// For positions, and for the first of several.
    Blue,
    /// For velocities, and for the second.
    Teal,
    /// For currents, and for the third.
    Orange,
}

/// A span of time.
#[derive(Clone, Debug)]
pub(crate) struct Section {
    /// Begin, s.
    pub(crate) from_s: f64,
    /// End, s.
    pub(crate) to_s: f64,
    /// Its number, written where there is room for it.
    pub(crate) number: String,
    /// Names from the longest to the shortest; the first that fits is written under the number.
    pub(crate) names: Vec<String>,
}

/// A moment.
#[derive(Clone, Debug)]
pub(crate) struct Event {
    /// When, s.
    pub(crate) at_s: f64,
    /// What happened, in a few words.
    pub(crate) label: String,
    /// Decides the colour.
    pub(crate) kind: EventKind,
}

/// What sort of moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EventKind {
    /// The drive reports a fault.
    Fault,
    /// A stop was commanded.
    Stop,
    /// Anything else worth a mark.
    Note,
}

impl Figure {
    /// First and last moment of all traces.
    pub(super) fn time_span(&self) -> (f64, f64) {
        let times = self
            .panels
            .iter()
            .flat_map(|panel| &panel.traces)
            .flat_map(|trace| trace.points.first().into_iter().chain(trace.points.last()).map(|point| point.0));
        let (low, high) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)));
        if low < high { (low, high) } else { (0.0, 1.0) }
    }
}

//! What a picture shows, as plain data.

use std::borrow::Cow;

/// A page of figures, as plain data.
#[derive(Clone, Debug, Default)]
pub struct Poster {
    /// Large line at the top.
    pub title: String,
    /// Small line under it.
    pub subtitle: String,
    /// From top to bottom; those of a row stand side by side.
    pub rows: Vec<Vec<Figure>>,
}

/// A figure: what to draw, not how.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Line above it.
    pub title: String,
    /// Small words after the title.
    pub subtitle: String,
    /// What the time axis shows: "time, s".
    pub time: Cow<'static, str>,
    /// The axis is logarithmic: what stands as a time is the common logarithm of what the axis shows, a frequency for instance.
    pub logarithmic: bool,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// Spans of time with a name, not overlapping.
    pub sections: Vec<Section>,
    /// Marked moments.
    pub events: Vec<PlotEvent>,
    /// Spans of time that are left out, ascending; a mark on the time axis shows each.
    pub cuts: Vec<(f64, f64)>,
}

/// One set of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The quantity: "velocity".
    pub title: Cow<'static, str>,
    /// Its unit: "r/min".
    pub unit: Cow<'static, str>,
    /// Of its axes, px.
    pub height: f64,
    /// The axis reaches to 0, whatever the values are.
    pub with_zero: bool,
    /// Its axis spans at least this much, in its unit: what changes by less is not shown as a change.
    pub least_span: f64,
    /// Drawn in order, the last one on top.
    pub traces: Vec<Trace>,
}

impl Default for Panel {
    fn default() -> Self {
        Self { title: "".into(), unit: "".into(), height: 80.0, with_zero: true, least_span: 0.0, traces: Vec::new() }
    }
}

/// One line of a panel.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Written at the line's right end.
    pub label: Cow<'static, str>,
    /// How it looks.
    pub style: Style,
    /// Time in the figure's unit and value in the panel's unit, time ascending.
    pub points: Vec<(f64, f64)>,
}

/// The role of a line decides its look; the same role looks alike in all panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
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
pub enum Colour {
    /// For positions, and for the first of several.
    Blue,
    /// For velocities, and for the second.
    Teal,
    /// For currents, and for the third.
    Orange,
    /// For voltages, and for the fourth.
    Purple,
    /// For temperatures, and for the fifth.
    Red,
    /// For anything else, and for the sixth.
    Grey,
}

impl Colour {
    /// All of them, in the order in which several of a kind take them.
    pub const ALL: [Self; 6] = [Self::Blue, Self::Teal, Self::Orange, Self::Purple, Self::Red, Self::Grey];
}

/// A span of time.
#[derive(Clone, Debug)]
pub struct Section {
    /// Begin, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
    /// Its number, written where there is room for it.
    pub number: String,
    /// Names from the longest to the shortest; the first that fits is written under the number.
    pub names: Vec<String>,
}

/// A moment.
#[derive(Clone, Debug)]
pub struct PlotEvent {
    /// When, s.
    pub at_s: f64,
    /// What happened, in a few words.
    pub label: String,
    /// Decides the colour.
    pub kind: EventKind,
}

/// What sort of moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The drive reports a fault.
    Fault,
    /// A stop was commanded.
    Stop,
    /// Anything else worth a mark.
    Note,
}

impl Figure {
    /// First and last moment of all traces.
    pub(crate) fn time_span(&self) -> (f64, f64) {
        let times = self
            .panels
            .iter()
            .flat_map(|panel| &panel.traces)
            .flat_map(|trace| trace.points.first().into_iter().chain(trace.points.last()).map(|point| point.0));
        let (low, high) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)));
        if low < high { (low, high) } else { (0.0, 1.0) }
    }
}

//! The demo's picture: position, velocity and current over time, with the manual's sections and what happened.

use super::bench::{Finished, SIGNALS};
use super::set_points::Axis;
use crate::plot::{Colour, Figure, Panel, Section, Style, Trace};

use sim::recorder::Signal;

/// Draws what the bench recorded.
pub(super) fn figure(finished: &Finished) -> Figure {
    let trace = |label, style, signal: Signal| {
        let channel = SIGNALS.iter().position(|recorded| *recorded == signal).unwrap_or(0);
        let times = finished.recorder.times().iter().map(|at| at.as_secs_f64());
        Trace { label, style, points: times.zip(finished.recorder.samples(channel)).collect() }
    };
    let panel = |title, unit, colour, axis, demand, actual| Panel {
        title,
        unit,
        traces: vec![
            trace("demand", Style::Demand, demand),
            Trace { label: "set-point", style: Style::SetPoint, points: finished.set_points.line(axis) },
            trace("actual", Style::Actual(colour), actual),
        ],
    };
    Figure {
        title: "Every procedure of the ZLAC8030L's manual, on the virtual drive".into(),
        subtitle: "ferrodrive demo: datagrams as printed in the quick start guide V1.00, control loops at 20 kHz, \
                   motor physics, virtual time"
            .into(),
        panels: vec![
            panel("Position", "counts", Colour::Blue, Axis::Position, Signal::PositionDemand, Signal::Position),
            panel("Velocity", "r/min", Colour::Teal, Axis::Velocity, Signal::VelocityDemand, Signal::Velocity),
            panel("Motor current", "A", Colour::Orange, Axis::Current, Signal::CurrentDemand, Signal::Current),
        ],
        sections: sections(finished),
        events: finished.events.clone(),
    }
}

fn sections(finished: &Finished) -> Vec<Section> {
    let begins = finished.sections.iter();
    let ends = finished.sections.iter().skip(1).map(|(at, ..)| *at).chain([finished.end]);
    let section = |(begin, number, name): &(can::Instant, &str, &str), end: can::Instant| Section {
        from_s: begin.as_secs_f64(),
        to_s: end.as_secs_f64(),
        number: (*number).into(),
        names: [*name].into_iter().chain(name.split(' ').next_back()).map(Into::into).collect(),
    };
    begins.zip(ends).map(|(begin, end)| section(begin, end)).collect()
}

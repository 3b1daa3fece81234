//! The demo's picture: position, velocity and current of each drive over time, with the manuals' sections and what
//! happened.

use std::f64::consts::TAU;

use sim::recorder::Signal;

use super::bench::{Finished, SIGNALS};
use super::set_points::Axis;
use crate::plot::{Colour, Figure, Panel, Poster, Section, Style, Trace};

/// The picture without its charts.
pub(super) fn poster() -> Poster {
    Poster {
        title: "Every procedure of three drives' manuals, on the virtual drives".into(),
        subtitle: "ferrodrive demo: datagrams as printed, the drives' own control loops, motor physics, virtual time"
            .into(),
        rows: Vec::new(),
    }
}

/// The ZLAC8030L's chart.
pub(super) fn zlac8030l(finished: &Finished) -> Vec<Vec<Figure>> {
    vec![vec![drive(finished, "ZLAC8030L", "hub servo, quick start guide V1.00", "counts", Signal::Position)]]
}

/// The joint's chart.
pub(super) fn mjoint(finished: &Finished) -> Vec<Vec<Figure>> {
    vec![vec![drive(finished, "M4230E17B50", "robot joint, CanOpen manual", "counts", Signal::Position)]]
}

/// The stepper's chart.
pub(super) fn zlim42c(finished: &Finished) -> Vec<Vec<Figure>> {
    vec![vec![drive(finished, "ZLIM42-C", "open-loop stepper, user manual V1.03", "pulses", Signal::Position)]]
}

/// Angle and speed of three models that are asked the same.
pub(super) fn same_calls(finished: &Finished) -> Vec<Vec<Figure>> {
    let names = ["ZLAC8030L", "M joint", "ZLIM42-C"];
    vec![vec![Figure {
        title: "Three drives on one bus".into(),
        subtitle: "the same call of the master on each, in degrees and r/min at the motor's shaft".into(),
        time: "time, s",
        panels: vec![
            axes(finished, names, "Shaft angle", "°", Signal::ShaftAngle, 360.0 / TAU),
            axes(finished, names, "Velocity", "r/min", Signal::Velocity, 1.0),
        ],
        sections: sections(finished),
        events: finished.events.clone(),
    }]]
}

/// The start of three joints in microseconds, and the path that they are led along.
pub(super) fn interpolation(finished: &Finished) -> Vec<Vec<Figure>> {
    let names = ["node 1", "node 2", "node 3"];
    let starts = finished.starts.iter().map(|start| Figure {
        title: format!("{}: {:.0} µs apart", start.setting, start.spread_us()),
        subtitle: "three joints after one SYNC".into(),
        time: "µs",
        panels: vec![Panel {
            title: "Shaft",
            unit: "counts",
            traces: names
                .into_iter()
                .zip(COLOURS)
                .zip(&start.axes)
                .map(|((label, colour), points)| Trace { label, style: Style::Actual(colour), points: points.clone() })
                .collect(),
        }],
        sections: Vec::new(),
        events: Vec::new(),
    });
    let path = Figure {
        title: "Three joints, interpolation".into(),
        subtitle: "mode 7: RPDO4 to each and SYNC, every 2 ms".into(),
        time: "time, s",
        panels: vec![axes(finished, names, "Shaft angle", "turns of the motor", Signal::ShaftAngle, 1.0 / TAU)],
        sections: sections(finished),
        events: finished.events.clone(),
    };
    vec![vec![path], starts.collect()]
}

const COLOURS: [Colour; 3] = [Colour::Blue, Colour::Teal, Colour::Orange];

/// One signal of three drives.
fn axes(
    finished: &Finished,
    names: [&'static str; 3],
    title: &'static str,
    unit: &'static str,
    signal: Signal,
    scale: f64,
) -> Panel {
    let place = SIGNALS.iter().position(|recorded| *recorded == signal).unwrap_or(0);
    let traces = names.into_iter().zip(COLOURS).enumerate().map(|(drive, (label, colour))| {
        let times = finished.recorder.times().iter().map(|at| at.as_secs_f64());
        let values = finished.recorder.samples(drive * SIGNALS.len() + place).map(|value| value * scale);
        Trace { label, style: Style::Actual(colour), points: times.zip(values).collect() }
    });
    Panel { title, unit, traces: traces.collect() }
}

/// Position, velocity and current of the first drive.
fn drive(
    finished: &Finished,
    title: &'static str,
    subtitle: &'static str,
    position_unit: &'static str,
    position: Signal,
) -> Figure {
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
        title: title.into(),
        subtitle: subtitle.into(),
        time: "time, s",
        panels: vec![
            panel("Position", position_unit, Colour::Blue, Axis::Position, Signal::PositionDemand, position),
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

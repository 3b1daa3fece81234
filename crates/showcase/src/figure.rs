//! The picture: position, velocity and current of each drive over time, with the manuals' sections and what
//! happened; then the drives together.

use std::borrow::Cow;
use std::f64::consts::TAU;

use sim::recorder::Signal;

use super::bench::{Finished, SIGNALS};
use super::set_points::Axis;
use plot::{Colour, Figure, Panel, Poster, Section, Style, Trace};

/// The picture without its charts.
pub(super) fn poster(of_one: bool) -> Poster {
    let title = if of_one {
        "Every procedure of a drive's manual, on the virtual drive"
    } else {
        "Every procedure of three drives' manuals, on the virtual drives"
    };
    Poster {
        title: title.into(),
        subtitle: "ferrodrive demo: datagrams as printed, the drives' own control loops, motor physics, virtual time"
            .into(),
        rows: Vec::new(),
    }
}

/// The ZLAC8030L's chart.
pub(super) fn zlac8030l(finished: &Finished, name: &'static str) -> Vec<Vec<Figure>> {
    vec![vec![drive(
        finished,
        name,
        "hub servo, quick start guide V1.00",
        "counts",
        samples(finished, 0, Signal::Position),
    )]]
}

/// The joint's chart.
pub(super) fn mjoint(finished: &Finished, name: &'static str) -> Vec<Vec<Figure>> {
    vec![vec![drive(
        finished,
        name,
        "robot joint, CanOpen manual; waiting is left out at //",
        "counts",
        samples(finished, 0, Signal::Position),
    )]]
}

/// The stepper's chart.
pub(super) fn zlim42c(finished: &Finished, name: &'static str) -> Vec<Vec<Figure>> {
    vec![vec![drive(
        finished,
        name,
        "open-loop stepper, user manual V1.03; waiting is left out at //",
        "pulses",
        samples(finished, 0, Signal::Position),
    )]]
}

/// Angle and speed of three models that are asked the same.
pub(super) fn same_calls(finished: &Finished, _name: &'static str) -> Vec<Vec<Figure>> {
    let names = ["ZLAC8030L", "M joint", "ZLIM42-C"];
    vec![vec![Figure {
        logarithmic: false,
        title: "Three drives on one bus".into(),
        subtitle: "the same call of the master on each, in degrees and r/min at the motor's shaft".into(),
        time: "time, s".into(),
        panels: vec![
            axes(names, "Shaft angle", "°", |drive| angle(finished, drive, 360.0)),
            axes(names, "Velocity", "r/min", |drive| mean_rpm(finished, drive)),
        ],
        sections: sections(finished),
        events: finished.events.clone(),
        cuts: Vec::new(),
    }]]
}

/// The start of three joints in microseconds, and the path that they are led along.
pub(super) fn interpolation(finished: &Finished, _name: &'static str) -> Vec<Vec<Figure>> {
    let names = ["node 1", "node 2", "node 3"];
    let starts = finished.starts.iter().map(|start| Figure {
        logarithmic: false,
        title: format!("{}: {:.0} µs apart", start.setting, start.spread_us()),
        subtitle: "three joints after one SYNC".into(),
        time: "µs".into(),
        panels: vec![Panel {
            title: "Shaft".into(),
            unit: "counts".into(),
            height: 90.0,
            traces: names
                .into_iter()
                .zip(COLOURS)
                .zip(&start.axes)
                .zip(0..)
                .map(|(((label, colour), points), place)| Trace {
                    label: label.into(),
                    style: Style::OneOf(colour, place),
                    points: points.clone(),
                })
                .collect(),
            ..Panel::default()
        }],
        ..Figure::default()
    });
    let path = Figure {
        logarithmic: false,
        title: "Three joints, interpolation".into(),
        subtitle: "mode 7: RPDO4 to each and SYNC, every 2 ms".into(),
        time: "time, s".into(),
        panels: vec![axes(names, "Shaft angle", "turns of the motor", |drive| angle(finished, drive, 1.0))],
        sections: sections(finished),
        events: finished.events.clone(),
        cuts: Vec::new(),
    };
    vec![vec![path], starts.collect()]
}

const COLOURS: [Colour; 3] = [Colour::Blue, Colour::Teal, Colour::Orange];

/// One quantity of three drives.
fn axes(
    names: [&'static str; 3],
    title: &'static str,
    unit: &'static str,
    points: impl Fn(usize) -> Vec<(f64, f64)>,
) -> Panel {
    let traces = names.into_iter().zip(COLOURS).zip(0..).map(|((label, colour), place)| Trace {
        label: label.into(),
        style: Style::OneOf(colour, place),
        points: points(place.into()),
    });
    Panel { title: title.into(), unit: unit.into(), height: 90.0, traces: traces.collect(), ..Panel::default() }
}

/// Angle of a shaft, in parts of a turn.
fn angle(finished: &Finished, drive: usize, parts: f64) -> Vec<(f64, f64)> {
    let samples = samples(finished, drive, Signal::ShaftAngle);
    samples.into_iter().map(|(time, angle)| (time, angle / TAU * parts)).collect()
}

/// Position, velocity and current of the first drive.
fn drive(
    finished: &Finished,
    title: &'static str,
    subtitle: &'static str,
    position_unit: &'static str,
    position: Vec<(f64, f64)>,
) -> Figure {
    let panel = |title: &'static str, unit: &'static str, height, colour, axis, demand, actual| Panel {
        title: Cow::from(title),
        unit: Cow::from(unit),
        height,
        traces: vec![
            Trace { label: "demand".into(), style: Style::Demand, points: samples(finished, 0, demand) },
            Trace { label: "set-point".into(), style: Style::SetPoint, points: finished.set_points.line(axis) },
            Trace { label: "actual".into(), style: Style::Actual(colour), points: actual },
        ],
        ..Panel::default()
    };
    let (velocity, current) = (mean_rpm(finished, 0), samples(finished, 0, Signal::Current));
    Figure {
        logarithmic: false,
        title: title.into(),
        subtitle: subtitle.into(),
        time: "time, s".into(),
        panels: vec![
            panel("Position", position_unit, 80.0, Colour::Blue, Axis::Position, Signal::PositionDemand, position),
            panel("Velocity", "r/min", 80.0, Colour::Teal, Axis::Velocity, Signal::VelocityDemand, velocity),
            panel("Motor current", "A", 60.0, Colour::Orange, Axis::Current, Signal::CurrentDemand, current),
        ],
        sections: sections(finished),
        events: finished.events.clone(),
        cuts: finished.cuts.iter().map(|(from, to)| (from.as_secs_f64(), to.as_secs_f64())).collect(),
    }
}

/// Speed of the shaft, the mean since the sample before: a stepper's rotor swings with each step, and to look at it at
/// moments would show that swing as a wrong speed.
fn mean_rpm(finished: &Finished, drive: usize) -> Vec<(f64, f64)> {
    let angles = samples(finished, drive, Signal::ShaftAngle);
    let rpm = |pair: &[(f64, f64)]| (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0) * cia402::RPM_PER_RAD_S;
    angles.windows(2).map(|pair| (pair[1].0, rpm(pair))).collect()
}

/// A signal of one of the drives over time, s.
fn samples(finished: &Finished, drive: usize, signal: Signal) -> Vec<(f64, f64)> {
    let place = SIGNALS.iter().position(|recorded| *recorded == signal).unwrap_or(0);
    let times = finished.recorder.times().iter().map(|at| at.as_secs_f64());
    times.zip(finished.recorder.samples(drive * SIGNALS.len() + place)).collect()
}

fn sections(finished: &Finished) -> Vec<Section> {
    let begins = finished.sections.iter();
    let ends = finished.sections.iter().skip(1).map(|(at, ..)| *at).chain([finished.end]);
    let section = |(begin, number, name): &(can::Instant, String, String), end: can::Instant| Section {
        from_s: begin.as_secs_f64(),
        to_s: end.as_secs_f64(),
        number: number.clone(),
        names: [name.as_str()].into_iter().chain(name.split(' ').next_back()).map(str::to_owned).collect(),
    };
    begins.zip(ends).map(|(begin, end)| section(begin, end)).collect()
}

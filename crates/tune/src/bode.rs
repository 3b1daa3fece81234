//! A Bode plot: magnitude, phase and coherence over the logarithm of the frequency.

use plot::{Colour, EventKind, Figure, Panel, PlotEvent, Style, Trace};

use crate::mechanics::Mechanics;
use crate::response::{Line, Response};

/// Speed per current, measured, and of a model beside it.
pub fn bode(title: &str, response: &Response, model: Option<&Mechanics>) -> Figure {
    let over = |value: &dyn Fn(&Line) -> f64| -> Vec<(f64, f64)> {
        response
            .lines
            .iter()
            .map(|line| (line.hz.log10(), value(line)))
            .filter(|(_, value)| value.is_finite())
            .collect()
    };
    let magnitude = |value: f64| 20.0 * value.log10();
    let mut traces = [Vec::new(), Vec::new()];
    if let Some(model) = model {
        let points = [
            over(&|line| magnitude(model.response(line.omega()).norm())),
            unwrapped(over(&|line| model.response(line.omega()).arg().to_degrees())),
        ];
        for (traces, points) in traces.iter_mut().zip(points) {
            traces.push(Trace { label: "model".into(), style: Style::Demand, points });
        }
    }
    let measured = [
        over(&|line| magnitude(line.plant.norm())),
        unwrapped(over(&|line| line.plant.arg().to_degrees())),
        over(&|line| line.coherence),
    ];
    let [magnitudes, phases, coherence] =
        measured.map(|points| Trace { label: "measured".into(), style: Style::Actual(Colour::Teal), points });
    let [mut gains, mut angles] = traces;
    gains.push(magnitudes);
    angles.push(phases);
    let panel = |title: &'static str, unit: &'static str, traces| Panel {
        title: title.into(),
        unit: unit.into(),
        height: 150.0,
        with_zero: false,
        least_span: 1.0,
        traces,
    };
    let coherence = Panel { height: 60.0, with_zero: true, ..panel("coherence", "", vec![coherence]) };
    let mark = |hz: f64, label: &str| PlotEvent {
        at_s: hz.log10(),
        label: format!("{label} {hz:.1} Hz"),
        kind: EventKind::Note,
    };
    let events = model.and_then(|model| model.elastic).map_or(Vec::new(), |elastic| {
        vec![mark(elastic.anti_resonance_hz, "anti-resonance"), mark(elastic.resonance_hz, "resonance")]
    });
    Figure {
        title: title.to_owned(),
        subtitle: "speed per current".to_owned(),
        time: "frequency, Hz".into(),
        logarithmic: true,
        panels: vec![panel("magnitude", "dB of 1 (rad/s)/A", gains), panel("phase", "degrees", angles), coherence],
        events,
        ..Figure::default()
    }
}

/// Without steps of a whole turn.
fn unwrapped(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    for n in 1..points.len() {
        points[n].1 -= 360.0 * ((points[n].1 - points[n - 1].1) / 360.0).round();
    }
    points
}

//! A record as a picture: a figure for each subject, a panel for each quantity.

use std::ops::RangeInclusive;

use plot::{Colour, EventKind, Figure, Panel, PlotEvent, Poster, Style, Trace};

use super::capture::ABOUT;
use super::column::{Column, Subject, select};
use super::piece::{Recorded, Series, Severity};

/// What is drawn by default.
const USUAL: [&str; 8] = ["position", "velocity", "current", "supply", "x_m", "y_m", "heading", "joint"];

/// Kinds of events that are not marked: the curves show them, or their consequences.
const QUIET: [&str; 6] = ["boot", "nmt", "mode", "state", "store_begun", "target_reached"];

/// A series of one of the records that are drawn together, with what that is called; empty where it is the only one.
struct Drawn<'a> {
    of: &'a str,
    series: Series,
}

/// A picture of `recorded` within `span`, in s. `patterns` are as [`select`] takes them; none asks for the usual signals.
///
/// # Errors
/// A sentence: a pattern asks for nothing, or nothing was recorded in this time.
pub fn picture(
    title: &str,
    recorded: &Recorded,
    patterns: &[String],
    span: RangeInclusive<f64>,
) -> Result<Poster, String> {
    overlay(title, &[("", recorded)], patterns, span)
}

/// The same of several records, each with what it is called: those of the same subject are laid over each other.
///
/// # Errors
/// Those of [`picture`], of any of them.
pub fn overlay(
    title: &str,
    records: &[(&str, &Recorded)],
    patterns: &[String],
    span: RangeInclusive<f64>,
) -> Result<Poster, String> {
    let mut series = Vec::new();
    for (of, recorded) in records {
        let found = chosen(recorded, patterns, &span)?;
        series.extend(found.into_iter().map(|series| Drawn { of, series }));
    }
    let mut subjects: Vec<&Subject> = Vec::new();
    for one in &series {
        if !subjects.contains(&&one.series.column.subject) {
            subjects.push(&one.series.column.subject);
        }
    }
    let figures = subjects.iter().map(|subject| vec![figure(subject, &series, records, &span)]);
    let is_torn = records.iter().any(|(_, recorded)| recorded.torn);
    let subtitle = if is_torn { "the end of the file is missing" } else { "recorded by ferrodrive" };
    Ok(Poster { title: title.to_owned(), subtitle: subtitle.to_owned(), rows: figures.collect() })
}

/// What of a record is drawn.
fn chosen(recorded: &Recorded, patterns: &[String], span: &RangeInclusive<f64>) -> Result<Vec<Series>, String> {
    let names: Vec<String> = recorded.series.iter().map(|series| series.column.name()).collect();
    let mut chosen = if patterns.is_empty() {
        let usual: Vec<String> = USUAL.map(str::to_owned).into();
        usual.iter().flat_map(|pattern| select(&names, std::slice::from_ref(pattern)).unwrap_or_default()).collect()
    } else {
        select(&names, patterns)?
    };
    if chosen.is_empty() {
        // A record of other signals than the usual ones.
        chosen = (0..names.len()).collect();
    }
    let series: Vec<Series> = chosen.iter().filter_map(|i| within(&recorded.series[*i], span)).collect();
    if series.is_empty() { Err(nothing_there(recorded, span)) } else { Ok(series) }
}

/// The part of a series that lies in `span`; `None` if there is no value in it.
fn within(series: &Series, span: &RangeInclusive<f64>) -> Option<Series> {
    let points: Vec<(f64, f64)> = series.points.iter().copied().filter(|(at, _)| span.contains(at)).collect();
    let some = points.iter().any(|(_, value)| value.is_finite());
    some.then(|| Series { column: series.column.clone(), points })
}

fn nothing_there(recorded: &Recorded, span: &RangeInclusive<f64>) -> String {
    let times = recorded.series.iter().flat_map(|series| series.points.first().into_iter().chain(series.points.last()));
    let times = times.map(|(at, _)| *at);
    let (first, last) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    if first > last {
        return "nothing is recorded in it".into();
    }
    if *span.start() > last || *span.end() < first {
        return format!("it was recorded from {first:.3} s to {last:.3} s");
    }
    "these signals have no value in it".into()
}

fn figure(
    subject: &Subject,
    series: &[Drawn<'_>],
    records: &[(&str, &Recorded)],
    span: &RangeInclusive<f64>,
) -> Figure {
    let of_it: Vec<&Drawn<'_>> = series.iter().filter(|one| one.series.column.subject == *subject).collect();
    let mut quantities: Vec<String> = Vec::new();
    for one in &of_it {
        let quantity = quantity(&one.series.column);
        if !quantities.contains(&quantity) {
            quantities.push(quantity);
        }
    }
    let panels = quantities.iter().map(|name| {
        let of_quantity = |one: &&Drawn<'_>| quantity(&one.series.column) == *name;
        let lines: Vec<&Drawn<'_>> = of_it.iter().copied().filter(of_quantity).collect();
        panel(name, &lines)
    });
    let title = subject.title();
    let marks = records.iter().flat_map(|(_, recorded)| &recorded.marks).filter(|mark| {
        let about_it = mark.of.is_empty() || mark.of == title;
        about_it
            && !mark.text.starts_with(ABOUT)
            && !QUIET.contains(&&*mark.kind)
            && span.contains(&mark.at.as_secs_f64())
    });
    let events = marks.map(|mark| PlotEvent {
        at_s: mark.at.as_secs_f64(),
        label: mark.text.clone(),
        kind: match mark.severity {
            Severity::Note => EventKind::Note,
            Severity::Warning => EventKind::Stop,
            Severity::Fault => EventKind::Fault,
        },
    });
    Figure {
        title: title.clone(),
        time: "time, s".into(),
        panels: panels.collect(),
        events: events.collect(),
        ..Figure::default()
    }
}

/// What a column measures, without whether it is asked for or there: `velocity_rpm` and `velocity_demand_rpm` are one.
fn quantity(column: &Column) -> String {
    column.signal.replace("_demand", "").replace("rotor_", "")
}

fn panel(quantity: &str, lines: &[&Drawn<'_>]) -> Panel {
    let unit = lines.first().map_or_else(String::new, |one| one.series.column.unit.clone().into_owned());
    let (colour, with_zero) = look(quantity, &unit);
    // The demand first, so that the actual value lies on it.
    let (demands, actuals): (Vec<&Drawn<'_>>, Vec<&Drawn<'_>>) =
        lines.iter().partition(|one| one.series.column.signal.contains("_demand"));
    let colours = Colour::ALL.into_iter().cycle().skip_while(move |first| *first != colour);
    let traces = demands
        .into_iter()
        .map(|one| ("demand", Style::Demand, one))
        .chain(actuals.into_iter().zip(colours).map(|(one, colour)| {
            let label = if one.series.column.signal.starts_with("rotor_") { "rotor" } else { "actual" };
            (label, Style::Actual(colour), one)
        }))
        .map(|(label, style, one)| {
            let label = if one.of.is_empty() { label.to_owned() } else { format!("{label}, {}", one.of) };
            Trace { label: label.into(), style, points: one.series.points.clone() }
        });
    // A supply that gives a hundredth of a volt less is one that stands.
    let least_span = if matches!(unit.as_str(), "V" | "°C") { 1.0 } else { 0.0 };
    let traces = traces.collect();
    Panel { title: title(quantity).into(), unit: unit.into(), with_zero, least_span, traces, ..Panel::default() }
}

/// `velocity_rpm` in words: `Velocity`.
fn title(quantity: &str) -> String {
    const UNITS: [&str; 13] =
        ["_counts", "_rpm", "_rad_s", "_deg_s", "_m_s", "_rad", "_deg", "_nm", "_a", "_v", "_c", "_j", "_m"];
    let bare = UNITS.iter().find_map(|unit| quantity.strip_suffix(unit)).unwrap_or(quantity).replace('_', " ");
    let mut letters = bare.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The colour of a quantity, and whether its 0 belongs into the picture.
fn look(quantity: &str, unit: &str) -> (Colour, bool) {
    match unit {
        "counts" | "rad" | "m" | "°" => (Colour::Blue, false),
        "r/min" | "m/s" | "rad/s" | "°/s" => (Colour::Teal, true),
        "A" | "N·m" => (Colour::Orange, true),
        "V" => (Colour::Purple, false),
        "°C" => (Colour::Red, false),
        "J" => (Colour::Red, true),
        _ => (Colour::Grey, quantity != "statusword"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::piece::Mark;
    use super::*;
    use can::Instant;

    /// Two drives of which one has no demand, and a fault at 0.5 s.
    fn recorded() -> Recorded {
        let series = |name: &str| {
            let column = name.parse().unwrap();
            Series { column, points: (0..100).map(|i| (f64::from(i) * 0.01, f64::from(i))).collect() }
        };
        let names = ["4.position_counts", "4.velocity_rpm", "4.velocity_demand_rpm", "5.current_a", "5.statusword"];
        let mark = Mark {
            at: Instant::from_millis(500),
            of: "node 4".into(),
            kind: "fault".into(),
            severity: Severity::Fault,
            text: "over-voltage".into(),
        };
        Recorded {
            series: names.map(series).into(),
            marks: vec![Mark { kind: "state".into(), ..mark.clone() }, mark],
            torn: false,
        }
    }

    fn drawn(patterns: &[&str], span: RangeInclusive<f64>) -> Result<Poster, String> {
        let patterns: Vec<String> = patterns.iter().map(|pattern| (*pattern).to_owned()).collect();
        picture("run", &recorded(), &patterns, span)
    }

    #[test]
    fn each_node_has_a_figure_and_each_quantity_a_panel() {
        let poster = drawn(&[], 0.0..=10.0).unwrap();
        let panels = |row: usize| {
            let figure = &poster.rows[row][0];
            figure.panels.iter().map(|panel| format!("{}, {}: {}", panel.title, panel.unit, panel.traces.len()))
        };
        assert_eq!(panels(0).collect::<Vec<_>>(), ["Position, counts: 1", "Velocity, r/min: 2"]);
        assert_eq!(panels(1).collect::<Vec<_>>(), ["Current, A: 1"]);
        assert_eq!(poster.rows[0][0].events.iter().map(|event| &*event.label).collect::<Vec<_>>(), ["over-voltage"]);
        assert!(poster.rows[1][0].events.is_empty());
    }

    #[test]
    fn records_of_the_same_node_lie_over_each_other_with_their_names() {
        let (one, two) = (recorded(), recorded());
        let patterns = ["4.velocity_rpm".to_owned()];
        let poster = overlay("both", &[("a.csv", &one), ("b.csv", &two)], &patterns, 0.0..=10.0).unwrap();
        let traces = &poster.rows[0][0].panels[0].traces;
        assert_eq!(traces.iter().map(|trace| &*trace.label).collect::<Vec<_>>(), ["actual, a.csv", "actual, b.csv"]);
        assert_ne!(traces[0].style, traces[1].style);
        assert_eq!((poster.rows.len(), poster.rows[0][0].panels.len(), traces[0].points.len()), (1, 1, 100));
    }

    #[test]
    fn a_span_is_cut_out_and_an_empty_one_is_reported() {
        let poster = drawn(&["4.position_counts"], 0.2..=0.3).unwrap();
        let points = &poster.rows[0][0].panels[0].traces[0].points;
        assert!(points.iter().all(|(at, _)| (0.2..=0.3).contains(at)) && points.len() >= 10);
        let refusal = |patterns: &[&str], span| drawn(patterns, span).err().unwrap_or_default();
        assert_eq!(refusal(&[], 5.0..=6.0), "it was recorded from 0.000 s to 0.990 s");
        assert!(refusal(&["speed"], 0.0..=1.0).contains("unknown signal 'speed'"));
        assert!(picture("", &Recorded::default(), &[], 0.0..=1.0).unwrap_err().contains("nothing is recorded"));
    }
}

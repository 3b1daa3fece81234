//! Layout and drawing: where panels, ticks, labels and marks go.

use crate::lanes;
use crate::poster::{Colour, EventKind, Figure, Panel, PlotEvent, Poster, Style, Trace};
use crate::svg::{Anchor, Font, Scale, Svg};
use crate::thin::thin;
use crate::ticks::{self, Ticks};

/// Chosen for pages that show pictures about 900 px wide: letters stay readable there.
const WIDTH: f64 = 1000.0;
/// From a figure's border to its axes: room for the ticks, and for the names of the lines.
const LEFT: f64 = 84.0;
const RIGHT: f64 = 112.0;
/// Holds the poster's title and subtitle.
const HEADING: f64 = 66.0;
/// Holds a figure's title.
const TOP: f64 = 34.0;
const SECTION_STRIP: f64 = 38.0;
const EVENT_LANE: f64 = 16.0;
const EVENT_LANES: usize = 9;
/// Names may come this close to their neighbours: their width is estimated on the safe side.
const CROWDING: f64 = 1.1;
/// Holds the title of the panel below.
const PANEL_GAP: f64 = 27.0;
/// Room above and below the values of a panel, as a part of their range.
const HEADROOM: f64 = 0.07;
const BOTTOM: f64 = 44.0;
const LABEL_GAP: f64 = 15.0;
/// A tick of the time axis for each so many pixels at most.
const TICK_DISTANCE: f64 = 62.0;
const TICK_HEIGHT: f64 = 16.0;

const GROUND: &str = "#ffffff";
const FRAME: &str = "#d0d7de";
const BAND: &str = "#f3f6f9";
const GRID: &str = "#e3e8ee";
const ZERO: &str = "#b6c0cb";
const CUT: &str = "#7a8694";

const TITLE: Font = Font { size: 19.0, colour: "#1f2933", bold: true };
const SUBTITLE: Font = Font { size: 13.0, colour: "#5b6773", bold: false };
const FIGURE_TITLE: Font = Font { size: 15.5, colour: "#1f2933", bold: true };
const AXIS: Font = Font { size: 12.0, colour: "#5b6773", bold: false };
const NAME: Font = Font { size: 12.5, colour: "#1f2933", bold: true };
const NUMBER: Font = Font { size: 12.0, colour: "#3b4652", bold: true };
const SECTION: Font = Font { size: 11.5, colour: "#5b6773", bold: false };

/// Where things of a figure lie, px.
struct Layout<'a> {
    time: (f64, f64),
    /// What a logarithmic axis shows; empty for a time.
    logarithmic: &'a str,
    cuts: &'a [(f64, f64)],
    left: f64,
    right: f64,
    top: f64,
    event_top: f64,
    panels_top: f64,
    panels_bottom: f64,
}

impl Layout<'_> {
    fn x(&self, time: f64) -> f64 {
        self.left + self.shown(time) / self.shown(self.time.1) * (self.right - self.left)
    }

    /// Time from the begin to `time` without what is cut out.
    fn shown(&self, time: f64) -> f64 {
        let cut = self.cuts.iter().map(|(from, to)| (to.min(time) - from).max(0.0)).sum::<f64>();
        time - self.time.0 - cut
    }

    fn is_cut(&self, time: f64) -> bool {
        self.cuts.iter().any(|(from, to)| (*from..*to).contains(&time))
    }
}

/// The whole picture; `scripted` if a script is to find its scales and lines.
pub(crate) fn poster(poster: &Poster, scripted: bool) -> String {
    let mut body = Svg::new(scripted);
    body.text((24.0, 34.0), Anchor::Start, TITLE, &poster.title);
    body.text((24.0, 55.0), Anchor::Start, SUBTITLE, &poster.subtitle);
    let mut top = HEADING;
    let mut number = 0;
    for row in &poster.rows {
        let width = WIDTH / row.len().max(1) as f64;
        let bottoms = row.iter().enumerate().map(|(place, it)| {
            let left = place as f64 * width;
            number += 1;
            figure(&mut body, it, (left + LEFT, left + width - RIGHT), top, number)
        });
        top = bottoms.fold(top, f64::max);
    }
    let mut svg = Svg::default();
    svg.rect((0.5, 0.5), (WIDTH - 1.0, top - 1.0), 8.0, &format!(r#"fill="{GROUND}" stroke="{FRAME}""#));
    svg.append(body);
    svg.document((WIDTH, top), &poster.title)
}

/// One figure; gives where the next one may begin.
fn figure(svg: &mut Svg, figure: &Figure, (left, right): (f64, f64), top: f64, number: usize) -> f64 {
    let mut events: Vec<&PlotEvent> = figure.events.iter().collect();
    events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    let section_strip = if figure.sections.is_empty() { 0.0 } else { SECTION_STRIP };
    let top = top + TOP;
    let mut layout = Layout {
        time: figure.time_span(),
        logarithmic: if figure.logarithmic { &figure.time } else { "" },
        cuts: &figure.cuts,
        left,
        right,
        top,
        event_top: top + section_strip,
        panels_top: 0.0,
        panels_bottom: 0.0,
    };
    let event_lanes = event_lanes(&layout, &events);
    let lane_count = event_lanes.iter().max().map_or(0, |lane| lane + 1);
    layout.panels_top = layout.event_top + lane_count as f64 * EVENT_LANE + 26.0;
    let heights = figure.panels.iter().map(|panel| panel.height + PANEL_GAP).sum::<f64>();
    layout.panels_bottom = layout.panels_top + heights - PANEL_GAP;

    let title_left = left - LEFT + 24.0;
    svg.text((title_left, top - 9.0), Anchor::Start, FIGURE_TITLE, &figure.title);
    let after_title = title_left + 8.0 + FIGURE_TITLE.width(&figure.title);
    svg.text((after_title, top - 9.0), Anchor::Start, SUBTITLE, &figure.subtitle);
    sections(svg, &layout, figure);
    draw_events(svg, &layout, &events, &event_lanes);
    let mut panel_top = layout.panels_top;
    for panel in &figure.panels {
        draw_panel(svg, &layout, panel_top, panel, number);
        panel_top += panel.height + PANEL_GAP;
    }
    time_axis(svg, &layout, &figure.time);
    layout.panels_bottom + BOTTOM
}

fn sections(svg: &mut Svg, layout: &Layout<'_>, figure: &Figure) {
    let places = figure.sections.iter().map(|section| (section, layout.x(section.from_s), layout.x(section.to_s)));
    // Every other section has a tinted ground; all grounds come before all names, which may reach over a border.
    for (_, left, right) in places.clone().step_by(2) {
        svg.rect(
            (left, layout.top),
            (right - left, layout.panels_bottom - layout.top),
            0.0,
            &format!(r#"fill="{BAND}""#),
        );
    }
    for (section, left, right) in places {
        let fits = |name: &&String| SECTION.width(name) < (right - left) * CROWDING;
        let middle = (left + right) / 2.0;
        if NUMBER.width(&section.number) < right - left {
            svg.text((middle, layout.top + 16.0), Anchor::Middle, NUMBER, &section.number);
        }
        if let Some(name) = section.names.iter().find(fits) {
            svg.text((middle, layout.top + 31.0), Anchor::Middle, SECTION, name);
        }
    }
}

fn draw_panel(svg: &mut Svg, layout: &Layout<'_>, top: f64, panel: &Panel, figure: usize) {
    let (low, high) = value_span(panel);
    svg.begin_panel(&Scale {
        figure,
        name: &panel.title,
        unit: &panel.unit,
        x: ((layout.left, layout.right), layout.time),
        logarithmic: layout.logarithmic,
        y: (top, panel.height),
        values: (low, high),
    });
    let ticks = Ticks::within(low, high, (panel.height / TICK_HEIGHT) as usize);
    let y = |value: f64| top + (high - value) / (high - low) * panel.height;
    for &tick in &ticks.values {
        let colour = if tick == 0.0 { ZERO } else { GRID };
        svg.line((layout.left, y(tick)), (layout.right, y(tick)), &format!(r#"stroke="{colour}""#));
        svg.text((layout.left - 8.0, y(tick) + 4.0), Anchor::End, AXIS, &ticks.text(tick));
    }
    svg.rimmed_text((layout.left, top - 7.0), Anchor::Start, NAME, &panel.title);
    let after_title = layout.left + 7.0 + NAME.width(&panel.title);
    svg.rimmed_text((after_title, top - 7.0), Anchor::Start, AXIS, &panel.unit);
    for trace in &panel.traces {
        // Where a trace has no value, its line has a gap.
        for piece in trace.points.split(|point| !point.1.is_finite()).filter(|piece| !piece.is_empty()) {
            let shown = piece.iter().filter(|point| !layout.is_cut(point.0));
            let pixels = shown.map(|&(time, value)| (layout.x(time), y(value)));
            let line = if trace.style == Style::SetPoint { steps(pixels) } else { thin(pixels) };
            svg.path(&line, &format!("{}{}", paint(trace.style), svg.label(&trace.label)));
        }
    }
    svg.end_panel();
    trace_labels(svg, (layout.right + 8.0, top), panel, y);
}

/// Lowest and highest value of a panel's axis.
fn value_span(panel: &Panel) -> (f64, f64) {
    let values = panel.traces.iter().flat_map(|trace| &trace.points).map(|point| point.1);
    // A value that is not a number is a gap, and `min` and `max` pass it over.
    let outside = if panel.with_zero { (0.0, 0.0) } else { (f64::INFINITY, f64::NEG_INFINITY) };
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold(outside, |(low, high), value| (f64::min(low, value), f64::max(high, value)));
    // A line that never changes lies in the middle.
    let (low, high) = match low.partial_cmp(&high) {
        Some(std::cmp::Ordering::Less) => (low, high),
        Some(std::cmp::Ordering::Equal) => (low - low.abs().max(1.0) * 0.1, high + high.abs().max(1.0) * 0.1),
        _ => (-1.0, 1.0),
    };
    let missing = (panel.least_span - (high - low)).max(0.0) / 2.0;
    let (low, high) = (low - missing, high + missing);
    (low - (high - low) * HEADROOM, high + (high - low) * HEADROOM)
}

fn trace_labels(svg: &mut Svg, (x, top): (f64, f64), panel: &Panel, y: impl Fn(f64) -> f64) {
    let traces = &panel.traces;
    let ends: Vec<f64> = traces.iter().map(|trace| y(last_value(trace))).collect();
    let heights = lanes::spread(&ends, LABEL_GAP, top + 2.0, top + panel.height - 2.0);
    for (trace, height) in traces.iter().zip(heights) {
        svg.line((x, height), (x + 14.0, height), &paint(trace.style));
        let font = Font { size: 12.0, colour: text_colour(trace.style), bold: is_actual(trace.style) };
        svg.text((x + 19.0, height + 4.0), Anchor::Start, font, &trace.label);
    }
}

/// Where the label belongs: at the last value that there is.
fn last_value(trace: &Trace) -> f64 {
    trace.points.iter().rev().map(|point| point.1).find(|value| value.is_finite()).unwrap_or(0.0)
}

/// A lane for each event's label, so that labels do not overlap.
fn event_lanes(layout: &Layout<'_>, events: &[&PlotEvent]) -> Vec<usize> {
    let spans: Vec<(f64, f64)> = events
        .iter()
        .map(|event| {
            let left = label_left(layout, event);
            (left - 8.0, left + event_font(event.kind).width(&event.label) + 10.0)
        })
        .collect();
    lanes::assign(&spans, EVENT_LANES)
}

/// Labels begin at their mark, or end at the right border when they would leave the picture.
fn label_left(layout: &Layout<'_>, event: &PlotEvent) -> f64 {
    let width = event_font(event.kind).width(&event.label);
    (layout.x(event.at_s) + 6.0).min(layout.right + RIGHT - 14.0 - width)
}

/// All lines first, so that none runs over a label.
fn draw_events(svg: &mut Svg, layout: &Layout<'_>, events: &[&PlotEvent], lanes: &[usize]) {
    let places = || {
        let heights = lanes.iter().map(|lane| layout.event_top + *lane as f64 * EVENT_LANE + 12.0);
        events.iter().zip(heights).map(|(event, y)| (*event, layout.x(event.at_s), y))
    };
    for (event, x, y) in places() {
        let colour = event_font(event.kind).colour;
        let paint = format!(r#"stroke="{colour}" stroke-width="1" stroke-dasharray="2 3" opacity="0.75""#);
        svg.line((x, y - 4.0), (x, layout.panels_bottom), &paint);
    }
    for (event, x, y) in places() {
        let font = event_font(event.kind);
        svg.dot((x, y - 4.0), 3.2, font.colour);
        svg.rimmed_text((label_left(layout, event), y), Anchor::Start, font, &event.label);
    }
}

fn event_font(kind: EventKind) -> Font {
    let colour = match kind {
        EventKind::Fault => "#b42318",
        EventKind::Stop => "#a15c07",
        EventKind::Note => "#475467",
    };
    Font { size: 11.5, colour, bold: false }
}

fn time_axis(svg: &mut Svg, layout: &Layout<'_>, name: &str) {
    let (begin, end) = layout.time;
    // As if what is cut out were there, with the same distances.
    let whole = (layout.right - layout.left) * (end - begin) / layout.shown(end);
    let ticks = if layout.logarithmic.is_empty() {
        Ticks::within(begin, end, ((whole / TICK_DISTANCE) as usize).max(2)).labelled()
    } else {
        ticks::logarithmic(begin, end)
    };
    let y = layout.panels_bottom;
    svg.line((layout.left, y), (layout.right, y), &format!(r#"stroke="{ZERO}""#));
    let mut free_from = f64::NEG_INFINITY;
    for (tick, text) in ticks.into_iter().filter(|(tick, _)| !layout.is_cut(*tick)) {
        let x = layout.x(tick);
        svg.line((x, y), (x, y + 5.0), &format!(r#"stroke="{ZERO}""#));
        let half = AXIS.width(&text) / 2.0;
        if x - half >= free_from {
            svg.text((x, y + 20.0), Anchor::Middle, AXIS, &text);
            free_from = x + half + 4.0;
        }
    }
    for (from, _) in layout.cuts {
        let x = layout.x(*from);
        for shift in [-2.0, 2.0] {
            svg.line((x + shift - 2.5, y + 6.0), (x + shift + 2.5, y - 6.0), &format!(r#"stroke="{CUT}""#));
        }
    }
    // The last tick may stand at the right border, with half of its label beyond it.
    let name_left = (layout.right + 8.0).max(free_from + 4.0);
    svg.text((name_left, y + 20.0), Anchor::Start, AXIS, name);
}

/// A line that holds each value until the next.
fn steps(pixels: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::new();
    for (x, y) in pixels {
        match line.last() {
            Some(&(_, held)) if held != y => line.extend([(x, held), (x, y)]),
            Some(_) if line.len() > 1 && line[line.len() - 2].1 == y => {
                let end = line.len() - 1;
                line[end].0 = x;
            }
            _ => line.push((x, y)),
        }
    }
    line
}

fn is_actual(style: Style) -> bool {
    matches!(style, Style::Actual(_) | Style::OneOf(..))
}

fn paint(style: Style) -> String {
    match style {
        Style::OneOf(colour, place) => {
            let width = (6.0 - 2.2 * f64::from(place)).max(1.4);
            format!(r#"stroke="{}" stroke-width="{width:.1}""#, line_colour(colour))
        }
        Style::Actual(colour) => format!(r#"stroke="{}" stroke-width="1.7""#, line_colour(colour)),
        Style::Demand => r##"stroke="#b9c3cf" stroke-width="4.2" stroke-linecap="round""##.into(),
        Style::SetPoint => r##"stroke="#667382" stroke-width="1.2" stroke-dasharray="5 4""##.into(),
    }
}

fn line_colour(colour: Colour) -> &'static str {
    match colour {
        Colour::Blue => "#1d5fbf",
        Colour::Teal => "#00796b",
        Colour::Orange => "#c4500b",
        Colour::Purple => "#7a3fb0",
        Colour::Red => "#b3265e",
        Colour::Grey => "#4d5a67",
    }
}

fn text_colour(style: Style) -> &'static str {
    match style {
        Style::Actual(colour) | Style::OneOf(colour, _) => line_colour(colour),
        Style::Demand => "#7a8694",
        Style::SetPoint => "#667382",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poster::Section;

    fn example() -> Poster {
        Poster { title: "Title".into(), subtitle: "subtitle".into(), rows: vec![vec![figure()]] }
    }

    fn figure() -> Figure {
        let wave =
            |amplitude: f64| (0..2000).map(move |i| (f64::from(i) * 0.01, amplitude * (f64::from(i) * 0.01).sin()));
        Figure {
            logarithmic: false,
            title: "Drive".into(),
            subtitle: "in words".into(),
            time: "time, s".into(),
            panels: vec![
                Panel {
                    title: "velocity".into(),
                    unit: "r/min".into(),
                    height: 100.0,
                    traces: vec![
                        Trace {
                            label: "set-point".into(),
                            style: Style::SetPoint,
                            points: vec![(0.0, 0.0), (5.0, 80.0)],
                        },
                        Trace { label: "demand".into(), style: Style::Demand, points: wave(98.0).collect() },
                        Trace {
                            label: "actual".into(),
                            style: Style::Actual(Colour::Teal),
                            points: wave(100.0).collect(),
                        },
                    ],
                    ..Panel::default()
                },
                Panel { title: "empty".into(), unit: "A".into(), height: 60.0, ..Panel::default() },
            ],
            sections: vec![Section {
                from_s: 0.0,
                to_s: 10.0,
                number: "4.1".into(),
                names: vec!["x".repeat(500), "short".into()],
            }],
            events: vec![PlotEvent { at_s: 3.0, label: "quick stop".into(), kind: EventKind::Stop }],
            cuts: vec![(12.0, 16.0)],
        }
    }

    #[test]
    fn a_figure_is_one_svg_with_its_own_background_and_no_script() {
        let svg = example().to_svg();
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        assert!(svg.contains(r##"fill="#ffffff""##) && !svg.contains("<script"));
        assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
        assert!(svg.len() < 60_000, "{} bytes", svg.len());
    }

    #[test]
    fn an_axis_without_zero_spans_its_values_and_gaps_are_none_of_them() {
        let of = |with_zero, values: &[f64]| {
            let points = values.iter().enumerate().map(|(i, value)| (i as f64, *value)).collect();
            let trace = Trace { label: "".into(), style: Style::Demand, points };
            value_span(&Panel { with_zero, traces: vec![trace], ..Panel::default() })
        };
        assert_eq!(of(false, &[48.0, f64::NAN, 50.0]), (48.0 - 2.0 * HEADROOM, 50.0 + 2.0 * HEADROOM));
        assert_eq!(of(true, &[50.0]).0, -50.0 * HEADROOM);
        let (low, high) = of(false, &[48.0, 48.0]);
        assert!(low < 48.0 && 48.0 < high);
        assert!(of(false, &[]).0 < of(false, &[]).1);
        let still = Trace { label: "".into(), style: Style::Demand, points: vec![(0.0, 47.99), (1.0, 48.01)] };
        let (low, high) =
            value_span(&Panel { with_zero: false, least_span: 2.0, traces: vec![still], ..Panel::default() });
        assert!((high - low - 2.0 * (1.0 + 2.0 * HEADROOM)).abs() < 1e-9 && ((low + high) / 2.0 - 48.0).abs() < 1e-9);
    }

    #[test]
    fn a_page_holds_the_same_picture_with_its_scales_and_needs_nothing_else() {
        let page = example().to_html();
        assert_eq!(page.matches("<g data-figure=\"1\"").count(), 2);
        assert_eq!(page.matches("</g>").count(), 2);
        assert!(page.contains("data-label=\"set-point\"") && page.contains("data-unit=\"r/min\""));
        let plain: String = example().to_svg();
        let paths = |text: &str| text.matches("<path d=").count();
        assert_eq!(paths(&page), paths(&plain));
        // The two that are there are names of the SVG namespace, and nothing is fetched from them.
        assert_eq!((plain.contains("data-"), page.matches("http:").count()), (false, 2));
        assert!(!page.contains("https:") && !page.contains(" src="));
    }

    #[test]
    fn a_section_takes_the_first_name_that_fits() {
        let svg = example().to_svg();
        assert!(svg.contains(">short<") && !svg.contains("xxxx"));
    }

    #[test]
    fn no_number_in_the_picture_is_broken() {
        let mut poster = example();
        poster.rows[0][0].panels[0].traces.clear();
        let svg = poster.to_svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn time_that_is_cut_out_takes_no_room() {
        let cuts = [(2.0, 4.0), (6.0, 7.0)];
        let layout = Layout {
            time: (0.0, 10.0),
            logarithmic: "",
            cuts: &cuts,
            left: 0.0,
            right: 700.0,
            top: 0.0,
            event_top: 0.0,
            panels_top: 0.0,
            panels_bottom: 0.0,
        };
        let at = [0.0, 2.0, 3.0, 4.0, 6.5, 8.0, 10.0].map(|time| layout.x(time));
        assert_eq!(at, [0.0, 200.0, 200.0, 200.0, 400.0, 500.0, 700.0]);
        assert!(layout.is_cut(3.0) && !layout.is_cut(4.0) && !layout.is_cut(1.0));
    }

    #[test]
    fn the_name_of_the_time_axis_stands_clear_of_the_last_tick() {
        let points = vec![(0.0, 0.0), (20_000.0, 1.0)];
        let trace = Trace { label: "actual".into(), style: Style::Demand, points };
        let panel = Panel { height: 100.0, traces: vec![trace], ..Panel::default() };
        let figure = Figure { time: "time, s".into(), panels: vec![panel], ..Figure::default() };
        let svg = Poster { rows: vec![vec![figure]], ..Poster::default() }.to_svg();
        let left_of = |text: &str| {
            let (before, _) = svg.split_once(&format!(">{text}<")).expect("it is written");
            let (_, element) = before.rsplit_once("<text x=\"").expect("an element");
            element.split('"').next().and_then(|x| x.parse::<f64>().ok()).expect("a number")
        };
        let last = "20\u{2009}000";
        assert!(left_of("time, s") > left_of(last) + AXIS.width(last) / 2.0, "{svg}");
    }

    #[test]
    fn figures_of_a_row_stand_side_by_side() {
        let height = |rows: Vec<Vec<Figure>>| {
            let svg = Poster { rows, ..Poster::default() }.to_svg();
            let (_, size) = svg.split_once("viewBox=\"0 0 ").expect("a view box");
            size.split(['"', ' ']).nth(1).and_then(|height| height.parse::<f64>().ok()).expect("a height")
        };
        let one = height(vec![vec![figure()]]);
        assert_eq!(height(vec![vec![figure(), figure()]]), one);
        assert!(height(vec![vec![figure()], vec![figure()]]) > one + 200.0);
    }

    #[test]
    fn set_points_are_drawn_as_steps() {
        assert_eq!(
            steps([(0.0, 1.0), (5.0, 1.0), (9.0, 1.0), (10.0, 3.0)].into_iter()),
            [(0.0, 1.0), (9.0, 1.0), (10.0, 1.0), (10.0, 3.0)]
        );
    }
}

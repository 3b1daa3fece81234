//! The picture: nodes, plots of the chosen one, what it has to say, what has happened, keys. Made for 80 columns and 24 lines; more
//! room goes to the plots. Nothing is shown by colour alone.

use host::{News, NodeView, Snapshot};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Borders, Chart, Clear, Dataset, GraphType, Paragraph, Wrap};

use super::app::{App, LEAST};
use super::samples::{SIGNALS, SPAN_S, bounds};

/// Nodes that are listed at most; further ones are scrolled to.
const MOST_NODES: u16 = 6;

/// Lines of news.
const NEWS: u16 = 3;

const KEYS: &str = "e enable  d disable  left/right jog  s stop  r reset  SPACE stop  ? help  q quit";

const HELP: [&str; 20] = [
    "SPACE, Esc       quick stop of every drive",
    "left, right      jog the chosen drive while held (also h and l). It",
    "                 begins with the second repeat of the key and ends 0.2 s",
    "                 after the last: a press alone moves nothing",
    "+, -             speed to jog at",
    "up, down         choose a node (k and j too)",
    "e                enable: to Operation enabled, holding still",
    "d                disable: stop, then no current",
    "s                stop by the deceleration ramp; it stays enabled",
    "r                reset its fault, once the cause is gone",
    "x                explain why it does not move",
    "n                scan the bus",
    "t                take control, if no other session has it",
    "w                what has happened, read back",
    "o                plot an object of the chosen node, by name or number",
    "q, Ctrl-C        quit: what was moved from here stops",
    "Ctrl-Z           stop that too, and back to the shell until fg",
    "",
    "What this terminal moves stops too when it closes, when its connection",
    "is lost or when this program ends.",
];

/// How it is painted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// With colours.
    pub(super) colour: bool,
}

impl Look {
    fn in_colour(self, colour: Color) -> Style {
        if self.colour { Style::new().fg(colour) } else { Style::new() }
    }

    fn bad(self) -> Style {
        self.in_colour(Color::Red).add_modifier(Modifier::BOLD)
    }
}

/// Draws everything.
pub(super) fn draw(frame: &mut Frame<'_>, app: &App, look: Look) {
    let area = frame.area();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let size = format!("{} x {}, and {} x {} are needed", area.width, area.height, LEAST.0, LEAST.1);
        let text =
            format!("SPACE stops all, q quits. This terminal is too small: {size}. Until then no key moves a drive");
        // What is cut off at the end is what matters less.
        let lines: Vec<_> = unseen_stop(app, look).into_iter().chain([Line::from(text)]).collect();
        return frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }), area);
    }
    let listed = (app.state.nodes.len() as u16).clamp(1, MOST_NODES);
    let rows = [1, listed + 1, 0, 4, NEWS + 1, 1];
    let rows = rows.map(|rows| if rows == 0 { Constraint::Min(7) } else { Constraint::Length(rows) });
    let [title, nodes, plots, chosen, news, keys] = Layout::vertical(rows).areas(area);
    frame.render_widget(unseen_stop(app, look).unwrap_or_else(|| title_line(app, look)), title);
    draw_nodes(frame, nodes, app, look);
    draw_plots(frame, plots, app, look);
    frame.render_widget(chosen_lines(app, look), chosen);
    draw_news(frame, news, app);
    frame.render_widget(Line::from(KEYS).style(Style::new().add_modifier(Modifier::DIM)), keys);
    if let Some(back) = app.read_back {
        draw_past(frame, area, app, back);
    }
    if let Some(typed) = &app.typed {
        draw_typed(frame, area, typed);
    }
    if app.help {
        draw_help(frame, area);
    }
    if let Some(node) = app.question {
        draw_question(frame, area, app.state.node(node), look);
    }
}

/// Which drives were commanded to stop and have not been seen to stand since.
fn unseen_stop(app: &App, look: Look) -> Option<Line<'static>> {
    let unseen = app.state.nodes.iter().filter(|node| node.stop_unseen).map(|node| node.node.to_string());
    let unseen = unseen.collect::<Vec<_>>().join(", ");
    let text = format!("! NODE {unseen} MAY STILL BE MOVING: no stop was seen. Use the emergency stop");
    (!unseen.is_empty()).then(|| Line::from(text).style(look.bad().add_modifier(Modifier::REVERSED)))
}

fn title_line<'a>(app: &'a App, look: Look) -> Line<'a> {
    let Snapshot { bus, scanning, .. } = &*app.state;
    let rate = bus.bitrate.map_or_else(String::new, |rate| format!("  {} kbit/s", rate / 1000));
    let load = bus.load_percent.map_or_else(String::new, |load| format!("  load {load:.1} %"));
    let mut line = vec![
        Span::from("ferrodrive top").style(Style::new().add_modifier(Modifier::BOLD)),
        Span::from(format!("  {}{rate}{load}  {} frames/s", bus.name, bus.frames_per_s)),
    ];
    let nodes = app.state.nodes.len();
    if nodes > usize::from(MOST_NODES) {
        let faulted = app.state.nodes.iter().filter(|node| is_faulted(node)).count();
        let faults = if faulted > 0 { format!(", {faulted} faulted") } else { String::new() };
        line.push(Span::from(format!("  {nodes} nodes{faults}")));
    }
    if *scanning {
        line.push(Span::from("  scanning"));
    }
    if !app.has_control() && app.state.controller.is_some() {
        line.push(Span::from("  another session has control").style(look.bad()));
    }
    line.into()
}

/// Columns of the list: name and width.
const COLUMNS: [(&str, usize); 8] =
    [("  node", 7), ("model", 12), ("NMT", 16), ("heard", 8), ("state", 19), ("speed", 8), ("A", 6), ("V", 4)];

fn draw_nodes(frame: &mut Frame<'_>, area: Rect, app: &App, look: Look) {
    let head: String = COLUMNS.iter().map(|(name, width)| format!("{name:width$}")).collect();
    let mut lines = vec![Line::from(head).style(Style::new().add_modifier(Modifier::DIM))];
    let room = usize::from(area.height.saturating_sub(1));
    let at = app.state.nodes.iter().position(|node| Some(node.node) == app.chosen).unwrap_or(0);
    let first = (at + 1).saturating_sub(room);
    for node in app.state.nodes.iter().skip(first).take(room) {
        lines.push(node_line(node, Some(node.node) == app.chosen, look));
    }
    if app.state.nodes.is_empty() {
        lines.push(Line::from("  no node has been heard: is there power, is the bit rate right? n scans the bus"));
    }
    frame.render_widget(Paragraph::new(lines), area);
}

fn is_faulted(node: &NodeView) -> bool {
    node.drive.as_ref().and_then(|drive| drive.fault_code).is_some_and(|code| code != 0)
}

fn node_line(node: &NodeView, is_chosen: bool, look: Look) -> Line<'static> {
    let drive = node.drive.as_ref();
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
    };
    let fault = drive.and_then(|drive| drive.fault_code).filter(|code| *code != 0);
    let faulted = is_faulted(node);
    let state = match (drive, fault, &node.trouble) {
        (_, _, Some(_)) => "no answer".to_owned(),
        (_, Some(code), _) => format!("! fault {code:04X}h"),
        (Some(drive), None, _) => node.doing.or(drive.state).unwrap_or("-").to_owned(),
        (None, None, _) => "-".to_owned(),
    };
    let heard = node.heartbeat_age_ms.map_or_else(
        || "-".to_owned(),
        |ms| match ms {
            0..10_000 => format!("{ms} ms"),
            _ => format!("{} s", ms / 1000),
        },
    );
    let texts = [
        format!("{} {}", if is_chosen { '>' } else { ' ' }, node.node),
        node.model.unwrap_or("?").to_owned(),
        node.nmt.clone().unwrap_or_else(|| "-".to_owned()),
        heard,
        state,
        number(drive.and_then(|drive| drive.velocity_rpm), 1),
        number(drive.and_then(|drive| drive.current_a), 1),
        number(drive.and_then(|drive| drive.supply_v), 0),
    ];
    let cells: String = texts.iter().zip(COLUMNS).map(|(text, (_, width))| fitted(text, width)).collect();
    let style = if faulted || node.trouble.is_some() { look.bad() } else { Style::new() };
    Line::from(cells).style(if is_chosen { style.add_modifier(Modifier::BOLD) } else { style })
}

/// A text in a column, with a blank behind it.
fn fitted(text: &str, width: usize) -> String {
    let cut: String = text.chars().take(width - 1).collect();
    format!("{cut:width$}")
}

fn draw_plots(frame: &mut Frame<'_>, area: Rect, app: &App, look: Look) {
    let Some(node) = app.chosen else { return };
    let now_s = app.state.time_s;
    let always =
        SIGNALS.iter().enumerate().map(|(at, signal)| (format!("{signal} of {node}"), app.past.of(node, at, now_s)));
    let object = app.object.as_ref();
    let object = object.map(|object| (format!("{} of {}", object.name, object.node), object.values(now_s)));
    let plots: Vec<_> = always.chain(object).collect();
    let areas = Layout::horizontal(plots.iter().map(|_| Constraint::Fill(1))).spacing(1).split(area);
    let colours = [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta];
    for (((title, values), area), colour) in plots.into_iter().zip(areas.iter()).zip(colours) {
        let [low, high] = bounds(&values);
        let line = Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(look.in_colour(colour))
            .data(&values);
        let chart = Chart::new(vec![line])
            .block(Block::new().borders(Borders::TOP).title(title))
            .x_axis(Axis::default().bounds([-SPAN_S, 0.0]).labels(["-60 s", "now"]))
            .y_axis(Axis::default().bounds([low, high]).labels([shown(low), shown(high)]));
        frame.render_widget(chart, *area);
    }
}

/// The bound of an axis, which is a round number.
fn shown(bound: f64) -> String {
    let text = format!("{bound:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn chosen_lines<'a>(app: &'a App, look: Look) -> Paragraph<'a> {
    let Some(node) = app.node() else { return Paragraph::new("") };
    let mut lines = Vec::new();
    if let Some(drive) = &node.drive {
        let parts = [
            drive.mode_name.map(str::to_owned),
            drive.angle_degrees.map(|angle| format!("{angle:.1} deg")),
            drive.motor_celsius.map(|celsius| format!("motor {celsius:.0} C")),
            drive.driver_celsius.map(|celsius| format!("driver {celsius:.0} C")),
        ];
        let parts = parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        lines.push(Line::from(format!("node {}: {parts}", node.node)));
        for fault in drive.faults.iter().take(1) {
            lines.push(Line::from(format!("! {}: {}", fault.name, fault.remedy)).style(look.bad()));
        }
    }
    if let Some(trouble) = node.trouble.as_ref().or(node.remark.as_ref()) {
        lines.push(Line::from(format!("! {trouble}")).style(look.bad()));
    }
    let jog = if app.is_jogging() { "jogging" } else { "jog" };
    let without =
        node.without_us.as_deref().map_or_else(String::new, |without| format!("; without this program {without}"));
    let jog = format!("{jog} at {} r/min, + and - change that", app.jog_rpm());
    let style = if node.goes_on { look.bad() } else { Style::new() };
    lines.push(Line::from(vec![Span::from(jog), Span::from(without).style(style)]));
    Paragraph::new(lines).wrap(Wrap { trim: true }).block(Block::new().borders(Borders::TOP))
}

fn draw_news(frame: &mut Frame<'_>, area: Rect, app: &App) {
    let news = app.news.iter().rev().take(usize::from(NEWS)).rev();
    let lines: Vec<_> = news.map(|news| Line::from(news_text(news))).collect();
    frame.render_widget(Paragraph::new(lines).block(Block::new().borders(Borders::TOP)), area);
}

fn news_text(news: &News) -> String {
    let node = news.node.map(|node| format!("node {node}")).filter(|node| !news.text.starts_with(node));
    let node = node.map_or_else(String::new, |node| format!("{node}: "));
    format!("{:8.1} s  {node}{}", news.time_s, news.text)
}

/// What has happened, in full, up to so many news before the last.
fn draw_past(frame: &mut Frame<'_>, area: Rect, app: &App, back: usize) {
    frame.render_widget(Clear, area);
    let (count, room) = (app.news.len(), usize::from(area.height).saturating_sub(2));
    let last = count.saturating_sub(back);
    let width = usize::from(area.width).saturating_sub(2).max(1);
    let lines: Vec<_> = app.news[..last].iter().flat_map(|news| wrapped(&news_text(news), width)).collect();
    let shown: Vec<_> =
        lines[lines.len().saturating_sub(room)..].iter().map(|line| Line::from(line.as_str())).collect();
    let title = format!(" news up to {last} of {count}; up, down, page keys; any other key goes back ");
    frame.render_widget(Paragraph::new(shown).block(Block::bordered().title(title)), area);
}

/// A text in lines of a width; all but the first begin below its words.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    const INDENT: usize = 12;
    let mut lines = vec![String::new()];
    let mut at = 0;
    for word in text.split_inclusive(' ') {
        let length = word.trim_end().chars().count();
        if at > INDENT && at + length > width {
            lines.push(" ".repeat(INDENT));
            at = INDENT;
        }
        at += word.chars().count();
        if let Some(line) = lines.last_mut() {
            line.push_str(word);
        }
    }
    lines
}

/// The name of an object while it is typed.
fn draw_typed(frame: &mut Frame<'_>, area: Rect, typed: &str) {
    let width = LEAST.0 - 4;
    let within = Rect { x: area.x + (area.width - width) / 2, y: area.y + area.height / 2 - 2, width, height: 4 };
    frame.render_widget(Clear, within);
    let text = vec![
        Line::from(format!("object to plot: {typed}_")),
        Line::from("e.g. 60F4 or following_error; Enter plots it, Enter alone plots none"),
    ];
    frame.render_widget(Paragraph::new(text).block(Block::bordered()), within);
}

/// Lines of the question: what a drive does without this program is shown in full.
const QUESTION: u16 = 12;

/// That nothing stops a drive, before it is moved for the first time.
fn draw_question(frame: &mut Frame<'_>, area: Rect, node: Option<&NodeView>, look: Look) {
    let Some(node) = node else { return };
    let width = LEAST.0 - 4;
    let within = Rect {
        x: area.x + (area.width - width) / 2,
        y: area.y + (area.height - QUESTION) / 2,
        width,
        height: QUESTION,
    };
    frame.render_widget(Clear, within);
    let number = node.node;
    let why = node.without_us.as_deref().unwrap_or("nothing stops it");
    let text = vec![
        Line::from(format!("NOTHING STOPS NODE {number} IF THIS PROGRAM DIES")).style(look.bad()),
        Line::from(format!("If this program dies in the middle of a motion, {why}.")).style(look.bad()),
        Line::from(""),
        Line::from("It was not moved. Keep an emergency stop within reach."),
        Line::from(""),
        Line::from("y      move it nevertheless: release the key, then hold it again"),
        Line::from("SPACE  quick stop of every drive; any other key goes back"),
    ];
    let text = Paragraph::new(text).wrap(Wrap { trim: false });
    frame.render_widget(text.block(Block::bordered().title(format!(" node {number} "))), within);
}

fn draw_help(frame: &mut Frame<'_>, area: Rect) {
    let (width, height) = (LEAST.0 - 4, HELP.len() as u16 + 2);
    let within = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    frame.render_widget(Clear, within);
    let text = HELP.map(Line::from).to_vec();
    frame.render_widget(Paragraph::new(text).block(Block::bordered().title(" keys; any key goes back ")), within);
}

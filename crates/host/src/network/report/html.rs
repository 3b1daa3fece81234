//! A report as one page of HTML that needs nothing else.

use std::fmt::Write;

use super::{Fact, NodeReport, ReportedCapture, TunedGain, TunedLoop, Tuning};
use crate::network::faults::RememberedError;
use words::{counted, escaped};

impl NodeReport {
    /// The page: no script, nothing that is loaded; light, and to be printed on A4.
    pub fn to_html(&self) -> String {
        let mut out = String::new();
        self.head(&mut out);
        self.differences(&mut out);
        self.limits_and_guard(&mut out);
        self.faults(&mut out);
        self.pdos(&mut out);
        self.tunings.iter().for_each(|tuning| self::tuning(&mut out, tuning));
        self.captures.iter().for_each(|capture| self::capture(&mut out, capture));
        let _ = write!(
            out,
            "<footer>Made by ferrodrive report {}; it only reads. As delivered: {}.</footer>",
            env!("CARGO_PKG_VERSION"),
            escaped(self.manual)
        );
        plot::html::page(&format!("{}, node {}", self.title, self.node), &out)
    }

    fn head(&self, out: &mut String) {
        let _ = write!(out, "<h1>{}, node {}</h1>", escaped(self.title), self.node);
        let by = self.made.by.as_ref().map_or_else(String::new, |by| format!(", by {by}"));
        let _ = write!(out, "<p>{}</p>", escaped(&format!("{}{by}, on {}", self.made.at, self.made.bus)));
        let faults = self.remembered.as_ref().map_or(0, Vec::len) + usize::from(self.fault.is_some());
        let (stops, watch) = match self.guard.stops {
            Some(true) => ("pass", "Stops"),
            Some(false) => ("fail", "Goes on"),
            None => ("na", "Not known"),
        };
        let not_known = self.fault_not_known.is_some() || self.remembered_not_known.is_some();
        let faults_seen =
            if not_known { "faults seen; others are not known" } else { "faults, present and remembered" };
        let count = |class: &str, count: usize| if count > 0 { class.to_owned() } else { "na".to_owned() };
        let tiles = [
            (count("expected", self.differences.len()), self.differences.len().to_string(), "differ from delivery"),
            (count("fail", faults), faults.to_string(), faults_seen),
            (stops.to_owned(), watch.to_owned(), "when its host dies"),
        ];
        out.push_str("<div class=\"sum\">");
        for (class, value, what) in tiles {
            let _ = write!(out, "<div class=\"{class}\"><b>{value}</b><span>{what}</span></div>");
        }
        out.push_str("</div>");
        facts(out, "Identity", &[Fact { name: "Model".into(), value: self.model.into() }], &self.identity);
        facts(out, "State at this time", &self.state, &[]);
    }

    fn differences(&self, out: &mut String) {
        let title = format!("What differs from delivery: {} of {}", self.differences.len(), self.compared);
        let rows = self.differences.iter().map(|row| {
            let text = |shown: &Option<crate::network::params::Shown>| {
                shown.as_ref().map_or_else(|| "-".to_owned(), |shown| escaped(&shown.text))
            };
            [code(&row.object), escaped(row.name.unwrap_or_default()), text(&row.first), text(&row.second)]
        });
        table(out, &title, ["Object", "Name", "Here", "As delivered"], rows.collect());
        let mut notes = Vec::new();
        if self.not_compared > 0 {
            let objects = counted(self.not_compared, "parameter");
            notes.push(format!("{objects} more: its manual does not say how they are delivered."));
        }
        notes.extend(
            self.refused
                .iter()
                .map(|row| format!("{} {} was not read: {}", row.object, row.name.unwrap_or_default(), row.why)),
        );
        notes.iter().for_each(|note| paragraph(out, note));
    }

    fn limits_and_guard(&self, out: &mut String) {
        let row = |row: &super::LimitRow| [code(&row.object), escaped(row.name), escaped(&row.value.text)];
        table(out, "Limits and protections", ["Object", "Name", "Value"], self.limits.iter().map(row).collect());
        out.push_str("<h2>Guard</h2>");
        let text = format!("When the program that moves and guards it dies, {}.", self.guard.text);
        match self.guard.stops {
            Some(true) => classed(out, "pass", &text),
            Some(false) => classed(out, "fail", &text),
            None => paragraph(out, &format!("Not known: {}.", self.guard.text)),
        }
    }

    fn faults(&self, out: &mut String) {
        out.push_str("<h2>Faults seen</h2>");
        match (&self.fault, &self.fault_not_known) {
            (None, None) => paragraph(out, "No fault is present."),
            (None, Some(why)) => paragraph(out, &format!("Not known whether a fault is present: {why}.")),
            (Some(fault), _) => {
                classed(out, "fail", &format!("Present: {}", fault.text()));
                paragraph(out, &fault.remedies.join(" "));
            }
        }
        match (&self.remembered, &self.remembered_not_known) {
            (None, None) => paragraph(out, "It has no object 1003h, so that it remembers no errors."),
            (None, Some(why)) => paragraph(out, &format!("Not known which errors it remembers: {why}.")),
            (Some(errors), _) if errors.is_empty() => paragraph(out, "It remembers no errors (1003h)."),
            (Some(errors), _) => {
                let row = |(place, error): (usize, &RememberedError)| {
                    let remedy = error.remedy.unwrap_or_default();
                    [
                        format!("{}", place + 1),
                        code(&format!("{:04X}h", error.code)),
                        format!("{}<div class=\"why\">{}</div>", escaped(&error.name), escaped(remedy)),
                        escaped(&error.manufacturer),
                    ]
                };
                let rows = errors.iter().enumerate().map(row).collect();
                rows_of(out, ["", "Code", "What, and what to do", "Maker's bytes"], rows);
            }
        }
    }

    fn pdos(&self, out: &mut String) {
        let ms = |time: Option<f64>| time.map_or_else(|| "-".to_owned(), |time| format!("{time} ms"));
        let row = |pdo: &crate::network::pdos::PdoSetup| {
            [
                code(&pdo.pdo),
                pdo.id_text(),
                format!("{}<div class=\"why\">{}</div>", pdo.transmission, escaped(&pdo.when)),
                ms(pdo.inhibit_ms),
                ms(pdo.event_ms),
                escaped(&pdo.carries()),
            ]
        };
        let names = ["PDO", "Identifier", "Type", "Inhibit", "Timer", "Carries"];
        table(out, "PDOs", names, self.pdos.iter().map(row).collect());
    }
}

fn capture(out: &mut String, capture: &ReportedCapture) {
    let row = |figure: &super::CaptureFigure| {
        let number = |value: f64| format!("{value:.3} {}", figure.unit).trim_end().to_owned();
        [escaped(&figure.name), number(figure.min), number(figure.mean), number(figure.max)]
    };
    let title = format!("Capture: {}", capture.file);
    table(out, &title, ["Signal", "Least", "Mean", "Most"], capture.figures.iter().map(row).collect());
    if let Some(merit) = &capture.merit {
        let rows = merit.rows().into_iter().map(|row| row.map(|cell| escaped(&cell)));
        rows_of(out, ["Motion", "Figure", "+-"], rows.collect());
    }
    if capture.is_cut_off {
        classed(out, "fail", "The end of this record is missing: what came after is in neither figures nor picture.");
    }
    let _ = write!(out, "<figure>{}</figure>", capture.picture);
}

/// Before and after, side by side.
fn tuning(out: &mut String, tuning: &Tuning) {
    let gain =
        |gain: &TunedGain| [code(&gain.object), escaped(&gain.name), gain.before.to_string(), gain.after.to_string()];
    let mut rows: Vec<[String; 4]> = tuning.gains.iter().map(gain).collect();
    let margins = |row: &TunedLoop| {
        let state = if row.stable { "" } else { ", not stable" };
        format!("{:.1} Hz, {:.0}° of phase, sensitivity {:.1}{state}", row.crossover_hz, row.phase_deg, row.sensitivity)
    };
    let mut add =
        |what: &str, before: String, after: String| rows.push([String::new(), what.to_owned(), before, after]);
    add("Speed loop: crossover and margins", margins(&tuning.before), margins(&tuning.after));
    if let Some(position) = &tuning.position {
        add("Position loop around it", "-".to_owned(), margins(position));
    }
    let errors = [
        ("Error after a step and a load, on the twin", Some(tuning.twin_error)),
        ("Error after a step, on the drive", tuning.drive_error),
    ];
    for (what, [before, after]) in errors.into_iter().filter_map(|(what, error)| Some((what, error?))) {
        add(what, format!("{before:.2} r/min s"), format!("{after:.2} r/min s"));
    }
    table(out, "Tuning", ["Object", "What", "Before", "Proposed"], rows);
    let resonance = match (tuning.anti_resonance_hz, tuning.resonance_hz) {
        (Some(anti), Some(resonance)) => format!("anti-resonance {anti:.1} Hz, resonance {resonance:.1} Hz"),
        _ => "no resonance".to_owned(),
    };
    let found = format!(
        "Found: inertia {:.4e} kg·m², dry friction {:.3} N·m, viscous {:.4} N·m·s/rad, {resonance}; its twin is {:.0} % off. {}",
        tuning.inertia_kg_m2,
        tuning.dry_friction_nm,
        tuning.viscous_friction_nm_s,
        100.0 * tuning.twin_off,
        if tuning.applied { "The drive was given the proposed values." } else { "The drive kept the values before." }
    );
    paragraph(out, &found);
    tuning.notes.iter().for_each(|note| paragraph(out, note));
    if !tuning.picture.is_empty() {
        let _ = write!(out, "<figure>{}</figure>", tuning.picture);
    }
}

fn facts(out: &mut String, title: &str, first: &[Fact], others: &[Fact]) {
    if first.is_empty() && others.is_empty() {
        return;
    }
    let _ = write!(out, "<h2>{title}</h2><dl>");
    for fact in first.iter().chain(others) {
        let _ = write!(out, "<dt>{}</dt><dd>{}</dd>", escaped(&fact.name), escaped(&fact.value));
    }
    out.push_str("</dl>");
}

fn paragraph(out: &mut String, text: &str) {
    let _ = write!(out, "<p>{}</p>", escaped(text));
}

fn classed(out: &mut String, class: &str, text: &str) {
    let _ = write!(out, "<p class=\"{class}\">{}</p>", escaped(text));
}

/// What does not break over two lines.
fn code(text: &str) -> String {
    format!("<span style=\"white-space:nowrap\">{}</span>", escaped(text))
}

/// A section with a table; cells are HTML.
fn table<const N: usize>(out: &mut String, title: &str, names: [&str; N], rows: Vec<[String; N]>) {
    let _ = write!(out, "<h2>{}</h2>", escaped(title));
    if rows.is_empty() {
        return paragraph(out, "None.");
    }
    rows_of(out, names, rows);
}

fn rows_of<const N: usize>(out: &mut String, names: [&str; N], rows: Vec<[String; N]>) {
    let cells =
        |tag: &str, cells: &[String]| -> String { cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect() };
    let _ = write!(out, "<table><thead><tr>{}</tr></thead><tbody>", cells("th", &names.map(str::to_owned)));
    for row in rows {
        let _ = write!(out, "<tr>{}</tr>", cells("td", &row));
    }
    out.push_str("</tbody></table>");
}

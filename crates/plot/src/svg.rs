//! The few SVG elements a plot needs, as text.

use std::fmt::Write;

use crate::xml::escaped;

/// SVG text under construction.
#[derive(Default)]
pub(crate) struct Svg {
    body: String,
    /// A script shall find the scales and the lines.
    scripted: bool,
}

/// The scale of a panel.
pub(crate) struct Scale<'a> {
    /// Number of the figure that it belongs to.
    pub(crate) figure: usize,
    /// The quantity.
    pub(crate) name: &'a str,
    /// Its unit.
    pub(crate) unit: &'a str,
    /// Left and right end, px, and what they stand for.
    pub(crate) x: ((f64, f64), (f64, f64)),
    /// What the axis of `x` shows; empty for a time.
    pub(crate) logarithmic: &'a str,
    /// Upper end and height, px.
    pub(crate) y: (f64, f64),
    /// Value at the lower and the upper end.
    pub(crate) values: (f64, f64),
}

/// Where a text is held.
#[derive(Clone, Copy)]
pub(crate) enum Anchor {
    /// At its left end.
    Start,
    /// At its middle.
    Middle,
    /// At its right end.
    End,
}

/// Look of a text.
#[derive(Clone, Copy)]
pub(crate) struct Font {
    /// Height, px.
    pub(crate) size: f64,
    /// Colour.
    pub(crate) colour: &'static str,
    /// Bold or not.
    pub(crate) bold: bool,
}

impl Font {
    /// Width of a text, px; an estimate on the safe side from the advances of common sans-serif faces.
    pub(crate) fn width(self, text: &str) -> f64 {
        let advance_em = |letter: char| match letter {
            'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '(' | ')' | ' ' => 0.36,
            'f' | 'r' | 't' | '-' | '/' => 0.44,
            'm' | 'w' | 'M' | 'W' => 0.95,
            'A'..='Z' => 0.72,
            _ => 0.62,
        };
        let bold = if self.bold { 1.09 } else { 1.0 };
        text.chars().map(advance_em).sum::<f64>() * self.size * bold
    }
}

impl Svg {
    /// An empty one.
    pub(crate) fn new(scripted: bool) -> Self {
        Self { body: String::new(), scripted }
    }

    /// Begins a group that a script finds as a panel.
    pub(crate) fn begin_panel(&mut self, scale: &Scale<'_>) {
        if self.scripted {
            let Scale { figure, name, unit, logarithmic, .. } = scale;
            let Scale { x: ((left, right), (begin, end)), y: (top, height), values: (low, high), .. } = scale;
            let _ = writeln!(
                self.body,
                r#"<g data-figure="{figure}" data-name="{}" data-unit="{}" data-left="{left}" data-right="{right}" data-begin="{begin}" data-end="{end}" data-top="{top}" data-height="{height}" data-low="{low}" data-high="{high}" data-logarithmic="{}">"#,
                escaped(name),
                escaped(unit),
                escaped(logarithmic)
            );
        }
    }

    /// Ends it.
    pub(crate) fn end_panel(&mut self) {
        if self.scripted {
            self.body.push_str("</g>\n");
        }
    }

    /// What a script finds a line by.
    pub(crate) fn label(&self, label: &str) -> String {
        if self.scripted { format!(r#" data-label="{}""#, escaped(label)) } else { String::new() }
    }

    /// Puts what another one holds on top.
    pub(crate) fn append(&mut self, other: Self) {
        self.body.push_str(&other.body);
    }

    /// A rectangle with rounded corners.
    pub(crate) fn rect(&mut self, (x, y): (f64, f64), (width, height): (f64, f64), radius: f64, paint: &str) {
        let _ = writeln!(
            self.body,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{width:.1}" height="{height:.1}" rx="{radius}" {paint}/>"#
        );
    }

    /// A straight line.
    pub(crate) fn line(&mut self, (x1, y1): (f64, f64), (x2, y2): (f64, f64), paint: &str) {
        let _ = writeln!(self.body, r#"<line x1="{x1:.1}" y1="{y1:.1}" x2="{x2:.1}" y2="{y2:.1}" {paint}/>"#);
    }

    /// A dot.
    pub(crate) fn dot(&mut self, (x, y): (f64, f64), radius: f64, colour: &str) {
        let _ = writeln!(self.body, r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{colour}"/>"#);
    }

    /// A broken line through points. Points between neighbours of the same height are left out.
    pub(crate) fn path(&mut self, points: &[(f64, f64)], paint: &str) {
        let mut data = String::with_capacity(points.len() * 12);
        let tenths = |point: &(f64, f64)| (point.1 * 10.0).round() as i64;
        for (i, point) in points.iter().enumerate() {
            let is_level = |other: Option<&(f64, f64)>| other.is_some_and(|other| tenths(other) == tenths(point));
            if i > 0 && is_level(points.get(i - 1)) && is_level(points.get(i + 1)) {
                continue;
            }
            let _ = write!(data, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, point.0, point.1);
        }
        let _ = writeln!(self.body, r#"<path d="{data}" fill="none" stroke-linejoin="round" {paint}/>"#);
    }

    /// A line of text; `y` is its base line.
    pub(crate) fn text(&mut self, at: (f64, f64), anchor: Anchor, font: Font, text: &str) {
        self.painted_text(at, anchor, font, "", text);
    }

    /// A line of text with a light rim, which reads well where lines run under it.
    pub(crate) fn rimmed_text(&mut self, at: (f64, f64), anchor: Anchor, font: Font, text: &str) {
        let rim = r##" paint-order="stroke" stroke="#ffffff" stroke-width="3.5" stroke-opacity="0.9""##;
        self.painted_text(at, anchor, font, rim, text);
    }

    fn painted_text(&mut self, (x, y): (f64, f64), anchor: Anchor, font: Font, paint: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let weight = if font.bold { r#" font-weight="600""# } else { "" };
        let _ = writeln!(
            self.body,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" font-size="{}" fill="{}"{weight}{paint}>{}</text>"#,
            font.size,
            font.colour,
            escaped(text)
        );
    }

    /// The whole document.
    pub(crate) fn document(self, (width, height): (f64, f64), title: &str) -> String {
        format!(
            concat!(
                r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0} {height:.0}" "#,
                r#"width="{width:.0}" height="{height:.0}" role="img" "#,
                r#"font-family="ui-sans-serif, system-ui, 'Segoe UI', Helvetica, Arial, sans-serif">"#,
                "\n<title>{title}</title>\n{body}</svg>\n"
            ),
            width = width,
            height = height,
            title = escaped(title),
            body = self.body
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_line_needs_its_ends_only() {
        let mut svg = Svg::default();
        svg.path(&[(0.0, 5.0), (1.0, 5.02), (2.0, 5.0), (3.0, 9.0)], "");
        assert!(svg.body.contains(r#"d="M0.0 5.0L2.0 5.0L3.0 9.0""#), "{}", svg.body);
    }

    #[test]
    fn texts_are_escaped() {
        let mut svg = Svg::default();
        svg.text((0.0, 0.0), Anchor::Start, Font { size: 10.0, colour: "#000", bold: false }, "a < b & c");
        assert!(svg.document((10.0, 10.0), "<t>").contains("a &lt; b &amp; c"));
    }
}

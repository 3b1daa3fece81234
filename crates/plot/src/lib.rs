//! What a person looks at: time plots as SVG (a poster of figures, each with stacked panels over one time axis, named
//! sections and marked events), tables with columns and colours for a terminal ([`Table`],
//! [`Paint`]), and the look of pages that are kept and printed ([`html`]).
//!
//! A [`Poster`] is plain data in; [`Poster::to_svg`] is text out. It has its own light background, so that it
//! reads the same on a white page and in a dark one, and holds no script and no fonts. Long traces are thinned to
//! the smallest and largest value of each pixel column, so nothing that could be seen is lost.
//!
//! ```
//! use plot::{Colour, Figure, Panel, Poster, Style, Trace};
//!
//! let points = (0..100).map(|i| (f64::from(i) * 0.1, (f64::from(i) * 0.1).sin())).collect();
//! let trace = Trace { label: "actual".into(), style: Style::Actual(Colour::Teal), points };
//! let panel = Panel { title: "Velocity".into(), unit: "r/min".into(), traces: vec![trace], ..Panel::default() };
//! let figure = Figure { title: "node 4".into(), time: "time, s".into(), panels: vec![panel], ..Figure::default() };
//! let svg = Poster { title: "A run".into(), rows: vec![vec![figure]], ..Poster::default() }.to_svg();
//! assert!(svg.starts_with("<svg ") && svg.contains("r/min"));
//! ```

mod draw;
pub mod html;
mod lanes;
mod page;
mod paint;
mod poster;
mod svg;
mod table;
mod thin;
mod ticks;
mod xml;

pub use paint::Paint;
pub use poster::{Colour, EventKind, Figure, Panel, PlotEvent, Poster, Section, Style, Trace};
pub use table::Table;
pub use xml::escaped;

impl Poster {
    /// The picture, as the text of an SVG file.
    pub fn to_svg(&self) -> String {
        draw::poster(self, false)
    }

    /// A web page with the picture that shows the values under the pointer. It needs nothing from anywhere.
    pub fn to_html(&self) -> String {
        page::page(self, &draw::poster(self, true))
    }
}

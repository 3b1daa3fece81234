//! Time plots as SVG: a poster of figures, each with stacked panels over one time axis, named sections and marked events.
//!
//! A [`Poster`] is plain data in; [`Poster::to_svg`] is text out. It has its own light background, so that it
//! reads the same on a white page and in a dark one, and holds no script and no fonts. Long traces are thinned to
//! the smallest and largest value of each pixel column, so nothing that could be seen is lost.

mod draw;
mod lanes;
mod poster;
mod svg;
mod thin;
mod ticks;

pub use poster::Poster;
pub(crate) use poster::{Colour, Event, EventKind, Figure, Panel, Section, Style, Trace};

impl Poster {
    /// The picture, as the text of an SVG file.
    pub fn to_svg(&self) -> String {
        draw::poster(self)
    }
}

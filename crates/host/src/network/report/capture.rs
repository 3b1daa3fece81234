//! What records of runs have of a node, in figures and as a picture.

use canopen::NodeId;
use plot::Figure;
use recording::{Recorded, Subject, picture};

use super::{CaptureFigure, ReportedCapture};
use crate::test_motion::Figures;

impl ReportedCapture {
    /// What a record has of a node; `file` is its name.
    ///
    /// # Errors
    /// In a sentence: it has nothing of the node.
    pub fn of_record(file: String, recorded: Recorded, node: NodeId) -> Result<Self, String> {
        let Recorded { mut series, marks, torn } = recorded;
        series.retain(|series| matches!(series.column.subject, Subject::Axis(place) if place.node == node.raw()));
        let recorded = Recorded { series, marks, torn };
        // A node with several axes has as many motions.
        let capture = recording::Capture::of(&recorded, None).ok();
        let merit = capture.map(|capture| Figures::of(None, &capture)).filter(Figures::are_some);
        let poster = picture(&file, &recorded, &[], 0.0..=f64::INFINITY)?;
        let drawn: Vec<&Figure> = poster.rows.iter().flatten().collect();
        // A node with several axes has a figure for each.
        let axis = |figure: &Figure| if drawn.len() > 1 { format!("{}: ", figure.title) } else { String::new() };
        let axis = &axis;
        let figures = drawn.iter().flat_map(|figure| {
            let traces = figure.panels.iter().flat_map(|panel| panel.traces.iter().map(move |trace| (panel, trace)));
            traces.filter_map(move |(panel, trace)| {
                let name = format!("{}{}, {}", axis(figure), panel.title, trace.label);
                let (min, mean, max) = extent(&trace.points)?;
                Some(CaptureFigure { name, unit: panel.unit.to_string(), min, mean, max })
            })
        });
        let figures = figures.collect();
        Ok(Self { figures, merit, file, is_cut_off: torn, picture: poster.to_svg() })
    }
}

/// The least value, the mean of the samples and the most; `None` where no sample has a value.
fn extent(points: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let values = || points.iter().map(|(_, value)| *value).filter(|value| value.is_finite());
    let (min, max) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
    Some((min, values().sum::<f64>() / values().count() as f64, max))
}
